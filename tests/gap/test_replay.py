"""Replays of records that numpy and scipy made, at even and uneven times, with faults put in by hand."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.gap.proof.replay import TrialReplays, replay_trials
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.records.trials import Trial
from tank2sim.simulation.manoeuvres import Zigzag
from tank2sim.simulation.run import simulate
from tests.gap.replay_noise import NOISE
from tests.identification.trials import made_up_ship

ZIGZAG = made_up_ship.zigzag(20.0)


def card(effect: str = "", changes: dict[str, str] | None = None) -> ManoeuvringCard:
    text = made_up_ship.CARD + "\n" + effect
    for old, new in (changes or {}).items():
        assert old in text
        text = text.replace(old, new)
    result = parse_card(text, "made_up.toml")
    assert isinstance(result, ManoeuvringCard)
    return result


def effect(name: str, **parameters: float) -> str:
    return f'\n[[effects]]\nname = "{name}"\n[effects.parameters]\n' + "\n".join(
        f"{key} = {value}" for key, value in parameters.items()
    )


def together(*trials: Trial) -> Measured:
    return Measured(trials, "angle", ())


@pytest.fixture(scope="module")
def record() -> Trial:
    return made_up_ship.trial(ZIGZAG, name="zigzag", duration=250.0)


def changed(trial: Trial, **signals: np.ndarray | float) -> Trial:
    """The record with something added to some signals."""
    return replace(trial, signals={**trial.signals, **{n: trial.signals[n] + change for n, change in signals.items()}})


def test_the_very_ship_leaves_noise(record: Trial) -> None:
    (replay,) = replay_trials(card(), card(), together(record), NOISE, held_out=True)
    assert replay.held_out and replay.name == "zigzag"
    for name in NOISE:
        assert replay.misfit("before", name) == pytest.approx(1.0, abs=0.12), name
        assert replay.after[name] is replay.before[name] or np.array_equal(replay.after[name], replay.before[name])
    readings = np.interp(replay.time_s, record.time_s, record.signals["x_m"])
    np.testing.assert_allclose(replay.measured["motion.x"], readings, atol=1e-9)


def test_a_current_is_left_in_the_track_alone_and_its_effect_takes_it_away(record: Trial) -> None:
    t = record.time_s
    drifted = together(changed(record, x_m=0.5 * np.cos(2.0) * t, y_m=0.5 * np.sin(2.0) * t))
    improved = card(effect("current", speed_mps=0.5, direction_rad=2.0))
    (replay,) = replay_trials(card(), improved, drifted, NOISE, held_out=False)
    for name in ("motion.u", "motion.v", "motion.r", "motion.psi"):
        assert replay.misfit("before", name) < 1.15
    assert replay.misfit("before", "motion.x") > 10 < replay.misfit("before", "motion.y")
    assert replay.misfit("after") == pytest.approx(1.0, abs=0.06)
    # Readings drift 0.5 m/s * 250 s from the model: 125 m at the end.
    end = np.hypot(*(replay.measured[n][-1] - replay.before[n][-1] for n in ("motion.x", "motion.y")))
    assert end == pytest.approx(125.0, rel=0.05)


def test_a_sensor_at_fault_in_the_card_is_compared_by_what_it_shows(record: Trial) -> None:
    biased = together(changed(record, r_radps=0.001))
    (replay,) = replay_trials(card(), card(effect("gyro_bias", rate_radps=0.001)), biased, NOISE, held_out=False)
    assert replay.misfit("before", "motion.r") > 2
    assert replay.misfit("after", "motion.r") == pytest.approx(1.0, abs=0.12)


def test_corrected_trials_are_followed_and_shown_as_the_faulty_sensor_has_them(record: Trial) -> None:
    biased = together(changed(record, r_radps=0.001))
    given_card = card()
    (replay,) = replay_trials(given_card, given_card, biased, NOISE, held_out=False, corrected=together(record))
    assert replay.misfit("before", "motion.r") > 2
    assert replay.misfit("after", "motion.r") == pytest.approx(1.0, abs=0.12)
    assert np.mean(replay.after["motion.r"] - replay.before["motion.r"]) == pytest.approx(0.001, rel=0.2)


def test_a_late_rudder_is_replayed_late(record: Trial) -> None:
    early = replace(record, signals={**record.signals, "delta_rad": np.array([ZIGZAG(t + 2.0) for t in record.time_s])})
    (replay,) = replay_trials(
        card(), card(effect("rudder_time_offset", delay_s=2.0)), together(early), NOISE, held_out=False
    )
    assert replay.misfit("before") > 5
    assert replay.misfit("after") == pytest.approx(1.0, abs=0.06)


def test_a_ship_that_measured_little_is_followed(record: Trial) -> None:
    few = {name: record.signals[name] for name in ("psi_rad", "delta_rad")}
    (replay,) = replay_trials(card(), card(), together(replace(record, signals=few)), NOISE, held_out=False)
    assert set(replay.noise) == {"motion.psi"}
    assert replay.misfit("before") == pytest.approx(1.0, abs=0.1)
    track = {name: record.signals[name] for name in ("x_m", "y_m", "delta_rad")}
    (replay,) = replay_trials(card(), card(), together(replace(record, signals=track)), NOISE, held_out=False)
    assert replay.misfit("before") == pytest.approx(1.0, abs=0.1)


def test_gaps_of_the_record_stay_gaps(record: Trial) -> None:
    u = record.signals["u_mps"].copy()
    u[300:600] = np.nan  # 60 to 120 s
    (replay,) = replay_trials(
        card(), card(), together(replace(record, signals={**record.signals, "u_mps": u})), NOISE, held_out=False
    )
    inside = (replay.time_s > 61) & (replay.time_s < 119)
    assert np.isnan(replay.measured["motion.u"][inside]).all() and np.isfinite(replay.before["motion.u"]).all()
    assert replay.misfit("before", "motion.u") == pytest.approx(1.0, abs=0.12)


def test_a_motion_that_runs_away_has_no_finite_misfit(record: Trial) -> None:
    wild = card(changes={"Nr = -0.0022": "Nr = 0.05"})
    (replay,) = replay_trials(wild, card(), together(record), NOISE, held_out=False)
    assert replay.misfit("before") == np.inf and np.isnan(replay.before["motion.r"][-1])
    assert replay.misfit("after") == pytest.approx(1.0, abs=0.06)


def test_a_black_box_is_next_to_both(record: Trial) -> None:
    given_card = card(changes={"Nr = -0.0022": "Nr = -0.0015"})
    results = replay_trials(given_card, given_card, together(record), NOISE, held_out=False)
    (replay,) = TrialReplays(NOISE).with_black_box(results, card(), together(record))
    assert replay.misfit("before") > 5
    assert replay.misfit("black_box") == pytest.approx(1.0, abs=0.06)


def test_trials_that_are_followed_at_once_are_followed_alike(record: Trial) -> None:
    given_card = card(changes={"Nr = -0.0022": "Nr = -0.0015"})

    def both() -> Measured:  # other objects: what was simulated of a trial is kept with it
        return Measured((replace(record, path=Path("a.csv")), replace(record, path=Path("b.csv"))), "angle", ())

    alone = TrialReplays(NOISE).by_cards(given_card, card(), both(), held_out=False)
    with ThreadPoolExecutor(2) as pool:
        at_once = TrialReplays(NOISE, pool).by_cards(given_card, card(), both(), held_out=False)
    assert [replay.name for replay in at_once] == ["a", "b"]
    for one, other in zip(alone, at_once, strict=True):
        assert one.misfit("before") > 5 > one.misfit("after")
        for name in NOISE:
            np.testing.assert_array_equal(one.after[name], other.after[name])
            np.testing.assert_array_equal(one.before[name], other.before[name])


def test_an_order_that_a_gear_with_a_largest_rate_follows_keeps_its_time(mariner_card: ManoeuvringCard) -> None:
    """The rudder leaves when it is reported, and not earlier by the mean of two orders."""
    track = simulate(build(mariner_card), Zigzag(np.radians(20), np.radians(20)), duration_s=300.0).trajectory
    t = np.arange(0.0, 299.0, 0.1)
    names = {"u_mps": "motion.u", "r_radps": "motion.r", "psi_rad": "motion.psi", "x_m": "motion.x", "y_m": "motion.y"}
    signals = {name: np.interp(t, track.t, track[signal]) for name, signal in names.items()}
    held = np.clip(np.searchsorted(track.t, t, side="right") - 1, 0, None)
    signals["delta_order_rad"] = track["rudder.command"][held]
    measured = Measured((Trial(Path("zz.csv"), t, signals),), "order", ())
    fine = {"motion.psi": np.radians(0.1), "motion.r": np.radians(0.02), "motion.x": 0.6, "motion.y": 0.6}
    (replay,) = replay_trials(mariner_card, mariner_card, measured, fine, held_out=False)
    assert replay.misfit("before") < 0.5


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
