"""The result of a simulated manoeuvre: its charts and tables hold the numbers of the study."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tank2sim.analysis.ensemble.results import ManoeuvreBands
from tank2sim.analysis.manoeuvre import ManoeuvreStudy
from tank2sim.errors import InputError
from tank2sim.notices import Notice
from tank2sim.results.manoeuvre import ManoeuvreResult
from tank2sim.simulation.bands import Band, BandOverTime, TrackBand
from tests.answer.drawn import panels, rows_of

TIMES = np.arange(4.0)
NORTH, EAST = np.array([0.0, 7.0, 14.0, 21.0]), np.array([0.0, 0.1, 0.3, 0.6])
HISTORIES = {
    "t_s": TIMES,
    "delta_deg": np.array([0.0, 10.0, 10.0, 10.0]),
    "n_rpm": np.full(4, 60.0),
    "u_mps": np.array([7.0, 6.9, np.nan, 6.7]),
    "r_degps": np.array([0.0, 0.1, 0.2, 0.3]),
    "psi_deg": np.array([0.0, 0.05, 0.2, 0.45]),
    "x_m": NORTH,
    "y_m": EAST,
}
STUDY = ManoeuvreStudy(
    ship="A ship",
    length_m=100.0,
    beam_m=None,
    manoeuvre="turn:10",
    figures={
        "advance_m": 570.0,
        "advance_lengths": 5.7,
        "tactical_diameter_m": None,
        "tactical_diameter_lengths": None,
    },
    limits={"advance_lengths": 4.5},
    left_card_range_s=None,
    left_card_range_by="",
    outside_card_range=(),
    histories=HISTORIES,
    notices=(Notice("of the run"),),
)
SPEED = BandOverTime(7.0 - 0.1 * TIMES - 0.1, 7.0 - 0.1 * TIMES, 7.0 - 0.1 * TIMES + 0.1)
ENSEMBLE = ManoeuvreBands(
    members=5,
    seed=0,
    usable=5,
    unusable={},
    notices=(Notice("of the members"),),
    figures={"advance_m": Band(500.0, 570.0, 600.0, 30.0, 5)},
    t_s=TIMES,
    histories={"u_mps": SPEED, "x_m": SPEED, "y_m": SPEED},
    track=TrackBand(*(np.column_stack([NORTH, EAST + aside]) for aside in (0.0, -0.1, 0.1))),
    steps_s=(1.0, 1.0),
    single_precision=False,
)
BANDED = ManoeuvreResult(replace(STUDY, ensemble=ENSEMBLE))
TURN, OVER_TIME = "turning_circle_10_of_rudder_to_starboard", "time_histories"


def shown(rows: list[dict[str, Any]], run: str) -> list[dict[str, Any]]:
    return [row for row in rows if row.get("run") == run]


def test_a_manoeuvre_has_its_track_and_its_histories_in_their_units() -> None:
    result = ManoeuvreResult(STUDY)
    charts = result._charts()
    assert list(charts) == [TURN, OVER_TIME]
    track = [(row["x"], row["y"]) for row in shown(rows_of(charts[TURN]), "track")]
    assert track[:4] == list(zip(NORTH, EAST, strict=True))
    drawn = panels(charts[OVER_TIME])
    assert list(drawn) == [
        "rudder, + to starboard (deg)",
        "heading (deg)",
        "yaw rate (deg/s)",
        "surge velocity (m/s)",
    ]
    for title, name in (("heading (deg)", "psi_deg"), ("yaw rate (deg/s)", "r_degps")):
        assert [row["v"] for row in drawn[title]] == pytest.approx(HISTORIES[name])
    assert [row["v"] for row in drawn["surge velocity (m/s)"]] == [7.0, 6.9, None, 6.7]
    assert "revolutions 60 rpm" in result.sections[1].charts[0].caption


def test_an_ensemble_is_drawn_as_bands_next_to_the_run() -> None:
    charts = BANDED._charts()
    speeds = shown(rows_of(charts[OVER_TIME]), "band")
    assert [row["low"] for row in speeds] == pytest.approx(SPEED.p5) and len(speeds) == 4
    assert [row["high"] for row in speeds] == pytest.approx(SPEED.p95)
    edges = [row["y"] for row in shown(rows_of(charts[TURN]), "band")]
    assert edges == pytest.approx([*(EAST - 0.1), *(EAST + 0.1)[::-1]])


def test_a_spiral_is_drawn_against_its_rudder() -> None:
    figures: dict[str, Any] = {"rudder_deg": [10.0, 0.0, -10.0], "rate_degps": [0.5, 0.1, -0.4]}
    charts = ManoeuvreResult(replace(STUDY, manoeuvre="spiral", figures=figures))._charts()
    rows = dict.fromkeys((row["x"], row["v"]) for row in rows_of(charts["direct_spiral"]) if "i" in row)
    assert [value for row in rows for value in row] == pytest.approx([10.0, 0.5, 0.0, 0.1, -10.0, -0.4])


def test_the_figures_are_a_table_with_lengths_limits_and_what_is_not_shown() -> None:
    figures, bands = BANDED.tables
    assert figures.rows == [["advance", "m", 570.0, 5.7, 450.0]]
    assert "tactical diameter" in figures.notes[0]
    assert bands.rows == [["advance", "m", 500.0, 570.0, 600.0, 5]]
    assert BANDED.headline[0].endswith("IMO MSC.137(76): advance.")
    assert BANDED.notices == ("of the run", "of the members")


def test_figures_by_number_say_which_are_outside_the_card() -> None:
    figures: dict[str, Any] = {"overshoots_deg": [7.0, 8.0], "execute_times_s": [10.0]}
    study = replace(STUDY, manoeuvre="zigzag:10/10", figures=figures, outside_card_range=("overshoot_2_deg",))
    result = ManoeuvreResult(study)
    assert result.figures == {"overshoot_1_deg": 7.0, "overshoot_2_deg": 8.0, "execute_time_1_s": 10.0}
    assert result.tables[0].rows == [[1, 7.0, 10.0, None], [2, 8.0, None, "outside"]]


def test_a_result_read_from_its_json_has_no_motion_to_write() -> None:
    again = ManoeuvreResult.read(BANDED.to_dict(), "m.json")
    assert again.df["x_m"].to_list() == NORTH.tolist()
    with pytest.raises(InputError, match="has not the whole motion"):
        again.to_csv()


def test_a_figure_that_the_run_does_not_show_is_named_once():
    (table,) = [one for section in ManoeuvreResult(STUDY).sections for one in section.tables]
    assert [note for note in table.notes if "too short" in note] == ["The run is too short to show: tactical diameter."]
