"""Effects on derivatives and effects with states, against cards with the changed numbers and exact solutions."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard
from tank2sim.dynamics import Model, build
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.errors import InputError

from .ships import (
    CB,
    FORCES,
    MASS,
    RHO,
    STATES,
    TYPICAL,
    U0,
    X_G,
    B,
    G,
    L,
    T,
    added_forces,
    card_with,
    mariner_text,
    ship,
    state,
    values,
)

WANTED = [*FORCES, "motion.udot", "motion.vdot", "motion.rdot"]
HYDRODYNAMIC = mariner_text(yaw_rate_terms='yaw_rate_terms = "hydrodynamic"')


def changed(card: ManoeuvringCard, **derivatives: float) -> Model:
    return build(replace(card, effects=(), derivatives={**card.derivatives, **derivatives}))


def bare_parts(card: ManoeuvringCard) -> dict[str, float]:
    """Derivatives without the inertia of the ship: Y_r + m, N_r + m x_G of a card that holds them, and as much of what
    they have by speed; the Mariner's Y_ru, N_ru are its Y_r, N_r."""
    c = dict.fromkeys(ALL_TERMS, 0.0) | dict(card.derivatives)
    if card.model.yaw_rate_terms == "total":
        assert (c["Yru"], c["Nru"]) == (c["Yr"], c["Nr"])
        c["Yr"] += MASS
        c["Nr"] += MASS * X_G
        c["Yru"], c["Nru"] = c["Yr"], c["Nr"]
    return c


def same(effects: dict[str, dict[str, float]], text: str, expected: Model) -> None:
    for at in STATES:
        np.testing.assert_allclose(values(ship(effects, text), WANTED, at), values(expected, WANTED, at), rtol=1e-9)


@pytest.mark.parametrize("name", ["cubic_yaw_damping", "sway_yaw_coupling", "turning_drag"])
@pytest.mark.parametrize("text", [mariner_text(), HYDRODYNAMIC])
def test_terms_are_added_to_the_cards_own(name: str, text: str) -> None:
    card = card_with(text=text)
    new = {key: card.derivatives.get(key, 0.0) + value for key, value in TYPICAL[name].items()}
    same({name: TYPICAL[name]}, text, changed(card, **new))


def test_turning_drag_slows_a_ship_that_drifts_outwards_in_its_turn() -> None:
    for v, r in ((-0.8, 0.01), (0.8, -0.01)):
        X, Y, N = added_forces("turning_drag", {"Xvr": 1e-3}, state(6.0, v, r))
        assert X < 0 and Y == 0 and N == 0


@pytest.mark.parametrize(
    ("name", "derivatives"),
    [
        ("added_yaw_inertia", ["Nrdot"]),
        ("added_sway_mass", ["Yvdot"]),
        ("linear_yaw_damping", ["Yr", "Nr", "Yru", "Nru", "Yruu", "Nruu"]),
        ("linear_sway_damping", ["Yv", "Nv", "Yvu", "Nvu", "Yvuu", "Nvuu"]),
    ],
)
@pytest.mark.parametrize("text", [mariner_text(), HYDRODYNAMIC])
def test_factors_multiply_the_hydrodynamic_part_only(name: str, derivatives: list[str], text: str) -> None:
    card = card_with(text=text)
    parts = bare_parts(card)
    new = {key: card.derivatives.get(key, 0.0) + 0.3 * parts[key] for key in derivatives}
    same({name: {"factor": 0.3}}, text, changed(card, **new))


@pytest.mark.parametrize("text", [mariner_text(), HYDRODYNAMIC])
def test_shallow_water_magnifies_added_masses_and_odd_terms(text: str) -> None:
    card = card_with(text=text)
    parts = bare_parts(card)
    odd = "Yv Yvvv Yvrr Yvu Yvuu Yr Yrrr Yvvr Yru Yruu".split()
    names = ["Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot", *odd, *(f"N{name[1:]}" for name in odd)]
    new = {name: card.derivatives.get(name, 0.0) + 0.4 * parts[name] for name in names}
    same({"shallow_water": {"magnification": 0.4}}, text, changed(card, **new))


def test_water_depth_follows_kijima() -> None:
    card, H = card_with(), 12.0
    h, full, parts = T / H, CB * B / T, bare_parts(card_with())
    f = {
        name: (1 - h) ** -n - h
        for name, n in (("Yv", 0.4 * full), ("Nv", 0.425 * full), ("Nr", 1.5 - 7.14 * 2 * T / L))
    }
    assert all(1.0 < value < 5.0 for value in f.values())
    new = {name: card.derivatives[name] + (f[name] - 1) * parts[name] for name in f}
    same({"water_depth": {"depth_m": H}}, mariner_text(), changed(card, **new))


def test_the_depth_is_an_input_and_a_ship_aground_is_refused() -> None:
    model = ship({"water_depth": {"depth_m": 12.0}})
    assert model.input_names[-1] == "water.depth"
    other = ship({"water_depth": {"depth_m": 20.0}})
    at = STATES[0]
    np.testing.assert_array_equal(values(model, WANTED, {**at, "water.depth": 20.0}), values(other, WANTED, at))
    assert np.all(np.isfinite(values(model, WANTED, {**at, "water.depth": 1.06 * T})))
    for depth in (-5.0, 0.0, 1.0, T, 1.04 * T):
        with pytest.raises(InputError) as caught:
            model.input_values({"water.depth": depth})
        assert caught.value.place == "water.depth"
        with pytest.raises(InputError) as caught:
            ship({"water_depth": {"depth_m": depth}})
        assert caught.value.place == "effects.0.parameters.depth_m"


