"""The ship's equations against (3.5), (3.8) written out again, term by term as printed, in plain numpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS, ACCELERATION_TERMS, ALL_TERMS
from tests.cards.si_card import SI_CARD
from tests.dynamics.states import rates, values

L, U0, RHO = 160.93, 7.7175, 1025.0


def with_random_derivatives(card: ManoeuvringCard, seed: int, **model: str) -> ManoeuvringCard:
    random = np.random.default_rng(seed)
    derivatives = dict(card.derivatives)
    for name in (*ABKOWITZ_TERMS["X"], *ABKOWITZ_TERMS["Y"], *ABKOWITZ_TERMS["N"]):
        derivatives[name] = random.normal(scale=1e-3)
    return replace(card, derivatives=derivatives, model=card.model.model_copy(update=model))


def printed(c: dict[str, float], card: ManoeuvringCard, state: tuple[float, ...]) -> np.ndarray:
    """du/dt, dv/dt, dr/dt by (3.8) and a matrix solve; v, r, d, u given in SI, all in the prime system within."""
    u, v, r, d = state
    V = np.hypot(u, v) if card.model.speed_scale == "instantaneous" else U0
    Du, v, r, u = (u - U0) / V, v / V, r * L / V, u / V
    m, xG, Jz = card.rigid_body.mass, card.rigid_body.x_G, card.rigid_body.yaw_inertia
    add = 1.0 if card.model.yaw_rate_terms == "hydrodynamic" else 0.0
    X = (
        c["X0"] + c["Xu"] * Du + c["Xuu"] * Du**2 + c["Xuuu"] * Du**3
        + c["Xvv"] * v**2 + (c["Xrr"] + add * m * xG) * r**2
        + c["Xdd"] * d**2 + c["Xvvu"] * v**2 * Du + c["Xrru"] * r**2 * Du + c["Xddu"] * d**2 * Du
        + (c["Xvr"] + add * m) * v * r + c["Xvd"] * v * d + c["Xrd"] * r * d
        + c["Xvru"] * v * r * Du + c["Xvdu"] * v * d * Du + c["Xrdu"] * r * d * Du
    )  # fmt: skip

    def odd(F: str, inertial: float) -> float:
        return (
            c[F + "0"] + c[F + "0u"] * Du + c[F + "0uu"] * Du**2
            + c[F + "v"] * v + c[F + "vvv"] * v**3 + c[F + "vrr"] * v * r**2 + c[F + "vdd"] * v * d**2
            + c[F + "vu"] * v * Du + c[F + "vuu"] * v * Du**2
            + (c[F + "r"] - add * inertial * u) * r + c[F + "rrr"] * r**3 + c[F + "vvr"] * r * v**2
            + c[F + "rdd"] * r * d**2 + c[F + "ru"] * r * Du + c[F + "ruu"] * r * Du**2
            + c[F + "d"] * d + c[F + "ddd"] * d**3 + c[F + "vvd"] * d * v**2 + c[F + "rrd"] * d * r**2
            + c[F + "du"] * d * Du + c[F + "duu"] * d * Du**2 + c[F + "vrd"] * v * r * d
        )  # fmt: skip

    M = np.array(
        [
            [m - c["Xudot"], 0, 0],
            [0, m - c["Yvdot"], m * xG - c["Yrdot"]],
            [0, m * xG - c["Nvdot"], Jz - c["Nrdot"]],
        ]
    )
    udot, vdot, rdot = np.linalg.solve(M, [X, odd("Y", m), odd("N", m * xG)])
    return np.array([udot * V**2 / L, vdot * V**2 / L, rdot * V**2 / L**2])


def accelerations(card: ManoeuvringCard, state: tuple[float, ...]) -> np.ndarray:
    at = dict(zip(("motion.u", "motion.v", "motion.r", "rudder.angle"), state, strict=True))
    return values(build(card), ("motion.udot", "motion.vdot", "motion.rdot"), at)


def linear(card: ManoeuvringCard) -> ManoeuvringCard:
    return replace(card, model=card.model.model_copy(update={"kind": "linear"}))


STATES = [(7.7175, 0.3, 0.004, 0.1), (6.0, -0.9, 0.011, -0.5), (9.1, 0.7, -0.008, 0.3)]


def test_the_term_lists_are_those_of_the_paper() -> None:
    assert [len(ABKOWITZ_TERMS[force]) for force in "XYN"] == [16, 22, 22]
    assert len(ACCELERATION_TERMS) == 5 and len(set(ALL_TERMS)) == 65


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("speed_scale", ["instantaneous", "nominal"])
@pytest.mark.parametrize("yaw_rate_terms", ["total", "hydrodynamic"])
def test_all_65_terms_are_those_of_3_8(mariner_card, state, speed_scale, yaw_rate_terms) -> None:
    card = with_random_derivatives(mariner_card, 7, speed_scale=speed_scale, yaw_rate_terms=yaw_rate_terms)
    np.testing.assert_allclose(accelerations(card, state), printed(card.derivatives, card, state), rtol=1e-11)


@pytest.mark.parametrize("yaw_rate_terms", ["total", "hydrodynamic"])
def test_the_linear_model_is_3_5(mariner_card, yaw_rate_terms) -> None:
    card = with_random_derivatives(mariner_card, 3, yaw_rate_terms=yaw_rate_terms)
    only = {"Xu", "Yv", "Yr", "Yd", "Nv", "Nr", "Nd", *ACCELERATION_TERMS}
    # (3.8) without its other terms, near u0 and for small v, r, is (3.5)
    c = {name: value if name in only else 0.0 for name, value in card.derivatives.items()}
    near = replace(card, model=card.model.model_copy(update={"speed_scale": "nominal"}))
    state = (U0, 1e-4, 1e-6, 1e-4)
    np.testing.assert_allclose(accelerations(linear(card), state)[1:], printed(c, near, state)[1:], rtol=1e-9)
    fast, slow = accelerations(linear(card), (8.0, 0, 0, 0)), accelerations(linear(card), (7.0, 0, 0, 0))
    m = card.rigid_body.mass - c["Xudot"]
    np.testing.assert_allclose((fast - slow)[0], c["Xu"] * U0 / L / m, rtol=1e-9)


def test_total_and_hydrodynamic_differ_by_m_times_speed_difference(mariner_card) -> None:
    """formats: the two differ by m (V - u) r once the inertia terms are taken over."""
    m, xG = mariner_card.rigid_body.mass, mariner_card.rigid_body.x_G
    c = mariner_card.derivatives
    moved = {"Yr": c["Yr"] + m, "Nr": c["Nr"] + m * xG, "Xvr": c["Xvr"] - m, "Xrr": c["Xrr"] - m * xG}
    bare = replace(
        mariner_card,
        derivatives={**c, **moved},
        model=mariner_card.model.model_copy(update={"yaw_rate_terms": "hydrodynamic"}),
    )
    u, v, r = 6.5, -0.8, 0.01
    V = np.hypot(u, v)
    half = RHO / 2 * L**3
    matrix = half * np.array([[m - c["Yvdot"], L * (m * xG - c["Yrdot"])], [L * (m * xG - c["Nvdot"]), 0]])
    matrix[1, 1] = half * L**2 * (mariner_card.rigid_body.yaw_inertia - c["Nrdot"])
    difference = half * m * np.array([1.0, xG * L]) * (V - u) * r
    found = accelerations(bare, (u, v, r, 0.1)) - accelerations(mariner_card, (u, v, r, 0.1))
    np.testing.assert_allclose(found[1:], np.linalg.solve(matrix, difference), rtol=1e-8)


def test_ships_of_any_size_with_equal_primes_accelerate_alike(mariner_card) -> None:
    """Dimensional similarity: accelerations scale with U^2/L and U^2/L^2, whatever the density."""
    scale, speed, density = 1 / 40.0, 0.2, 0.97
    model = replace(
        mariner_card,
        ship=mariner_card.ship.model_copy(update={"length_m": L * scale}),
        model=mariner_card.model.model_copy(update={"speed_mps": U0 * speed, "valid_speed_mps": None}),
        environment=mariner_card.environment.model_copy(update={"water_density_kgpm3": RHO * density}),
    )
    state = np.array([6.5, -0.8, 0.01, 0.3])
    scaled = accelerations(model, tuple(state * [speed, speed, speed / scale, 1]))
    expected = accelerations(mariner_card, tuple(state)) * [speed**2 / scale, speed**2 / scale, speed**2 / scale**2]
    np.testing.assert_allclose(scaled, expected, rtol=1e-11)


def test_positive_rudder_turns_to_starboard(mariner_card) -> None:
    assert accelerations(mariner_card, (U0, 0, 0, 0.2))[2] > 0


def test_the_steering_gear_keeps_its_limits_and_stays_when_it_fails(mariner) -> None:
    def rate(command_deg: float, angle_deg: float = 0.0, failed: float = 0.0) -> float:
        at = {"motion.u": U0, "rudder.angle": np.radians(angle_deg), "steering.failed": failed}
        return rates(mariner, at | {"rudder.command": np.radians(command_deg)})["rudder.angle"]

    assert rate(35) == pytest.approx(np.radians(5.0))
    assert rate(2) == pytest.approx(np.radians(2.0) / 1.0)
    assert rate(35, failed=1.0) == 0.0
    assert rate(60, angle_deg=40) == pytest.approx(0.0, abs=1e-15)


def test_a_card_without_gear_says_which_lag_is_taken() -> None:
    model = build(parse_card(SI_CARD, "ship.toml"))
    assert any("time constant" in notice for notice in model.notices)


def test_current_carries_the_ship_and_changes_no_force(mariner_card) -> None:
    effect = '\n[[effects]]\nname = "current"\nparameters = {speed_mps = 0.5, direction_deg = 120.0}\n'
    model, plain = build(parse_card(mariner_card.text + effect, "ship.toml")), build(mariner_card)
    at = {"motion.psi": 0.3, "motion.u": 7.0, "motion.v": -0.4, "motion.r": 0.008, "rudder.angle": 0.2}
    with_current, without = rates(model, at), rates(plain, at)
    carried = {"motion.x": 0.5 * np.cos(np.radians(120)), "motion.y": 0.5 * np.sin(np.radians(120))}
    assert with_current == pytest.approx({key: without[key] + carried.get(key, 0.0) for key in without}, abs=1e-14)
    assert {"current.speed", "current.direction"} <= set(model.input_names)


def test_propulsion_balances_at_nominal_revolutions_and_pulls_above(data) -> None:
    card = parse_card((data / "data/gap_cases/case_1/ship.toml").read_text(), "ship.toml")
    model = build(card)
    nominal = 84.0 * 2 * np.pi / 60

    def udot(n: float) -> float:
        return rates(model, {"motion.u": U0, "propeller.speed": n})["motion.u"]

    assert udot(nominal) == pytest.approx(0.0, abs=1e-12)
    m = card.rigid_body.mass - card.derivatives["Xudot"]
    assert udot(1.1 * nominal) == pytest.approx(0.00077 * 0.21 * U0**2 / L / m, rel=1e-9)
    assert udot(-nominal) == pytest.approx(-2 * 0.00077 * U0**2 / L / m, rel=1e-9)


@pytest.mark.parametrize(
    ("lag", "step"),
    # L/u0 is 20.8 s: a two-hundredth of it is 0.104 s, rounded down 0.1 s; or a fifth of the lag of the gear
    [(10.0, 0.1), (0.6, 0.1), (0.5, 0.1), (0.45, 0.05), (0.1, 0.02), (0.06, 0.01), (0.02, 0.002)],
)
def test_the_step_is_a_two_hundredth_of_the_time_of_a_length_or_a_fifth_of_the_lag_of_the_gear(
    mariner_card, lag: float, step: float
) -> None:
    assert mariner_card.ship.length_m / mariner_card.model.speed_mps == pytest.approx(20.85, abs=0.01)
    gear = mariner_card.steering_gear.model_copy(update={"time_constant_s": lag})
    assert build(replace(mariner_card, steering_gear=gear)).step_s == pytest.approx(step)
