"""One record in several disguises, and runs that are alike without being one record."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.reading import looks_like_a_trial, read_trial_file
from tank2sim.records.same_record import Likeness, likeness, refuse_copies, same_record, signature
from tank2sim.records.trials import Trial
from tests.records.motions import NOISE, motion, trial

MOTIONS = {kind: motion(kind) for kind in ("zigzag", "turn", "straight")}


def digits(values, count):
    unit = 10.0 ** (np.floor(np.log10(np.abs(values) + 1e-300)) - count + 1)
    return np.round(values / unit) * unit


def changed(one, **changes):
    return replace(one, path=Path("copy.csv"), **changes)


def disguises_of(one):
    signals = one.signals
    return {
        "renamed": changed(one),
        "fewer digits": changed(one, signals={name: digits(values, 4) for name, values in signals.items()}),
        "three digits": changed(one, signals={name: digits(values, 3) for name, values in signals.items()}),
        "fewer columns": changed(one, signals={name: signals[name] for name in ("delta_rad", "psi_rad", "x_m")}),
        "another clock": changed(one, time_s=one.time_s + 1000.0),
        "cut": changed(one, time_s=one.time_s[900:], signals={name: values[900:] for name, values in signals.items()}),
        "every second row": changed(one, time_s=one.time_s[::2], signals={n: v[::2] for n, v in signals.items()}),
        "turned": turned(one, 1.05, 0.0, 0.0),
        "turned and moved": turned(one, -2.5, 4000.0, -900.0),
        "every third row from another zero of time": begun_again(one, slice(len(one.time_s) // 7, None, 3)),
    }


def turned(one, angle, north, east):
    """The run under another heading from another place, by the rotation of its track."""
    signals, (x, y) = dict(one.signals), (one.signals["x_m"], one.signals["y_m"])
    signals["psi_rad"] = signals["psi_rad"] + angle
    signals["x_m"] = np.cos(angle) * x - np.sin(angle) * y + north
    signals["y_m"] = np.sin(angle) * x + np.cos(angle) * y + east
    return changed(one, signals=signals)


def begun_again(one, rows):
    signals = {name: values[rows] for name, values in one.signals.items()}
    return changed(one, time_s=one.time_s[rows] - one.time_s[rows][0], signals=signals)


def mirrored(one):
    odd = ("delta_rad", "v_mps", "r_radps", "psi_rad", "y_m")
    return changed(one, signals={name: -v if name in odd else v for name, v in one.signals.items()})


def disturbed(kind, seed, share):
    """The motion with slow gusts that turn the ship by a share of its largest yaw rate, and its track by quadrature."""
    made, rng = dict(MOTIONS[kind]), np.random.default_rng(seed)
    t = made["t_s"]
    gusts = sum(
        rng.standard_normal() * np.cos(2 * np.pi * k * t / t[-1] + rng.uniform(0, 2 * np.pi)) for k in range(1, 13)
    )
    gust = share * np.abs(made["r_radps"]).max() * gusts / gusts.std()
    step = t[1] - t[0]
    made["r_radps"] = made["r_radps"] + gust
    made["psi_rad"] = made["psi_rad"] + np.cumsum(gust) * step
    u, v, psi = made["u_mps"], made["v_mps"], made["psi_rad"]
    made["x_m"] = np.cumsum(u * np.cos(psi) - v * np.sin(psi)) * step
    made["y_m"] = np.cumsum(u * np.sin(psi) + v * np.cos(psi)) * step
    return made


@pytest.mark.parametrize("kind", MOTIONS)
def test_a_record_is_found_in_every_disguise(kind):
    one = trial(MOTIONS[kind])
    disguises = disguises_of(one)
    missed = [how for how, copy in disguises.items() if not (same_record(one, copy) and same_record(copy, one))]
    assert not missed
    with pytest.raises(InputError, match=r"copy\.csv.*record of made_up\.csv again"):
        refuse_copies([one, disguises["renamed"]])
    with pytest.raises(InputError, match=r"copy\.csv.*both fitted and held out"):
        refuse_copies([one], [disguises["fewer digits"]])


@pytest.mark.parametrize("kind", MOTIONS)
def test_a_second_run_of_the_same_manoeuvre_is_another_record(kind):
    """The most alike that runs can be: the same motion to the last metre, through sensors of their own."""
    runs = [trial(MOTIONS[kind], seed=seed) for seed in range(3)]
    refuse_copies(runs)
    refuse_copies(runs[:1], runs[1:])


@pytest.mark.parametrize("kind", ["zigzag", "turn"])
def test_a_mirror_image_and_a_second_recorder_are_marked(kind):
    one = trial(MOTIONS[kind])
    for image in (mirrored(one), turned(mirrored(one), 2.0, 50.0, 60.0), begun_again(mirrored(one), slice(0, None, 2))):
        assert likeness(one, image) is likeness(image, one) is Likeness.MIRROR
    other = trial(MOTIONS[kind], seed=2, noise={name: 2 * size for name, size in NOISE.items()})
    for again in (
        other,
        begun_again(other, slice(203, None, 7)),
        turned(begun_again(other, slice(None, None, 13)), 3, 9, 9),
    ):
        assert likeness(one, again) is likeness(again, one) is Likeness.TWICE
    (notice,) = refuse_copies([one], [changed(other)])
    assert notice.leads and "copy.csv" in notice and "made_up.csv" in notice
    (notice,) = refuse_copies([one, mirrored(one)])
    assert notice.leads and "mirror image" in notice


@pytest.mark.parametrize("kind", ["zigzag", "turn"])
def test_runs_with_disturbances_of_their_own_have_nothing_in_common(kind):
    """Gusts of 2 % of the yaw rate, the least that differs between repeats in a basin (HSVA)."""
    runs = [trial(disturbed(kind, seed, 0.02), seed=seed) for seed in range(3)]
    assert refuse_copies(runs) == ()
    assert refuse_copies(runs[:1], [mirrored(runs[1]), turned(runs[2], 1.0, 2.0, 3.0)]) == ()


def signed(one, **changes):
    """The trial as its signature has it, printed and read."""
    time, signals = signature(one)
    assert len(time) < 32 and len(signals) <= 4 and all(len(values) == len(time) for values in signals.values())
    return replace(one, time_s=np.array(time), signals={name: np.array(values) for name, values in signals.items()})


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("rows", [None, 240, 90])
def test_a_few_rows_are_enough_to_know_a_record_by(kind, rows):
    one = trial(MOTIONS[kind])
    if rows:
        part = slice(0, len(one.time_s), len(one.time_s) // rows)
        one = replace(one, time_s=one.time_s[part], signals={name: v[part] for name, v in one.signals.items()})
    disguises = disguises_of(one)
    del disguises["every third row from another zero of time"]  # of which the few rows may have none
    n = len(one.time_s)
    for how, part in {"cut": slice(n // 3, None), "its end cut": slice(0, n // 2), "third": slice(0, None, 3)}.items():
        disguises[how] = changed(one, time_s=one.time_s[part], signals={m: v[part] for m, v in one.signals.items()})
    if rows == 90:  # its rows are not a multiple of two or three apart
        del disguises["every second row"], disguises["third"]
    if rows and not same_record(one, disguises["three digits"]):  # too coarse for the whole records, too
        del disguises["three digits"]
    missed = [how for how, copy in disguises.items() if not same_record(signed(one), copy)]
    assert not missed
    found_again = [seed for seed in range(2, 7) if same_record(signed(one), trial(MOTIONS[kind], seed=seed))]
    assert not found_again


def test_signals_that_are_never_known_at_once_still_make_a_signature():
    one = trial(MOTIONS["zigzag"])
    signals = {name: values.copy() for name, values in one.signals.items()}
    signals["psi_rad"][1::2] = np.nan
    signals["x_m"][::2] = np.nan
    one = replace(one, signals=signals)
    assert len(signature(one)[1]["psi_rad"]) >= 16
    assert same_record(signed(one), one)
    still = replace(one, signals={"psi_rad": np.zeros_like(one.time_s)})
    assert signature(still) == ([], {})


def swinging(rows: int = 401, **signals: np.ndarray) -> Trial:
    """A heading without noise that swings by +-1 ever faster, once a second."""
    time = np.arange(float(rows))
    return Trial(Path("made.csv"), time, {"psi_rad": np.sin(time / 7.3 * (1 + time / 900)), **signals}, columns={})


@pytest.mark.parametrize(("apart", "same"), [(0.9e-3, True), (1.2e-3, False)])
def test_records_are_the_same_up_to_a_thousandth_of_their_spread(apart: float, same: bool) -> None:
    one = swinging()
    heading = one.signals["psi_rad"]
    shift = apart * np.std(heading) * np.sign(np.cos(13.0 * one.time_s))
    assert same_record(one, changed(one, signals={"psi_rad": heading + shift})) == same


@pytest.mark.parametrize(("noise", "same"), [(0.45, True), (0.55, False)])
def test_records_are_the_same_within_half_of_the_smaller_noise(noise: float, same: bool) -> None:
    stream = np.random.default_rng(2)
    heading = np.sin(np.arange(4001.0) / 73.0) + 0.02 * stream.standard_normal(4001)
    other = heading + noise * 0.02 * np.sign(stream.standard_normal(4001))
    one = swinging(4001, psi_rad=heading)
    assert same_record(one, changed(one, signals={"psi_rad": other})) == same


@pytest.mark.parametrize(("rows", "same"), [(190, False), (210, True)])
def test_records_are_compared_if_they_share_half_of_the_shorter_one(rows: int, same: bool) -> None:
    """A record of 400 s against one that begins within it and ends after it, by the same clock."""
    whole = swinging(801)
    first = replace(whole, time_s=whole.time_s[:401], signals={"psi_rad": whole.signals["psi_rad"][:401]})
    later = slice(401 - rows, 801 - rows + 1)
    second = changed(whole, time_s=whole.time_s[later], signals={"psi_rad": whole.signals["psi_rad"][later]})
    assert same_record(first, second) == same_record(second, first) == same


def test_three_rows_in_common_say_nothing_and_four_do() -> None:
    for rows, same in ((3, False), (4, True)):
        one = swinging(rows)
        assert same_record(one, changed(one)) == same


def test_one_signal_that_differs_makes_another_record_and_one_that_rests_says_nothing() -> None:
    one = swinging(u_mps=5.0 + np.cos(np.arange(401.0) / 31.0))
    assert same_record(one, changed(one))
    assert not same_record(one, changed(one, signals={**one.signals, "u_mps": 1.1 * one.signals["u_mps"]}))
    resting = swinging(delta_rad=np.zeros(401))
    assert same_record(resting, changed(resting))
    only = replace(resting, signals={"delta_rad": np.zeros(401)})
    assert not same_record(only, changed(only))


@pytest.mark.slow
def test_measured_records_are_no_copies_of_each_other(data: Path) -> None:
    folders = [data / "data" / name for name in ("kvlcc2_hsva", "kvlcc2_marin", "gap_cases/case_1", "gap_cases/case_5")]
    folders += [path for path in (data / "data/esso_osaka").glob("*") if path.is_dir()]
    for folder in folders:
        trials = [read_trial_file(path) for path in sorted(folder.glob("*.*")) if looks_like_a_trial(path)]
        assert len(trials) > 1
        assert refuse_copies(trials) == ()
        for one in trials:
            known_again = [other.name for other in trials if same_record(signed(one), other)]
            assert known_again == [one.name]
