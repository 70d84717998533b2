"""The screen against least squares written out, and against effects hidden in trials of a ship typed by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.fit_all import Fitting
from tank2sim.gap.inference.hypothesis import Hypothesis
from tank2sim.gap.inference.kalman_filter import observer
from tank2sim.gap.inference.likelihood import COUNTED, Likelihood
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.gap.search.explanations import _proposals
from tank2sim.gap.search.screening import LEAST_AMPLITUDE, Screen, Screened, Variant, variants
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tests.identification.trials import made_up_ship
from tests.identification.trials.made_up_ship import TRUTH

EFFECTS = ("linear_yaw_damping", "current", "gyro_bias", "cubic_yaw_damping", "hull_fouling", "rudder_time_offset")
INCREASE = 0.25
"""By which the hidden ship's damping in yaw exceeds that of the card."""


@pytest.fixture(scope="module")
def card() -> ManoeuvringCard:
    read = parse_card(made_up_ship.CARD, "made_up.toml")
    assert isinstance(read, ManoeuvringCard)
    return read


def judged(card: ManoeuvringCard, truth=None, *, bias: float = 0.0, flow=(0.0, 0.0)) -> Likelihood:
    trials = [
        made_up_ship.trial(made_up_ship.zigzag(20), name="zigzag", duration=200, step=0.5, truth=truth),
        made_up_ship.trial(made_up_ship.turn(30), name="turn", duration=150, step=0.5, truth=truth, seed=2),
    ]
    for trial in trials:
        trial.signals["r_radps"][:] += bias
        for name, speed in zip(("x_m", "y_m"), flow, strict=True):  # velocities are through the water
            trial.signals[name][:] += speed * trial.time_s
    return likelihood_from_card(card, Measured(tuple(trials), "angle", ()))


@pytest.fixture(scope="module")
def damped(card) -> Likelihood:
    return judged(card, {**TRUTH, "Yr": (1 + INCREASE) * TRUTH["Yr"], "Nr": (1 + INCREASE) * TRUTH["Nr"]}, bias=0.001)


def none_of(likelihood: Likelihood) -> ExplanationFit:
    return likelihood.at_best(likelihood.none, np.zeros(0), [likelihood.belief.logs], [15])


def every(likelihood: Likelihood, names=EFFECTS) -> list[Variant]:
    card = likelihood.none.card
    return [variant for name in names for variant in variants(likelihood, Hypothesis(card, "angle", [name]))]


@pytest.fixture(scope="module")
def screened(damped) -> Screen:
    return Screen(damped, none_of(damped), every(damped))


def least_squares(likelihood: Likelihood, base: ExplanationFit, chosen: list[Variant]) -> tuple[float, np.ndarray]:
    """Least cost over what is there, the coefficients and the amplitudes of `chosen`; and these."""
    seen = observer(
        likelihood.linear(base.hypothesis, base.theta) if base.hypothesis.effects else likelihood.base, base.noise
    )
    columns_of_base = likelihood.columns(base.hypothesis, base.theta, likelihood.coefficient_columns).scaled(base.width)

    def rows(driving, shown):
        white = seen.whiten(driving, shown)
        return white.reshape(-1, white.shape[-1])

    columns = [rows(columns_of_base.driving, columns_of_base.shown)]
    # what the sensors show is left over by the effect: the residual has the opposite sign
    columns += [rows(variant.driving, -variant.shown) for variant in chosen]
    residual, held = columns[0][:, :1], columns[0][:, 1:]
    design = np.hstack([held, *columns[1:]])
    mean, precision = base.hypothesis.prior
    deviations = np.concatenate([np.sqrt(precision), np.ones(held.shape[1] - columns_of_base.parameter_count)])
    known = np.hstack([np.diag(deviations), np.zeros((held.shape[1], design.shape[1] - held.shape[1]))])
    away = np.concatenate(
        [np.sqrt(precision) * (base.theta - mean), np.zeros(held.shape[1] - columns_of_base.parameter_count)]
    )
    whole, target = np.vstack([design, known]), -np.concatenate([residual[:, 0], away])
    scale = np.linalg.norm(whole, axis=0)
    scale[scale == 0] = 1.0
    found = np.linalg.lstsq(whole / scale, target, rcond=1e-14)[0] / scale
    return float(np.sum((whole @ found - target) ** 2)), found[held.shape[1] :]