def test_trim_changes_the_linear_derivatives_of_the_even_keel() -> None:
    card, share = card_with(), 1.5 / T
    parts = bare_parts(card)
    new = {
        "Yv": card.derivatives["Yv"] + 2 / 3 * share * parts["Yv"],
        "Yr": card.derivatives["Yr"] + 0.8 * share * parts["Yr"],
        "Nv": card.derivatives["Nv"] - 0.27 * share * parts["Yv"],
        "Nr": card.derivatives["Nr"] + 0.3 * share * parts["Nr"],
    }
    same({"trim": {"by_stern_m": 1.5}}, mariner_text(), changed(card, **new))
    assert abs(new["Nv"]) < abs(card.derivatives["Nv"])  # by the stern: less of the moment that turns a drifting bow


@pytest.mark.parametrize("scale", ["instantaneous", "nominal"])
def test_memory_holds_back_a_share_of_the_linear_sway_damping(scale: str) -> None:
    text = mariner_text(speed_scale=f'speed_scale = "{scale}"')
    at, z = state(6.0, 0.8, 0.005, 0.1), 0.3
    V = np.hypot(6.0, 0.8) if scale == "instantaneous" else U0
    found = added_forces("flow_memory", {"share": 0.4, "time_constant_s": 8.0}, {**at, "flow_memory.v": z}, text)
    c = card_with().derivatives
    per_v = -0.4 * (0.8 - z) * 0.5 * RHO * L**2 * V
    np.testing.assert_allclose(found, [0.0, per_v * c["Yv"], per_v * c["Nv"] * L], rtol=1e-7, atol=1e-5)
    model = ship({"flow_memory": {"share": 0.4, "time_constant_s": 8.0}}, text)
    np.testing.assert_allclose(values(model, ["flow_memory.vdot"], {**at, "flow_memory.v": z}), 0.5 / 8)


def test_memory_vanishes_in_steady_motion_and_starts_with_it() -> None:
    model = ship({"flow_memory": TYPICAL["flow_memory"]})
    at = {**STATES[0], "flow_memory.v": STATES[0]["motion.v"]}
    np.testing.assert_array_equal(values(model, FORCES, at), values(ship(), FORCES, STATES[0]))
    start = np.array(model.initial(model.parameter_values({"initial.v": 0.7}))).ravel()
    assert start[model.state_names.index("flow_memory.v")] == 0.7


@pytest.mark.parametrize("scale", ["instantaneous", "nominal"])
def test_heel_gives_side_force_and_moment(scale: str) -> None:
    text = mariner_text(speed_scale=f'speed_scale = "{scale}"')
    at = state(6.0, 0.8, 0.005, 0.1)
    V = np.hypot(6.0, 0.8) if scale == "instantaneous" else U0
    found = added_forces("roll_coupling", {"Yphi": 3e-4, "Nphi": -1e-4}, {**at, "motion.phi": 0.1}, text)
    q = 0.5 * RHO * L**2 * V**2 * 0.1
    np.testing.assert_allclose(found, [0.0, 3e-4 * q, -1e-4 * q * L], rtol=1e-7, atol=1e-5)


def test_the_ship_heels_outwards_by_the_period_and_damping_given() -> None:
    """Held in a steady turn, heel is the exact answer of a damped oscillator to a step, u r/g times the ratio."""
    given = {"Yphi": 0.0, "Nphi": 0.0, "roll_period_s": 12.0, "damping": 0.2, "heel_ratio": 4.0}
    model = ship({"roll_coupling": given})
    names, at = ["motion.phidot", "motion.pdot"], state(6.0, 0.5, 0.01)
    w, steady = 2 * np.pi / 12.0, -4.0 * 6.0 * 0.01 / G
    assert steady < 0  # a turn to starboard heels to port
    np.testing.assert_allclose(values(model, names, {**at, "motion.phi": steady}), 0.0, atol=1e-12)
    x = ca.vcat([model.symbol("motion.phi"), model.symbol("motion.p")])
    rates = model.expand(ca.vcat([model.symbol(name) for name in names]))
    A = ca.Function("A", [model.x, model.u, model.p], [ca.jacobian(rates, x)])(
        0, model.input_values(), model.parameter_values()
    )
    poles = np.sort_complex(np.linalg.eigvals(np.array(A)))
    damped = w * np.sqrt(1 - 0.2**2)
    np.testing.assert_allclose(poles, [-0.2 * w - 1j * damped, -0.2 * w + 1j * damped], rtol=1e-9)
    assert {"motion.phi", "motion.p"} <= set(model.outputs)


def test_the_roll_period_follows_from_the_card_where_it_is_not_given() -> None:
    given = {"Yphi": 0.0, "Nphi": 0.0}
    known = mariner_text().replace("draught_m =", "metacentric_height_m = 1.1\ndraught_m =")
    name = "roll_coupling.roll_period"
    assert ship({"roll_coupling": given}, known)[name].start == pytest.approx(2 * np.pi * 0.4 * B / np.sqrt(G * 1.1))
    assert 5 < ship({"roll_coupling": given})[name].start < 25
    assert 5 < ship({"roll_coupling": given}, mariner_text(beam_m=""))[name].start < 25
