"""Manoeuvres that decide, by what is known of the effects, and the score against plain linear algebra."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.reading import linear_card
from tank2sim.dynamics import build
from tank2sim.gap.outcome.next_test import Explanation, WindowPrediction, _unabsorbed, next_test
from tank2sim.gap.outcome.next_test_candidates import candidate_manoeuvres, orders_csv
from tank2sim.gap.result import NextTest
from tank2sim.identification.trials.problem.problem_from_card import free_parameters
from tank2sim.simulation.manoeuvres import read_orders
from tank2sim.simulation.run import simulate
from tests.cli.command_line import tank2sim

NOISE = {
    **{"motion.u": 0.03, "motion.v": 0.03, "motion.r": np.radians(0.02), "motion.psi": np.radians(0.1)},
    **{"motion.x": 0.6, "motion.y": 0.6},
}


def explanation(card: ManoeuvringCard, name: str = "none", **parameters: float) -> Explanation:
    """With coefficients known to 1 %, and the effect's parameters to 30 %."""
    spread = {key: 0.01 * abs(value) for key, (value, _) in free_parameters(card).items()}
    if name != "none":
        lines = "\n".join(f"{key} = {value}" for key, value in parameters.items())
        text = f'{card.text}\n[[effects]]\nname = "{name}"\n[effects.parameters]\n{lines}\n'
        improved = parse_card(text, "improved.toml")
        assert isinstance(improved, ManoeuvringCard)
        card = improved
        inputs = {"speed_mps": "current.speed", "direction_rad": "current.direction"}
        for key, value in parameters.items():
            stem = re.sub("_(rad|s|prime)$", "", key)
            spread[inputs[key] if name == "current" else f"{name}.{stem}"] = 0.3 * abs(value)
    return Explanation(name, card, tuple(spread), np.diag(np.square(list(spread.values()))))


def asked(*explanations: Explanation, duration_s: float = 250.0) -> NextTest:
    found = next_test(explanations, NOISE, duration_s=duration_s)
    assert found is not None
    return found


def rudders(found: NextTest, folder: Path) -> np.ndarray:
    """Orders, deg, in the file."""
    path = folder / "next_test.csv"
    path.write_text(found.orders)
    return np.degrees(read_orders(path).inputs["rudder.command"])


def test_a_stall_of_the_rudder_asks_for_large_rudders(mariner_card: ManoeuvringCard, tmp_path: Path) -> None:
    stalled = explanation(mariner_card, "rudder_stall", angle_rad=0.35, loss=0.3)
    found = asked(stalled, explanation(mariner_card), duration_s=120.0)
    assert np.abs(rudders(found, tmp_path)).max() > 20
    assert found.manoeuvre in ("turn:35", "turn:-35")
    assert found.expected["turn:10"] < 1e-6 and found.expected[found.manoeuvre] > 10
    # The root of a score, which is a sum of squares in noise units, is how far apart the two are.
    size = f"{found.expected[found.manoeuvre] ** 0.5:.2g}"
    assert f"the prediction by rudder stall differs by {size} from the card alone" in found.why
    assert "standard deviation of the noise" in found.why and "3.2 would decide" in found.why
    (stall,) = found.sizes.items()
    assert stall[0] == "rudder_stall" and stall[1][0] == {"angle_rad": 0.35, "loss": 0.3}


@pytest.mark.slow
def test_play_and_lag_of_the_gear_ask_for_many_reversals(mariner_card: ManoeuvringCard, tmp_path: Path) -> None:
    found = asked(
        explanation(mariner_card, "rudder_backlash", width_rad=0.02),
        explanation(mariner_card, "rudder_lag", time_constant_s=3.0),
    )
    assert np.count_nonzero(np.diff(np.sign(rudders(found, tmp_path)))) >= 2
    assert found.expected["straight run"] < found.expected["zigzag:5/5"] > found.expected["turn:35"]


@pytest.mark.slow
def test_damping_and_heel_ask_for_transients(mariner_card: ManoeuvringCard, tmp_path: Path) -> None:
    found = asked(
        explanation(mariner_card, "linear_yaw_damping", factor=0.1),
        explanation(mariner_card, "roll_coupling", Yphi=1e-3, Nphi=-5e-4, roll_period_s=12.0),
    )
    assert np.count_nonzero(np.diff(rudders(found, tmp_path))) >= 2
    assert found.expected["zigzag:20/10"] > found.expected["course keeping"]


@pytest.mark.slow
def test_what_depends_on_heading_is_asked_on_two(mariner_card: ManoeuvringCard) -> None:
    carried = explanation(mariner_card, "current", speed_mps=0.3, direction_rad=np.pi / 2)
    # Carried to starboard, a ship seems to head too far to port.
    offset = explanation(mariner_card, "heading_offset", angle_rad=-0.3 / mariner_card.model.speed_mps)
    found = asked(carried, offset)
    assert "straight run on heading 090" in found.expected
    assert found.expected["turn:20"] > 5 * found.expected["straight run"]


@pytest.mark.slow
def test_what_no_test_can_tell_is_said(mariner_card: ManoeuvringCard) -> None:
    found = asked(explanation(mariner_card, "rudder_effectiveness", factor=1e-5), explanation(mariner_card))
    assert found.why.startswith("No manoeuvre considered would distinguish rudder effectiveness for sure")
    assert next_test([explanation(mariner_card)], NOISE) is None


