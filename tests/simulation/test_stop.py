"""Stopping against the closed form of constant thrust astern and resistance by u^2; pull-outs of stable ships."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.dynamics import Model, build
from tank2sim.errors import InputError
from tank2sim.native.lanes import widest_lanes
from tank2sim.simulation.figures import figures_of
from tank2sim.simulation.lane_figures import LaneManoeuvres
from tank2sim.simulation.manoeuvres import COASTING_END, FULL_ASTERN, Stop, parse_manoeuvre
from tank2sim.simulation.run import simulate
from tank2sim.simulation.trajectory import Trajectory

from ..cli.command_line import refused, tank2sim

L, U0, XNN, N0 = 160.93, 7.7175, 77e-5, 84.0 * math.tau / 60


@pytest.fixture(scope="module")
def quadratic(mariner_card) -> ManoeuvringCard:
    """A symmetric ship whose surge is (T n|n|/n0^2 - R u^2)/M at every speed: Xu = -2 Xnn, Xuu = -Xu/2 say just that.

    With Du' = (u - u0)/u straight ahead, Xnn (u0^2 - u^2)/u^2 = Xnn (Du'^2 - 2 Du').
    """
    text = mariner_card.text.replace("[5.4, 9.3]", "[3.9, 9.3]") + f"\n[propulsion]\nnominal_rpm = 84.0\nXnn = {XNN}\n"
    card = parse_card(text, "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    even = {force + end: 0.0 for force in "YN" for end in ("0", "0u", "0uu")}
    surge = {"Xu": -2 * XNN, "Xuu": XNN, "Xuuu": 0.0}
    return replace(card, derivatives={**card.derivatives, **even, **surge})


@pytest.fixture(scope="module")
def ship(quadratic) -> Model:
    return build(quadratic)


def closed_form(card: ManoeuvringCard, astern: float, final: float = 0.0) -> tuple[float, float]:
    """Distance in lengths and time in L/u0 from u0 to `final` u0 under a thrust astern of `astern` times R(u0)."""
    mass = (card.rigid_body.mass - card.derivatives["Xudot"]) / XNN
    if astern == 0:
        return mass * math.log(1 / final), mass * (1 / final - 1)
    reach = mass / 2 * math.log((astern + 1) / (astern + final**2))
    root = math.sqrt(astern)
    return reach, mass / root * (math.atan(1 / root) - math.atan(final / root))


@pytest.mark.parametrize("share", [None, 1.0, 0.5])
def test_a_crash_stop_has_the_reach_and_the_time_of_the_closed_form(ship, quadratic, share) -> None:
    stop = Stop() if share is None else Stop(-share * N0)
    figures = simulate(ship, stop).figures
    reach, time = closed_form(quadratic, (FULL_ASTERN if share is None else share) ** 2)
    # The linear damping at low speed takes off a little.
    assert figures["head_reach_m"] == pytest.approx(reach * L, rel=5e-3)
    assert figures["track_reach_m"] == pytest.approx(reach * L, rel=5e-3)
    assert figures["time_to_stop_s"] == pytest.approx(time * L / U0, rel=5e-3)
    assert figures["head_reach_lengths"] == pytest.approx(reach, rel=5e-3)
    assert figures["side_reach_m"] == pytest.approx(0.0, abs=1e-9)
    assert figures["heading_change_deg"] == pytest.approx(0.0, abs=1e-9)


def test_with_the_engine_stopped_she_coasts_to_a_fifth_of_her_speed(ship, quadratic) -> None:
    result = simulate(ship, parse_manoeuvre("stop:0"))
    reach, time = closed_form(quadratic, 0.0, COASTING_END)
    assert result.figures["head_reach_lengths"] == pytest.approx(reach, rel=0.03)
    assert result.figures["time_to_stop_s"] == pytest.approx(time * L / U0, rel=0.05)
    assert result.trajectory["motion.u"][-1] == pytest.approx(COASTING_END * U0, rel=1e-9)


needs_lanes = pytest.mark.skipif(widest_lanes() == 0, reason="needs a C compiler")


@pytest.mark.slow
@needs_lanes
@pytest.mark.parametrize("share", [None, 1.0, 0.0])
def test_stops_of_many_ships_have_the_closed_form_each_by_its_own_mass(ship, quadratic, share) -> None:
    stop = Stop() if share is None else Stop(-share * N0)
    added = ship.parameter_names.index("derivatives.Xudot")
    p = np.tile(ship.parameter_values(), (3, 1))
    p[:, added] *= (1.0, 3.0, 5.0)
    found = LaneManoeuvres(ship).run(stop, p)
    assert found.fine.all()
    for number, times in enumerate((1.0, 3.0, 5.0)):
        heavier = replace(
            quadratic, derivatives={**quadratic.derivatives, "Xudot": times * quadratic.derivatives["Xudot"]}
        )
        if share == 0.0:
            reach, time = closed_form(heavier, 0.0, COASTING_END)
        else:
            reach, time = closed_form(heavier, (FULL_ASTERN if share is None else share) ** 2)
        figures = {name: values[number] for name, values in found.figures.items()}
        room = 0.03 if share == 0.0 else 5e-3
        assert figures["track_reach_lengths"] == pytest.approx(reach, rel=room)
        assert figures["head_reach_m"] == pytest.approx(reach * L, rel=room)
        assert figures["time_to_stop_s"] == pytest.approx(time * L / U0, rel=2 * room)
        assert figures["stopped_at_mps"] == pytest.approx(COASTING_END * U0 if share == 0.0 else 0.0, abs=1e-9)
        assert abs(figures["side_reach_m"]) < 1e-6 and abs(figures["heading_change_deg"]) < 1e-6


@pytest.mark.slow
@needs_lanes
def test_stops_of_many_ships_turn_as_far_aside_as_single_ones(mariner_card) -> None:
    """A ship that is not alike to both sides: its reaches and change of heading differ from those straight ahead."""
    text = mariner_card.text.replace("[5.4, 9.3]", "[3.9, 9.3]") + f"\n[propulsion]\nnominal_rpm = 84.0\nXnn = {XNN}\n"
    model = build(parse_card(text, "ship.toml"))
    start = model.parameter_values({"initial.psi": 0.7}) if "initial.psi" in model else model.parameter_values()
    found = LaneManoeuvres(model).run(Stop(), start[None])
    expected = simulate(model, Stop(), parameters=dict(zip(model.parameter_names, start.tolist(), strict=True))).figures
    for name, value in expected.items():
        assert found.figures[name][0] == pytest.approx(value, rel=1e-9), name
    assert abs(expected["side_reach_m"]) > 1 and abs(expected["heading_change_deg"]) > 0.1


@pytest.mark.slow
@needs_lanes
def test_a_ship_that_does_not_stop_in_the_longest_time_has_no_figures(ship) -> None:
    weak = Stop(-0.001 * N0)
    assert set(simulate(ship, weak).figures.values()) == {None}
    found = LaneManoeuvres(ship).run(weak, ship.parameter_values()[None])
    assert all(np.isnan(values[0]) for values in found.figures.values())


def test_a_longer_run_goes_astern_and_has_the_same_figures_and_a_shorter_one_has_none(ship) -> None:
    until_stopped = simulate(ship, Stop()).figures
    longer = simulate(ship, Stop(), duration_s=800.0)
    assert longer.trajectory["motion.u"][-1] < 0
    for name, value in until_stopped.items():
        assert longer.figures[name] == pytest.approx(value, rel=1e-6, abs=1e-9)
    shorter = simulate(ship, Stop(), duration_s=60.0)
    assert set(shorter.figures.values()) == {None}
    assert any("does not show" in notice for notice in shorter.notices)


def test_track_head_and_side_reach_of_a_quarter_circle(ship) -> None:
    """A track made up: a quarter circle to starboard of radius R, on a heading of 30 deg."""
    radius, heading = 500.0, math.radians(30.0)
    t = np.linspace(0.0, 100.0, 2001)
    angle = t / 100.0 * math.pi / 2
    ahead, side = radius * np.sin(angle), radius * (1 - np.cos(angle))
    x = np.zeros((len(t), len(ship.states)))
    signals = {
        "motion.x": ahead * math.cos(heading) - side * math.sin(heading),
        "motion.y": ahead * math.sin(heading) + side * math.cos(heading),
        "motion.psi": heading + angle,
        "motion.u": 5.0 * (1 - t / 80.0),
        "motion.udot": np.full_like(t, -5.0 / 80.0),
    }
    y = np.zeros((len(t), len(ship.outputs)))
    for name, values in signals.items():
        if name in ship.state_names:
            x[:, ship.state_names.index(name)] = values
        y[:, ship.outputs.index(name)] = values
    figures = figures_of(Stop(), Trajectory(ship, t, x, np.zeros((len(t), len(ship.inputs))), y), 100.0)
    at = 0.8 * math.pi / 2
    assert figures["time_to_stop_s"] == pytest.approx(80.0)
    assert figures["track_reach_m"] == pytest.approx(radius * at, rel=1e-6)
    assert figures["head_reach_m"] == pytest.approx(radius * math.sin(at), rel=1e-6)
    assert figures["side_reach_m"] == pytest.approx(radius * (1 - math.cos(at)), rel=1e-6)
    assert figures["heading_change_deg"] == pytest.approx(72.0, rel=1e-6)


def test_a_ship_without_propulsion_is_refused_with_the_reason(mariner) -> None:
    with pytest.raises(InputError, match=r"propulsion: is missing.*add \[propulsion\]"):
        simulate(mariner, Stop())


@pytest.mark.parametrize("text", ["stop:60", "stop:x", "stop:", "stop:-6/2"])
def test_what_is_no_stop_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"^manoeuvre: "):
        parse_manoeuvre(text)


def test_revolutions_of_a_stop_are_in_rpm() -> None:
    assert parse_manoeuvre("stop") == Stop()
    astern = parse_manoeuvre("stop:-60")
    assert isinstance(astern, Stop) and astern.revolutions == pytest.approx(-math.tau)
    assert parse_manoeuvre("stop:0") == Stop(0.0)


def test_the_command_prints_reaches_and_refuses_a_ship_without_propulsion(tmp_path) -> None:
    done = tank2sim("simulate", "esso-osaka-estimated", "--manoeuvre", "stop", "--json", "stop.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    figures = json.loads((tmp_path / "stop.json").read_text())["figures"]
    assert 2 < figures["track_reach_lengths"] < 20
    refused(tank2sim("simulate", "mariner", "--manoeuvre", "stop", cwd=tmp_path), "propulsion", "is missing")


@pytest.mark.parametrize("side", [20, -20])
def test_a_stable_ship_with_a_neutral_rudder_off_zero_keeps_no_yaw_rate(side: int) -> None:
    card = read_card("mariner")  # stable; Y0 and N0 are not zero
    run = simulate(build(card), parse_manoeuvre(f"pullout:{side}"))
    # N and Y of v and the rudder vanish with r = 0: from the linear terms of the card, rudder to starboard
    d = card.derivatives
    determinant = d["Yv"] * d["Nd"] - d["Nv"] * d["Yd"]
    neutral = (d["Nv"] * d["Y0"] - d["Yv"] * d["N0"]) / determinant
    assert run.figures["neutral_rudder_deg"] == pytest.approx(math.degrees(neutral), abs=0.02)
    assert abs(run.figures["neutral_rudder_deg"]) > 0.5
    assert abs(run.figures["residual_rate_degps"]) < 0.01 * abs(run.figures["steady_rate_degps"])


def test_an_unstable_ship_keeps_turning_to_its_side() -> None:
    model = build(read_card("kvlcc2-captive"))
    left, right = (simulate(model, parse_manoeuvre(f"pullout:{side}")).figures for side in (-20, 20))
    assert right["residual_rate_degps"] > 0.1 and left["residual_rate_degps"] < -0.1
    assert right["neutral_rudder_deg"] == pytest.approx(left["neutral_rudder_deg"])
