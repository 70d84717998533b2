"""A page opened in a headless Chromium."""

from __future__ import annotations

import shutil
import subprocess

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


CHROMIUM = next((path for name in NAMES if (path := shutil.which(name))), None)


FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --enable-logging=stderr --v=0 --window-size=1200,2000 "
    "--virtual-time-budget=10000 --dump-dom"
).split()

# WebGL drawn by the processor; the switch that keeps a browser off the graphics processor is left out with it.
WEBGL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def opened(html, folder, *flags):
    """The page after its scripts have run, and what stood in the console."""
    file = folder / "page.html"
    file.write_text(html, encoding="utf-8")
    kept = [flag for flag in FLAGS if flag != "--disable-gpu" or not {*WEBGL} <= {*flags}]
    command = [CHROMIUM, *kept, f"--user-data-dir={folder / 'profile'}", *flags, file.as_uri()]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return run.stdout, [line for line in run.stderr.splitlines() if "CONSOLE" in line]
