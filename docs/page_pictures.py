"""Makes the pages of the manual's gallery, ``docs/live/pages/``, and their thumbnails, ``docs/static/pages/``.

Bundled ships alone are in them. The pages, some 15 MB, are not kept: a manual that is built while they are there has
them, and its thumbnails open them. Needs Chromium::

    python docs/page_pictures.py
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).parent / "static" / "pages"
LIVE = Path(__file__).parent / "live" / "pages"
EXAMPLES = Path(__file__).parent / "examples"
PAGES = {
    "turn": "simulate mariner-nominal --manoeuvre turn:35",
    "zigzag": "simulate kvlcc2-l7 --manoeuvre zigzag:-10/10 --members 200",
    "spiral": "simulate kvlcc2-l7 --manoeuvre spiral:20",
    "stop": "simulate esso-osaka-ship --manoeuvre stop",
    "stability": "stability kvlcc2-l7",
    "autopilot": "autopilot mariner-nominal",
    "compare": "compare mariner mariner-nominal",
    "poster": "poster esso-osaka-ship",
    "pilotcard": "pilotcard esso-osaka-ship",
    "trials": "trials trial --ship mariner --notes trial/notes.toml",
    "craft": "autopilot otter",
    "guess": "guess --length 320 --beam 58 --draught 20.8 --block 0.81 --speed 15.5 -o guessed.toml",
    "design": "design mariner --hours 40 --carriage-length 240",
}
"""Name of the thumbnail to the command that writes its page; the gallery shows the same."""

FLAGS = (
    "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --hide-scrollbars --force-device-scale-factor=0.5 --virtual-time-budget=10000"
).split()
WIDTH_PX, HEIGHT_PX = 1240, 1240


def main() -> int:
    """Make the pictures; 2 where Chromium is missing."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        print("Chromium, which opens the pages, is not installed")
        return 2
    for folder in (FOLDER, LIVE):
        folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        subprocess.run([sys.executable, EXAMPLES / "make_sea_trial.py", Path(name) / "trial"], check=True)
        for stem, command in PAGES.items():
            page, picture = LIVE / f"{stem}.html", FOLDER / f"{stem}.png"
            program = Path(sys.executable).with_name("tank2sim")
            subprocess.run([program, *command.split(), "--page", page], check=True, capture_output=True, cwd=name)
            size = f"--window-size={WIDTH_PX},{HEIGHT_PX}"
            taken = [f"--user-data-dir={Path(name) / 'profile'}", size, f"--screenshot={picture}", page.as_uri()]
            subprocess.run([chromium, *FLAGS, *taken], check=True, capture_output=True, timeout=120)
            print(picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
