"""Examples of the manual: a block ``sh`` or ``python``, and the block ``text`` after it with what that prints.

``python -m tests.docs.examples docs/tutorials/simulator.md`` runs a page's examples and writes what they print into it.
A comment before the block tells which lines: ``<!-- show: 1-3, 8 -->``.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from tests.cli.command_line import tank2sim
from tests.conftest import ROOT

MANUAL = ROOT / "docs"
LEFT_OUT = "..."

_EXAMPLE = re.compile(
    r"(?:<!-- show: (?P<show>[^>]*?) -->\n)?```(?P<language>sh|python)\n(?P<code>.*?)```\n"
    r"(?:\n?```text\n(?P<output>.*?)```\n)?",
    re.DOTALL,
)
_TERMINAL = {"TTY_COMPATIBLE": "1", "TERM": "dumb"}
"""The manual shows tables as a terminal does, without its colours."""
_WITH_PYTHON = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_FRAME = str.maketrans(dict.fromkeys("┃│┏┓┗┛└┘┡┩╇┳━─┴┬┼├┤", " "))


@dataclass(frozen=True)
class Example:
    """Code of one block, the lines of its output to show (all without), and what the page says that it prints."""

    language: str
    code: str
    show: str | None
    output: str | None


def pages() -> list[Path]:
    """The pages that have examples with their output."""
    return [page for page in sorted(MANUAL.rglob("*.md")) if any(one.output is not None for one in examples(page))]


def examples(page: Path) -> list[Example]:
    """The examples of a page, in their order."""
    return [Example(**found.groupdict()) for found in _EXAMPLE.finditer(page.read_text(encoding="utf-8"))]


def prepare(folder: Path) -> None:
    """What the examples find in their folder: of a fresh checkout the bundled models and what the manual brings."""
    for name in ("models", "docs/examples"):
        shutil.copytree(ROOT / name, folder / name)


def run(example: Example, folder: Path) -> str:
    """What an example prints; AssertionError if it fails."""
    if example.language == "python":
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.chdir(folder):
            exec(compile(example.code, "example", "exec"), {})
        return printed.getvalue()
    text = ""
    for line in example.code.replace("\\\n", "").splitlines():
        if line.startswith("tank2sim "):
            words = subprocess.run(
                ["/bin/sh", "-c", f"printf '%s\\n' {line}"], cwd=folder, capture_output=True, text=True, check=False
            )
            done = tank2sim(*words.stdout.splitlines()[1:], cwd=folder, **_TERMINAL)
        elif line.strip():
            done = subprocess.run(
                ["/bin/sh", "-c", line], cwd=folder, env=_WITH_PYTHON, capture_output=True, text=True, check=False
            )
        else:
            continue
        assert done.returncode == 0, f"{line}\n{done.stderr}"
        text += done.stdout
    return text


def reported(words: str) -> list[str]:
    """Words and numbers of an output, without the frames of its tables."""
    return words.translate(_FRAME).split()


def alike(found: str, wanted: str, tolerance: float = 0.03) -> bool:
    """Whether the words of `wanted` stand in `found`, in their order and with numbers about the same.

    ``...`` stands for lines left out. A number may differ by the share `tolerance`, or by as much in all of them that
    are below 1e-6.
    """
    words = reported(found)
    start = 0
    for block in _blocks(wanted):
        place = next((n for n in range(start, len(words)) if _same(words[n : n + len(block)], block, tolerance)), None)
        if place is None:
            return False
        start = place + len(block)
    return True


def _blocks(wanted: str) -> Iterator[list[str]]:
    for left_out, lines in groupby(wanted.splitlines(), lambda line: line.strip() == LEFT_OUT):
        if not left_out:
            yield reported("\n".join(lines))


def _same(found: list[str], wanted: list[str], tolerance: float) -> bool:
    return len(found) == len(wanted) and all(_close(a, b, tolerance) for a, b in zip(found, wanted, strict=True))


def _close(found: str, wanted: str, tolerance: float) -> bool:
    if found == wanted:
        return True
    if _NUMBER.sub("#", found) != _NUMBER.sub("#", wanted):
        return False
    pairs = zip(_NUMBER.findall(found), _NUMBER.findall(wanted), strict=True)
    return all(abs(float(a) - float(b)) <= tolerance * max(abs(float(a)), abs(float(b))) + 1e-6 for a, b in pairs)


def chosen(output: str, show: str | None) -> str:
    """The lines of an output that a page shows, `show` such as ``1-3, 8``."""
    lines = [line.rstrip() for line in output.rstrip().splitlines()]
    if not show:
        return "\n".join(lines)
    kept: list[str] = []
    before = 0
    for part in show.split(","):
        first, _, last = part.strip().partition("-")
        begin, end = int(first), min(int(last or first), len(lines)) if last != "" or "-" not in part else len(lines)
        if begin > before + 1:
            kept.append(LEFT_OUT)
        kept += lines[begin - 1 : end]
        before = end
    return "\n".join(kept if before >= len(lines) else [*kept, LEFT_OUT])


def rewrite(page: Path) -> None:
    """Run the examples of a page and write what they print into it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)

        def with_output(found: re.Match[str]) -> str:
            example = Example(**found.groupdict())
            output = run(example, folder)
            comment = f"<!-- show: {example.show} -->\n" if example.show is not None else ""
            code = f"{comment}```{example.language}\n{example.code}```\n"
            if example.output is None:
                return code
            return f"{code}\n```text\n{chosen(output, example.show)}\n```\n"

        page.write_text(_EXAMPLE.sub(with_output, page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:]:
        rewrite(Path(name))
