"""Runs chosen benchmarks, and prints the rows of ``docs/benchmarks.md`` above what each script printed.

``python benchmarks/table.py accuracy agreement`` takes names of scripts; without names it lists them. With ``--record``
first, what each script printed is written to ``docs/static/benchmarks``, from where the page shows it under its tables.
Whether a figure agrees is for the reader to judge: nothing is compared here, and a script that fails is reported.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "benchmarks.md"
RECORDS = ROOT / "docs" / "static" / "benchmarks"


def rows_of_page(text: str) -> dict[str, list[tuple[str, str]]]:
    """Claims and figures of the page by the command that prints them."""
    found: dict[str, list[tuple[str, str]]] = {}
    for claim, figure, commands in re.findall(r"^\| (.+) \| (.+) \| (`benchmarks/.+`) \|$", text, re.MULTILINE):
        # A row may name several scripts; arguments belong to a single one.
        for command in re.findall(r"`benchmarks/([^`]+)`|`(\w+\.py)`", commands):
            found.setdefault(next(filter(None, command)), []).append((claim, figure))
    return found


def main() -> int:
    rows = rows_of_page(PAGE.read_text(encoding="utf-8"))
    names = sorted({command.split()[0].removesuffix(".py") for command in rows})
    record = sys.argv[1:2] == ["--record"]
    chosen = sys.argv[1 + record :]
    if not chosen or not set(chosen) <= set(names):
        print("names of benchmarks:", ", ".join(names))
        return 2 if chosen else 0
    failed = 0
    for command in (row for row in rows if row.split()[0].removesuffix(".py") in chosen):
        script, *arguments = shlex.split(command)
        print(f"\n== benchmarks/{command}")
        for claim, figure in rows[command]:
            print(f"page: {claim}: {figure}")
        begin = time.perf_counter()
        call = [sys.executable, ROOT / "benchmarks" / script, *arguments]
        done = subprocess.run(call, check=False, stdout=subprocess.PIPE, text=True)
        print(done.stdout, end="")
        if record and done.returncode == 0:
            RECORDS.mkdir(parents=True, exist_ok=True)
            name = "_".join([script.removesuffix(".py"), *(word.strip("-") for word in arguments)])
            (RECORDS / f"{name}.txt").write_text(f"$ python benchmarks/{command}\n{done.stdout}", encoding="utf-8")
        failed += done.returncode != 0
        print(f"{'done' if done.returncode == 0 else 'FAILED'} in {time.perf_counter() - begin:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
