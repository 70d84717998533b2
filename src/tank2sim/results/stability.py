"""Results of ``stability``: straight course, turning and IMO criteria of a ship; straight runs and turns of a craft."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from tank2sim.analysis.stability.craft import STRAIGHT_FROM_LENGTHS, CraftStabilityStudy
from tank2sim.analysis.stability.response import FIRST_ORDER
from tank2sim.analysis.stability.study import StabilityStudy
from tank2sim.answer.charts.analysis import FrequencyResponse, PolesZeros, bode_chart, pole_zero_chart
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import (
    Cell,
    Illustration,
    KeyFigure,
    Section,
    Table,
    Verdict,
    records_frame,
    records_table,
    table,
)
from tank2sim.results.ensembles import EnsembleResult, chance_sentences, figures_section, stability_section
from tank2sim.results.imo import imo_section
from tank2sim.results.stability_charts import (
    characteristic_chart,
    criterion_by_speed_chart,
    influence_chart,
    steering_diagram,
    step_chart,
    trim_chart,
)

if TYPE_CHECKING:
    import pandas as pd

_CRITERION = (
    "C′ = Y′v (N′r − m′x′G) − N′v (Y′r − m′), from the slopes of the full forces on the straight course. Its sign is "
    "the sign of the margin between two levers: the yaw damping lever (N′r − m′x′G)/(Y′r − m′) lies ahead of the sway "
    "lever N′v/Y′v on a ship that is stable. The margin in per cent is C′ over |Y′v (N′r − m′x′G)|, its stabilising "
    "part."
)
_TRIM = (
    "A card holds for one trim; this is an estimate. Krezelewski and Misiag say that 1 % of trim changes one of Y_r "
    "and N_r by 7.5 %; the print does not show which, nor which way and 1 % of what: both readings are drawn, as "
    "growing with trim by the stern over length. The chart also shows the corrections of Inoue, Hirano and "
    "Kijima (1981) to Y_v, Y_r, N_v and N_r. All act on the hydrodynamic part, without the inertia."
)
_RESPONSE = (
    "Response of the yaw rate to the rudder, by the linear equations about the straight course. The gear acts with "
    "its lag; its rate limit is not linear and left out. The poles of an unstable ship lie in the tinted half; its "
    "Bode diagram shows the plant that a controller sees, not a ship with a fixed rudder."
)
_TURNING = (
    "All steady turns that are joined to the straight course, at constant revolutions in calm water, followed by "
    "continuation through the folds. Solid: stable with the rudder held (all eigenvalues decay). Dashed: the ship "
    "leaves the turn by itself, and only a rudder at work holds it there."
)
_SPIRALS = (
    "The spiral holds each rudder until the turn is steady, so its points lie on the stable branches and jump at the "
    "folds. The reverse spiral holds each yaw rate by the rudder and also reaches the unstable branch. Both are "
    "simulated on the nonlinear model with its gear."
)
_CHARACTERISTIC = (
    "Bech: H(r) = δ is the diagram itself, here with the nearest cubic. Norrbin: n3 r³ + n2 r² + n1 r + n0 = K δ "
    "keeps place and slope of the straight course, so that n1 is 1 or −1. Both are fitted in rudder angle up to 20 "
    "deg; the error beyond is reported."
)


_S = TypeVar("_S", StabilityStudy, CraftStabilityStudy)


@dataclass(frozen=True, eq=False, repr=False)
class ResultOnCourse(EnsembleResult[_S]):
    """Stability of a ship or craft on a straight course.

    Parameters
    ----------
    study : dataclass
    ship : Ship, optional
        The ship (:class:`tank2sim.Ship`); None if the result was read from its JSON.
    """

    study: _S
    ship: Any = None
    command: ClassVar[str] = "stability"


@dataclass(frozen=True, eq=False, repr=False)
class StabilityResult(ResultOnCourse[StabilityStudy]):
    """Stability, steady turning and IMO criteria of a ship.

    Parameters as of :class:`ResultOnCourse`, with the study :class:`.StabilityStudy`.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.load("mariner").stability(spirals=False)
    >>> found.stable
    True
    """

    @property
    def subtitle(self) -> str:
        """Speed of the straight course."""
        return f"Stability and manoeuvrability, {self.study.operating_point.speed_mps:.4g} m/s"

    @property
    def stable(self) -> bool:
        """True if the ship holds a straight course with the rudder fixed: no eigenvalue has a positive real part."""
        return self.study.stability_criterion.stable

    @property
    def criterion(self) -> float:
        """C' (prime): the ship is stable on a straight course if it is positive and no effect adds a growing mode."""
        return self.study.stability_criterion.C_prime

    @property
    def imo(self) -> pd.DataFrame:
        """The IMO criteria (MSC.137(76)), worse side: found, allowed, unit, met, margin (%)."""
        frame = records_frame(self.study.imo, ("name", "found", "allowed", "unit", "passed", "margin_percent"))
        return frame.rename(columns={"name": "criterion", "passed": "met"}).set_index("criterion")

    @property
    def headline(self) -> tuple[str, ...]:
        """Stability on a straight course, the range of steady turns, the IMO criteria, probabilities of an ensemble."""
        point = self.study.operating_point
        verdict = "stable" if self.stable else "unstable"
        course = (
            f"{self.study.ship} at {point.speed_mps:.4g} m/s (drift {point.drift_deg:.3g} deg, rudder "
            f"{point.rudder_deg:.3g} deg) is {verdict} on a straight course: {self._margin()}."
        )
        return (course, *self._turns(), *self._criteria(), *chance_sentences(self.study.ensemble))

    def _margin(self) -> str:
        found, margin = self.study.stability_criterion, self.study.margins
        if not found.C_prime_decides:
            return (
                f"a mode grows at {found.growth_per_s:.3g} 1/s, which C' = {found.C_prime:.4g} does not show, so the "
                "margin is not defined"
            )
        levers = f"levers {margin.lever_margin_lengths:.3g} L apart"
        return f"C' = {found.C_prime:.4g}, margin {margin.margin_percent:.3g} %, {levers}"

    def _turns(self) -> list[str]:
        turning = self.study.steady_turning
        if turning is None:
            return []
        rudder, rate = turning.points.rudder_deg, turning.points.yaw_rate_degps
        text = (
            f"Steady turns: {rate[0]:.3g} to {rate[-1]:.3g} deg/s at {rudder[0]:.3g} to {rudder[-1]:.3g} deg of rudder"
        )
        if turning.loop is None:
            return [f"{text}; no hysteresis loop."]
        height = turning.loop.height_degps
        high = "" if height is None else f", {height:.3g} deg/s high"
        return [f"{text}; hysteresis loop {turning.loop.width_deg:.3g} deg of rudder wide{high}."]

    def _criteria(self) -> list[str]:
        met = [criterion.passed for criterion in self.study.imo]
        if missed := [criterion.name for criterion in self.study.imo if criterion.passed is False]:
            return [f"These criteria of IMO MSC.137(76) are not met: {'; '.join(missed)}."]
        if all(met):
            return ["All criteria of IMO MSC.137(76) are met."]
        count = met.count(True)
        return [f"{count} of {len(met)} criteria of IMO MSC.137(76) are met; the others are open."] if count else []

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The straight course, its margin, Nomoto's K', the loop, and the IMO criteria."""
        study = self.study
        straight, prime = study.stability_criterion, study.nomoto.prime
        figures = [
            KeyFigure(
                "Straight course",
                "stable" if straight.stable else "unstable",
                verdict=Verdict.PASSED if straight.stable else Verdict.CAUTION,
                note=f"C′ = {format_number(straight.C_prime, 3)}",
            ),
            self._margin_figure(),
            KeyFigure("Nomoto K′", prime.K_prime, note=f"T′ = {format_number(prime.T_prime, 3)}"),
        ]
        if study.steady_turning and (loop := study.steady_turning.loop):
            note = "of rudder, between the folds"
            figures.append(KeyFigure("Hysteresis loop", loop.width_deg, "deg", note=note))
        return [*figures, self._criteria_figure()]

    def _margin_figure(self) -> KeyFigure:
        straight, margins = self.study.stability_criterion, self.study.margins
        if not straight.C_prime_decides:
            note = f"a mode grows at {straight.growth_per_s:.3g} 1/s that C′ does not show"
            return KeyFigure("Margin", "none", verdict=Verdict.CAUTION, note=note)
        note = f"levers {format_number(margins.lever_margin_lengths, 3)} L apart"
        return KeyFigure("Margin", margins.margin_percent, "%", note=note)

    def _criteria_figure(self) -> KeyFigure:
        criteria = self.study.imo
        met = [criterion.passed for criterion in criteria]
        beyond = sum(criterion.beyond_card and criterion.found is not None for criterion in criteria)
        failed, unknown = met.count(False), met.count(None) - beyond
        verdict = Verdict.FAILED if failed else Verdict.CAUTION if unknown or beyond else Verdict.PASSED
        notes = [f"{unknown} open"] if unknown else []
        notes += [f"{beyond} beyond the card's validity"] if beyond else []
        value = f"{met.count(True)} of {len(met)}"
        return KeyFigure("IMO criteria met", value, verdict=verdict, note=", ".join(notes))

    @property
    def sections(self) -> Sequence[Section]:
        """IMO criteria, steady turning, the ensemble, the straight course, its margin, response and nonlinearity."""
        study = self.study
        return [
            imo_section(study.imo),
            *([self._turning()] if study.steady_turning else []),
            *([stability_section(study.ensemble, study.imo)] if study.ensemble else []),
            self._straight_line(),
            self._influences(),
            self._response(),
            *([self._characteristic()] if study.characteristic else []),
        ]

    def _turning(self) -> Section:
        turning, spirals = self.study.steady_turning, self.study.spirals
        assert turning is not None
        tables = [records_table("Steady turns", turning.turns, on_screen=False)]
        if turning.folds:
            tables.append(records_table("Folds, where the ship leaves its branch", turning.folds, on_screen=False))
        return Section(
            "Steady turning",
            text=f"{_TURNING}\n\n{_SPIRALS}" if spirals.direct or spirals.reverse else _TURNING,
            tables=tables,
            charts=[Illustration(steering_diagram(turning, spirals, title="Steady turns against the rudder"))],
        )

    def _straight_line(self) -> Section:
        straight, margins, nomoto = self.study.stability_criterion, self.study.margins, self.study.nomoto
        states = straight.settled_states
        levers: list[list[Cell]] = [
            ["yaw damping lever", margins.damping_lever_lengths, "L"],
            ["sway lever", margins.sway_lever_lengths, "L"],
            ["levers apart", margins.lever_margin_lengths, "L"],
            ["margin" if straight.C_prime_decides else "margin of C′ alone", margins.margin_percent, "%"],
        ]
        slow = f", in slow motions ({', '.join(states)} at rest)" if states else ""
        return Section(
            "Straight-line stability",
            text=_CRITERION,
            tables=[
                table("Margin of stability", ("quantity", "value", "unit"), levers, on_screen=False),
                _eigenvalues(self.study.eigenvalues, "".join(f", {name}" for name in states)),
                table(
                    f"Nomoto's coefficients{slow}",
                    ("units", "K", "T", "T1", "T2", "T3"),
                    [["1/s and s", *vars(nomoto.dimensional).values()], ["prime", *vars(nomoto.prime).values()]],
                ),
            ],
        )

    def _influences(self) -> Section:
        margins, trim = self.study.margins, self.study.trim
        rows: list[list[Cell]] = [
            [one.short_name, one.value, one.percent, one.neutral_value, one.neutral_percent]
            for one in margins.derivatives
        ]
        heads = ("coefficient", "value", "C' for 10 % more (%)", "neutral at", "change to neutral (%)")
        changes = trim.inoue_1981.change_percent_by_1_percent.items()
        changed = ", ".join(f"{name} {change:+.3g} %" for name, change in changes)
        charts = []
        if margins.derivatives:
            charts.append(Illustration(influence_chart(margins, title="Influence on C′")))
        if margins.speed:
            chart = criterion_by_speed_chart(margins.speed, title="Speed")
            charts.append(Illustration(chart, caption="Over the card's range of speeds."))
        charts.append(
            Illustration(
                trim_chart(trim, title="Trim (estimate)"),
                caption=f"After Inoue, 1 % of length of trim by the stern changes {changed}.",
            )
        )
        return Section(
            "Influences on the margin",
            text=f"Derivatives are prime, mass in kg and x_G in m. A coefficient is neutral at the value for which "
            f"C′ = 0, all else unchanged. {_TRIM}",
            tables=[table("Influences on C', strongest first", heads, rows)],
            charts=charts,
            folded=True,
        )

    def _response(self) -> Section:
        heading, responses = "Response to the rudder", self.study.responses
        if not responses:
            return Section(heading, text="The yaw rate does not answer to the rudder.")
        # Poles of the gear lie far out and are left out.
        systems = [
            PolesZeros(one.label, poles=one.poles.tolist(), zeros=one.zeros.tolist())
            for one in responses
            if one.label in (responses[0].label, FIRST_ORDER)
        ]
        curves = [FrequencyResponse(one.label, omega_radps=one.omega_radps, response=one.response) for one in responses]
        charts = [
            pole_zero_chart(systems, title="Poles and zeros"),
            bode_chart(curves, title="Bode diagram"),
            step_chart(responses, title="Step of the rudder"),
        ]
        return Section(heading, text=_RESPONSE, charts=[Illustration(chart) for chart in charts], folded=True)

    def _characteristic(self) -> Section:
        found = self.study.characteristic
        assert found is not None
        rows: list[list[Cell]] = [
            [name, *cubic.coefficients, *vars(cubic.error).values()]
            for name, cubic in (("Bech", found.bech), (f"Norrbin, K = {found.norrbin.K_per_s:.4g} 1/s", found.norrbin))
        ]
        errors = ("rms error (deg)", "largest error (deg)", "error beyond the fit (deg)")
        caption = "Coefficients by powers of the yaw rate, rad and s: Bech's of δ, Norrbin's of K δ"
        return Section(
            "Nonlinear steering characteristic",
            text=_CHARACTERISTIC,
            tables=[table(caption, ("cubic", "r⁰", "r¹", "r²", "r³", *errors), rows, on_screen=False)],
            charts=[Illustration(characteristic_chart(found, title="Rudder that holds a yaw rate"))],
            folded=True,
        )


def _eigenvalues(values: Sequence[complex], further: str = "") -> Table:
    rows: list[list[Cell]] = [[one.real, one.imag, -1 / one.real if one.real else None] for one in values]
    heads = ("real part (1/s)", "imaginary part (1/s)", "time constant (s)")
    return table(f"Eigenvalues of surge, sway and yaw{further}", heads, rows)


_DEGPS_PER_100_RPM = 600.0
"""Yaw rate in deg/s for a difference of 100 rpm, over the same in rad/s by rad/s."""


@dataclass(frozen=True, eq=False, repr=False)
class CraftStabilityResult(ResultOnCourse[CraftStabilityStudy]):
    """Straight-line stability, surge and turning of a craft with thrusters at both sides.

    Parameters as of :class:`ResultOnCourse`, with the study :class:`.CraftStabilityStudy`.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.load("otter").stability().stable
    False
    """

    @property
    def subtitle(self) -> str:
        """Speed of the straight run."""
        return f"Stability and turning, {self.study.straight_run.speed_mps:.4g} m/s"

    @property
    def stable(self) -> bool:
        """True if the craft holds a straight course with its revolutions held: every mode decays."""
        return self.study.straight_run.stable

    @property
    def nearly_straight(self) -> bool:
        """True if the craft, with no difference of revolutions, holds a straight course or a very wide loop."""
        return self.study.nearly_straight

    @property
    def headline(self) -> tuple[str, ...]:
        """Stability on a straight course, the time constant of surge, and the fastest steady turn."""
        study, run = self.study, self.study.straight_run
        verdict = "stable" if run.stable else "unstable"
        surge = "" if run.surge_time_constant_s is None else f"; surge time constant {run.surge_time_constant_s:.3g} s"
        unstable = [f"{one.speed_mps:.3g}" for one in study.speeds if not one.stable]
        others = f"; at {', '.join(unstable)} m/s it is unstable" if unstable else ""
        lines = [
            f"{study.ship} at {run.speed_mps:.4g} m/s ({run.revolutions_rpm:.4g} rpm) is {verdict} on a straight "
            f"course, revolutions held{surge}{others}."
        ]
        turns = study.difference_turns
        if turns and not turns[0].difference_rpm:
            lines.append(self._left_alone())
        if turns and (last := turns[-1]).difference_rpm:
            lines.append(
                f"Steady turns: up to {last.yaw_rate_degps:.3g} deg/s, {last.diameter_m:.3g} m wide, at "
                f"{last.difference_rpm:.4g} rpm of difference."
            )
        return (*lines, *chance_sentences(study.ensemble))

    def _left_alone(self) -> str:
        """Motion of an unstable craft without a difference of revolutions."""
        turn, length = self.study.difference_turns[0], self.study.length_m
        if turn.diameter_m > STRAIGHT_FROM_LENGTHS * length:
            per_length = math.degrees(2 * length / turn.diameter_m)
            return (
                f"Left alone it stays nearly straight: it settles on a curve of {per_length:.1g} deg for each length."
            )
        return f"It turns by itself, to either side: {turn.yaw_rate_degps:.3g} deg/s, {turn.diameter_m:.3g} m wide."

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The straight run, surge, and the highest speed."""
        run = self.study.straight_run
        figures = [
            KeyFigure(
                "Straight course",
                "stable" if run.stable else "unstable",
                verdict=Verdict.PASSED if run.stable else Verdict.CAUTION,
            )
        ]
        if run.surge_time_constant_s is not None:
            figures.append(KeyFigure("Surge time constant", run.surge_time_constant_s, "s"))
        figures.append(KeyFigure("Highest speed", self.study.highest_speed_mps, "m/s"))
        return figures

    @property
    def sections(self) -> Sequence[Section]:
        """The straight run, other speeds, and steady turns by difference."""
        study, run = self.study, self.study.straight_run
        runs = sorted((run, *study.speeds), key=lambda one: one.speed_mps)
        surge = {"speed_mps": "", "revolutions_rpm": "", "stable": "", "surge_time_constant_s": ""}
        nomoto = table(
            "Nomoto's coefficients; K: yaw rate for 100 rpm of port less starboard",
            ("speed (m/s)", "K (deg/s)", "T (s)", "T1 (s)", "T2 (s)", "T3 (s)"),
            [[one.speed_mps, one.K * _DEGPS_PER_100_RPM, one.T_s, one.T1_s, one.T2_s, one.T3_s] for one in runs],
        )
        caption = f"Steady turns about {run.revolutions_rpm:.4g} rpm, positive to starboard"
        turn = dict.fromkeys(("difference_rpm", "yaw_rate_degps", "speed_mps", "drift_deg", "diameter_m"), "")
        turns = records_table(caption, study.difference_turns, fields=turn | {"difference_rpm": "port less starboard"})
        return [
            Section(
                "Straight course",
                tables=[
                    _eigenvalues(run.eigenvalues),
                    records_table("Straight runs by speed", runs, fields=surge),
                    nomoto,
                ],
            ),
            Section("Steady turning", tables=[turns]),
            *([figures_section(study.ensemble)] if study.ensemble else []),
        ]
