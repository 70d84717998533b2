"""Another draught and trim: nothing at the card's own, regressions by hand, and what is published of their signs."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.analysis.linearisation import state_space, straight_course
from tank2sim.bundled import bundled_cards
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.model import Model, Quantity

from .ships import CB, FRONT, MASS, RHO, STATES, TYPICAL, U0, X_G, B, L, T, card_with, forces, ship, state, values

OWN = {"mean_draught_m": T}


def text_with_loading(name: str, parameters: str) -> str:
    text = bundled_cards()[name].read_text(encoding="utf-8")
    return f'{text}\n[[effects]]\nname = "loading"\nparameters = {{{parameters}}}\n'


@pytest.mark.parametrize("name", ["kvlcc2-mmg", "container", "esso-osaka-ship"])
def test_at_the_cards_own_condition_no_digit_of_a_rate_changes(name: str) -> None:
    bare = parse_card(bundled_cards()[name].read_text(encoding="utf-8"), "ship.toml")
    loaded = parse_card(text_with_loading(name, f"mean_draught_m = {bare.ship.draught_m}"), "ship.toml")
    models = build(bare), build(loaded)
    u0 = bare.model.speed_mps
    for v, r, rudder in ((0.05, -0.002, 0.3), (-0.2, 0.01, -0.5)):
        at = {"motion.u": 0.9 * u0, "motion.v": v * u0, "motion.r": r, "rudder.angle": rudder, "rudder.command": 0.1}
        pair = [values(model, [state.derivative for state in model.states], at) for model in models]
        np.testing.assert_array_equal(*pair)


def test_nor_does_any_force_of_the_effects_that_read_the_draught() -> None:
    others = {name: TYPICAL[name] for name in ("finite_depth", "wind", "cross_flow_drag", "bank", "current_field")}
    names = ["force.X", "force.Y", "force.N", "motion.rdot", "water.under_keel_clearance"]
    for at in STATES:
        pair = [values(ship(effects), names, at) for effects in (others, {**others, "loading": OWN})]
        np.testing.assert_array_equal(*pair)


def derivatives(given: dict[str, float], names: list[str]) -> np.ndarray:
    """Derivatives that the Mariner's equations have at a loading."""
    card = card_with()
    asked = [Quantity(name=f"asked.{one}", unit="1", description=one, value=build(card).symbol(one)) for one in names]
    model: Model = EFFECTS["loading"].apply(build(card).extend(*asked), given, card)
    return values(model, [quantity.name for quantity in asked], state(U0, 0.0, 0.0))


LIGHT, TRIM = 6.5, 0.7


def test_mass_and_derivatives_are_the_published_estimates_by_hand() -> None:
    waterplane = (1 + 2 * CB) / 3
    k = (LIGHT / T) ** (waterplane / CB)
    block = k * CB * T / LIGHT
    shift = TRIM * (0.350 * waterplane**2 - 0.405 * waterplane + 0.146) * L**2 * B / (CB * L * B * T * k)
    x_G = X_G - shift / L
    own = dict(
        zip(
            NAMES := ["Yv", "Nv", "Nr", "Yr", "Yvdot", "Nrdot", "Xudot", "Yvvr", "Nvvv", "Nd", "Yvvd"],
            [
                -1160e-5,
                -264e-5,
                -166e-5 + MASS * X_G,
                -499e-5 + MASS,
                -748e-5,
                -43.8e-5,
                -42e-5,
                15356e-5,
                1636e-5,
                -139e-5,
                1190e-5,
            ],
            strict=True,
        )
    )
    clarke = {
        "Yv": lambda t, c: t**2 * (1 + 0.40 * c * B / t),
        "Nv": lambda t, c: t**2 * (0.5 + 2.4 * t / L),
        "Nr": lambda t, c: t**2 * (0.25 + 0.039 * B / t - 0.56 * B / L),
        "Yvdot": lambda t, c: t**2 * (1 + 0.16 * c * B / t - 5.1 * (B / L) ** 2),
        "Nrdot": lambda t, c: t**2 * (1 / 12 + 0.017 * c * B / t - 0.33 * B / L),
        "Yr": lambda t, c: t**2,
        "Xudot": lambda t, c: (c * t) ** (5 / 3),
        "Yvvr": lambda t, c: t,
        "Nvvv": lambda t, c: t,
        "Nd": lambda t, c: 1.0,
        "Yvvd": lambda t, c: 1.0,
    }
    wanted = {name: own[name] * clarke[name](LIGHT, block) / clarke[name](T, CB) for name in NAMES}
    share, Yv = TRIM / LIGHT, wanted["Yv"]
    wanted["Nv"] -= 0.27 * share * Yv
    wanted["Yv"] *= 1 + 2 / 3 * share
    wanted["Yr"] *= 1 + 0.80 * share
    wanted["Nr"] *= 1 + 0.30 * share
    wanted["Yr"] -= k * MASS
    wanted["Nr"] -= k * MASS * x_G
    given = {"mean_draught_m": LIGHT, "trim_m": TRIM}
    found = derivatives(given, [*(f"derivatives.{name}" for name in NAMES), "ship.mass", "ship.x_G", "ship.draught"])
    np.testing.assert_allclose(np.abs(found[:-3]), np.abs(list(wanted.values())), rtol=1e-9)
    mass = MASS * 0.5 * RHO * L**3
    np.testing.assert_allclose(found[-3:], [k * mass, x_G * L, LIGHT], rtol=1e-12)
    shown = values(ship({"loading": given}), ["loading.displacement"], {})
    assert shown == pytest.approx([k * mass])