def allowed(variant: Variant, shares: np.ndarray) -> bool:
    """Whether the bounds allow the signs of the amplitudes."""
    places = list(variant.amplitudes)
    sizes = variant.theta[places] * shares[: len(places)]
    low, high = (bound[places] for bound in variant.hypothesis.bounds)
    return bool(np.all((sizes >= 0) | (low < 0)) and np.all((sizes <= 0) | (high > 0)))


def check(screen: Screen, base: ExplanationFit, places: list[int]) -> None:
    likelihood, chosen = screen.likelihood, [screen.every[place] for place in places]
    before, _ = least_squares(likelihood, base, [])
    after, shares = least_squares(likelihood, base, chosen)
    asked = sum(len(variant.theta) for variant in chosen)
    gain, found = screen.of(places)
    ends = np.cumsum([variant.driving.shape[-1] for variant in chosen])[:-1]
    if all(allowed(variant, part) for variant, part in zip(chosen, np.split(shares, ends), strict=True)):
        assert found == pytest.approx(shares, rel=1e-4, abs=1e-6)
        assert gain == pytest.approx(before - after - asked * np.log(likelihood.count / COUNTED), rel=1e-6, abs=1e-4)
    else:
        assert gain < 0 and np.all(found == 0)


def test_gains_are_those_of_least_squares(screened) -> None:
    none = none_of(screened.likelihood)
    for place in range(len(screened.every)):
        check(screened, none, [place])
    for a, b in ((0, 2), (0, 9), (10, 11), (4, 0)):
        check(screened, none, [a, b])


def test_a_screen_at_another_noise_and_width_is_the_one_that_begins_there(damped, screened) -> None:
    none = none_of(damped)
    louder = replace(none, logs=none.logs + np.log(2.0))
    moved, begun = screened.at(louder), Screen(damped, louder, screened.every)
    np.testing.assert_allclose(moved.gram, begun.gram, rtol=1e-9, atol=1e-9 * np.abs(begun.gram).max())
    assert moved.cost == pytest.approx(begun.cost, rel=1e-12) != screened.cost
    assert [one.gain for one in moved.singles()] == pytest.approx([one.gain for one in begun.singles()])


def test_gains_next_to_an_effect_that_is_there_are_those_of_least_squares(card, damped) -> None:
    """Also where something is known of its parameters, and away from the best ones."""
    assumed = Hypothesis(card, "angle", ["wave_drift"])
    logs = none_of(damped).logs
    theta = np.where(assumed.prior[1] > 0, assumed.prior[0] + 0.2, 1.0)
    base = ExplanationFit(assumed, theta, np.eye(len(theta)), logs, 0.0, np.zeros(0))
    screen = Screen(damped, base, every(damped, ("linear_yaw_damping", "gyro_bias", "wave_drift")))
    assert {variant.effect for variant in screen.every} == {"linear_yaw_damping", "gyro_bias"}
    check(screen, base, [0])
    check(screen, base, [0, 1])


def test_two_hidden_effects_are_the_first_pair_at_the_right_sizes(screened) -> None:
    best, second, *_ = screened.pairs()
    assert set(best.effects) == {"linear_yaw_damping", "gyro_bias"} and best.gain > second.gain
    assert best.thetas["linear_yaw_damping"] == pytest.approx([INCREASE], rel=0.3)
    assert best.thetas["gyro_bias"] == pytest.approx([0.001], rel=0.15)
    gains = [pair.gain for pair in screened.pairs()]
    assert gains == sorted(gains, reverse=True) and len(gains) == len(EFFECTS) * (len(EFFECTS) - 1) // 2


def test_a_small_hidden_amplitude_is_found_alone_at_its_size(card) -> None:
    likelihood = judged(card, bias=4e-4)
    screen = Screen(likelihood, none_of(likelihood), every(likelihood))
    best, second, *_ = screen.singles()
    assert best.effects == ("gyro_bias",) and best.gain > second.gain + 5
    assert best.thetas["gyro_bias"] == pytest.approx([4e-4], rel=0.15)


