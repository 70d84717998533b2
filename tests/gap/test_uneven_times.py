"""Replays of an exact truth from records with uneven time stamps: numpy and scipy make the ship and her gear."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.errors import InputError
from tank2sim.gap.proof.replay import replay_trials
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.records.trials import Trial
from tests.gap.replay_noise import NOISE
from tests.identification.trials import made_up_ship

RATE, LAG = math.radians(3.0), 0.5
TEXT = made_up_ship.CARD.replace("time_constant_s = 0.5", "time_constant_s = 0.5\nmax_rate_degps = 3.0")
DURATION = 250.0
SIGNALS = {"motion.u": "u_mps", "motion.v": "v_mps", "motion.r": "r_radps", "motion.psi": "psi_rad"}
SIGNALS |= {"motion.x": "x_m", "motion.y": "y_m"}


@cache
def zigzag():
    """The motion of a 20/20 zigzag, states over time, and the instants and values of the orders."""
    given, orders = [10.3], [math.radians(20.0)]

    def rates(_, x):
        u, v, r, psi, _, _, rudder = x
        order = orders[-1]
        turned = np.clip((order - rudder) / LAG, -RATE, RATE)
        cos, sin = math.cos(psi), math.sin(psi)
        motion = made_up_ship.accelerations(u, v, r, rudder, made_up_ship.TRUTH)
        return [*motion, r, u * cos - v * sin, u * sin + v * cos, turned]

    def reached(_, x):
        return x[3] - 0.3 - math.copysign(math.radians(20.0), orders[-1])

    reached.terminal = True
    accuracy = {"rtol": 1e-9, "atol": 1e-11, "max_step": 0.5, "dense_output": True}
    parts, orders[-1] = [], 0.0
    part = solve_ivp(rates, (0, given[0]), [made_up_ship.SPEED, 0, 0, 0.3, 0, 0, 0], **accuracy)
    parts.append(part)
    orders[-1] = math.radians(20.0)
    while part.t[-1] < DURATION:
        reached.direction = math.copysign(1.0, orders[-1])
        part = solve_ivp(rates, (part.t[-1], DURATION), part.y[:, -1], events=reached, **accuracy)
        parts.append(part)
        if part.t[-1] < DURATION:
            given.append(float(part.t[-1]))
            orders.append(-orders[-1])
    ends = np.array([each.t[-1] for each in parts])

    def motion(times):
        which = np.minimum(np.searchsorted(ends, times), len(parts) - 1)
        return np.array([parts[place].sol(time) for place, time in zip(which, times, strict=True)])

    return motion, np.array(given), np.array(orders)


def trial(times: np.ndarray, seed: int) -> Trial:
    motion, given, orders = zigzag()
    states, noise = motion(times), np.random.default_rng(seed)
    shown = np.concatenate([[0.0], orders])[np.searchsorted(given, times, side="right")]
    signals = {
        signal: states[:, place] + NOISE[variable] * noise.standard_normal(len(times))
        for place, (variable, signal) in enumerate(SIGNALS.items())
    }
    return Trial(Path("zigzag.csv"), times, {**signals, "delta_order_rad": shown})


def times_of(hertz: int, uneven: str) -> np.ndarray:
    even = np.arange(0.0, DURATION, 1 / hertz)
    if uneven == "events":
        return np.union1d(even, zigzag()[1][:3])
    if uneven == "jitter":
        away = np.random.default_rng(hertz).uniform(-0.2, 0.2, len(even)) / hertz
        return np.sort(np.maximum(even + away, 0.0))
    return even


@pytest.mark.parametrize(("hertz", "uneven"), [(10, "jitter"), (2, "events"), (1, "even")])
def test_the_very_ship_leaves_noise_however_uneven_the_times(hertz: int, uneven: str) -> None:
    card = parse_card(TEXT, "made_up.toml")
    assert isinstance(card, ManoeuvringCard)
    record = trial(times_of(hertz, uneven), seed=hertz)
    (replay,) = replay_trials(card, card, Measured((record,), "order", ()), NOISE, held_out=True)
    assert replay.misfit("before") == pytest.approx(1.0, abs=0.08)


def test_one_bad_time_among_the_rows_is_refused_before_it_asks_for_gigabytes() -> None:
    card = parse_card(TEXT, "made_up.toml")
    assert isinstance(card, ManoeuvringCard)
    record = trial(times_of(1, "even"), seed=1)
    record.time_s[-1] = 1.7e9  # an epoch among seconds
    with pytest.raises(InputError, match="correct the time, or cut the record"):
        replay_trials(card, card, Measured((record,), "order", ()), NOISE, held_out=True)
