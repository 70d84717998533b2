"""Makes the README's picture of the page on which a ship is steered, ``docs/static/steering_page.png``.

The Mariner turns in a current to the east, next to the track of the same turn without. Needs Chromium and the extra
`platforms`::

    python docs/screenshot.py
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PICTURE = Path(__file__).parent / "static" / "steering_page.png"
CURRENT = '\n[[effects]]\nname = "current"\nparameters = { speed_mps = 0.8, direction_deg = 90.0 }\n'
STEERED = """<script>
const waiting = setInterval(() => {
  const [trial, finish] = ["trial", "finish"].map((name) => document.getElementById(name));
  if (!finish.disabled) {
    clearInterval(waiting);
    finish.click();
  } else if (!trial.disabled) trial.click();
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
        card = Path(__file__).parents[1] / "models" / "mariner" / "ship.toml"
        (folder / "ship.toml").write_text(card.read_text(encoding="utf-8") + CURRENT, encoding="utf-8")
        turn = ["--manoeuvre", "turn:20", "--duration", "900"]
        tank2sim("simulate", "mariner", *turn, "--out", "still.csv", folder=folder)
        tank2sim("steer", "ship.toml", "--ghost", "still.csv", "-o", "page.html", folder=folder)
        page = folder / "page.html"
        # The page allows no script but its own.
        html = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page.read_text(encoding="utf-8"))
        page.write_text(html.replace("</body>", f"{STEERED}</body>"), encoding="utf-8")
        taken = [f"--user-data-dir={folder / 'profile'}", f"--screenshot={folder / 'page.png'}", page.as_uri()]
        subprocess.run([chromium, *FLAGS, *taken], check=True, capture_output=True, timeout=120)
        shutil.copyfile(folder / "page.png", PICTURE)
    print(PICTURE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