def test_singles_are_the_best_variant_of_each_effect(screened) -> None:
    singles = screened.singles()
    assert sorted(single.effects[0] for single in singles) == sorted(EFFECTS)
    for single in singles:
        gains = [
            screened.of([place])[0]
            for place, variant in enumerate(screened.every)
            if variant.effect == single.effects[0]
        ]
        assert single.gain == max(gains)
    assert [single.gain for single in singles] == sorted((single.gain for single in singles), reverse=True)


def test_a_search_begins_at_something_and_within_the_bounds(screened) -> None:
    card = screened.likelihood.none.card
    asked = {name: Hypothesis(card, "angle", [name]).estimated for name in EFFECTS}
    for proposal in (*screened.singles(), *screened.pairs()):
        for name, theta in proposal.thetas.items():
            for value, parameter in zip(theta, (each.parameter for each in asked[name]), strict=True):
                assert parameter.minimum <= value <= parameter.maximum
                if parameter.absent is not None:
                    least = LEAST_AMPLITUDE * abs(parameter.typical_values(card)[0])
                    assert abs(value - parameter.absent) > 0.99 * least, proposal.effects


def test_a_current_is_never_begun_with_backwards(card) -> None:
    """A negative share of a speed is another direction's; in its bounds it would be no current at all."""
    likelihood = judged(card, flow=(0.3 * np.cos(0.8), 0.3 * np.sin(0.8)))
    screen = Screen(likelihood, none_of(likelihood), every(likelihood, ("current", "gyro_bias")))
    best, _ = screen.singles()
    assert best.thetas["current"] == pytest.approx([0.3, np.pi / 4], rel=0.1)
    flows = [place for place, variant in enumerate(screen.every) if variant.effect == "current"]
    backwards = [place for place in flows if np.cos(screen.every[place].theta[1] - 0.8) < -0.5]
    assert backwards and all(screen.of([place])[0] < 0 for place in backwards)
    (pair,) = screen.pairs()
    assert pair.gain == max(screen.of([place, len(screen.every) - 1])[0] for place in flows)


def test_variants_are_all_typical_shapes_at_the_typical_size(card, damped) -> None:
    current = variants(damped, Hypothesis(card, "angle", ["current"]))
    assert len(current) == 8 and {variant.amplitudes for variant in current} == {(0,)}
    assert current[0].driving.shape == (*damped.motion.block_states.shape[:2], 6, 1)
    (cubic,) = variants(damped, Hypothesis(card, "angle", ["cubic_yaw_damping"]))
    assert cubic.amplitudes == (0, 1) and cubic.driving.shape[-1] == 2
    # each amplitude alone; together they add, for both are linear
    whole, _ = damped.added(cubic.hypothesis, cubic.theta)
    assert cubic.driving.sum(axis=-1) == pytest.approx(whole)
    assert cubic.start(np.array([2.0, -0.5])) == pytest.approx(cubic.theta * [2.0, -0.5])
    assert cubic.start(np.array([0.0, -0.001])) == pytest.approx(cubic.theta * [LEAST_AMPLITUDE, -LEAST_AMPLITUDE])


def test_a_faulty_sensor_adds_to_what_is_shown_alone(card, damped) -> None:
    (gyro,) = variants(damped, Hypothesis(card, "angle", ["gyro_bias"]))
    place = damped.motion.seen.index("motion.r")
    assert np.all(gyro.driving == 0)
    inside = damped.motion.inside
    assert gyro.shown[inside][:, place, 0] == pytest.approx(np.full(inside.sum(), gyro.theta[0]))
    assert np.all(np.delete(gyro.shown[inside], place, axis=1) == 0)


def test_two_forms_of_one_effect_are_not_proposed_together() -> None:
    nothing = np.zeros(1)
    screened = [
        Screened({first: nothing, second: nothing}, 100.0)
        for first, second in [("loaded_rudder", "rudder_slipstream"), ("loaded_rudder", "current")]
    ]
    fitting = cast(Fitting, SimpleNamespace(found={}))
    assert [proposal.effects for proposal in _proposals(fitting, screened, [])] == [("current", "loaded_rudder")]
