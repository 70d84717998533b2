"""Orders that were sampled once a second were given in between: the replay finds when."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gap_truth import HULLS, Made, Setting, make, sampled, write
from gap_truth.disturbances import WHITE, noise_scale

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.gap.improve_card import add_effects_to_card
from tank2sim.gap.proof.open_loop import Replayer, input_record
from tank2sim.gap.proof.replay import replay_trials
from tank2sim.identification.trials.problem.prepare_trials import measured
from tank2sim.identification.trials.problem.problem_from_card import polynomial_over_trials
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS

ZIGZAGS = ("zigzag10_10", "zigzag15_15_port")


@cache
def made_of(ship: str, effects: tuple[str, ...] = ()) -> Made:
    """Zigzags of a ship with a hidden effect."""
    (made,) = make([Setting(effects, 5, ship=ship, manoeuvres=ZIGZAGS)])
    return made


def written(folder: Path, ship: str, hertz: int):
    """Zigzags of a ship with nothing missing, as files; and the times at which the orders were given."""
    made = made_of(ship)
    write(sampled(made, hertz), folder)
    card = read_card(folder / "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    trials = measured([folder / f"{name}.csv" for name in ZIGZAGS], card)
    given = {
        name: trial["t_s"][1:][np.abs(np.diff(trial["delta_order_deg"])) > 1.0] for name, trial in made.trials.items()
    }
    return polynomial_over_trials(card, trials.trials), trials, given


def noise_of(ship: str) -> dict[str, float]:
    """Of one reading, by variable, SI: of the generator, white and slow together."""
    sizes = {"u_mps": 0.021, "v_mps": 0.021, "r_degps": 0.02, "psi_deg": 0.105, "x_m": 0.58, "y_m": 0.58}
    assert set(sizes) == set(WHITE)
    scaled = {name: size * noise_scale(HULLS[ship], name) for name, size in sizes.items()}
    radians = {name.replace("deg", "rad"): np.radians(v) if "deg" in name else v for name, v in scaled.items()}
    return {variable: radians[signal] for signal, variable in OBSERVED_SIGNALS.items() if signal in radians}


@pytest.mark.slow
@pytest.mark.parametrize("ship", ["tanker", "model"])
def test_a_right_model_follows_zigzags_of_a_record_of_one_row_a_second(tmp_path: Path, ship: str) -> None:
    """The tanker is unstable: an error of half a second at an order is many noises later."""
    card, trials, _ = written(tmp_path, ship, 1)
    misfits = [replay.misfit("after") for replay in replay_trials(card, card, trials, noise_of(ship), held_out=False)]
    assert max(misfits) < 1.5


@pytest.mark.slow
def test_the_instants_of_orders_are_found(tmp_path: Path) -> None:
    card, trials, given = written(tmp_path, "model", 1)
    noise = noise_of("model")
    replayer = Replayer(card, trials.driven_by, noise)
    p = replayer.model.parameter_values()
    found, middle = [], []
    for trial in trials.trials:
        record, _ = replayer.fit_record(input_record(replayer, trial), p)
        assert record.instants is not None
        order = record.inputs[:, replayer.model.input_names.index("rudder.command")]
        rows = np.flatnonzero(np.abs(np.diff(order)) > 0.01) + 1
        found += [*(record.given_s[rows] - given[trial.name])]
        middle += [*(replace(record, instants=None).given_s[rows] - given[trial.name])]
    assert np.abs(found).max() < 0.3
    assert np.std(found) < 0.5 * np.std(middle)


@pytest.mark.slow
def test_a_beginning_that_the_first_search_loses_is_found_without_steps_of_the_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tanker under small orders of course keeping: the first search ends where the record is missed by 75 noises."""
    (made,) = make([Setting((), 3, ship="tanker", manoeuvres=("accel",))])
    write(sampled(made, 1), tmp_path)
    given = read_card(tmp_path / "ship.toml")
    assert isinstance(given, ManoeuvringCard)
    trials = measured([tmp_path / "accel.csv"], given)
    card, noise = polynomial_over_trials(given, trials.trials), noise_of("tanker")
    replayer = Replayer(card, trials.driven_by, noise)
    p = replayer.model.parameter_values()
    record = input_record(replayer, trials.trials[0])
    lost = replayer.guess_initial_state(record, p) + 0.01
    monkeypatch.setattr(Replayer, "_least_squares_start", lambda *arguments, **options: (lost, 75.0))
    found, start = replayer.fit_record(record, p)
    assert np.sqrt(np.mean(replayer.away(found, start, p) ** 2)) < 1.3


