"""Sections and charts of ensembles: shaded bands, branches that part, gaps, and small probabilities."""

from __future__ import annotations

import math

import numpy as np

from tank2sim.analysis.ensemble.results import Chance, ChanceOfAll, StabilityBands
from tank2sim.analysis.ensemble.steering import BodeBands, CurveBand, SteeringBands, StepBands, TurningBands
from tank2sim.analysis.ensemble.tails import Tail
from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.answer.parts import Section
from tank2sim.results.ensembles import chance_sentences, curve_charts, stability_section, turns_chart
from tank2sim.simulation.bands import Band
from tests.answer.drawn import rows_of_layer

X = np.linspace(-0.6, 0.6, 13)
KNOWN = Tail(4.2, 1.3e-5, 4.5, 4.7, 253.0, "", 2.0e-4, 1.2e-5, 2000, 900, 7, 3, 11, 0.0, {"derivatives.Nd": -2.8})
FAR = Tail(16.8, 0.0, 1.9, None, 0.0, "too far out")


def band(own: np.ndarray) -> CurveBand:
    return CurveBand(own - 0.1, own.copy(), own + 0.2, own)


def bands(loop: bool) -> SteeringBands:
    turning = TurningBands(
        rudder_deg=np.degrees(X),
        yaw_rate_from_starboard_degps=band(np.where(X < -0.25, X, X + 0.3) if loop else X),
        yaw_rate_from_port_degps=band(np.where(X > 0.25, X + 0.3, X) if loop else X),
        loop_width_deg=Band(0.0, 1.0, 2.0, math.nan, 8),
        with_loop=5 if loop else 0,
    )
    bode = BodeBands(omega_radps=np.geomspace(0.01, 1, 13), magnitude_dB=band(-30 - X), phase_deg=band(-90 - X))
    step = StepBands(time_s=np.linspace(0, 9, 13), step_per_s=band(X + 0.6))
    return SteeringBands(members=8, steady_turning=turning, bode=bode, step=step)


def test_the_band_is_shaded_between_its_quantiles_around_the_ships_own_line() -> None:
    chart = turns_chart(bands(loop=False).steady_turning)
    line, area = rows_of_layer(chart, 0), rows_of_layer(chart, 1)
    assert {row["run"] for row in line} == {"stable turns"} and len(line) == len(area) == 13
    for row in area:
        assert np.isclose(row["low"], row["v"] - 0.1) and np.isclose(row["high"], row["v"] + 0.2)
        assert np.isclose(row["v"], np.radians(row["x"]), rtol=1e-5)


def test_the_branch_from_port_is_drawn_where_it_differs_alone() -> None:
    chart = turns_chart(bands(loop=True).steady_turning)
    port = np.radians(
        [row["x"] for row in rows_of_layer(chart, 0) if row["run"] == "from port turn" and row["v"] is not None]
    )
    # From -0.2 to 0.2 rad, and one more at either side, where they meet.
    assert np.isclose(port.min(), -0.3) and np.isclose(port.max(), 0.3) and len(port) == 7
    first, *_ = curve_charts(bands(loop=True))
    assert "5 of them have a hysteresis loop, 0 to 2 deg of rudder wide (none counted as 0)" in first.caption


def test_a_gap_of_the_band_is_not_bridged() -> None:
    turning = bands(loop=False).steady_turning
    for each in (turning.yaw_rate_from_starboard_degps, turning.yaw_rate_from_port_degps):
        each.p5[5:8] = each.p95[5:8] = np.nan
    chart = turns_chart(turning)
    area = rows_of_layer(chart, 1)
    assert sum(row["low"] is not None for row in area) == 10 and len(rows_of_layer(chart, 0)) == 13


def ensemble(together: Tail | None, tails: dict[str, Tail | None]) -> StabilityBands:
    chances = [
        Chance(
            name=name,
            allowed=4.5,
            unit="L",
            probability_met=1.0,
            interval_95=(0.9, 1.0),
            not_shown=0,
            beyond_card=5,
            tail=tail,
        )
        for name, tail in tails.items()
    ]
    return StabilityBands(
        members=100,
        seed=0,
        usable=100,
        unusable={},
        notices=(),
        figures={},
        probability_stable=None,
        probability_stable_interval_95=None,
        imo=tuple(chances),
        imo_all=ChanceOfAll(criteria=tuple(tails), probability_met=0.75, interval_95=(0.7, 0.8), tail=together),
        curves=None,
    )


def section(found: StabilityBands) -> Section:
    return stability_section(found, [ImoCriterion.judged(one.name, 1.0, 4.5, "L") for one in found.imo])


def test_each_small_probability_has_a_row_with_its_basis() -> None:
    found = ensemble(KNOWN, {"near": KNOWN, "far": FAR, "seen": None})
    chances, _, tails, linear, _ = section(found).tables
    assert [row[-1] for row in chances.rows] == [5, 5, 5]
    assert [row[0] for row in tails.rows] == ["near", "far", "any of these"]
    assert tails.rows[0][1:] == [2.0e-4, 1.2e-5, 253] and tails.rows[1][1:] == [None, None, 0]
    assert linear.rows[0][1:] == [4.2, 1.3e-5, 4.5, 4.7] and linear.rows[1][1:] == [16.8, 0.0, 1.9, None]
    near, far = tails.notes[0], tails.notes[-1]
    assert all(part in near for part in ("near", "900", "7 of them do not", "11 left", "3 members cannot", "Nd -2.8"))
    assert far == "far: too far out"
    (together,) = chance_sentences(found)
    assert "0.75" in together and "2.00e-04" in together


def test_without_small_probabilities_there_is_no_table_of_them() -> None:
    assert len(section(ensemble(None, {"seen": None})).tables) == 3


def test_a_criterion_judged_beyond_the_card_has_no_probability() -> None:
    found = ensemble(None, {"seen": None})
    beyond = ImoCriterion.judged("seen", 1.0, 4.5, "L", beyond_card=True)
    row = stability_section(found, [beyond]).tables[0].df.iloc[0]
    assert row["P(met)"] == "beyond the card" and row["at least"] is None
