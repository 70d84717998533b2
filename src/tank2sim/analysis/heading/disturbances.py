"""Disturbances of a steered ship: current, wind, and waves that yaw it at their own frequency."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm, solve_discrete_lyapunov

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.autopilot_loop import with_yaw_disturbance
from tank2sim.dynamics.effects.surroundings import CURRENT, WIND
from tank2sim.dynamics.model import Model


@dataclass(frozen=True, kw_only=True)
class Weather:
    """Current, wind and waves; speeds in m/s, directions in rad clockwise from north.

    The defaults are project choices for a ship of 160 m on a northerly course: a fresh breeze (Beaufort 5) and its sea
    on the bow, and a knot of current across.
    """

    current_mps: float = 0.5
    current_towards_rad: float = math.radians(90.0)
    wind_mps: float = 10.0
    wind_from_rad: float = math.radians(45.0)
    # Standard deviation of the heading that the waves alone give the ship at their frequency.
    wave_yaw_rad: float = math.radians(0.2)
    # `wave_radps`, `wave_damping`: Frequency of encounter, and relative damping of the shaping filter: 0.1 for a narrow
    # band (Fossen 2011, 8.2).
    wave_radps: float = 0.6
    wave_damping: float = 0.1
    seed: int = 1  # Seed of the noise that drives the filter


def weather_for(length_m: float, **given: float | None) -> Weather:
    """The default weather for a ship of a length, by Froude's law; given values (not None) replace defaults."""
    scale, usual = math.sqrt(length_m / 160.0), Weather()
    values: dict[str, float] = {
        "current_mps": usual.current_mps * scale,
        "wind_mps": usual.wind_mps * scale,
        "wave_radps": usual.wave_radps / scale,
    }
    values |= {name: value for name, value in given.items() if value is not None}
    return replace(usual, **values)  # type: ignore[arg-type]


def angles_in_degrees(values: Mapping[str, float]) -> dict[str, float]:
    """Numbers by name, with ``_deg`` in place of ``_rad``."""
    converted: dict[str, float] = {}
    for name, value in values.items():
        stem, _, unit = name.rpartition("_")
        converted |= {f"{stem}_deg": math.degrees(value)} if unit == "rad" else {name: value}
    return converted


def in_weather(ship: Model, card: SteeredCard, weather: Weather) -> tuple[Model, dict[str, float]]:
    """The ship with inputs for current, wind and waves, and the inputs of this weather by name.

    Effects that the card already has are not added; their inputs take the weather's values, too.
    """
    for effect in (CURRENT, WIND):
        if f"{effect.name}.speed" not in ship:
            ship = effect.apply(ship, dict.fromkeys(effect.required(), 0.0), card)
    inputs = {
        "current.speed": weather.current_mps,
        "current.direction": weather.current_towards_rad,
        "wind.speed": weather.wind_mps,
        "wind.direction": weather.wind_from_rad,
    }
    return with_yaw_disturbance(ship), inputs


def wave_yaw_acceleration(weather: Weather, step_s: float, count: int) -> Array:
    """Yaw acceleration by waves (count,), rad/s2, each held for a step.

    White noise through 2 z w s/(s^2 + 2 z w s + w^2) (Fossen 2011, 8.2), exact for noise held over a step, and
    stationary from the start. Its standard deviation is w^2 times the heading's: at wave frequency a ship
    responds to a moment by its inertia alone.
    """
    w, z = weather.wave_radps, weather.wave_damping
    A = np.array([[0.0, 1.0], [-(w**2), -2 * z * w]])
    B = np.array([[0.0], [1.0]])
    both = expm(np.block([[A, B], [np.zeros((1, 3))]]) * step_s)
    Ad, Bd = both[:2, :2], both[:2, 2]
    covariance = solve_discrete_lyapunov(Ad, np.outer(Bd, Bd))
    noise = np.random.default_rng(weather.seed)
    state = np.linalg.cholesky(covariance) @ noise.standard_normal(2)
    driven = noise.standard_normal(count)[:, None] * Bd
    values = np.empty(count)
    for place in range(count):
        values[place] = state[1]
        state = Ad @ state + driven[place]
    return np.asarray(values * w**2 * weather.wave_yaw_rad / math.sqrt(covariance[1, 1]))