def test_many_orders_of_unknown_instant_are_found_where_the_record_as_it_is_misses_the_motion_by_far(
    tmp_path: Path,
) -> None:
    """A play in the gear, a step every few seconds: orders in the middle of each second end many noises away."""
    (made,) = make([Setting(("rudder_backlash",), 24, ship="model", manoeuvres=("random_steps",))])
    write(sampled(made, 1), tmp_path)
    given = read_card(tmp_path / "ship.toml")
    assert isinstance(given, ManoeuvringCard)
    trials = measured([tmp_path / "random_steps.csv"], given)
    width = np.radians(made.parameters["rudder_backlash"]["width_deg"])
    card = add_effects_to_card(
        polynomial_over_trials(given, trials.trials), [("rudder_backlash", {"width_rad": width}, {})]
    )
    noise = noise_of("model")
    replayer = Replayer(card, trials.driven_by, noise)
    p = replayer.model.parameter_values()
    _, misfit = replayer._least_squares_start(input_record(replayer, trials.trials[0]), p, wrong=False)
    assert misfit > 10
    (replay,) = replay_trials(card, card, trials, noise, held_out=False)
    assert replay.misfit("after") < 1.5


def test_slopes_in_start_and_instants_are_difference_quotients_of_the_whole_motion(tmp_path: Path) -> None:
    card, trials, _ = written(tmp_path, "model", 1)
    replayer = Replayer(card, trials.driven_by, noise_of("model"))
    p, record = replayer.model.parameter_values(), input_record(replayer, trials.trials[0])
    order = record.inputs[:, replayer.model.input_names.index("rudder.command")]
    rows = np.flatnonzero(np.abs(np.diff(order)) > 0.01) + 1
    start = replayer.guess_initial_state(record, p)
    shares, reach = np.linspace(0.3, 0.7, len(rows)), np.append(np.full(len(start), 1e-6), np.full(len(rows), 1e-5))

    def moved(place: int) -> np.ndarray:
        values = np.append(start, shares)
        values[place] += reach[place]
        instants = np.full(len(record.inputs), 0.5)
        instants[rows] = values[len(start) :]
        return replayer.motion(replace(record, instants=instants), values[: len(start)], p)

    instants = np.full(len(record.inputs), 0.5)
    instants[rows] = shares
    timed = replace(record, instants=instants)
    found, still = replayer.slopes_of_motion(timed, start, p, rows), replayer.motion(timed, start, p)
    for place, step in enumerate(reach):
        quotient = (moved(place) - still) / step
        assert (np.abs(found[..., place] - quotient) <= 0.01 * np.abs(quotient).max(axis=0) + 1e-6).all()
    assert np.abs(found).max(axis=(0, 1)).min() > 1e-3


def test_a_motion_that_exceeds_all_bounds_counts_as_one_without_change(tmp_path: Path) -> None:
    card, trials, _ = written(tmp_path, "model", 1)
    replayer = Replayer(card, trials.driven_by, noise_of("model"))
    p, record = replayer.model.parameter_values(), input_record(replayer, trials.trials[0])
    start = replayer.guess_initial_state(record, p)
    turning = start + 1e9 * (np.arange(len(start)) == replayer.model.state_names.index("motion.r"))
    found = replayer.slopes_of_motion(record, turning, p)
    assert np.isnan(replayer.motion(record, turning, p)).any()
    assert np.isfinite(found).all()
    assert np.abs(found[0, :, replayer.model.state_names.index("motion.psi")]).max() > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("hertz", [1, 2])
def test_a_delay_of_the_record_does_not_hide_the_instants(tmp_path: Path, hertz: int) -> None:
    """The true delay follows the zigzags to the noise; half an interval more or less does not."""
    made = made_of("model", ("rudder_time_offset",))
    write(sampled(made, hertz), tmp_path)
    text, delay = (tmp_path / "ship.toml").read_text(encoding="utf-8"), made.parameters["rudder_time_offset"]["delay_s"]
    misfits = []
    for off in (0.0, 0.8):
        effect = f'\n[[effects]]\nname = "rudder_time_offset"\n[effects.parameters]\ndelay_s = {delay + off / hertz}\n'
        card = parse_card(text + effect, "late.toml")
        assert isinstance(card, ManoeuvringCard)
        trials = measured([tmp_path / f"{name}.csv" for name in ZIGZAGS], card)
        card = polynomial_over_trials(card, trials.trials)
        replays = replay_trials(card, card, trials, noise_of("model"), held_out=False)
        misfits.append(max(replay.misfit("after") for replay in replays))
    assert misfits[0] < 1.6 and misfits[1] > 1.5 * misfits[0]


@pytest.mark.slow
def test_fine_records_are_taken_as_they_are(tmp_path: Path) -> None:
    card, trials, _ = written(tmp_path, "tanker", 10)
    noise = noise_of("tanker")
    replayer = Replayer(card, trials.driven_by, noise)
    p = replayer.model.parameter_values()
    record, _ = replayer.fit_record(input_record(replayer, replace(trials.trials[0])), p)
    assert record.instants is None
