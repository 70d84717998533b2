"""Signals of which everything is known: white noise, first-order processes, sines, a Nomoto ship."""

from pathlib import Path

import numpy as np

from tank2sim.records.signals.sampling import Series
from tank2sim.records.trials import Trial


def series(values, step_s=0.1, name="r_radps", start_s=0.0):
    return Series(Path("made.csv"), name, start_s, step_s, np.asarray(values, dtype=float))


def trial(time_s, **signals):
    return Trial(
        Path("made.csv"), np.asarray(time_s, dtype=float), {k: np.asarray(v, float) for k, v in signals.items()}
    )


def white(seed, count=4000, spread=1.0):
    return spread * np.random.default_rng(seed).standard_normal(count)


def first_order(seed, time_constant_steps, count=4000):
    """x(k+1) = a x(k) + e, of variance 1 from the first sample on, by a loop and not by a filter of scipy."""
    a = np.exp(-1.0 / time_constant_steps)
    noise = np.random.default_rng(seed).standard_normal(count)
    values = np.empty(count)
    values[0] = noise[0]
    for place in range(1, count):
        values[place] = a * values[place - 1] + np.sqrt(1.0 - a * a) * noise[place]
    return values


def nomoto(rudder, step_s, gain, time_constant_s, noise=None):
    """Yaw rate of T r' + r = K delta, the rudder held over each step: the exact solution."""
    a = np.exp(-step_s / time_constant_s)
    rate = np.zeros(len(rudder))
    for place in range(1, len(rudder)):
        rate[place] = a * rate[place - 1] + gain * (1.0 - a) * rudder[place - 1]
    return rate if noise is None else rate + noise
