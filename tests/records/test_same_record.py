"""One record in several disguises, and runs that are alike without being one record."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.reading import looks_like_a_trial, read_trial_file
from tank2sim.records.same_record import refuse_copies, same_record, signature
from tests.records.motions import motion, trial

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
    }


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
    runs = [trial(MOTIONS[kind], seed=seed) for seed in range(5)]
    refuse_copies(runs)
    refuse_copies(runs[:2], runs[2:])


def signed(one, **changes):
    """The trial as its signature has it, printed and read."""
    time, signals = signature(one)
    assert len(time) < 32 and len(signals) <= 3 and all(len(values) == len(time) for values in signals.values())
    return replace(one, time_s=np.array(time), signals={name: np.array(values) for name, values in signals.items()})


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("rows", [None, 240, 90])
def test_a_few_rows_are_enough_to_know_a_record_by(kind, rows):
    one = trial(MOTIONS[kind])
    if rows:
        part = slice(0, len(one.time_s), len(one.time_s) // rows)
        one = replace(one, time_s=one.time_s[part], signals={name: v[part] for name, v in one.signals.items()})
    disguises = disguises_of(one)
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


@pytest.mark.slow
def test_measured_records_are_no_copies_of_each_other(data: Path) -> None:
    folders = [data / "data" / name for name in ("kvlcc2_hsva", "kvlcc2_marin", "gap_cases/case_1", "gap_cases/case_5")]
    folders += [path for path in (data / "data/esso_osaka").glob("*") if path.is_dir()]
    for folder in folders:
        trials = [read_trial_file(path) for path in sorted(folder.glob("*.*")) if looks_like_a_trial(path)]
        assert len(trials) > 1
        refuse_copies(trials)
        for one in trials:
            known_again = [other.name for other in trials if same_record(signed(one), other)]
            assert known_again == [one.name]
