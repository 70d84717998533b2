"""What the API is given is checked where it is called: an InputError that names the argument, before any work."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, get_args, get_origin

import click
import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim import memory
from tank2sim.api.commands import VERBS, variants_of
from tank2sim.arguments import (
    AngleArgument,
    ArgumentBounds,
    FalseDiscovery,
    annotated_kind,
    bounds_of,
    checked,
    chosen_names,
    numbers_in,
)
from tank2sim.cli import COMMANDS
from tank2sim.cli import tank2sim as group
from tank2sim.gap.search.decision import LIKELY, SUREST
from tank2sim.quantities import Speed
from tank2sim.units import in_words
from tests.cli.command_line import refused, tank2sim
from tests.conftest import ROOT

SHIP = t2s.load("mariner")
TOWS = ROOT / "models" / "wilinski-zellman" / "tows.csv"
GUESSED = {"length_m": 320, "beam_m": 58, "draught_m": 20.8, "block": 0.81, "speed_kn": 15.5}
TWICE = pd.DataFrame([[0, 1, 2], [1, 1, 2]], columns=["t_s", "delta_order_deg", "delta_order_deg"])
TIMES = {"t_s": [0.0, 1.0]}

NO_NUMBERS = ["35", None, np.array([35.0]), [35.0], math.nan, math.inf, True, 10**400, 3j, pd.Series([35.0]), b"35"]


@pytest.mark.parametrize("value", NO_NUMBERS, ids=lambda value: type(value).__name__)
def test_what_is_no_number_is_refused(value: object) -> None:
    for call, name in (
        (lambda: SHIP.turn(value), "rudder_deg"),
        (lambda: SHIP.zigzag(20, value), "heading_deg"),
        (lambda: SHIP.pullout(value), "rudder_deg"),
        (lambda: SHIP.spiral(value), "rudder_deg"),
        (lambda: SHIP.turn(35, seed=value), "seed"),
        (lambda: SHIP.turn(35, members=value), "members"),
        (lambda: SHIP.autopilot(course_change_deg=value), "course_change_deg"),
        (lambda: t2s.convert(SHIP, origin_m=value), "origin_m"),
        (lambda: t2s.guess(**{**GUESSED, "block": value}), "block"),
    ):
        if name in ("seed", "members") and isinstance(value, int) and not isinstance(value, bool) and name == "seed":
            continue  # a seed has any size
        with pytest.raises(t2s.InputError) as caught:
            call()
        assert caught.value.source == name and caught.value.remedy.startswith("give a")


@pytest.mark.parametrize(
    "call, name",
    [
        (lambda: SHIP.turn(35, members=10**9), "members"),
        (lambda: SHIP.turn(35, members=10_000_001), "members"),
        (lambda: SHIP.turn(35, members=-3), "members"),
        (lambda: SHIP.turn(35, members=2.5), "members"),
        (lambda: SHIP.turn(35, seed=-1), "seed"),
        (lambda: SHIP.turn(35, duration_s=-5.0), "duration_s"),
        (lambda: SHIP.stability(speed_mps=-7), "speed_mps"),
        (lambda: SHIP.stability(speed_mps=0), "speed_mps"),
        (lambda: SHIP.state_space(-7), "speed_mps"),
        (lambda: SHIP.autopilot(speed_mps=-7), "speed_mps"),
        (lambda: SHIP.autopilot(wind_mps=-1), "wind_mps"),
        (lambda: SHIP.autopilot(heading_weight_deg=0), "heading_weight_deg"),
        (lambda: SHIP.tune("steady_radius_m@20=424", within=-1), "within"),
        (lambda: SHIP.influence(5), "figures"),
        (lambda: SHIP.influence("criterion_C", joint_variation={"Yv": "1"}), "joint_variation: Yv"),
        (lambda: SHIP.influence("criterion_C", joint_variation={"Yv": math.nan}), "joint_variation: Yv"),
        (lambda: SHIP.simulate(None), "manoeuvre"),
        (lambda: SHIP.simulate(b"turn:35"), "manoeuvre"),
        (lambda: SHIP.steer(TWICE), "orders"),
        (lambda: SHIP.steer({**TIMES, "delta_order_deg": [1, 2], "delta_order_rad": [0.1, 0.2]}), "orders"),
        (lambda: SHIP.steer({**TIMES, "delta_order_deg": ["a", 2]}), "orders"),
        (lambda: SHIP.steer({**TIMES, "delta_order_deg": [1]}), "orders"),
        (lambda: SHIP.steer({"t_s": 0, "delta_order_deg": 1}), "orders"),
        (lambda: SHIP.steer(np.ones((3, 2))), "orders"),
        (lambda: SHIP.steer(None), "orders"),
        (lambda: SHIP.poster(order={"Half ahead": "a"}), "order: Half ahead"),
        (lambda: SHIP.save(None), "path"),
        (lambda: SHIP.to_fmu("x.fmu", fmi="2"), "fmi"),
        (lambda: SHIP.replace({"model.speed_mps": None}), SHIP.card.source),
        (lambda: SHIP.replace({"model.speed_mps": np.array([7.0])}), SHIP.card.source),
        (lambda: t2s.load(None), "card"),
        (lambda: t2s.Ship("mariner"), "card"),
        (lambda: t2s.Ship(5), "card"),
        (lambda: t2s.load(5), "card"),
        (lambda: t2s.load("mariner", 5), "values"),
        (lambda: t2s.guess(**GUESSED, turn35={"advance": 970}), "turn35"),
        (lambda: t2s.guess(**GUESSED, turn35=970), "turn35"),
        (lambda: t2s.guess(**GUESSED, members=99), "members"),
        (lambda: t2s.guess(**GUESSED, members=10**7), "members"),
        (lambda: t2s.guess(**{**GUESSED, "length_m": -1}), "length_m"),
        (lambda: t2s.identify(SHIP, 5), "trials"),
        (lambda: t2s.identify(SHIP, "x.csv", members=-1), "members"),
        (lambda: t2s.identify(SHIP, "x.csv", piece_s=0.0), "piece_s"),
        (lambda: t2s.identify(SHIP, "x.csv", posterior="gibbs"), "posterior"),
        (lambda: t2s.identify(SHIP, "x.csv", structure="kraken"), "structure"),
        (lambda: t2s.find_gap(SHIP, "x.csv", max_effects=9), "max_effects"),
        (lambda: t2s.find_gap(SHIP, "x.csv", workers=0), "workers"),
        (lambda: t2s.validate(SHIP, required_percent=-1), "required_percent"),
        (lambda: t2s.compare(5), "cards"),
        (lambda: t2s.compare(["mariner", "kvlcc2"], members=1e99), "members"),
        (lambda: t2s.convert("kvlcc2-mmg", scatter=-1), "scatter"),
        (lambda: t2s.design_campaign(SHIP, members=-1), "members"),
        (lambda: t2s.signals("x.csv", max_gap_s=-1), "max_gap_s"),
        (lambda: t2s.audit([5]), "trials"),
        (lambda: t2s.yaw("x.csv", inertia_kgm2=-1), "inertia_kgm2"),
        (lambda: t2s.reduce_runs("x.csv", speed_mps=-1), "speed_mps"),
        (lambda: t2s.steering_models("poznyakov-yudin", "20"), "rudder_deg"),
        (lambda: t2s.make_report(None), "result"),
    ],
)
def test_what_is_out_of_bounds_is_refused_by_name(call: Callable[[], object], name: str) -> None:
    with pytest.raises(t2s.InputError) as caught:
        call()
    assert caught.value.source == name and caught.value.remedy


def test_numbers_of_numpy_and_whole_floats_are_taken() -> None:
    assert SHIP.turn(np.float32(35), duration_s=np.int64(20), members=np.int32(0)).study.manoeuvre == "turn:35"
    assert (
        ArgumentBounds(0, whole=True).checked("x", 2000.0) == 2000
        and ArgumentBounds(1, 5).checked("x", np.float64(5)) == 5.0
    )
    assert type(ArgumentBounds(0, whole=True).checked("x", np.int8(3))) is int


@pytest.mark.parametrize(
    "bounds, within, beyond",
    [
        (ArgumentBounds(0, above=True), [1e-300, 1e300], [0, -1e-300]),
        (ArgumentBounds(0), [0, 0.0, 1], [-1e-300]),
        (ArgumentBounds(-2, 3), [-2, 3], [-2.0001, 3.0001]),
        (ArgumentBounds(2, 10, whole=True), [2, 10], [1, 11, 2.5]),
    ],
)
def test_bounds_hold_at_their_ends(bounds: ArgumentBounds, within: list[float], beyond: list[float]) -> None:
    assert [bounds.checked("x", value) for value in within] == within
    for value in beyond:
        with pytest.raises(t2s.InputError, match="x: is"):
            bounds.checked("x", value)


def test_a_function_is_checked_by_its_annotations() -> None:
    @checked
    def asked(
        angle: AngleArgument,
        *,
        speed: Speed | None = None,
        texts: Sequence[str] = (),
        numbers: Mapping[str, float] | None = None,
        path: str | Path = "",
        output: Annotated[Path, "a file to write"] = Path(),
        unknown: NotThere | None = None,  # type: ignore[name-defined]  # noqa: F821
    ) -> tuple[object, ...]:
        return angle, speed, texts, numbers, path, unknown

    assert asked(5) == (5, None, (), None, "", None)
    assert asked(-360.0, speed=3, texts=["a"], numbers={"b": 1}, path=Path("c"), unknown=object())[:2] == (-360.0, 3)
    assert asked(5, output=Path("d")) == asked(5)
    for wrong in (
        {"speed": 0},
        {"speed": "3"},
        {"texts": "a"},
        {"texts": [5]},
        {"numbers": {"b": "1"}},
        {"numbers": {1: 1}},
        {"numbers": []},
        {"path": 5},
        {"output": 5},
    ):
        with pytest.raises(t2s.InputError) as caught:
            asked(5, **wrong)
        assert caught.value.source.startswith(next(iter(wrong)))
    with pytest.raises(TypeError):
        asked()  # type: ignore[call-arg]


def test_an_ensemble_that_has_no_room_is_refused_with_the_number_that_has(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_bytes", lambda: 4_000_000)
    with pytest.raises(t2s.InputError) as caught:
        SHIP.turn(35, members=9_000)
    most = int(caught.value.remedy.split()[-1].replace(",", ""))
    assert caught.value.source == "members" and 1_000 < most < 9_000
    assert SHIP.turn(35, duration_s=1.0, members=3).study.ensemble is not None
    with pytest.raises(t2s.InputError, match="members"):
        t2s.guess(**GUESSED, members=2_000)


@pytest.mark.parametrize(
    "run, doubted",
    [
        (lambda: SHIP.turn(0.61, duration_s=20.0), True),
        (lambda: SHIP.turn(-math.radians(35), duration_s=20.0), True),
        (lambda: SHIP.zigzag(math.radians(20), math.radians(20), duration_s=20.0), True),
        (lambda: SHIP.steer({"t_s": [0, 10, 20], "delta_order_deg": [0.0, 0.35, -0.35]}), True),
        (lambda: SHIP.turn(35, duration_s=20.0), False),
        (lambda: SHIP.turn(1, duration_s=20.0), False),
        (lambda: SHIP.turn(5, duration_s=20.0), False),
        (lambda: SHIP.turn(0.05, duration_s=20.0), False),
        (lambda: SHIP.steer({"t_s": [0, 5, 10, 20], "delta_order_deg": [0.0, 0.35, 10.0, 0.0]}), False),
        (lambda: SHIP.steer({"t_s": [0, 10], "delta_order_deg": [0.0, 0.0]}), False),
    ],
)
def test_a_rudder_that_looks_like_radians_is_doubted_in_the_first_line(
    run: Callable[[], t2s.ManoeuvreResult], doubted: bool
) -> None:
    result = run()
    assert repr(result).startswith("CHECK: ") is doubted
    assert any(notice["level"] == "caution" for notice in result.to_dict()["notices"]) is doubted


def test_options_of_the_command_line_have_the_bounds_of_the_api() -> None:
    assert bounds_of(FalseDiscovery) == ArgumentBounds(round(1 - SUREST, 9), 1 - LIKELY)
    bounded = 0
    for name in COMMANDS:
        command = group.get_command(click.Context(group), name)
        assert command is not None
        kinds = {option.name: option.type for option in command.params}
        function = VERBS[name].function
        for argument in inspect.signature(function).parameters.values():
            kind = annotated_kind(argument.annotation, function)
            parts = (kind,) if get_origin(kind) is Annotated else get_args(kind) or (kind,)
            for bounds in filter(None, map(bounds_of, parts)):
                option = kinds[argument.name]
                if bounds != ArgumentBounds():
                    assert isinstance(option, click.IntRange | click.FloatRange), (name, argument.name)
                    assert (option.min, option.max, option.min_open) == (bounds.low, bounds.high, bounds.above)
                    bounded += 1
    assert bounded > 40


@pytest.mark.parametrize(
    "arguments, option",
    [
        ("simulate mariner --manoeuvre turn:35 --duration nan", "--duration"),
        ("simulate mariner --manoeuvre turn:35 --members 9999999999", "--members"),
        ("stability mariner --speed nan", "--speed"),
        ("autopilot mariner --wave-filter nan", "--wave-filter"),
        ("design mariner --carriage-length nan", "--carriage-length"),
        ("identify mariner x.csv --piece -3", "--piece"),
        ("guess --length nan --beam 1 --draught 1 --block 1 --speed 1", "--length"),
        ("convert mariner --to abkowitz --origin inf -o x.toml", "--origin"),
    ],
)
def test_the_command_line_calls_an_argument_by_its_option(arguments: str, option: str, tmp_path: Path) -> None:
    done = tank2sim(*arguments.split(), cwd=tmp_path)
    assert option in done.stderr and not list(tmp_path.iterdir())
    refused(done)


def test_every_argument_with_a_unit_is_bounded_on_both_sides() -> None:
    """A length of 1e9 m, a depth of 1e6 m: a number that no vessel and no sea has is a slip of the unit."""
    functions = [one for name in VERBS.names() for one in (VERBS[name], *variants_of(VERBS[name]).values())]
    calls = [call for verb in functions for call in (verb.function, *(output.write for output in verb.outputs))]
    calls += [call for name, call in vars(t2s.Ship).items() if inspect.isfunction(call) and name[0] != "_"]
    bounded, open_ended = 0, set()
    for function in calls:
        for argument in inspect.signature(function).parameters.values():
            kind = annotated_kind(argument.annotation, function)
            parts = (kind,) if get_origin(kind) is Annotated else get_args(kind) or (kind,)
            numbers = [one for one in parts if one is float or (get_origin(one) is Annotated and bounds_of(one))]
            for bounds in map(bounds_of, numbers if in_words(argument.name)[1] else ()):
                if bounds is None or bounds.low is None or bounds.high is None:
                    open_ended.add((function.__name__, argument.name))
                bounded += 1
    assert open_ended == {("tow", "force_N")}  # a number or the coefficients of a polynomial: bounded by its values
    assert bounded > 50


@pytest.mark.parametrize(
    "call, name",
    [
        (lambda: t2s.load("kulikovsky-velikanov").glide(budget_kg=1, depth_m=1e6), "depth_m"),
        (lambda: t2s.load("kulikovsky-velikanov").glide(budget_kg=1e15, depth_m=100), "budget_kg"),
        (lambda: t2s.tow(TOWS, length_m=1e9), "length_m"),
        (lambda: t2s.tow(TOWS, beam_m=1e-9), "beam_m"),
        (lambda: t2s.tow(TOWS, volume_m3=1e30), "volume_m3"),
        (lambda: t2s.tow(TOWS, mass_kg=1e30), "mass_kg"),
        (lambda: t2s.tow(TOWS, total_mass_kg=1e30), "total_mass_kg"),
        (lambda: t2s.tow(TOWS, force_N=1e30), "force_N"),
        (lambda: t2s.tow(TOWS, force_N=[1.0, 1e30]), "force_N"),
        (lambda: t2s.yaw("x.csv", torque_constant_NmpA=1e30), "torque_constant_NmpA"),
        (lambda: t2s.yaw("x.csv", inertia_error_kgm2=1e30), "inertia_error_kgm2"),
        (lambda: t2s.simulate_yaw("alyshev", "x.csv", noise_A=1e30), "noise_A"),
        (lambda: t2s.signals("x.csv", max_gap_s=1e12), "max_gap_s"),
        (lambda: SHIP.turn(300), "rudder_deg"),
        (lambda: SHIP.turn(35, duration_s=1e12), "duration_s"),
        (lambda: SHIP.autopilot(wind_mps=1e6), "wind_mps"),
        (lambda: SHIP.autopilot(current_mps=1e6), "current_mps"),
        (lambda: SHIP.autopilot(wave_yaw_deg=1e6), "wave_yaw_deg"),
        (lambda: SHIP.autopilot(wave_filter_radps=1e6), "wave_filter_radps"),
        (lambda: SHIP.stop(-1e9), "revolutions_rpm"),
        (lambda: SHIP.state_space(1e-30), "speed_mps"),
        (lambda: t2s.trial_office("x.csv", ship=SHIP, draught_fore_m=1e6), "draught_fore_m"),
        (lambda: t2s.trial_office("x.csv", ship=SHIP, sea_state=99), "sea_state"),
        (lambda: t2s.design_campaign(SHIP, model_length_m=1e9), "model_length_m"),
        (lambda: t2s.validate(SHIP, required_percent=1e9), "required_percent"),
        (lambda: SHIP.replace({"ship.beam_m": 1e9}), SHIP.card.source),
        (lambda: SHIP.replace({"ship.draught_m": 1e6}), SHIP.card.source),
        (lambda: SHIP.replace({"ship.rudder_area_m2": 1e9}), SHIP.card.source),
        (lambda: SHIP.replace({"ship.water_depth_m": 1e6}), SHIP.card.source),
    ],
)
def test_a_size_that_nothing_has_is_refused(call: Callable[[], object], name: str) -> None:
    with pytest.raises(t2s.InputError) as caught:
        call()
    assert caught.value.source == name and caught.value.remedy


@pytest.mark.parametrize("text", ["15,5", "15kn", "fast"])
def test_the_command_line_says_how_a_number_is_written(text: str, tmp_path: Path) -> None:
    words = f"guess --length 320 --beam 58 --draught 20 --block 0.8 --speed {text}".split()
    refused(tank2sim(*words, cwd=tmp_path), "--speed", f"{text!r} is not a number", "point for decimals")


def test_names_are_taken_in_their_order_from_a_text_or_a_list_and_unknown_or_repeated_ones_are_refused() -> None:
    for given in ("c, a", ["c", "a"], ("c,a",)):
        assert chosen_names("terms", given, "abc") == ("a", "c")
    assert chosen_names("terms", "none", "abc") == chosen_names("terms", (), "abc") == ()
    for given in ("d", "a,a"):
        with pytest.raises(t2s.InputError) as refusal:
            chosen_names("terms", given, "abc")
        assert refusal.value.source == "terms" and "a, b, c" in refusal.value.remedy


@pytest.mark.parametrize("text", ["", "1,,2", "one", "1,nan", "1,inf", "1,2,3"])
def test_a_text_holds_numbers_only_if_all_are_finite_and_as_many_as_asked(text: str) -> None:
    assert numbers_in(text, (1, 2)) == []
    assert numbers_in(" 1, -2e3", (1, 2)) == numbers_in("1,-2000") == [1.0, -2000.0]
