"""What no model explains: sensor noise, and forces of gusts and waves."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter, lfiltic

from gap_truth.lane import Lane
from gap_truth.ship import MARINER, Array, Hull

WHITE = {"u_mps": 0.02, "v_mps": 0.02, "r_degps": 0.02, "psi_deg": 0.1, "x_m": 0.5, "y_m": 0.5}
"""Standard deviation of each sample, as measured in the worked cases."""

WANDER = {
    "u_mps": (0.006, 28.0),
    "v_mps": (0.006, 28.0),
    "r_degps": (0.0011, 25.0),
    "psi_deg": (0.031, 28.0),
    "x_m": (0.3, 25.0),
    "y_m": (0.3, 25.0),
}
"""Standard deviation and time constant (s) of the slow bias of each sensor, first-order autoregressive.

Measured as `WHITE`, from the covariance of five-second means at 5 to 50 s lag."""

FORCE_STEP_S = 0.5
"""Of the Mariner; with L/U for others."""

GUST = ((3e-5, 25.0), (7e-5, 20.0), (1.5e-5, 15.0))
"""X', Y', N' (scaled with u0) standard deviation and time constant: N' of one degree of rudder is 2.4e-5."""

WAVE = (3e-4, 1e-3, 2e-4)
WAVE_BAND_RADPS = (0.5, 0.9)
WAVE_DAMPING = 0.08
"""Wave-frequency forces of some centimetres a second and some hundredths of a degree a second of motion."""


def markov(generator: np.random.Generator, count: int, step_s: float, sigma: float, tau_s: float) -> Array:
    """First-order Gauss-Markov series, stationary from its first sample."""
    keep = float(np.exp(-step_s / tau_s))
    kick = generator.standard_normal(count)
    kick[0] *= sigma
    kick[1:] *= sigma * np.sqrt(1.0 - keep * keep)
    return np.asarray(lfilter([1.0], [1.0, -keep], kick), float)


def noise_scale(hull: Hull, signal: str) -> float:
    """Noise of a signal over the Mariner's: a model basin's instruments are better as the model is smaller."""
    length = min(1.0, hull.length_m / MARINER.length_m)
    speed = min(1.0, hull.speed_mps / MARINER.speed_mps)
    return {"u_mps": speed, "v_mps": speed, "x_m": length, "y_m": length, "r_degps": 1.0 / min(1.0, hull.time)}.get(
        signal, 1.0
    )


def sensor_noise(lane: Lane, count: int) -> dict[str, Array]:
    """Noise of every signal, (count,) at 10 Hz, in file units."""
    generator = lane.setting.generator(f"sensors of {lane.trial}")
    noise = {}
    for name, sigma in WHITE.items():
        wander, tau_s = WANDER[name]
        slow = markov(generator, count, 0.1, wander, tau_s * lane.setting.hull.time)
        size = lane.setting.noise * noise_scale(lane.setting.hull, name)
        noise[name] = size * (sigma * generator.standard_normal(count) + slow)
    return noise


def forces(lane: Lane, duration_s: float) -> Array:
    """Process forces (count, 3) every `FORCE_STEP_S`: X', Y', N' scaled with u0; zeros in the regime `none`."""
    time = lane.setting.hull.time
    count = round(duration_s / (FORCE_STEP_S * time)) + 2
    if lane.setting.process == "none":
        return np.zeros((count, 3))
    generator = lane.setting.generator(f"process of {lane.trial}")
    if lane.setting.process == "gusts":
        return np.column_stack([markov(generator, count, FORCE_STEP_S, *gust) for gust in GUST])
    omega = lane.setting.generator("sea").uniform(*WAVE_BAND_RADPS)  # one sea for all trials of a set
    return np.column_stack([size * _narrow_band(generator, count, omega) for size in WAVE])


def _narrow_band(generator: np.random.Generator, count: int, omega: float) -> Array:
    """Unit-variance second-order oscillator driven by white noise, its start-up cut off."""
    lead = round(20.0 / (WAVE_DAMPING * omega) / FORCE_STEP_S / 4.0)
    radius = np.exp(-WAVE_DAMPING * omega * FORCE_STEP_S)
    angle = omega * np.sqrt(1.0 - WAVE_DAMPING**2) * FORCE_STEP_S
    a1, a2 = 2.0 * radius * np.cos(angle), -(radius**2)
    variance = (1.0 - a2) / ((1.0 + a2) * ((1.0 - a2) ** 2 - a1**2))  # of AR(2) with unit kicks
    kick = generator.standard_normal(count + lead) / np.sqrt(variance)
    return np.asarray(lfilter([1.0], [1.0, -a1, -a2], kick, zi=lfiltic([1.0], [1.0, -a1, -a2], [0.0, 0.0]))[0][lead:])
