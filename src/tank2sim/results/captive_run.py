"""Result of ``run``: Fourier coefficients, averaged cycle, residual and repeats of captive runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_panels
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.vega import ChartSpec, PlotAxis
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, Table, Verdict, data_frame, table
from tank2sim.answer.result import Result
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.single_runs import (
    CaptiveRunStudy,
    FourierCoefficient,
    RepeatedCoefficient,
    SingleRun,
)
from tank2sim.records.captive_record import FORCE_COLUMNS

if TYPE_CHECKING:
    import pandas as pd

_FORCES = {"X": "X (N)", "Y": "Y (N)", "N": "N (N m)"}
_KEYS = {"X": "N", "Y": "N", "N": "Nm"}
_HEADS = (
    "run", "signal", "unit", "order", "cos", "cos_error", "sin", "sin_error", "amplitude", "amplitude_error",
    "phase_deg", "phase_error_deg",
)  # fmt: skip
_SHOWN_ORDERS = 3
_FOURIER = (
    "F = mean + cos_n cos(n omega t) + sin_n sin(n omega t), t from a moment of the greatest leading velocity (v in "
    "pure sway, else r). X, Y, N as recorded in the hydrodynamic sense; X_water, Y_water, N_water without the inertia "
    "of the model. Errors include coloured noise within the run."
)


@dataclass(frozen=True, eq=False, repr=False)
class CaptiveRunResult(Result[CaptiveRunStudy]):
    """Fourier coefficients, averaged cycle, residual and repeats of captive runs.

    Parameters
    ----------
    study : CaptiveRunStudy
    reduced : tuple of ReducedRun
        The runs with their records; empty if the result was read from its JSON.
    """

    study: CaptiveRunStudy
    reduced: tuple[ReducedRun, ...] = ()
    command: ClassVar[str] = "run"
    procedure: ClassVar[str] = "Captive run, reduced by itself"

    @property
    def runs(self) -> tuple[SingleRun, ...]:
        """The runs."""
        return self.study.runs

    @property
    def repeats(self) -> tuple[RepeatedCoefficient, ...]:
        """Scatter of the coefficients between the runs; empty for a single one and for runs of different tests."""
        return self.study.repeats

    @property
    def coefficients(self) -> pd.DataFrame:
        """A row each Fourier coefficient: run, signal, unit, order, cosine, sine, amplitude, phase (deg), errors."""
        rows = [[run.name, *_coefficient_cells(each)] for run in self.runs for each in run.coefficients]
        return data_frame(rows, columns=_HEADS)

    def cycle(self, run: int = 0) -> pd.DataFrame:
        """Averaged cycle of a run: ``phase_deg``, and mean, standard deviation and fit of each force (N, N m).

        Parameters
        ----------
        run : int
            Place of the run.

        Raises
        ------
        InputError
            The run does not oscillate.
        """
        found = self.runs[run]
        if not found.cycles:
            raise InputError(found.name, "", "does not oscillate: it has no cycle", "take a run that does")
        columns = {"phase_deg": np.degrees(found.cycles["Y"].phase_rad)}
        for force, cycle in found.cycles.items():
            named = {"mean": cycle.mean, "deviation": cycle.deviation, "fit": cycle.fit}
            columns |= {f"{force}_{name}": values for name, values in named.items()}
        return data_frame(columns)

    def cycle_csv(self, run: int = 0) -> str:
        """The averaged cycle of a run (by its place) as CSV: columns, and errors, as of :meth:`cycle`."""
        text: str = self.cycle(run).to_csv(index=False, float_format="%.9g", lineterminator="\n")
        return text

    def to_csv(self, path: str | Path | None = None) -> str:
        """Return the Fourier coefficients as CSV, also written to `path`.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        text: str = self.coefficients.to_csv(index=False, na_rep="nan", float_format="%.9g", lineterminator="\n")
        if path is not None:
            write_together({Path(path): text}, inputs=[])
        return text

    @property
    def title(self) -> str:
        """The runs."""
        return f"Run: {', '.join(run.name.rpartition('/')[2] for run in self.runs)}"

    @property
    def headline(self) -> tuple[str, ...]:
        """Faults, repeats and the surest derivative; then type, speed, frequency and periods of each run."""
        lines = []
        for run in self.runs:
            swing = f", {run.frequency_radps:.4g} rad/s, {run.periods} periods" if run.cycles else ""
            lines.append(f"{run.name}: {_words(run.type)}, {run.speed_mps:.4g} m/s{swing}.")
        return (self._verdict(), *lines)

    def _verdict(self) -> str:
        faults = sum(len(run.faults) for run in self.runs)
        several = f"{faults} {'fault' if faults == 1 else 'faults'}: not to be used as recorded."
        parts = [several if faults else "No fault is found."]
        if self.repeats:
            odd = sum(row.differs for row in self.repeats)
            differ = f"more than their noise in {odd} of {len(self.repeats)} coefficients"
            parts.append(f"The repeats differ by {differ if odd else 'no more than their noise'}.")
        for name, value, error in _surest_derivatives(self.runs[0])[:1]:
            which = "first run" if len(self.runs) > 1 else "run"
            parts.append(f"By the {which} alone {name} is known to {100 * abs(error / value):.2g} %.")
        return " ".join(parts)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The surest derivatives of a run that is alone, runs, speed, periods, faults, repeats that differ."""
        runs, faults = self.runs, sum(len(run.faults) for run in self.runs)
        figures = [
            KeyFigure(f"{name}, times 10⁵", 1e5 * value, note=f"standard error {format_number(1e5 * error, 2)}")
            for name, value, error in (_surest_derivatives(runs[0])[:2] if len(runs) == 1 else ())
        ]
        kinds = ", ".join(dict.fromkeys(_words(run.type) for run in runs))
        figures += [
            KeyFigure("Runs", len(runs), note=kinds),
            KeyFigure("Speed", runs[0].speed_mps, "m/s"),
            KeyFigure("Periods", sum(run.periods for run in runs)),
            KeyFigure("Faults", faults, verdict=Verdict.FAILED if faults else Verdict.PASSED),
        ]
        if self.repeats:
            odd = sum(row.differs for row in self.repeats)
            verdict = Verdict.CAUTION if odd else Verdict.PASSED
            figures.append(KeyFigure("Coefficients in which repeats differ", odd, verdict=verdict))
        return figures

    @property
    def sections(self) -> Sequence[Section]:
        """Averaged cycle, derivatives, repeats, Fourier coefficients, forces over time, residuals."""
        named = dict(zip(_labels(self.runs), self.runs, strict=True))
        caption = "Points: mean by phase; shaded: ± one standard deviation; line: harmonics."
        swinging = {label: run for label, run in named.items() if run.cycles}
        cycles = []
        if swinging:
            chart = cycle_chart(swinging, title="Averaged cycle")
            cycles = [Section("Averaged cycle", charts=[Illustration(chart, caption=caption, name="cycle")])]
        fourier = [_forces_table(self.runs, water=self.study.inertia_removed), *map(_coefficients_table, self.runs)]
        return [
            *cycles,
            *_derivatives_section(self.runs),
            *_repeats_section(self.repeats),
            Section("Fourier coefficients", text=_FOURIER, tables=fourier),
            _over_time("Forces over time", "forces", "Points: readings; lines: harmonics and trend.", named),
            _over_time("Residual", "residual", "Record less harmonics and trend.", named),
        ]


def _coefficient_cells(each: FourierCoefficient) -> list[Cell]:
    phase, phase_error = math.degrees(each.phase_rad), math.degrees(each.phase_error_rad)
    return [
        each.signal,
        each.unit,
        each.order,
        *(each.cosine, each.cosine_error, each.sine, each.sine_error, each.amplitude, each.amplitude_error),
        *(phase, phase_error),
    ]


def _surest_derivatives(run: SingleRun) -> list[tuple[str, float, float]]:
    """Name, value and standard error of the derivatives of a run alone, the least relative error first."""
    if run.derivatives is None:
        return []
    errors = run.derivatives.standard_errors
    known = [
        (name, value, errors[name]) for name, value in run.derivatives.values.items() if value and errors.get(name)
    ]
    return sorted(known, key=lambda found: abs(found[2] / found[1]))


def _forces_table(runs: Sequence[SingleRun], *, water: bool) -> Table:
    """Coefficients of the forces to the third order."""
    shown = {f"{force}_water" for force in FORCE_COLUMNS} if water else set(FORCE_COLUMNS)
    rows: list[list[Cell]] = [
        [
            run.name,
            f"{each.signal.partition('_')[0]} ({each.unit})",
            each.order,
            _with_error(each.cosine, each.cosine_error),
            _with_error(each.sine, each.sine_error),
            _with_error(math.degrees(each.phase_rad), math.degrees(each.phase_error_rad)) if each.order else None,
        ]
        for run in runs
        for each in run.coefficients
        if each.signal in shown and each.order <= _SHOWN_ORDERS
    ]
    text = "of the water, inertia removed" if water else "as recorded"
    caption = f"Fourier coefficients of the forces {text}, about the leading velocity"
    return replace(table(caption, ("run", "force", "order", "cos", "sin", "phase (deg)"), rows), wide=True)


def _with_error(value: float, error: float) -> str:
    return f"{value:.5g} ± {error:.2g}" if error else f"{value:.5g}"


def _coefficients_table(run: SingleRun) -> Table:
    rows = [_coefficient_cells(each) for each in run.coefficients]
    for row in rows:
        if row[2] == 0:
            row[-2:] = [None, None]
    heads = ("signal", "unit", "order", "cos", "±", "sin", "±", "amplitude", "±", "phase (deg)", "± (deg)")
    return table(f"All Fourier coefficients: {run.name}", heads, rows, folded=True, on_screen=False)


def _derivatives_section(runs: Sequence[SingleRun]) -> list[Section]:
    rows: list[list[Cell]] = [
        [run.name, name, 1e5 * value, 1e5 * run.derivatives.standard_errors[name]]
        for run in runs
        if run.derivatives
        for name, value in run.derivatives.values.items()
    ]
    if not rows:
        return []
    caption = "Derivatives of the run alone, at its frequency and amplitude (prime, times 10⁵)"
    return [Section("Derivatives of the run alone", tables=[table(caption, ("run", "derivative", "value", "±"), rows)])]


def _repeats_section(repeats: Sequence[RepeatedCoefficient]) -> list[Section]:
    if not repeats:
        return []
    rows: list[list[Cell]] = [
        [
            *(row.signal, row.part, row.order, row.mean, row.deviation, row.expected, row.chance),
            Verdict.CAUTION if row.differs else Verdict.PASSED,
        ]
        for row in repeats
    ]
    heads = ("force", "part", "order", "mean", "deviation", "by noise", "chance", "verdict")
    note = "Deviation: standard deviation of one run. By noise: the deviation that the noise within the runs explains."
    return [Section("Repeats", tables=[table(f"{len(repeats[0].values)} runs compared", heads, rows, note)])]


def _over_time(heading: str, stem: str, caption: str, runs: Mapping[str, SingleRun]) -> Section:
    """Forces or residuals of each run over time."""
    signals = [Signal(force, force, "N.m" if force == "N" else "N") for force in _FORCES]
    charts = []
    for place, (label, run) in enumerate(runs.items(), start=1):
        title = f"{stem.capitalize()}: {label}"
        if stem == "forces":
            lines = [_history(run, "measured", "", measured=True), _history(run, "fit", "_fit")]
            chart = history_chart(lines, signals, title=title)
        else:
            chart = history_chart([_history(run, "residual", "_residual")], signals, title=title, height_px=80)
        charts.append(Illustration(chart, caption=caption, name=f"{stem}_{place}"))
    return Section(heading, charts=charts)


def _history(run: SingleRun, label: str, part: str, *, measured: bool = False) -> History:
    values = {force: run.history[f"{force}{part}_{unit}"] for force, unit in _KEYS.items()}
    return History(label, time_s=run.history["t_s"], values=values, measured=measured)


def _labels(runs: Sequence[SingleRun]) -> list[str]:
    names = [run.name for run in runs]
    return [name if names.count(name) == 1 else f"{name} ({place})" for place, name in enumerate(names, start=1)]


def _words(kind: str) -> str:
    return kind.replace("_", " ")


def cycle_chart(runs: Mapping[str, SingleRun], *, title: str = "") -> ChartSpec:
    """Averaged cycles over the phase of the motion, one panel a force, in bands of one standard deviation.

    `runs`: label to the run, in one colour each.
    """
    labels, plots = list(runs), []
    for force, up in _FORCES.items():
        series = []
        for label, each in runs.items():
            cycle = each.cycles[force]
            phase, mean, spread = np.degrees(cycle.phase_rad), cycle.mean, np.nan_to_num(cycle.deviation)
            series += [
                PlotSeries(label, x=phase, y=cycle.fit),
                PlotSeries(label, x=phase, y=mean, low=mean - spread, high=mean + spread, points=True),
            ]
        plots.append(Plot(series, up=PlotAxis(up), height_px=200))
    return curve_panels(
        plots,
        PlotAxis("phase (deg)", domain=(0.0, 360.0), nice=False),
        title=title,
        width_px=640,
        described=f"Forces over the phase of the motion of {', '.join(labels)}.",
        point_px=14,
        shaded=True,
    )
