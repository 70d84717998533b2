"""Calls a command of tank2sim from a script: for what the Python API does not have."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def tank2sim(*words: str | Path) -> None:
    """Run ``tank2sim`` with these words in the current folder; an error ends the script."""
    print("$ tank2sim", *words, flush=True)
    subprocess.run([Path(sys.executable).with_name("tank2sim"), *words], check=True)
