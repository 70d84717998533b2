"""Result of ``stability`` of a craft with thrusters: straight runs and turns by a difference of revolutions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tank2sim.analysis.stability.craft import STRAIGHT_FROM_LENGTHS, CraftStabilityStudy
from tank2sim.answer.parts import Cell, KeyFigure, Section, Verdict, records_table, table
from tank2sim.results.ensembles import chance_sentences, figures_section
from tank2sim.results.stability import ResultOnCourse

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
    True
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
        return (*lines, *(chance_sentences(study.ensemble) if study.ensemble else []))

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
                label="Straight course",
                value="stable" if run.stable else "unstable",
                verdict=Verdict.PASSED if run.stable else Verdict.CAUTION,
            )
        ]
        if run.surge_time_constant_s is not None:
            figures.append(KeyFigure(label="Surge time constant", value=run.surge_time_constant_s, unit="s"))
        figures.append(KeyFigure(label="Highest speed", value=self.study.highest_speed_mps, unit="m/s"))
        return figures

    @property
    def sections(self) -> Sequence[Section]:
        """The straight run, other speeds, and steady turns by difference."""
        study, run = self.study, self.study.straight_run
        eigenvalues: list[list[Cell]] = [
            [value.real, value.imag, -1 / value.real if value.real else None] for value in run.eigenvalues
        ]
        heads = ("real part (1/s)", "imaginary part (1/s)", "time constant (s)")
        runs = sorted((run, *study.speeds), key=lambda one: one.speed_mps)
        surge = {"speed_mps": "", "revolutions_rpm": "", "stable": "", "surge_time_constant_s": ""}
        steering: list[list[Cell]] = [
            [one.speed_mps, one.K * _DEGPS_PER_100_RPM, one.T_s, one.T1_s, one.T2_s, one.T3_s] for one in runs
        ]
        nomoto = table(
            "Nomoto's coefficients; K: yaw rate for 100 rpm of port less starboard",
            ("speed (m/s)", "K (deg/s)", "T (s)", "T1 (s)", "T2 (s)", "T3 (s)"),
            steering,
        )
        caption = f"Steady turns about {run.revolutions_rpm:.4g} rpm, positive to starboard"
        turn = dict.fromkeys(("difference_rpm", "yaw_rate_degps", "speed_mps", "drift_deg", "diameter_m"), "")
        turns = records_table(caption, study.difference_turns, fields=turn | {"difference_rpm": "port less starboard"})
        return [
            Section(
                heading="Straight course",
                tables=[
                    table("Eigenvalues of surge, sway and yaw", heads, eigenvalues),
                    records_table("Straight runs by speed", runs, fields=surge),
                    nomoto,
                ],
            ),
            Section(heading="Steady turning", tables=[turns]),
            *([figures_section(study.ensemble)] if study.ensemble else []),
        ]
