"""Charts of bands over an ensemble: what is shaded, where branches part, and gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tank2sim.analysis.ensemble.steering import FROM_PORT, FROM_STARBOARD, MAGNITUDE, PHASE, STEP, Grid, SteeringBands
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.files import plain_json
from tank2sim.report.ensemble.charts import curve_charts, turns_chart
from tank2sim.simulation.bands import Band, BandOverTime

X = np.linspace(-0.6, 0.6, 13)


def bands(loop: bool) -> SteeringBands:
    grid = Grid(X, np.geomspace(0.01, 1, 13), np.linspace(0, 9, 13), -90.0)
    starboard = np.where(X < -0.25, X, X + 0.3) if loop else X
    port = np.where(X > 0.25, X + 0.3, X) if loop else X
    own = {FROM_STARBOARD: starboard, FROM_PORT: port, MAGNITUDE: -30 - X, PHASE: -90 - X, STEP: X + 0.6}
    curves = {name: BandOverTime(one - 0.1, one, one + 0.2) for name, one in own.items()}
    return SteeringBands(grid, 8, own, curves, Band(0.0, 1.0, 2.0, 8), 5 if loop else 0, ())


def rows(specification, layer: int):
    return specification["datasets"][specification["layer"][layer]["data"]["name"]]


def test_the_band_is_shaded_between_its_quantiles_around_the_ships_own_line() -> None:
    specification = chart_specification(turns_chart(plain_json(bands(loop=False).as_json())["steady_turning"]))
    line, area = rows(specification, 0), rows(specification, 1)
    assert {row["run"] for row in line} == {"stable turns"} and len(line) == len(area) == 13
    for row in area:
        assert np.isclose(row["low"], row["v"] - 0.1) and np.isclose(row["high"], row["v"] + 0.2)
        assert np.isclose(row["v"], np.radians(row["x"]), rtol=1e-5)


def test_the_branch_from_port_is_drawn_where_it_differs_alone() -> None:
    specification = chart_specification(turns_chart(plain_json(bands(loop=True).as_json())["steady_turning"]))
    port = np.radians([row["x"] for row in rows(specification, 0) if row["run"] == "from port turn"])
    # From -0.2 to 0.2 rad, and one more at either side, where they meet.
    assert np.isclose(port.min(), -0.3) and np.isclose(port.max(), 0.3) and len(port) == 7
    first, *_ = curve_charts(plain_json(bands(loop=True).as_json()))
    assert "5 of them have a hysteresis loop, 0 to 2 deg of rudder wide (none counted as 0)" in first.caption


def test_a_gap_of_the_band_is_not_bridged() -> None:
    whole = bands(loop=False)
    low, high = (one.copy() for one in (whole.curves[FROM_STARBOARD].low, whole.curves[FROM_STARBOARD].high))
    low[5:8] = high[5:8] = np.nan
    gap = BandOverTime(low, whole.curves[FROM_STARBOARD].median, high)
    reported = replace(whole, curves={**whole.curves, FROM_STARBOARD: gap, FROM_PORT: gap})
    specification = chart_specification(turns_chart(plain_json(reported.as_json())["steady_turning"]))
    area = rows(specification, 1)
    assert len(area) == 10 and len({row["band"] for row in area}) == 2 and len(rows(specification, 0)) == 13
