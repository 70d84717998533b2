"""Result of ``yaw``: added yaw inertia and dissipation of a body on the yaw rig, by method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, ClassVar

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, row_chart
from tank2sim.answer.charts.vega import (
    STACKS,
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    channel,
    layer,
    layered,
    tooltips,
)
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, records_frame, table
from tank2sim.answer.result import Result
from tank2sim.apps.rigs.yaw.card import YawRigCard
from tank2sim.apps.rigs.yaw.energy import YawMethodEstimate
from tank2sim.apps.rigs.yaw.found_card import nrdot_prime, rig_card_text, with_nrdot
from tank2sim.apps.rigs.yaw.identify import STAGES, YAW_METHODS, EnergyBalance, EnergyResidual, YawStudy
from tank2sim.apps.rigs.yaw.model import UNKNOWN_RIG
from tank2sim.apps.rigs.yaw.records import YawRecord
from tank2sim.apps.rigs.yaw.theory import TheoryValue
from tank2sim.arrays import Columns
from tank2sim.cards import Card, parse_card
from tank2sim.errors import ArgumentError, InputError
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

_NORMAL = 1.959964
_SIGNALS = (
    Signal("rate", "yaw rate", "rad/s"),
    Signal("error", "tracking error", "rad"),
    Signal("current", "motor current", "A"),
)


_HOW = {
    "energy_least_squares": "all subintervals, measured speeds, the programme for instruments",
    "as_many_equations": "as many equations as unknowns: an interval, and sums over three parts",
    "two_intervals": "an accelerating and a braking interval, measured speeds",
    "output_error": "equation of motion integrated, fitted to the angle",
    "energy_least_squares_reference": "all subintervals, the programme's speeds",
    "two_intervals_reference": "an accelerating and a braking interval, the programme's speeds",
}
_ESTIMATES = (
    "Inertia and dissipation of one accelerating interval. Bars are 95 % intervals of scatter; they do not contain a "
    "bias that is the same in every pair of intervals."
)
_BALANCE = (
    "Over each part of the intervals the work of the motor is kinetic energy plus the work of friction and water."
)
_ANGLE = (
    "The equation of motion is integrated under the recorded current, each hump from its own start; the recorded angle "
    "is subtracted."
)


@dataclass(frozen=True, eq=False, repr=False)
class YawResult(Result[YawStudy]):
    """Added yaw inertia and dissipation of a body on the yaw rig, SI.

    Parameters
    ----------
    study : YawStudy
    method : str
        Method whose numbers a card gets.
    records : tuple of YawRecord
        Records of the study; empty if the result was read from its JSON.
    rig : YawRigCard, optional
        What is known of the rig.
    files : mapping, optional
        Paths and contents of the card's files, if the command writes one.
    """

    study: YawStudy
    method: str = YAW_METHODS[0]
    records: tuple[YawRecord, ...] = ()
    rig: YawRigCard | None = None
    files: Mapping[Path, str | bytes] = field(default_factory=dict)
    command: ClassVar[str] = "yaw"

    def _read_records(self) -> tuple[YawRecord, ...]:
        if not self.records:
            raise InputError(self.study.records[0], "", "was not read with this result", "evaluate the records again")
        return self.records

    def _known_method(self) -> str:
        if self.method not in self.study.methods:
            problem = f"{self.method} gave no estimate from these records"
            raise ArgumentError("method", "", problem, f"take one of {', '.join(self.study.methods)}")
        return self.method

    @property
    def estimates(self) -> pd.DataFrame:
        """Estimates by method (index) with their standard errors: inertias in kg m2, dissipation B + D in J.

        ``added_inertia_kgm2`` is missing where J_zz is not known; ``total_inertia_kgm2`` is J_zz + lambda661.
        """
        columns = [
            f"{name}{error}_{unit}"
            for name, unit in (("added_inertia", "kgm2"), ("total_inertia", "kgm2"), ("dissipation", "J"))
            for error in ("", "_standard_error")
        ]
        return records_frame(self.study.methods, columns, index="method")

    @property
    def added_inertia_kgm2(self) -> float | None:
        """lambda661 by :attr:`method`; None where J_zz is not known."""
        return self.study.methods[self._known_method()].added_inertia_kgm2

    def nrdot(self, length_m: float | None = None) -> tuple[float, float | None]:
        """N_rdot' (prime) of the body and its standard error.

        Parameters
        ----------
        length_m : float, optional
            Length of the body; by default as the records state.

        Raises
        ------
        InputError
            The added inertia or the length is not known, or the added inertia is negative.
        """
        return nrdot_prime(self.study, self._read_records(), self._known_method(), length_m)

    def with_nrdot(self, card: Any, length_m: float | None = None) -> Any:
        """A ship with N_rdot of the body on the rig on its card, the value before in a comment.

        Parameters
        ----------
        card : Ship, Card, str or path
        length_m : float, optional
            As in :meth:`nrdot`.

        Raises
        ------
        InputError
            As :meth:`nrdot`, or the card is not one of a ship that manoeuvres.
        """
        from tank2sim import Ship
        from tank2sim.dynamics.vessel import as_vessel

        found = self.nrdot(length_m)
        return Ship(with_nrdot(as_vessel(card).manoeuvring(), *found, self.method))

    def rig_card(self, name: str = "yaw rig") -> Card:
        """The card of the rig with its body, called `name`.

        Raises
        ------
        InputError
            The method gives no friction, or the added inertia is not known or negative.
        """
        records, method = self._read_records(), self._known_method()
        known = self.rig.yaw_rig if self.rig else UNKNOWN_RIG
        return parse_card(rig_card_text(self.study, records, method, name=name, known=known), "the card found")

    @property
    def title(self) -> str:
        """What was done."""
        return "Added yaw inertia by the energy method"

    @property
    def subtitle(self) -> str:
        """Records, medium, torque constant and inertia of the body."""
        study = self.study
        names = ", ".join(PurePath(record).name for record in study.records)
        body = ""
        if study.body_inertia_kgm2 is not None:
            body = f"; J_zz = {1e4 * study.body_inertia_kgm2:.5g}e-4 kg m2 ({study.body_inertia_source})"
        return f"{names}: in {study.medium}, k_t = {study.torque_constant_NmpA:.4g} N m/A{body}"

    @property
    def headline(self) -> tuple[str, ...]:
        """The inertia by the energy least squares, and the records."""
        kind, inertia, error = self.study.methods[YAW_METHODS[0]].inertia
        shown = f"{1e4 * inertia:.4g}" if error is None else f"({1e4 * inertia:.4g} ± {1e4 * error:.2g})"
        return (
            f"The {kind} yaw inertia is {shown} · 10⁻⁴ kg m² by the energy least squares; ± is one standard error.",
            f"{self.subtitle}.",
        )

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Inertia, dissipation, bias of the two-interval formula, mirror images."""
        best = self.study.methods[YAW_METHODS[0]]
        kind, inertia, error = best.inertia
        bias = 100 * (self.study.methods["two_intervals"].bias_against_least_squares_kgm2 or 0.0)
        bias /= best.total_inertia_kgm2
        return [
            KeyFigure(
                "Added yaw inertia" if kind == "added" else "Yaw inertia",
                float(f"{1e4 * inertia:.5g}"),
                "10⁻⁴ kg m²",
                note="energy least squares" + (f", ± {1e4 * error:.2g}" if error is not None else ""),
            ),
            KeyFigure(
                "Dissipation B + D",
                float(f"{1e4 * best.dissipation_J:.4g}"),
                "10⁻⁴ J",
                note=f"± {1e4 * (best.dissipation_standard_error_J or 0):.2g}",
            ),
            KeyFigure(
                "Bias of the two-interval formula",
                float(f"{bias:.2g}"),
                "%",
                note="of the total inertia",
                verdict=Verdict.CAUTION if abs(bias) > 1 else Verdict.NONE,
            ),
            KeyFigure(
                "Mirror images differ by",
                float(f"{100 * max(self.study.mirror_difference):.3g}"),
                "%",
                note="of the largest rate, in the worst pair",
            ),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Estimates, energy balance, records, residuals, theory."""
        study = self.study
        methods = study.methods
        estimates = Illustration(
            _estimates_chart(methods), caption="Dashed: the energy least squares.", name="estimates_by_method"
        )
        balance = [
            Illustration(
                _balance_chart(study.energy_balance), caption="The mean over all pairs.", name="energy_balance"
            ),
            Illustration(_energy_residual_chart(study.energy_residuals), name="energy_balance"),
        ]
        records = [
            Illustration(_record_chart(name, columns), name="record_and_programme")
            for name, columns in study.histories.items()
        ]
        sections = [
            Section("Estimates by method", text=_ESTIMATES, tables=[_estimates(methods)], charts=[estimates]),
            Section("Energy balance", text=_BALANCE, tables=[_friction(methods)], charts=balance),
            Section("Record and programme", text="The rate is shown where it is evaluated.", charts=records),
        ]
        if study.angle_residual is not None:
            chart = Illustration(_angle_residual_chart(study.angle_residual), name="nonlinear_least_squares")
            sections.append(Section("Nonlinear least squares", text=_ANGLE, charts=[chart]))
        return [*sections, *([_theory(study.theory)] if study.theory else [])]


def _theory(theory: Sequence[TheoryValue]) -> Section:
    rows: list[list[Cell]] = [
        [value.formula, 1e4 * value.value_kgm2, _scaled(value.printed_kgm2), value.remark] for value in theory
    ]
    heads = ("formula", "added inertia (10⁻⁴ kg m²)", "published, Table 1 (10⁻⁴ kg m²)", "remark")
    caption = "Added inertia from the form, by (7), (8) and (9) of Alyshev (2019)"
    return Section("Theory", tables=[table(caption, heads, rows, digits=5)])


def _scaled(value: float | None) -> float | None:
    """A value in 10⁻⁴ of its unit."""
    return None if value is None else 1e4 * value


def _estimates(methods: Mapping[str, YawMethodEstimate]) -> Table:
    fields = (
        "added_inertia_kgm2",
        "added_inertia_standard_error_kgm2",
        "total_inertia_kgm2",
        "dissipation_J",
        "dissipation_standard_error_J",
        "bias_against_least_squares_kgm2",
    )
    rows: list[list[Cell]] = [
        [method.replace("_", " "), *(_scaled(getattr(found, field)) for field in fields)]
        for method, found in methods.items()
    ]
    columns = [
        Column("method"),
        Column("added inertia", "10⁻⁴ kg m²", digits=5),
        Column("±", digits=3),
        Column("total inertia", "10⁻⁴ kg m²", digits=5),
        Column("B + D", "10⁻⁴ J"),
        Column("±", digits=3),
        Column("bias", "10⁻⁴ kg m²", digits=3),
    ]
    notes = [f"{method.replace('_', ' ')}: {_HOW[method]}." for method in methods]
    return table("Estimates with standard errors", columns, rows, *notes, folded=True)


def _friction(methods: Mapping[str, YawMethodEstimate]) -> Table:
    """A row for each term, a column for each method that gives it."""
    given = {name: found for name, found in methods.items() if found.friction}
    terms = dict.fromkeys(term for found in given.values() for term in found.friction)
    rows: list[list[Cell]] = []
    for term in terms:
        words, unit = in_words(term)
        cells: list[Cell] = []
        for found in given.values():
            value, error = _scaled(found.friction.get(term)), found.friction_standard_errors.get(term)
            shown = None if value is None else format_number(value)
            cells.append(shown if error is None else f"{shown} ± {format_number(1e4 * error, 2)}")
        rows.append([words, unit, *cells])
    heads = ("term", "unit", *(name.replace("_", " ") for name in given))
    return table("Friction and water, times 10⁴", heads, rows, folded=True)


def _record_chart(name: str, columns: Columns) -> ChartSpec:
    """Rate where it is evaluated next to the programme's, tracking error, and current, over the whole record."""
    shown = {"rate": "rate_radps", "error": "tracking_error_rad", "current": "current_A"}
    runs = {name: shown, "programme": {"rate": "programme_rate_radps"}}
    histories = [
        History(label, time_s=columns["t_s"], values={key: columns[column] for key, column in signals.items()})
        for label, signals in runs.items()
    ]
    return history_chart(histories, _SIGNALS, title=f"{name}: programme and record")


def _balance_chart(balance: EnergyBalance) -> ChartSpec:
    """Work of the motor in each subinterval (points) and its uses (bars), means over all pairs."""
    terms = {term.replace("_", " "): parts for term, parts in balance.spent_J.items()}
    look = series_look([*terms, "motor"], as_points=["motor"])
    panels = []
    for name in STAGES:
        bars = [
            {"part": place, "run": term, "v": plain(1e3 * value)}
            for term, parts in terms.items()
            for place, value in enumerate(parts[name].tolist(), start=1)
        ]
        motor = enumerate(balance.motor_J[name].tolist(), start=1)
        points = [{"part": place, "run": "motor", "v": plain(1e3 * value)} for place, value in motor]
        place = {
            "x": channel("part:O", title=f"{name}: part of the interval", axis={"labelAngle": 0}),
            "y": PlotAxis("work (mJ)", zero=True).channel("v"),
            "color": look.colour,
            "tooltip": tooltips({"run:N": "spent on", "part:O": "part", "v:Q": "work (mJ)"}),
        }
        marks = [
            layer("bar", bars, place, opacity=0.75),
            layer("point", points, {**place, "shape": look.shape}, size=60, strokeWidth=2),
        ]
        panels.append(layered(marks, size=(340, 260)))
    return {
        "hconcat": panels,
        "spacing": 24,
        "resolve": {"scale": {"y": "shared"}},
        "title": "Work of the motor and its uses",
        "description": "Energy balance of each subinterval: kinetic energy and each term of friction against the "
        "motor's work.",
        "usermeta": STACKS,
    }


def _estimates_chart(methods: Mapping[str, YawMethodEstimate]) -> ChartSpec:
    """Inertia by each method with its 95 % interval: the added one, or the total where J_zz is not known."""
    rows: list[ChartRecord] = []
    kind = "added"
    for method, estimate in methods.items():
        kind, value, error = estimate.inertia
        spread = _NORMAL * (error or 0.0)
        rows.append(
            {"name": method.replace("_", " "), "v": plain(1e4 * value)}
            | {"low": plain(1e4 * (value - spread)), "high": plain(1e4 * (value + spread))}
        )
    words = f"{kind} inertia"
    return row_chart(
        RowPlot(
            rows,
            across=PlotAxis(f"{words} (10⁻⁴ kg m²)"),
            rules=[Rule([rows[0]["v"]], dash=(4, 3))],
            side={"labelLimit": 260},
            shown={"name:N": "method", "v:Q": "10⁻⁴ kg m²", "low:Q": "from", "high:Q": "to"},
        ),
        title=f"{words.capitalize()} by method",
        described=f"{words.capitalize()} by each method with its 95 % interval.",
        width_px=560,
        step_px=34,
        span_px=2,
        filled=True,
        size=70,
    )


def _energy_residual_chart(residuals: Sequence[EnergyResidual]) -> ChartSpec:
    """Residual work of each subinterval, against the rate in its middle."""
    stages = {stage: [one for one in residuals if one.stage == stage] for stage in STAGES}
    series = [
        PlotSeries(
            stage,
            x=[one.rate_degps for one in found],
            y=[1e6 * one.left_J for one in found],
            points=True,
            more={"hump": [one.hump for one in found]},
        )
        for stage, found in stages.items()
    ]
    return curve_chart(
        Plot(series, up=PlotAxis("work left over (µJ)", zero=True), height_px=220, rules=[Rule([0.0])]),
        PlotAxis("mean rate of the subinterval (deg/s)"),
        title="Residuals of the energy balance",
        window=(),
        described="Work that the energy least squares do not explain, by subinterval.",
        shown={"run:N": "interval", "hump:O": "hump", "v:Q": "left over (µJ)"},
    )


def _angle_residual_chart(residual: Columns) -> ChartSpec:
    """Residual angle of the integrated equation over time."""
    history = History("integrated less measured", time_s=residual["t_s"], values={"left": residual["residual_rad"]})
    signal = Signal("left", "angle, integrated less measured", "rad")
    return history_chart([history], [signal], title="Residuals of the nonlinear least squares")
