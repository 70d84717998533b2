"""A matrix: coloured cells for pairs of names, with their numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tank2sim.answer.charts.vega import ChartSpec, TooltipFields, bare_layer, channel, tooltips

ROW_PX = 21
"""Height of a row, px."""

DARKEST = 100.0
"""Number of the darkest colour, and of all greater ones. Project choice: a misfit of so many noise units is far from
any doubt, and an error of so many per cent is as large as the signal."""

_DARK = 18
"""Number above which a cell is dark: it is written in white there."""

LOG_BLUES = {"type": "log", "domain": [1, DARKEST], "scheme": "blues", "clamp": True}
"""Scale of sizes from 1 to :data:`DARKEST`."""


@dataclass(frozen=True, kw_only=True)
class Matrix:
    """Cells of a matrix, and their numbers; the data belong to the chart that they are in.

    `colour`: field of the data that colours a cell; `rows`, `columns`: in their order; `shown`: fields of the tooltip;
    `names`: fields of the data with the row and the column; `scale`, `legend`: scale of the colours, and their legend;
    `side`, `foot`: words of Vega-Lite for the axes of rows and columns; `written`: whether the field ``text`` is
    written in each cell.
    """

    colour: str
    rows: Sequence[str]
    columns: Sequence[str]
    shown: TooltipFields
    names: tuple[str, str] = ("trial", "signal")
    scale: Mapping[str, Any] = field(default_factory=lambda: LOG_BLUES)
    legend: Mapping[str, Any] = field(default_factory=lambda: {"gradientLength": 180})
    side: Mapping[str, Any] = field(default_factory=dict)
    foot: Mapping[str, Any] = field(default_factory=dict)
    written: bool = True

    @property
    def layers(self) -> list[ChartSpec]:
        """The layers of the chart."""
        down, across = (f"{name}:N" for name in self.names)
        columns = {"sort": list(self.columns), "scale": {"domain": list(self.columns)}}
        place = {
            "x": channel(across, title=None, axis=dict(self.foot), **columns),
            "y": channel(down, title=None, axis=dict(self.side), sort=list(self.rows)),
            "tooltip": tooltips(self.shown),
        }
        fill = channel(f"{self.colour}:Q", scale=dict(self.scale), legend=dict(self.legend))
        cells = bare_layer("rect", {**place, "color": fill})
        if not self.written:
            return [cells]
        # Whatever the page is.
        ink = {"condition": {"test": f"datum.{self.colour} > {_DARK}", "value": "white"}, "value": "black"}
        return [cells, bare_layer("text", {**place, "text": "text:N", "color": ink}, fontSize=10.5)]
