"""Sections and charts of the autopilot's result hold the numbers of its study."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.analysis.heading.margins import LargestSteps, LoopMargins, LoopResponse
from tank2sim.analysis.heading.runs import CourseChange, CourseKeeping
from tank2sim.analysis.heading.study import AutopilotStudy, ClosedLoop, ShipAlone
from tank2sim.results.autopilot import AutopilotResult
from tests.answer.drawn import line, panels

OMEGA = np.logspace(-3, 1, 60)
LOOP = 0.1 / (1j * OMEGA * (1 + 10j * OMEGA))
CHANGE = CourseChange(
    ordered_deg=20.0,
    rise_time_s=60.0,
    overshoot_deg=1.0,
    settling_time_s=200.0,
    largest_rudder_deg=15.0,
    rate_limited_s=3.0,
)
MOTION = {
    "t_s": np.arange(4.0),
    "delta_deg": np.array([0.0, 10.0, 10.0, 10.0]),
    "r_degps": np.array([0.0, 0.1, 0.2, 0.3]),
    "psi_deg": np.array([0.0, 0.05, 0.2, 0.45]),
}
STUDY = AutopilotStudy(
    ship="A ship",
    design="pid",
    source="poles placed",
    gains={"Kp": 1.2},
    limits={"largest_rudder_deg": 35.0},
    ship_alone=ShipAlone(speed_mps=7.7, stable=True, rudder_deg=-1.0, K_per_s=0.2, T_s=100.0),
    margins=(
        LoopMargins(
            speed_mps=7.7,
            gain_margin_up=np.inf,
            gain_margin_down=0.0,
            gain_margin_dB=np.inf,
            phase_margin_deg=60.0,
            delay_margin_s=10.0,
            sensitivity_peak=float(1 / np.abs(1 + LOOP).min()),
            crossover_radps=0.1,
            bandwidth_radps=0.1,
            stable=True,
            poles=(-0.05 + 0.08j, -0.05 - 0.08j),
        ),
    ),
    responses=(LoopResponse(speed_mps=7.7, omega_radps=OMEGA, loop=LOOP, heading=LOOP / (1 + LOOP)),),
    closed_loop=ClosedLoop(
        largest_steps=LargestSteps(within_rate_deg=4.0, within_angle_deg=np.inf),
        course_changes={"change": CHANGE, "large": CHANGE},
        course_keeping=CourseKeeping(**dict.fromkeys(CourseKeeping.__dataclass_fields__, 1.0)),
    ),
    weather={"current_mps": 0.5, "current_towards_deg": 90.0, "wind_mps": 10.0, "wind_from_deg": 45.0}
    | {"wave_yaw_deg": 0.2, "wave_radps": 0.6, "seed": 1},
    track={},
    waypoints_m=np.zeros((0, 2)),
    histories=dict.fromkeys(("change", "large", "keeping"), MOTION),
    track_histories={},
    notices=(),
)


def test_the_charts_show_the_loop_and_the_course_change() -> None:
    charts = AutopilotResult(STUDY)._charts()
    assert list(charts) == [
        "course_change_by_20_deg",
        "a_change_that_takes_the_rudder_to_its_limit",
        "course_keeping_the_last_waves",
        "loop_transfer",
        "nyquist_curve",
        "sensitivity_and_closed_loop",
        "poles_of_the_closed_loop",
    ]
    magnitude, phase = panels(charts["loop_transfer"]).values()
    assert [row["v"] for row in magnitude] == pytest.approx(20 * np.log10(np.abs(LOOP)), rel=1e-4)
    assert [row["v"] for row in phase] == pytest.approx(np.degrees(np.angle(LOOP)), rel=1e-4)
    sensitivity = line(charts["sensitivity_and_closed_loop"], "v", "S, 7.7 m/s")
    wanted = -20 * np.log10(np.abs(1 + LOOP))
    assert sensitivity == pytest.approx(wanted[wanted > -60], rel=1e-4)
    heading = panels(charts["course_change_by_20_deg"])["heading (deg)"]
    assert [row["v"] for row in heading] == pytest.approx(MOTION["psi_deg"])


def test_the_margins_are_a_table_with_units() -> None:
    margins = AutopilotResult(STUDY).tables[2].df
    assert margins["phase margin (deg)"].to_list() == [60.0] and margins["stable"].to_list() == [True]
