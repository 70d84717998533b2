"""The generator of hidden truths: held against an independent program, against symmetry and against its own claims."""

from __future__ import annotations

import csv
import dataclasses
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from gap_truth import EFFECTS, FIT, HOLDOUT, HULLS, OUTSIDERS, SENSORS, SHIP_TOML, Setting, make, write
from gap_truth.disturbances import WANDER, WHITE, sensor_noise
from gap_truth.integrate import SPARE_S, integrate
from gap_truth.lane import Lane, lanes_of, parameters_of
from gap_truth.manoeuvres import MANOEUVRES, Manoeuvre
from gap_truth.record import recorded
from gap_truth.ship import Hull

QUIET = Setting((), seed=1, noise=0.0)
DISTURBED = tuple(
    dataclasses.replace(QUIET, **change)
    for change in ({"process": "gusts"}, {"process": "waves"}, {"coefficients": "independent"})
)
Trial = dict[str, np.ndarray]


def cut(setting: Setting, duration_s: float, *trials: str) -> list[Lane]:
    """The first part of some trials of a set."""
    lanes = lanes_of(dataclasses.replace(setting, manoeuvres=trials))
    return [dataclasses.replace(a, manoeuvre=dataclasses.replace(a.manoeuvre, duration_s=duration_s)) for a in lanes]


def run(groups: dict[str, list[Lane]]) -> dict[str, list[Trial]]:
    """Recorded trials of every group of lanes, all integrated in one batch."""
    lanes = [lane for group in groups.values() for lane in group]
    history = integrate(lanes)
    trials = iter(recorded(lane, history, column) for column, lane in enumerate(lanes))
    return {name: [next(trials) for _ in group] for name, group in groups.items()}


def misfits(first: list[Trial], second: list[Trial]) -> np.ndarray:
    """Root-mean-square difference of every signal of every trial, in white noise."""
    pairs = [(a[s], b[s], sigma) for a, b in zip(first, second, strict=True) for s, sigma in WHITE.items()]
    return np.array([np.sqrt(np.mean((a[: len(b)] - b[: len(a)]) ** 2)) / sigma for a, b, sigma in pairs])


def misfit(first: list[Trial], second: list[Trial]) -> float:
    """The largest of them."""
    return float(np.max(misfits(first, second)))


def columns(path: Path) -> Trial:
    with path.open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, float).T, strict=True))


def case(data: Path, number: int, *trials: str) -> list[Trial]:
    folder = data / "data" / "gap_cases" / f"case_{number}"
    return [columns(folder / f"{trial}.csv") for trial in trials]


@pytest.fixture(scope="module")
def short() -> dict[str, list[Trial]]:
    """Two minutes of a zigzag and a turn, noiseless, with every effect at full and some at quarter strength."""
    trials = ("zigzag20_20", "turn35_stbd")
    settings = {"none": QUIET} | {name: dataclasses.replace(QUIET, effects=(name,)) for name in EFFECTS}
    settings |= {f"{name}/4": dataclasses.replace(settings[name], strength=0.25) for name in EFFECTS}
    settings |= {f"{s.process} {s.coefficients}": s for s in DISTURBED}
    return run({name: cut(setting, 120.0, *trials) for name, setting in settings.items()})


