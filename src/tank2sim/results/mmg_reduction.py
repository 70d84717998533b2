"""Result of ``reduce --mmg``: coefficients of the MMG method from steady captive tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.charts.curves import PlotSeries
from tank2sim.answer.charts.vega import ChartSpec, PlotAxis, layer, layered, tooltips
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, records_frame, table
from tank2sim.answer.result import Result
from tank2sim.cards import Card
from tank2sim.identification.captive_mmg.regression import MmgFit
from tank2sim.identification.captive_mmg.study import ChannelReadings, MmgCoefficient, MmgStudy
from tank2sim.results.captive_charts import derivative_certainty_chart

if TYPE_CHECKING:
    import pandas as pd

_CHANNELS = {
    "X": "surge force",
    "Y": "sway force",
    "N": "yaw moment",
    "T": "thrust",
    "F_N": "normal force of the rudder",
    "T_left": "thrust of the left propeller",
    "F_N_left": "normal force of the left rudder",
    "Q": "torque of the propeller",
}


@dataclass(frozen=True, eq=False, repr=False)
class MmgReductionResult(Result[MmgStudy]):
    """Coefficients of the MMG method from steady captive tests.

    Parameters
    ----------
    study : MmgStudy
    fit : MmgFit, optional
        None, as card and ship, if the result was read from its JSON.
    card : Card, optional
        The MMG card found, with the covariance of its coefficients; ``card.save("ship.toml")`` writes it.
    """

    study: MmgStudy
    fit: MmgFit | None = None
    card: Card | None = None
    command: ClassVar[str] = "reduce"

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Tables and runs of the campaign."""
        if self.fit is None:
            return ()
        form = self.fit.tests.form
        named = [section.file for section in (form.averages, form.open_water) if section and section.file]
        named += [run.file for run in form.runs if form.averages is None]
        return tuple(Path(self.study.campaign).parent / name for name in named)

    @property
    def coefficients(self) -> dict[str, MmgCoefficient]:
        """Coefficients by the names of an MMG card."""
        return self.study.coefficients

    @property
    def derivatives(self) -> pd.DataFrame:
        """Coefficients by name: value, standard error, origin; hull in prime II."""
        return records_frame(self.coefficients, ("value", "standard_error", "origin"))

    @property
    def unexplained(self) -> tuple[float, ...]:
        """rms of the residuals over rms of the readings, of each channel."""
        return tuple(channel.unexplained for channel in self.study.channels.values())

    @property
    def title(self) -> str:
        """The model."""
        return f"{self.study.model}: coefficients of the MMG method"

    @property
    def subtitle(self) -> str:
        """The tests."""
        return f"From {len(self.study.conditions)} steady captive conditions"

    @property
    def _open(self) -> list[str]:
        return [name for name, found in self.coefficients.items() if found.origin == "open"]

    @property
    def headline(self) -> tuple[str, ...]:
        """Number of coefficients, and the worst residual."""
        study, measured = self.study, sum(found.origin == "measured" for found in self.coefficients.values())
        worst, channel = max(study.channels.items(), key=lambda channel: channel[1].unexplained)
        opened = f"; {len(self._open)} are open and taken from ordinary ships" if self._open else ""
        return (
            f"{study.model}: {measured} coefficients of the MMG method are measured in {len(study.conditions)} steady "
            f"conditions{opened}.",
            f"The method follows every force within {100 * channel.unexplained:.2g} % of its rms; the "
            f"{_CHANNELS[worst]} is the worst.",
        )

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Residuals of the channels, and how many coefficients the tests leave open."""
        return [
            *(
                KeyFigure(
                    f"{_CHANNELS[name].capitalize()} followed within",
                    float(f"{100 * channel.unexplained:.2g}"),
                    "%",
                    note=f"rms, {channel.standard_deviation:.3g} {channel.unit.replace('.', ' ')}",
                )
                for name, channel in self.study.channels.items()
            ),
            KeyFigure(
                "Left open by the tests",
                len(self._open),
                verdict=Verdict.CAUTION if self._open else Verdict.NONE,
                note=", ".join(self._open) or "none",
            ),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Coefficients, computed and measured readings, the budget."""
        certainty = []
        known = {name: found for name, found in self.coefficients.items() if found.standard_error and found.value}
        if known:
            title = "Certainty of the coefficients"
            certainty = [Illustration(derivative_certainty_chart(known, title=title))]
        readings = [
            Illustration(computed_chart(name, readings), half=True) for name, readings in self.study.readings.items()
        ]
        return [
            Section(
                "Coefficients",
                text="One weighted regression of all readings.",
                charts=certainty,
                tables=[self._coefficients()],
            ),
            Section(
                "Computed against measured",
                text="Each point is a condition; on the line computed and measured reading agree.",
                charts=readings,
                tables=[self._residuals()],
            ),
            Section(
                "Uncertainty budget",
                text="After ITTC 7.5-02-06-04: the scatter of the tests, and errors common to all of them as "
                "[uncertainty] of the campaign states them.",
                tables=[self._budget()],
                folded=True,
            ),
        ]

    def _coefficients(self) -> Table:
        rows: list[list[Cell]] = [
            [name, found.value, found.standard_error, found.origin] for name, found in self.coefficients.items()
        ]
        arm = self.study.yaw_arm
        rows.append(["x_R + a_H x_H", arm.value, arm.standard_error, "measured"])
        heads = ("coefficient", "value", "standard error", "origin")
        return table("Coefficients (hull: prime II, by 1/2 rho L d U²)", heads, rows)

    def _residuals(self) -> Table:
        words = {name: (_CHANNELS[name], channel) for name, channel in self.study.channels.items()}
        words |= {name: (f"{name} (open water)", curve) for name, curve in self.study.open_water.items()}
        rows: list[list[Cell]] = [
            [title, found.unit.replace(".", " "), found.standard_deviation, 100 * found.unexplained]
            for title, found in words.values()
        ]
        heads = ("channel", "unit", "standard deviation", "share of the rms (%)")
        return table("Residuals of the readings", heads, rows, digits=3)

    def _budget(self) -> Table:
        sources = list(dict.fromkeys(source for found in self.coefficients.values() for source in found.type_b))
        rows: list[list[Cell]] = [
            [
                name,
                *(
                    round(100 * (part / found.standard_error) ** 2, 2)
                    for part in (found.type_a, *(found.type_b.get(source, 0.0) for source in sources))
                ),
                found.standard_error,
                2 * found.standard_error,
            ]
            for name, found in self.coefficients.items()
        ]
        columns = [
            *(Column("coefficient"), Column("scatter", "%", digits=3)),
            *(Column(source.rpartition("_")[0], "%", digits=3) for source in sources),
            *(Column("combined", digits=3), Column("expanded, k = 2", digits=3)),
        ]
        return table("Shares of the variance", columns, rows, on_screen=False)


def computed_chart(name: str, readings: ChannelReadings) -> ChartSpec:
    """Computed over measured readings of one channel (by its name), with the line on which both are the same."""
    unit = readings.unit.replace(".", " ")
    ends = [float(readings.measured.min()), float(readings.measured.max())]
    equal = PlotSeries("equal", x=ends, y=ends)
    both = PlotSeries("", x=readings.measured, y=readings.computed, points=True)
    across, up = (PlotAxis(f"{name} {kind} ({unit})", zero=True) for kind in ("measured", "computed"))
    place = {"x": across.channel("x"), "y": up.channel("v")}
    shown = tooltips({"x:Q": "measured", "v:Q": "computed"})
    return layered(
        [
            layer("line", equal.rows, place, opacity=0.5),
            layer("circle", both.rows, {**place, "tooltip": shown}, size=36, opacity=0.7),
        ],
        size=(300, 300),
        title=_CHANNELS[name].capitalize(),
        description=f"Computed and measured {_CHANNELS[name]}.",
    )
