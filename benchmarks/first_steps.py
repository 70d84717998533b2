"""The first minutes of a new user: a fresh environment, the README's lines, and how long each takes.

``python benchmarks/first_steps.py`` installs the checkout without extras into a new environment and prints the size of
it and of its largest packages, then the wall time and the time of a core from the first line to: a page with a turning
ship, a page to steer one, an FMU with its check, and the demo. Downloads count only as far as pip's cache lacks them.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MB = 1e6


def size_mb(folder: Path) -> float:
    """Size of the files below a folder, MB."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink()) / MB


def timed(words: list[str], folder: Path) -> tuple[float, float]:
    """Wall time of a command and time of the processors (s)."""
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        sys.exit(f"{' '.join(words)}: exit {done.returncode}\n{done.stdout}{done.stderr}")
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--demo", action="store_true", help="also run the demo")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program, python = folder / "env" / "bin" / "tank2sim", folder / "env" / "bin" / "python"
        install = [str(python), "-m", "pip", "install", "--quiet", "--no-compile", str(ROOT)]
        steps = [
            ("an environment", [sys.executable, "-m", "venv", "env"]),
            ("pip install .", install),
            (
                "a page with a turn",
                [str(program), "simulate", "mariner", "--manoeuvre", "turn:35", "--page", "turn.html"],
            ),
            ("a page to steer", [str(program), "steer", "-o", "steer.html"]),
            ("an FMU", [str(program), "export", "mariner", "-o", "mariner.fmu"]),
            ("the FMU checked", [str(program), "check", "mariner.fmu"]),
        ]
        if asked.demo:
            steps.append(("the demo", [str(program), "demo", "-o", "demo"]))
        since = 0.0
        for title, words in steps:
            wall, core = timed(words, folder)
            since += wall
            print(
                f"{title:20} {wall:6.1f} s wall, {core:6.1f} s of a core; {since:6.1f} s since the first line",
                flush=True,
            )
            if words is install:
                (packages,) = (folder / "env" / "lib").glob("*/site-packages")
                sizes = sorted(
                    ((size_mb(path), path.name) for path in packages.iterdir() if path.is_dir()), reverse=True
                )
                largest = ", ".join(f"{package} {size:.0f}" for size, package in sizes[:8])
                print(f"{'':20} {size_mb(folder / 'env'):.0f} MB: {largest}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