@pytest.fixture(scope="module")
def long() -> dict[str, list[Trial]]:
    """Four minutes of what needs them: outsiders, a turn from the first second, a symmetric hull, worked cases."""
    groups = {name: cut(dataclasses.replace(QUIET, effects=(name,)), 260.0, "turn35_stbd") for name in OUTSIDERS}
    for key, strength in (("wind", 1.0), ("wind/4", 0.25)):
        seeds = [Setting(("wind",), seed, noise=0.0, strength=strength) for seed in range(5)]
        groups[key] = [cut(setting, 260.0, "turn35_stbd")[0] for setting in seeds]
    (plain,) = groups["none"] = cut(QUIET, 260.0, "turn35_stbd")
    turn = Manoeuvre(0.0, 260.0, orders=((0.0, 35.0),))
    groups["from 0"] = [dataclasses.replace(plain, manoeuvre=turn)]
    even = {name: 0.0 if "0" in name else value for name, value in plain.coefficients.items()}
    effects = {"cross_flow_drag": {"drag_coefficient": 0.5}, "rudder_stall": {"angle_deg": 22.0, "loss": 0.4}}
    port = dataclasses.replace(turn, orders=((0.0, -35.0),))
    groups["sides"] = [
        dataclasses.replace(plain, coefficients=even, effects=effects, manoeuvre=manoeuvre)
        for manoeuvre in (turn, port)
    ]
    groups["case"] = cut(QUIET, 260.0, "turn20_port", "zigzag20_20", "slowdown")
    for number, known in {
        1: {"current": {"speed_mps": 0.52881, "direction_deg": 252.957}},
        2: {"rudder_rate_limit": {"max_rate_degps": 1.57651}},
        3: {"cross_flow_drag": {"drag_coefficient": 0.39081}},
        4: {"wind": {"speed_mps": 10.86993, "direction_deg": 55.010}},
        8: {"current": {"speed_mps": 0.46989, "direction_deg": 87.205}, "rudder_bias": {"angle_deg": 1.94475}},
    }.items():
        groups[f"case {number}"] = [dataclasses.replace(lane, effects=known) for lane in groups["case"]]
    return run(groups)


@pytest.mark.slow
def test_turn_agrees_with_an_independent_program(data: Path, long: dict[str, list[Trial]]) -> None:
    reference = columns(data / "reference" / "mariner_turn_35.csv")
    (run,) = long["from 0"]
    psi = np.radians(run["psi_deg"])
    for angle, axis in ((np.pi / 2.0, "x_m"), (np.pi / 2.0, "y_m"), (np.pi, "y_m")):  # advance, transfer, diameter
        expected = np.interp(angle, reference["psi_rad"], reference[axis])
        assert np.interp(angle, psi, run[axis]) == pytest.approx(expected, rel=1e-3)
    then = reference["t_s"] <= 260.0
    for name in ("u_mps", "v_mps"):
        at = np.interp(reference["t_s"][then], run["t_s"], run[name])
        assert at == pytest.approx(reference[name][then], abs=2e-3)


@pytest.mark.slow
def test_none_is_the_worked_case_without_an_effect(data: Path, long: dict[str, list[Trial]]) -> None:
    assert misfit(long["case"], case(data, 6, "turn20_port", "zigzag20_20", "slowdown")) < 1.6


@pytest.mark.long
@pytest.mark.parametrize(("number", "left"), [(1, 0.02), (2, 0.02), (3, 0.2), (4, 0.3), (8, 0.02)])
def test_effects_explain_the_worked_cases(data: Path, long: dict[str, list[Trial]], number: int, left: float) -> None:
    """Wind and cross flow have other forms than the case, and leave something."""
    measured = case(data, number, "turn20_port", "zigzag20_20", "slowdown")
    assert misfit(long[f"case {number}"], measured) < left * misfit(long["case"], measured)


@pytest.mark.slow
def test_symmetric_hull_turns_alike_to_both_sides(long: dict[str, list[Trial]]) -> None:
    stbd, port = long["sides"]
    for name in ("v_mps", "r_degps", "psi_deg", "y_m"):
        assert stbd[name] == pytest.approx(-port[name], abs=1e-9)
    assert stbd["x_m"] == pytest.approx(port["x_m"], abs=1e-9)
    assert stbd["psi_deg"][-1] > 90.0