@pytest.mark.slow
def test_coloured_readings_tell_less_and_the_nearest_rival_counts(mariner_card: ManoeuvringCard) -> None:
    card = linear_card(mariner_card)
    damped, bare = explanation(card, "linear_yaw_damping", factor=0.1), Explanation("none", card, (), np.zeros((0, 0)))
    near = explanation(card, "linear_yaw_damping", factor=0.09)
    scores = [
        next_test(explanations, NOISE, duration_s=130.0, correlation_s=correlation)
        for explanations, correlation in (([damped, bare], 0.0), ([damped, bare], 8.0), ([damped, bare, near], 0.0))
    ]
    white, coloured, three = (found.expected["zigzag:10/10"] for found in scores if found is not None)
    assert 0 < coloured < 0.5 * white
    assert 0 < three < 0.1 * white


@pytest.mark.slow
def test_the_orders_run_and_a_zigzag_in_them_is_one(mariner_card: ManoeuvringCard, tmp_path: Path) -> None:
    found = asked(
        explanation(mariner_card, "rudder_lag", time_constant_s=3.0),
        explanation(mariner_card, "rudder_time_offset", delay_s=2.0),
    )
    assert found.manoeuvre.startswith("zigzag:")
    (tmp_path / "ship.toml").write_text(mariner_card.text)
    (tmp_path / "next_test.csv").write_text(found.orders)
    result = tank2sim("simulate", "ship.toml", "--manoeuvre", "file:next_test.csv", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    rudder, heading = (float(text) for text in found.manoeuvre.removeprefix("zigzag:").split("/"))
    orders = read_orders(tmp_path / "next_test.csv")
    ordered = np.round(np.degrees(orders.inputs["rudder.command"]), 6)
    assert ordered[0] == 0 and set(np.abs(ordered[1:])) == {rudder}
    # By the explanation that steered, the rudder goes over when the heading has changed by the angle.
    late = explanation(mariner_card, "rudder_lag", time_constant_s=3.0).card
    run = simulate(build(late), orders).trajectory
    over = orders.times[2:-1]
    turned = np.degrees(np.interp(over, run.t, run["motion.psi"])) * -np.sign(ordered[2:-1])
    np.testing.assert_allclose(turned, heading, atol=0.6)


def test_candidates_stay_within_the_gear_and_order_revolutions_only_with_propulsion(
    mariner_card: ManoeuvringCard,
) -> None:
    names = [candidate.name for candidate in candidate_manoeuvres(mariner_card, 20.0)]
    assert "turn:35" in names and "slow-down and acceleration" not in names
    text = mariner_card.text.replace("max_angle_deg = 40.0", "max_angle_deg = 25.0")
    assert text != mariner_card.text
    weak = parse_card(text + "\n[propulsion]\nnominal_rpm = 80.0\nXnn = 7e-4\n", "weak.toml")
    assert isinstance(weak, ManoeuvringCard)
    names = [candidate.name for candidate in candidate_manoeuvres(weak, 20.0)]
    assert "turn:25" in names and "turn:35" not in names and "slow-down and acceleration" in names


def test_orders_are_rows_of_changes_in_degrees_and_revolutions_a_minute(tmp_path: Path) -> None:
    rudder = np.radians([10.0, 10.0, -5.0, -5.0])
    text = orders_csv(0.5, {"rudder.command": rudder, "propeller.speed": np.full(4, 2 * np.pi)}, "why: so")
    assert text.splitlines()[1:] == ["t_s,delta_order_deg,n_rpm", "0,10,60", "1,-5,60", "2,-5,60"]
    (tmp_path / "orders.csv").write_text(text)
    assert read_orders(tmp_path / "orders.csv").times[-1] == 2.0


def test_what_is_left_is_that_of_the_plain_formula() -> None:
    rng = np.random.default_rng(1)
    d, J, S = rng.standard_normal((1, 2, 30)), rng.standard_normal((1, 2, 30, 4)), rng.standard_normal((1, 2, 30, 3))
    # All unknowns at once: four of the explanation, and three of each window, with unit prior variance.
    A = np.zeros((60, 10))
    A[:, :4] = J.reshape(60, 4)
    A[:30, 4:7], A[30:, 7:] = S[0, 0], S[0, 1]
    flat = d.ravel()
    expected = flat @ (np.eye(60) - A @ np.linalg.inv(A.T @ A + np.eye(10)) @ A.T) @ flat
    assert _unabsorbed(d, WindowPrediction(d, J, S))[0] == pytest.approx(expected)
    d[0, 1, 3] = np.nan
    assert np.isnan(_unabsorbed(d, WindowPrediction(d, J, S))[0])


def test_the_straight_run_on_two_headings_turns_after_a_third_of_its_length(mariner_card: ManoeuvringCard) -> None:
    (found,) = (
        candidate
        for candidate in candidate_manoeuvres(mariner_card, 30.0)
        if candidate.name == "straight run on two headings"
    )
    helmsman = found.helmsman()
    assert [np.degrees(helmsman(time, 0.0, 0.0)) for time in (0.0, 9.9, 10.1, 29.0)] == pytest.approx([0, 0, 20, 20])
    assert helmsman(20.0, np.pi / 2, 0.0) == pytest.approx(0.0)


@pytest.mark.slow
def test_a_lag_behind_another_needs_the_instants_of_the_orders(mariner_card: ManoeuvringCard) -> None:
    """They differ by a delay of the gear's own time constant, which orders read seldom hide."""
    lags = [explanation(mariner_card, name, time_constant_s=6.0) for name in ("rudder_lag", "telemotor_lag")]
    known, unknown = (next_test(lags, NOISE, duration_s=250.0, unsure_s=unsure_s) for unsure_s in (0.0, 20.0))
    assert known is not None and unknown is not None
    assert not known.needs_instants and unknown.needs_instants
    assert unknown.expected == pytest.approx(known.expected)
