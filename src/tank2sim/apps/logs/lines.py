"""Lines of text logs, whatever their encoding."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from tank2sim.errors import InputError
from tank2sim.records.text_layout import decoded_text

_HEAD_BYTES = 4096


def text_lines(path: Path) -> Iterator[bytes]:
    """Lines of a text file in one byte a letter: UTF-16 is decoded, the mark of UTF-8 left out.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    try:
        with path.open("rb") as file:
            encoding = decoded_text(file.read(_HEAD_BYTES), complete=False)[1]
        if encoding.startswith("utf-16"):
            with path.open(encoding=encoding, errors="replace") as text:
                yield from (line.encode("latin-1", errors="replace") for line in text)
            return
        with path.open("rb") as file:
            yield next(file, b"").removeprefix(b"\xef\xbb\xbf")
            yield from file
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None


def mostly(head: bytes, fits: Callable[[bytes], object]) -> bool:
    """Whether at least half the lines of the beginning of a file fit, comments and a cut last line left out."""
    lines = re.split(rb"[\r\n]+", head)
    lines = [line for line in lines[:-1] or lines if line.strip() and not line.startswith(b"#")]
    return bool(lines) and 2 * sum(bool(fits(line)) for line in lines) > len(lines)