@pytest.mark.slow
def test_a_model_turns_like_its_ship() -> None:
    """Froude's law: lengths with the scale, times with L/U, speeds as shares of the approach."""
    full, small = HULLS["tanker"], HULLS["model"]
    rate = 1.5
    (again,), (turned,) = run_each(rate_limited(full, rate / full.time), rate_limited(small, rate / small.time))
    late = again["t_s"] <= 0.95 * again["t_s"][-1]
    at = again["t_s"][late] * small.time / full.time
    for name, scale in (("x_m", 7.0 / 320.0), ("y_m", 7.0 / 320.0), ("u_mps", 1.179 / 7.97), ("psi_deg", 1.0)):
        found = np.interp(at, turned["t_s"], turned[name])
        assert found == pytest.approx(scale * again[name][late], abs=0.01 * scale * np.ptp(again[name]))


def run_each(*groups: list[Lane]) -> list[list[Trial]]:
    """Recorded trials of lanes of several ships."""
    return [run({"": group})[""] for group in groups]


def rate_limited(hull: Hull, rate: float) -> list[Lane]:
    """The first part of the turn of a ship whose gear is limited to this rate (deg/s)."""
    (lane,) = lanes_of(dataclasses.replace(QUIET, ship=hull.name, manoeuvres=("turn35_stbd",)))
    begun = dataclasses.replace(lane.manoeuvre, duration_s=0.4 * lane.manoeuvre.duration_s)
    return [dataclasses.replace(lane, manoeuvre=begun, effects={"rudder_rate_limit": {"max_rate_degps": rate}})]


def test_noise_has_the_stated_size() -> None:
    lane = lanes_of(dataclasses.replace(QUIET, noise=2.0))[0]
    for name, noise in sensor_noise(lane, 60_000).items():
        assert np.std(noise) == pytest.approx(2.0 * np.hypot(WHITE[name], WANDER[name][0]), rel=0.05)
        assert np.std(np.diff(noise)) / np.sqrt(2.0) == pytest.approx(2.0 * WHITE[name], rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("name", EFFECTS)
def test_effect_shows(short: dict[str, list[Trial]], name: str) -> None:
    none, changed = short["none"], short[name]
    if name == "rudder_time_offset":
        steps = [np.flatnonzero(trial[0]["delta_order_deg"])[0] for trial in (none, changed)]
        delay = 10.0 * parameters_of(Setting((name,), 1))[name]["delay_s"]
        assert steps[0] - steps[1] == pytest.approx(delay, abs=1.0)  # the record runs ahead of the gear
    else:
        assert misfit(none, changed) > 1.0


@pytest.mark.long
@pytest.mark.parametrize("name", OUTSIDERS)
def test_outsider_shows(long: dict[str, list[Trial]], name: str) -> None:
    assert misfit(long["none"], long[name]) > 1.0


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in EFFECTS if name not in ("rudder_time_offset", "wind")])
def test_quarter_strength_is_about_a_quarter_of_the_response(short: dict[str, list[Trial]], name: str) -> None:
    full, quarter = (np.linalg.norm(misfits(short["none"], short[key])) for key in (name, f"{name}/4"))
    assert 0.15 < quarter / full < 0.35


@pytest.mark.long
def test_quarter_of_wind_on_the_average_of_directions(long: dict[str, list[Trial]]) -> None:
    full, quarter = (np.linalg.norm(misfits(5 * long["none"], long[key])) for key in ("wind", "wind/4"))
    assert 0.15 < quarter / full < 0.35


@pytest.mark.long
@pytest.mark.parametrize("setting", DISTURBED)
def test_disturbances_move_the_ship_but_not_absurdly(short: dict[str, list[Trial]], setting: Setting) -> None:
    assert 1.0 < misfit(short["none"], short[f"{setting.process} {setting.coefficients}"]) < 100.0


