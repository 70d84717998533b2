"""Makes the README's picture of the page on which a ship is steered, ``docs/static/steering_page.png``.

The Esso Osaka on autopilot in the bundled channel, with the ships that the measurements cannot exclude. Needs Chromium
and the extra `platforms`::

    python docs/screenshot.py
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PICTURE = Path(__file__).parent / "static" / "steering_page.png"
UNTIL = 1300  # s
COURSES = {0: 0, 340: 22, 600: 35, 900: 34, 1100: 12}  # deg, by the time (s) of the order
# The attempt as a link has it (src/tank2sim/apps/steering/attempt.js), opened and sailed to its end.
STEERED = """<script>
const waiting = setInterval(() => {
  if (document.documentElement.dataset.ship !== "ready") return;
  clearInterval(waiting);
  const data = JSON.parse(document.getElementById("ship").textContent);
  const courses = Object.entries(COURSES).map(([t, deg]) => `${t / data.step}!c!${deg * Math.PI / 180}`);
  const start = Object.entries(data.start).map(([name, value]) => `s!${name}!${value}`);
  const inputs = data.controls.map(({ start: value }, number) => `i!${number}!${value}`);
  location.hash = [data.id, UNTIL / data.step, ...start, ...inputs, ...courses].join("~");
  setTimeout(() => { for (const name of ["finish", "farther"]) document.getElementById(name).click(); }, 500);
}, 300);
</script>"""
FLAGS = (
    "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --hide-scrollbars --window-size=1366,768 --virtual-time-budget=11000"
).split()


def tank2sim(*words: str, folder: Path) -> None:
    """Run a command of the program in a folder."""
    subprocess.run([Path(sys.executable).with_name("tank2sim"), *words], cwd=folder, check=True)


def main() -> int:
    """Make the picture; 2 where Chromium is missing."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        print("Chromium, which opens the page, is not installed")
        return 2
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tank2sim("steer", "--scenario", "channel", "-o", "page.html", folder=folder)
        page = folder / "page.html"
        script = STEERED.replace("COURSES", json.dumps(COURSES)).replace("UNTIL", str(UNTIL))
        # The page allows no script but its own.
        html = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page.read_text(encoding="utf-8"))
        page.write_text(html.replace("</body>", f"{script}</body>"), encoding="utf-8")
        taken = [f"--user-data-dir={folder / 'profile'}", f"--screenshot={folder / 'page.png'}", page.as_uri()]
        subprocess.run([chromium, *FLAGS, *taken], check=True, capture_output=True, timeout=120)
        shutil.copyfile(folder / "page.png", PICTURE)
    print(PICTURE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
