"""The covariance of a card's numbers: a JSON file next to the card, to which a comment line of the card refers.

``# covariance: ship.covariance.json`` names the file, relative to the card's folder. It has ``format``
(:data:`COVARIANCE_FORMAT`), ``names`` (dotted keys of the card, ``derivatives.Yv``) and ``covariance``, a row for each
name, in the conventions of the card's own text: scaling, units, sign of the rudder. Numbers that it does not name are
independent, with the standard error of the card. Where a posterior was sampled it also has ``samples``: rows of numbers
by ``names``.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path

from tank2sim.arrays import Array
from tank2sim.files import BYTE_ORDER_MARK

COVARIANCE_FORMAT = "tank2sim-covariance/1"
"""Format of the file, as it states it itself."""

REFERENCE_LINE = re.compile(r"^#[ \t]*covariance:[ \t]*(\S[^\r\n]*?)[ \t]*\r?$", re.MULTILINE)
"""Comment line of a card; its group is the name of the file."""

_WHOLE_LINE = re.compile(REFERENCE_LINE.pattern + r"\n?", re.MULTILINE)


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariance of numbers of a card."""

    names: tuple[str, ...]  # Their k dotted keys in the card's file
    matrix: Array  # (k, k): In the conventions of that file
    # (n, k): Samples of the numbers' joint distribution, in the same conventions; normal without any.
    samples: Array | None = None

    def as_text(self) -> str:
        """The JSON of the file: a row of the matrix a line, every figure kept."""
        names = json.dumps(list(self.names))
        samples = "" if self.samples is None else f',\n "samples": {_rows_text(self.samples)}'
        covariance = _rows_text(self.matrix)
        return f'{{\n "format": "{COVARIANCE_FORMAT}",\n "names": {names},\n "covariance": {covariance}{samples}\n}}\n'


def _rows_text(rows: Array) -> str:
    lines = ",\n  ".join(json.dumps(row) for row in rows.tolist())
    return f"[\n  {lines}\n ]"


def covariance_file(card: Path) -> Path:
    """Where the covariance of a card lies: ``ship.covariance.json`` next to ``ship.toml``."""
    return card.with_name(f"{card.stem}.covariance.json")


def referring(text: str, card: Path) -> str:
    """A card's text with the line that refers to the file next to `card`, in place of any that it had.

    It follows the comment with which the card begins.
    """
    mark = BYTE_ORDER_MARK if text.startswith(BYTE_ORDER_MARK) else ""
    kept = _WHOLE_LINE.sub("", text.removeprefix(mark))
    lines = re.split(r"(?<=\n)", kept)  # other ends of lines may stand within a comment
    head = next((place for place, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return mark + "".join([*lines[:head], f"# covariance: {covariance_file(card).name}\n", *lines[head:]])


def not_referring(text: str) -> str:
    """A card's text without the line that refers to a covariance."""
    return _WHOLE_LINE.sub("", text)