@pytest.mark.long
def test_set_is_the_same_to_the_bit_in_any_batch() -> None:
    settings = [Setting((name,), 5, process="gusts") for name in EFFECTS if name not in SENSORS]
    settings += [Setting(("wind", "cross_flow_drag"), 5, coefficients="correlated")]
    groups = {str(i): cut(setting, 26.0, "zigzag20_20") for i, setting in enumerate(settings)}
    together = run(groups)
    for chosen in ("0", "1", str(len(settings) - 1)):
        alone = run({chosen: groups[chosen]})[chosen]
        for name, values in alone[0].items():
            assert np.array_equal(values, together[chosen][0][name])


def test_parameters_do_not_depend_on_noise_and_scale_with_strength() -> None:
    full = parameters_of(Setting(("current",), 7))["current"]
    half = parameters_of(Setting(("current",), 7, strength=0.5, noise=3.0, process="waves"))["current"]
    assert half == {"speed_mps": 0.5 * full["speed_mps"], "direction_deg": full["direction_deg"]}
    assert 0.3 <= full["speed_mps"] <= 0.6


def test_coefficient_errors_are_two_percent_and_grouped() -> None:
    nominal = lanes_of(QUIET)[0].coefficients
    errors = []
    for seed in range(5):
        independent = lanes_of(Setting((), seed, coefficients="independent"))[0].coefficients
        errors += [independent[name] / nominal[name] - 1.0 for name in nominal]
    assert np.std(errors) == pytest.approx(0.02, rel=0.15)
    correlated = lanes_of(Setting((), 3, coefficients="correlated"))[0].coefficients
    ratio = {name: correlated[name] / nominal[name] for name in nominal}
    assert ratio["Yv"] == pytest.approx(ratio["Yru"])
    assert ratio["Yd"] == pytest.approx(ratio["Nuud"])
    assert ratio["Yv"] != pytest.approx(ratio["Nv"], abs=1e-5)


@pytest.mark.slow
def test_written_files_read_like_the_worked_cases(tmp_path: Path) -> None:
    (made,) = make([Setting(("out_oscillation",), 2, manoeuvres=("straight",))])
    write(made, tmp_path)
    table = columns(tmp_path / "straight.csv")
    assert list(table) == "t_s,delta_order_deg,n_rpm,u_mps,v_mps,r_degps,psi_deg,x_m,y_m".split(",")
    assert table["x_m"] == pytest.approx(made.trials["straight"]["x_m"], abs=6e-4)
    assert table["t_s"] == pytest.approx(0.1 * np.arange(3001))
    truth = json.loads((tmp_path / "truth.json").read_text(encoding="utf-8"))
    assert truth["verdict"] == "outside the library"
    assert truth["effects"] == []
    assert set(truth["parameters"]["out_oscillation"]) == {"Y", "N", "period_s", "phase_rad"}


def test_card_and_trials_are_those_of_the_worked_cases(data: Path) -> None:
    folder = data / "data" / "gap_cases"
    assert tomllib.loads(SHIP_TOML) == tomllib.loads((folder / "case_1" / "ship.toml").read_text(encoding="utf-8"))
    truth = json.loads((folder / "case_1-truth.json").read_text(encoding="utf-8"))
    assert (list(FIT), list(HOLDOUT)) == (truth["fit"], truth["holdout"])
    assert set(MANOEUVRES) == set(FIT + HOLDOUT)


@pytest.mark.slow
def test_a_record_whose_clock_stood_still_lasts_as_long_as_its_manoeuvre() -> None:
    setting = Setting(("out_clock_freeze",), seed=207748247, ship="tanker", manoeuvres=("zigzag10_10",))
    (lane,) = lanes_of(setting)
    assert lane.value("out_clock_freeze", "freeze_s", 0.0) > SPARE_S
    (made,) = make([setting])
    trial = made.trials["zigzag10_10"]
    assert trial["t_s"][-1] == pytest.approx(lane.manoeuvre.duration_s, abs=0.1)
    assert np.isfinite(trial["u_mps"]).all()


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="gremlins"):
        Setting(("gremlins",), 1)
