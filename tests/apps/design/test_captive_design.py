"""Designed campaigns: never worse than the usual matrix, within the hours, and for the figures that were asked for."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.apps.design.command import design_campaign
from tank2sim.apps.design.figure_slopes import (
    both_sides,
    figure_slopes,
    hydrodynamic_derivatives,
    range_of_figures,
)
from tank2sim.apps.design.planning import _assumptions
from tank2sim.apps.design.tank_form import TankFile
from tank2sim.cards import read_card
from tank2sim.errors import InputError
from tank2sim.notices import foremost
from tank2sim.records.campaigns import read_campaign_form

FIGURES = "steady_radius_m@20,K_prime"


@cache
def plan(**options):
    return design_campaign("esso-osaka", **{"figures": FIGURES, "hours": 8.0, "members": 0, **options})


@pytest.mark.slow
def test_the_plan_keeps_the_hours_and_makes_every_figure_more_certain_than_the_usual_matrix():
    found = plan(hours=None)
    hours = found.design.usual_hours
    assert 0.95 * hours < found.design.hours_used <= hours
    assert found.runs["tank_min"].sum() / 60 == pytest.approx(found.design.hours_used, rel=1e-4)
    assert (found.figures["design"] < 0.95 * found.figures["usual"]).all()
    assert 0 < found.design.hours_needed < hours


@pytest.mark.slow
def test_the_usual_matrix_in_twice_the_hours_has_half_the_variance():
    short, long = plan(hours=40.0), plan(hours=80.0)
    ratio = (short.figures["usual"] / long.figures["usual"]) ** 2
    assert ratio.to_numpy() == pytest.approx(2.0, rel=0.03)
    assert (long.figures["design"] < short.figures["design"]).all()


@pytest.mark.slow
def test_runs_and_template_are_the_same_plan(tmp_path):
    found = plan()
    (tmp_path / "campaign.toml").write_text(found.template, encoding="utf-8")
    form = read_campaign_form(tmp_path / "campaign.toml")
    rows = found.runs.reset_index()
    assert [run.file for run in form.runs] == rows["file"].tolist()
    assert [run.type for run in form.runs] == rows["type"].tolist()
    assert np.degrees([run.drift_rad or 0 for run in form.runs]) == pytest.approx(
        rows["drift_deg"].to_numpy(), abs=1e-4
    )
    for sheet, row in zip(form.runs, rows.to_dict("records"), strict=True):
        if sheet.type == "pure_sway":
            assert sheet.amplitude_m == pytest.approx(row["sway_amplitude_m"])
        elif sheet.yaw_rate_amplitude_radps is not None:
            assert np.degrees(sheet.yaw_rate_amplitude_radps) == pytest.approx(row["yaw_rate_amplitude_degps"])
            # The path of the yaw: U r_a / omega^2.
            side = row["speed_mps"] * sheet.yaw_rate_amplitude_radps / sheet.frequency_radps**2
            assert side == pytest.approx(row["sway_amplitude_m"], rel=1e-4)
    assert form.model.mass_kg == pytest.approx(read_card("esso-osaka").rigid_body.mass * 500 * 3.0**3, rel=1e-4)
    assert len(found.plan.splitlines()) == len(rows) + 1


@pytest.mark.slow
def test_a_campaign_of_ones_own_is_compared_in_place_of_the_usual_matrix(tmp_path):
    gauges = {f"{force}_zero_{unit}": 0.02 for force, unit in (("X", "N"), ("Y", "N"), ("N", "Nm"))}
    gauges |= {key.replace("zero", "noise"): 0.1 for key in gauges}
    lines = ["[gauges]", *(f"{key} = {value}" for key, value in gauges.items())]
    (tmp_path / "tank.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    first = plan(tank=str(tmp_path / "tank.toml"))
    (tmp_path / "campaign.toml").write_text(first.template, encoding="utf-8")
    again = plan(tank=str(tmp_path / "tank.toml"), usual=str(tmp_path / "campaign.toml"))
    assert sum(map(len, again.design.usual)) == len(first.runs)
    # The records of a sheet are as long as the carriage allows, so that its runs take more time.
    ratio = again.figures["usual"] / first.figures["design"]
    assert ((ratio > 0.9) & (ratio < 1.3)).all()


@pytest.mark.slow
def test_a_plan_is_as_certain_as_a_matrix_that_turns_the_rudder_in_yaw(tmp_path):
    rows = [f"0,{rudder},0,{rate}" for rudder in (0, 20) for rate in (0.2, 0.4)]
    rows += [f"{drift},{rudder},0,0" for drift in (-10, 0, 10) for rudder in (-20, 0, 20)]
    rows += ["0,0,0.2,0", "6,0,0,0.3"]
    (tmp_path / "matrix.csv").write_text("\n".join(["beta_deg,delta_deg,v_prime,r_prime", *rows]) + "\n")
    found = plan(usual=str(tmp_path / "matrix.csv"), hours=None)
    assert any(run.oscillates and run.rudder_rad for group in found.design.usual for run in group)
    assert (found.figures["design"] <= found.figures["usual"]).all()


@pytest.mark.slow
def test_ranges_of_the_gauges_leave_out_what_is_too_strong(tmp_path):
    usual = plan()
    reach = usual.design.planned.largest_forces(max(usual.design.runs, key=lambda run: abs(run.drift_rad)))
    (tmp_path / "tank.toml").write_text(f"[gauges]\nY_range_N = {0.6 * reach['Y']!r}\n", encoding="utf-8")
    narrow = plan(tank=str(tmp_path / "tank.toml"), hours=2.0)
    assert narrow.design.too_strong > 0
    forces = [narrow.design.planned.largest_forces(run)["Y"] for run in narrow.design.runs]
    assert max(forces) <= 0.6 * reach["Y"]


@pytest.mark.slow
def test_errors_of_a_symmetric_zero_cancel_in_the_mean_of_both_sides():
    card = read_card("kvlcc2-captive")
    asked = [parse_figure("overshoot_1_deg@10/10")]
    mean, one = (figure_slopes(card, asked, ["N0"], draws=0, seed=0, one_side=one_side) for one_side in (False, True))
    # The ship is not quite symmetric.
    assert abs(mean.of(["N0"], mean.at_card)[0, 0]) < 0.25 * abs(one.of(["N0"], one.at_card)[0, 0])


def test_the_range_of_the_tests_is_that_of_the_manoeuvres():
    card = read_card("mariner")
    turn = t2s.load("mariner").turn(35).df
    rate = (turn["r_degps"].abs() * np.pi / 180 * 160.93 / np.hypot(turn["u_mps"], turn["v_mps"])).max()
    found = range_of_figures(card, [parse_figure("advance_m@35")])
    assert np.degrees(found.drift_rad) == pytest.approx(9.0) and np.degrees(found.rudder_rad) == pytest.approx(35.0)
    assert rate <= found.yaw_rate_prime < rate + 0.05
    assert range_of_figures(card, [parse_figure("criterion_C")]).yaw_rate_prime == pytest.approx(0.2)


def test_inertia_in_the_terms_of_a_card_is_taken_out():
    """The Mariner's printed Y_r contains -m': -499e-5 + 798e-5."""
    found = hydrodynamic_derivatives(read_card("mariner"))
    assert found["Yr"] == pytest.approx(299e-5) and found["Yv"] == pytest.approx(-1160e-5)
    assert found["Nr"] == pytest.approx(-166e-5 + 798e-5 * -0.023)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("advance@35", "advance_m"),
        ("overshoot1_deg@10/10", "overshoot_1_deg"),
        ("tactical_diameter@35", "tactical_diameter_m"),
        ("steady_radius@20", "steady_radius_m"),
    ],
)
def test_a_figure_has_its_one_name(text, name):
    with pytest.raises(InputError, match=f"did you mean {name}") as raised:
        design_campaign("mariner", figures=text, hours=2, members=0)
    assert (raised.value.source, raised.value.place) == ("figures", text)


def test_the_other_side_of_a_figure_has_the_opposite_rudder():
    here, there = both_sides(parse_figure("overshoot_1_deg@10/10"))
    assert there.angles == pytest.approx((-here.angles[0], here.angles[1]))
    assert len(both_sides(parse_figure("criterion_C"))) == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"hours": -1.0}, "hours"),
        pytest.param({"hours": 0.05}, "hours", marks=pytest.mark.slow),
        ({"figures": "advanc@35"}, "advance_m"),
        ({"figures": ""}, "no figure"),
        ({"carriage_length_m": 2.0}, "carriage_length_m"),
        ({"carriage_length_m": float("nan")}, "carriage_length_m"),
        ({"model_length_m": 1000.0}, "model_length_m"),
        ({"largest": (12.0, 95.0, 0.5)}, "largest"),
        ({"tank": "nowhere.toml"}, "nowhere.toml"),
    ],
)
def test_what_cannot_be_designed_is_refused(options, words):
    with pytest.raises(InputError) as caught:
        design_campaign("esso-osaka", **{"figures": FIGURES, "members": 0, **options})
    assert words in str(caught.value)


def test_an_unknown_key_of_the_tank_is_refused_with_its_place(tmp_path):
    (tmp_path / "tank.toml").write_text("[gauges]\nY_range = 3.0\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        design_campaign("esso-osaka", figures=FIGURES, members=0, tank=tmp_path / "tank.toml")
    assert caught.value.place == "gauges.Y_range"


@pytest.mark.slow
def test_drawn_ships_count_as_much_as_the_one_of_the_card():
    found = plan(members=3, hours=40.0)
    assert len(found.design.slopes.drawn) > 1
    assert (found.figures["variance_ratio"] < 1).all()


@pytest.mark.slow
def test_few_hours_are_compared_with_one_whole_usual_matrix_with_a_caution():
    few = plan(hours=1.0)
    once = plan(hours=None)  # the time of the usual matrix
    assert few.design.usual_hours == once.design.usual_hours
    assert few.figures["usual"].to_numpy() == pytest.approx(once.figures["usual"].to_numpy(), rel=1e-9)
    assert few.study.usual_matrix.repeats == 1.0
    assert few.design.curve.usual_time_s == pytest.approx((3600 * few.design.usual_hours,), rel=1e-12)
    assert any("hours" in text for text in foremost(few.notices))
    assert not any("too few" in text for text in once.notices)


@pytest.mark.slow
def test_a_hardly_certain_figure_is_marked_with_the_gauge_at_fault():
    wide = TankFile.model_validate({"gauges": {"N_range_Nm": 1e9}})
    found = plan(tank=wide)
    shares = found.design.gauge_shares
    assert sum(share[0] for share in shares.values()) == pytest.approx(1.0) and shares["N"][0] > 0.5
    checks = foremost(found.notices)
    assert any("steady_radius_m@20" in text and "gauge N" in text for text in checks)
    assert any("range of gauge N" in text for text in checks) and not any("gauge X" in text for text in checks)
    certain = plan(hours=None)
    assert certain.design.hours_used > 3 * found.design.hours_used
    assert not any("range of gauge" in text or "of its value" in text for text in certain.notices)


@pytest.mark.slow
def test_what_is_assumed_is_a_caution_item_by_item():
    def texts(gauges, **more):
        tank = TankFile.model_validate({"gauges": gauges, **more})
        design = plan().design
        changed = replace(design, tank_runs=replace(design.tank_runs, tank=tank))
        return " ".join(foremost(_assumptions(changed, 0)))

    only_zero = texts({"zero_share": 0.0})
    assert "noise of X, Y, N" in only_zero and "gain" in only_zero and "zero" not in only_zero
    only_gain = texts({"gain_relative": 0.0})
    assert "noise of X, Y, N" in only_gain and "zero of X, Y, N" in only_gain and "gain" not in only_gain
    assert "noise of X, N " in texts({"Y_noise_N": 1.0})
    rest = texts({}, carriage={"waiting_s": 300.0})
    assert "model of 3 m" in rest and "carriage way 240 m" in rest and "acceleration" in rest and "waiting" not in rest


@pytest.mark.slow
def test_derivatives_without_a_stated_error_are_a_caution_where_ships_are_drawn():
    card = plan().design.card
    bare = replace(card, uncertainty={})
    count = sum(1 for value in card.derivatives.values() if value)
    assert f"none of {count} derivatives, and 30 %" in " ".join(
        foremost(_assumptions(replace(plan().design, card=bare), 2))
    )
    assert not any("of the card" in text for text in _assumptions(replace(plan().design, card=bare), 0))


@pytest.mark.slow
def test_a_range_that_the_mechanism_cuts_is_noted():
    tank = TankFile.model_validate({"mechanism": {"drift_rad": np.radians(5.0), "rudder_rad": np.radians(10.0)}})
    found = plan(tank=tank, largest=(30.0, 35.0, 0.6), hours=2.0)
    notes = " ".join(found.notices)
    assert "drift goes to 5 deg, not 30" in notes and "rudder goes to 10 deg, not 35" in notes
