"""``gap.json`` holds what was found in the units and names of the files, and is valid JSON whatever was found."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.answer.study import study_values
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.outcome.export import (
    effect_parameter_name,
    estimate_in_file,
    gap_study,
    in_file_units,
    signal_display_name,
)
from tank2sim.gap.result import Acting, Gap, Named, Refitted
from tank2sim.identification.trials.problem.prepare_trials import RecordDoubt
from tank2sim.results.gap_text import found_in_words, place_of_cause
from tank2sim.units import to_si
from tests.gap import made_up


def written(gap, **options):
    return json.loads(json.dumps(study_values(gap_study(gap, **options)), allow_nan=False))


@pytest.mark.parametrize("verdict", made_up.EVERY)
def test_every_verdict_is_valid_json_with_the_keys_of_the_format(verdict) -> None:
    result = written(made_up.EVERY[verdict]())
    assert result["verdict"] == verdict
    assert {"effects", "alternatives", "where", "misfit", "could_hide", "next_test"} <= set(result)
    assert {"noise", "noise_floor", "before", "after"} <= set(result["misfit"])


def test_an_effect_is_in_the_units_of_a_card() -> None:
    (effect,) = written(made_up.missing())["effects"]
    assert effect["name"] == "current" and effect["confidence"] == 0.97
    assert effect["parameters"] == pytest.approx({"speed_mps": 0.45, "direction_deg": 270.0})
    assert effect["standard_errors"] == pytest.approx({"speed_mps": 0.02, "direction_deg": 1.5})


def test_places_bear_names_of_files_and_columns() -> None:
    first, second = written(made_up.missing(), files={"zigzag": "zigzag.dat"})["where"]
    assert first == {"trial": "turn35.csv", "signal": "x_m", "t_start_s": 20, "t_end_s": 80, "share_of_misfit": 0.6}
    assert (second["trial"], second["signal"]) == ("zigzag.dat", "psi_deg")


@pytest.mark.parametrize(
    ("variable", "column"),
    [("motion.x", "x_m"), ("motion.u", "u_mps"), ("motion.r", "r_degps"), ("motion.u_ground", "u_ground_mps")],
)
def test_a_variable_is_told_by_the_column_that_measures_it(variable, column) -> None:
    assert signal_display_name(variable).file == column


def test_misfit_is_in_noise_units_and_noise_in_the_units_of_its_column() -> None:
    misfit = written(made_up.missing())["misfit"]
    assert misfit["noise_floor"] == 1
    assert misfit["before"] == pytest.approx({"fit": np.sqrt((64 + 36) / 2), "holdout": 9.0})
    assert misfit["after"] == pytest.approx({"fit": 1.0, "holdout": 1.5})
    assert misfit["black_box"] == pytest.approx({"fit": 3.0, "holdout": 3.0})
    assert misfit["noise"]["psi_deg"] == {"sigma": pytest.approx(0.2), "from": "estimated"}
    assert misfit["noise"]["r_degps"]["sigma"] == pytest.approx(0.05)
    assert misfit["noise"]["y_m"] == {"sigma": 0.5, "from": "stated"}


def test_what_could_hide_is_in_the_units_of_a_card() -> None:
    hidden = written(made_up.missing())["could_hide"]
    assert hidden == {
        "rudder_bias": {"angle_deg": pytest.approx(0.25)},
        "linear_yaw_damping": {"factor": pytest.approx(0.05)},
    }


def test_explanations_are_joined_and_the_next_test_names_its_file() -> None:
    result = written(made_up.ambiguous())
    assert result["alternatives"] == ["current", "wind + rudder_bias"]
    assert result["next_test"]["orders"] == "next_test.csv" and result["next_test"]["manoeuvre"] == "turn:35"
    assert [rival["effects"] for rival in result["rivals"]] == [["current"], ["heading_offset"], []]


def test_a_simulation_that_left_all_bounds_has_no_misfit() -> None:
    result = written(made_up.outside())
    assert result["misfit"]["before"] == {"fit": None, "holdout": None}
    lost, turn = result["trials"]
    assert lost["misfit"]["before"] is None and turn["misfit"]["before"] == pytest.approx(6.0)
    assert result["effects"] == [] and result["next_test"] is None


def test_a_signal_that_a_trial_lacks_is_left_out_of_its_misfits() -> None:
    found = made_up.missing()
    turn, *remaining = found.passed
    blind = replace(turn, measured={**turn.measured, "motion.x": np.full(len(turn.time_s), np.nan)})
    first, second, _ = written(replace(found, passed=(blind, *remaining)))["trials"]
    assert "x_m" not in first["signals"] and "x_m" in second["signals"]
    assert first["signals"]["y_m"]["before"] == pytest.approx(8.0)


def test_each_trial_says_what_it_alone_would_have() -> None:
    agreement = written(made_up.missing())["agreement"]
    assert agreement["current.speed_mps"]["turn35.csv"] == {"value": 0.44, "standard_error": 0.03}
    directions = agreement["current.direction_deg"]
    assert directions["turn35.csv"]["value"] == pytest.approx(268)
    assert directions["zigzag.csv"]["value"] == pytest.approx(271)
    assert directions["zigzag.csv"]["standard_error"] == pytest.approx(np.rad2deg(0.03))


def test_figures_stand_before_and_after() -> None:
    advance, _, lost = written(made_up.missing())["figures"]
    assert advance["before"] == pytest.approx(550) and advance["after"] == pytest.approx(505)
    assert lost["after"] is None
    same = written(made_up.nothing())["figures"]
    assert [figure["before"] == figure["after"] for figure in same] == [True] * 3


def test_every_parameter_of_the_library_is_read_back_as_it_was() -> None:
    for effect in EFFECTS.values():
        if not effect.sought:  # of two effects with one input it is the one that is sought
            continue
        for parameter, variable in effect.model_names().items():
            key, value = in_file_units(parameter, 0.3)
            assert "rad" not in key.rpartition("_")[2]
            assert to_si(key, value) == (parameter, pytest.approx(0.3))
            assert effect_parameter_name(variable) == (effect.name, parameter)


def test_directions_alone_go_round_once() -> None:
    assert estimate_in_file("direction_rad", -0.1)[1] == pytest.approx(360 - np.rad2deg(0.1))
    assert estimate_in_file("angle_rad", -0.1)[1] == pytest.approx(-np.rad2deg(0.1))


def test_times_are_those_of_the_samples() -> None:
    """Adding up steps of half a second, or taking them off a later start, leaves the last digits wrong."""
    gap = made_up.missing()
    where = (replace(gap.where[0], t_start_s=11.499999999999755, t_end_s=539.4999999999981),)
    (place,) = written(replace(gap, where=where))["where"]
    assert (place["t_start_s"], place["t_end_s"]) == (11.5, 539.5)


def test_candidates_do_not_hide_and_tell_their_sizes() -> None:
    gap = made_up.ambiguous()
    assert gap.next_test is not None
    sizes = {"wind": ({"direction_rad": -np.pi / 2}, {"direction_rad": 0.1})}
    result = written(replace(gap, next_test=replace(gap.next_test, sizes=sizes)))
    assert set(result["could_hide"]) == {"linear_yaw_damping"} == set(result["could_hide_in_words"])
    (wind,) = result["next_test"]["candidates"].values()
    assert wind["parameters"] == {"direction_deg": pytest.approx(270.0)}


def test_what_could_hide_is_worded_by_what_a_size_means() -> None:
    sizes = {"rudder_bias": {"angle_rad": np.deg2rad(0.25)}, "rudder_rate_limit": {"max_rate_radps": np.deg2rad(4)}}
    words = written(replace(made_up.missing(), could_hide=sizes))["could_hide_in_words"]
    assert words["rudder_bias"] == "angle up to 0.25 deg would not show"
    assert words["rudder_rate_limit"] == "max rate of 4 deg/s in place of the card's would not show"


def test_no_force_is_told_of_where_none_is_missing() -> None:
    gap = made_up.missing()
    assert written(gap)["missing_force"] is None
    assert written(replace(gap, effects=(), equation="sway"))["missing_force"]["equation"] == "Y"


def test_what_no_effect_explains_has_its_place_and_size_in_newton() -> None:
    passages = (Acting("turn35", "yaw", 10.0, 20.0, 5.0, 3e6), Acting("zigzag", "sway", 0.0, 9.0, 4.0, 2e4))
    gap = replace(made_up.outside(), missing_force=replace(made_up.force(), passages=passages))
    study = gap_study(gap)
    forces = tuple(interval for interval in study.acting if interval.equation in {"yaw", "sway"})
    moment, force = forces
    assert (moment.moment_Nm, moment.force_N, force.force_N) == (3e6, None, 2e4)
    forced = replace(study, acting=forces)
    said = place_of_cause(forced)
    assert "from 10 s to 20 s of turn35" in said and "3000 kN m" in said
    assert said in found_in_words(forced)


def test_a_record_that_the_audit_doubts_comes_before_what_no_effect_explains() -> None:
    """Only where the misfit is in that record: a heading 5 deg off in another trial explains nothing."""
    passages = (Acting("turn35", "sway", 0.0, 9.0, 4.0, 2e4),)
    gap = replace(made_up.outside(), missing_force=replace(made_up.force(), passages=passages))
    doubts = {name: RecordDoubt(name, "psi_deg", "psi reads +5 deg too much") for name in ("turn35", "zigzag")}
    acting = gap_study(gap).acting[0].trial.removesuffix(".csv")
    other = next(name for name in doubts if name != acting)
    plain = found_in_words(gap_study(gap))
    assert found_in_words(gap_study(replace(gap, doubts=(doubts[other],)))) == plain
    said = found_in_words(gap_study(replace(gap, doubts=(doubts[acting],))))
    assert said != plain and acting in said and "psi reads +5 deg too much" in said


def cautions_of(gap: Gap) -> list[str]:
    return [notice["text"] for notice in written(gap)["notices"] if notice["level"] == "caution"]


def test_objections_to_the_verdict_are_cautions() -> None:
    gap = made_up.missing()
    poor = replace(gap, passed=(made_up.passed("turn35", 9.0, 5.0),))
    first, second, *_ = cautions_of(poor)
    assert "55 % of the gap of the fitting trials remains" in first and "black box" in second


@pytest.mark.parametrize(
    ("factor", "moved", "cautions"), [(0.3, 3.0, 0), (3.0, 3.0, 1), (0.3, 18.0, 1), (3.0, 18.0, 2)]
)
def test_sizes_at_a_bound_and_coefficients_far_beyond_their_errors_are_cautioned_against(
    factor: float, moved: float, cautions: int
) -> None:
    """A card in other units is explained by names that are sure and impossible."""
    (parameter,) = EFFECTS["rudder_effectiveness"].parameters
    assert parameter.maximum == 3.0
    effect = Named("rudder_effectiveness", {"factor": factor}, {"factor": 0.1}, 0.99)
    coefficient = Refitted("Nv", -0.01 - moved * 1e-4, 1e-4, -0.01, 1e-4)
    gap = replace(made_up.missing(), effects=(effect,), coefficients=(coefficient,))
    assert len(cautions_of(gap)) == cautions


@pytest.mark.parametrize(("current", "cautions"), [(0.01, 0), (5.0, 1)])
def test_no_missing_effect_says_little_where_most_would_not_show(current: float, cautions: int) -> None:
    """A current of 5 m/s is far above any; one of 1 cm/s is not."""
    hidden = {"current": {"speed_mps": current}, "gyro_bias": {"rate_radps": 1e-9}}
    assert len(cautions_of(replace(made_up.nothing(), could_hide=hidden))) == cautions
    assert not cautions_of(replace(made_up.missing(), could_hide=hidden))


def test_replays_are_thinned_in_the_units_of_their_columns_with_every_extreme() -> None:
    trial = made_up.passed("long", 8.0, 1.0)
    count, place = 5000, 1234
    time = np.linspace(0.0, 499.9, count)
    psi = np.full(count, np.nan)
    psi[::100] = 0.01 * time[::100]  # measured seldom
    u = np.sin(time / 20)
    u[place] = 9.0
    measured = {"motion.psi": psi, "motion.u": u}
    models = [{"motion.psi": 0.01 * time, "motion.u": np.sin(time / 20) + size} for size in (0.16, 0.02)]
    noise = {name: made_up.NOISE[name] for name in measured}
    long = replace(trial, time_s=time, noise=noise, measured=measured, before=models[0], after=models[1], black_box={})
    (replay,) = written(replace(made_up.missing(), passed=(long,)), files={"long": "long.dat"})["replays"]
    assert replay["trial"] == "long.dat" and replay["held_out"] is False
    assert all(set(replay[key]) == {"t_s", "psi_deg", "u_mps"} for key in ("measured", "before", "found"))
    times = replay["measured"]["t_s"]
    assert times == replay["before"]["t_s"] == replay["found"]["t_s"] and len(times) < 250
    assert times[0] == 0 and times[-1] == pytest.approx(499.9) and max(replay["measured"]["u_mps"]) == 9.0
    headings = [value for value in replay["measured"]["psi_deg"] if value is not None]
    assert len(headings) == 50 and headings[-1] == pytest.approx(np.rad2deg(psi[4900]), rel=1e-6)
    assert replay["before"]["u_mps"][0] == pytest.approx(0.16) and replay["found"]["u_mps"][0] == pytest.approx(0.02)


def test_the_ship_has_its_name() -> None:
    gap = made_up.missing()
    assert written(gap)["ship"] == gap.card.ship.name
