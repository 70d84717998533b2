"""What a headless Chromium measures on a page."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --virtual-time-budget=6000"
).split()


def browser() -> str:
    """The path of Chromium; the test is skipped where there is none."""
    found = next((path for name in NAMES if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("no Chromium is installed to open the page in")
    return found


def measured_in_browser(html: str, folder: Path, name: str, *flags: str) -> Any:
    """What a script of the page has left as JSON in ``document.body.dataset[name]``."""
    file = folder / "page.html"
    # The pages allow no script but their own: the policy is of the file, and not of what is measured.
    policy = re.compile(r'<meta http-equiv="Content-Security-Policy"[^>]*>')
    file.write_text(policy.sub("", html), encoding="utf-8")
    command = [browser(), *FLAGS, f"--user-data-dir={folder / 'profile'}", *flags, "--dump-dom", file.as_uri()]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    left = re.search(rf'data-{name}="([^"]*)"', run.stdout)
    assert left, run.stderr[-2000:]
    return json.loads(unescape(left[1]))