@pytest.mark.parametrize("name", ["mariner", "kvlcc2-mmg"])
def test_trim_by_the_stern_makes_a_ship_more_stable_and_by_the_bow_less(name: str) -> None:
    """Inoue, Hirano and Kijima (1981); Kijima et al. (1990)."""
    draught = parse_card(bundled_cards()[name].read_text(encoding="utf-8"), "ship.toml").ship.draught_m
    criteria = []
    for trim in (-0.08, 0.0, 0.08):
        text = text_with_loading(name, f"mean_draught_m = {draught}, trim_m = {trim * draught}")
        model = build(parse_card(text, "ship.toml"))
        system = state_space(model, straight_course(model))
        places = [model.state_names.index(f"motion.{one}") for one in "vr"]
        criteria.append(np.linalg.det(system.A[np.ix_(places, places)]))
    assert criteria[0] < criteria[1] < criteria[2]


def test_resistance_goes_with_displacement_to_the_power_of_two_thirds() -> None:
    u = 6.0
    k = (LIGHT / T) ** ((1 + 2 * CB) / 3 / CB)
    at = state(u, 0.0, 0.0)
    X = forces(ship({"loading": {"mean_draught_m": LIGHT}}), at)[0] - forces(ship(), at)[0]
    assert pytest.approx(-77e-5 * 0.5 * RHO * L**2 * u**2 * (k ** (2 / 3) - 1)) == X
    assert X > 0


def test_a_light_ship_has_more_water_under_the_keel_and_more_side_to_the_wind() -> None:
    shallow, blown = {"finite_depth": {"depth_m": 12.0}}, {"wind": {"speed_mps": 20.0, "direction_deg": 90.0}}
    names, at = ["water.under_keel_clearance", "squat.barrass"], state(4.0, 0.0, 0.0)
    light = {"loading": {"mean_draught_m": LIGHT}}
    own, lighter = (values(ship({**shallow, **more}), names, at) for more in ({}, light))
    assert np.sum(lighter) - np.sum(own) == pytest.approx(T - LIGHT)
    Y = [values(ship({**blown, **more}), ["wind.Y", "wind.X"], at) for more in ({}, light)]
    assert Y[1][0] / Y[0][0] == pytest.approx(1 + L * (T - LIGHT) / 1500.0)
    assert Y[1][1] / Y[0][1] == pytest.approx(1 + B * (T - LIGHT) / FRONT)


@pytest.mark.parametrize(
    ("draught", "trim", "least", "most"),
    [(T, 0.0, 1.0, 1.0), (0.75 * T, 0.0, 0.6, 0.95), (0.4 * T, 0.0, 0.0, 0.0), (T, 2.0, 1.0, 1.0), (T, 5.0, 0.0, 0.0),
     (1.3 * T, 0.0, 0.3, 0.8), (0.55 * T, -2.0, 0.0, 0.1)],
)  # fmt: skip
def test_validity_falls_away_from_the_cards_own_condition(
    draught: float, trim: float, least: float, most: float
) -> None:
    model = ship({"loading": {"mean_draught_m": draught, "trim_m": trim}})
    factor, validity = values(model, ["validity_by.loading", "validity"], state(7.0, 0.0, 0.0))
    assert least <= factor <= most and validity == pytest.approx(factor)
