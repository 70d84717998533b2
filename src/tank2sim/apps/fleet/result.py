"""Result of ``gap`` for a fleet: all ships in one table, each with the way to its own page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from tank2sim.answer.charts.parts import series_look
from tank2sim.answer.charts.rows import RowPlot, row_chart
from tank2sim.answer.charts.vega import PlotAxis, Rule
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Link, Section, Table, Verdict, table
from tank2sim.answer.result import Result
from tank2sim.apps.fleet.summary import REPORT_FILE, FleetStudy, ShipSummary
from tank2sim.gap.result import AMBIGUOUS, GAP_VERDICTS, MISSING
from tank2sim.notices import Notice
from tank2sim.results.gap_text import effect_in_words, parameter_cells

_SHIPS = (
    "Misfit is the root mean square of simulated less measured, in standard deviations of the measurement noise: 1 is "
    "the noise floor. It is counted over the held-out trials, which took no part in naming the effect, or over the "
    "fitting ones where none was held out. Before is the card as given, after the card with the named effects."
)
_CHART = "The line is the noise; the scale is logarithmic. The points coincide where nothing was added."
_LINKS = f"Each ship has a page of its own, {REPORT_FILE}, in the folder of its name next to fleet.json."
_BEFORE, _AFTER = "card as given", "card found"


@dataclass(frozen=True, eq=False, repr=False)
class FleetResult(Result[FleetStudy]):
    """The missing effects of the ships of a fleet.

    Parameters
    ----------
    study : FleetStudy
    linked : bool
        Whether the page lies in the folder of the results, and leads to the page of each ship.
    origins : mapping
        Ship to the origin of its results: this search or an earlier one.
    remarks : tuple of Notice
        Messages about the folder of the results.
    inputs : tuple of Path
        Cards and trials.
    written : tuple of Path
        Files of the fleet; the ships' files are listed in their ``gap.json``.
    """

    study: FleetStudy
    linked: bool = False
    origins: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[Notice, ...] = ()
    inputs: tuple[Path, ...] = ()
    written: tuple[Path, ...] = ()
    command: ClassVar[str] = "gap"

    @property
    def title(self) -> str:
        """The fleet."""
        return f"Fleet: {self.study.fleet}"

    @property
    def subtitle(self) -> str:
        """Number of ships."""
        return f"Search for the missing effects of {len(self.study.ships)} ships"

    @property
    def headline(self) -> tuple[str, ...]:
        """Number of ships with each verdict and without a result; the origin of each result."""
        study = self.study
        counts = [f"{word}: {study.verdicts[word]}" for word in GAP_VERDICTS if word in study.verdicts]
        counts += [f"without a result: {len(self._faults)}"] if self._faults else []
        origins = (f"{ship}: {origin}" for ship, origin in self.origins.items())
        return f"{study.fleet}: {len(study.ships)} ships ({', '.join(counts)}).", *origins

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Messages about the ships and the folder of the results."""
        return *self.remarks, *self.study.notices

    @property
    def faults(self) -> tuple[str, ...]:
        """The ships without a result, those with one reason together."""
        ships: dict[str, list[str]] = {}
        for ship in self._faults:
            ships.setdefault(ship.fault, []).append(ship.folder)
        return tuple(f"{', '.join(names)}: {fault}" for fault, names in ships.items())

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Number of ships, in all and with each verdict."""
        counts = self.study.verdicts
        figures = [KeyFigure("Ships", str(len(self.study.ships)))]
        figures += [
            KeyFigure(f"{word[0].upper()}{word[1:]}", str(counts[word])) for word in GAP_VERDICTS if word in counts
        ]
        if self._faults:
            count = str(len(self._faults))
            figures.append(KeyFigure("Without a result", count, verdict=Verdict.FAILED))
        return figures

    @property
    def sections(self) -> Sequence[Section]:
        """The ships, and those without a result."""
        found = [ship for ship in self.study.ships if not ship.fault]
        sections = []
        if found:
            text = _SHIPS if self.linked else f"{_SHIPS} {_LINKS}"
            tables = [_ships(found, self.linked), *_sizes(found)]
            sections.append(Section("Ships", text=text, tables=tables, charts=_misfits(found)))
        if self._faults:
            rows = [[ship.folder, ship.fault] for ship in self._faults]
            faults = table("Ships that could not be judged", ("ship", "reason"), rows)
            sections.append(Section("Without a result", tables=[faults]))
        return sections

    @property
    def _faults(self) -> list[ShipSummary]:
        return [ship for ship in self.study.ships if ship.fault]


def _ships(found: Sequence[ShipSummary], linked: bool) -> Table:
    rows: list[list[Cell]] = [
        [
            Link(text=ship.folder, path=ship.report) if linked else ship.folder,
            ship.name,
            ship.verdict,
            _effects(ship),
            *map(_hundredths, ship.misfits),
            "held out" if ship.held_out else "fitting",
        ]
        for ship in found
    ]
    # Misfits are rounded to hundredths: seven digits cut nothing off.
    heads = [Column(head, digits=7) for head in ("before", "after")]
    columns: list[str | Column] = ["ship", "name", "verdict", "missing effect", *heads, "trials"]
    return table("Findings, and the misfit before and after in units of the noise", columns, rows)


def _sizes(found: Sequence[ShipSummary]) -> list[Table]:
    rows = [
        [ship.folder, effect_in_words(effect.name), *parameter_cells(effect, parameter)]
        for ship in found
        for effect in ship.effects
        for parameter in effect.parameters
    ]
    heads = ("ship", "effect", "parameter", "value", "unit", "meaning")
    return [table("Sizes of the effects, ± one standard error", heads, rows, on_screen=False)] if rows else []


def _effects(ship: ShipSummary) -> str:
    """The effects, or all that it may be."""
    named = "; ".join(effect_in_words(effect.name) for effect in ship.effects)
    if ship.verdict == AMBIGUOUS:
        return " or ".join([named, *map(effect_in_words, ship.alternatives)])
    return named if ship.verdict == MISSING else ""


def _hundredths(misfit: float | None) -> float | None:
    return None if misfit is None else round(misfit, 2)


def _misfits(found: Sequence[ShipSummary]) -> list[Illustration]:
    """Misfit of each ship before and after, a row each; empty where no simulation came to its end."""
    rows = [
        {"name": ship.folder, "run": label, "v": _hundredths(misfit)}
        for ship in found
        for label, misfit in zip((_BEFORE, _AFTER), ship.misfits, strict=True)
        if misfit
    ]
    if not rows:
        return []
    chart = row_chart(
        RowPlot(
            rows,
            across=PlotAxis("misfit (standard deviations of the noise)", log=True),
            look=series_look([_BEFORE, _AFTER], as_points=[_BEFORE, _AFTER]),
            names=[ship.folder for ship in found],
            rules=[Rule([1.0], style="limit")],
            shown={"name:N": "ship", "run:N": "model", "v:Q": "misfit"},
        ),
        title="Misfit before and after",
        described=f"Misfit of {len(found)} ships by the cards as given and by those found.",
        step_px=22,
        filled=True,
        size=70,
    )
    return [Illustration(chart, caption=_CHART, name="misfit")]
