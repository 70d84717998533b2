"""What of a card may be wrong, by itself and together with others, and what is believed of the noise."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.gap.inference.hypothesis import CLOCK, Hypothesis
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.inference.prior import LARGEST_SHARE, likelihood_from_card
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tests.identification.trials import made_up_ship
from tests.identification.trials.made_up_ship import ESTIMATED, TRUTH

STEP = 0.5
GEAR = "\nmax_rate_degps = 3.0"
STATED = {"Nr": 0.1, "Yd": 0.5}
"""Shares of their values by which a card says that two of its derivatives may be wrong."""


def posed(
    *,
    by_angle: bool = True,
    gear: str = "time_constant_s = 0.5" + GEAR,
    stated: bool = False,
    duration: float = 60,
    step: float = STEP,
) -> Likelihood:
    text = made_up_ship.CARD.replace("time_constant_s = 0.5", gear)
    if stated:
        text += "\n[uncertainty]\n" + "\n".join(f"{name} = {abs(TRUTH[name]) * s}" for name, s in STATED.items())
    card = parse_card(text, "made_up.toml")
    assert isinstance(card, ManoeuvringCard)
    trial = made_up_ship.trial(made_up_ship.zigzag(20), duration=duration, step=step)
    if not by_angle:
        trial.signals["delta_order_rad"] = trial.signals.pop("delta_rad")
    return likelihood_from_card(card, Measured((trial,), "angle" if by_angle else "order", ()))


def individual(likelihood: Likelihood) -> dict[str, int]:
    """Name to the place of the first cause that changes it alone."""
    mixing = likelihood.coefficients.mixing
    alone = np.flatnonzero(np.count_nonzero(mixing, axis=0) == 1)
    found: dict[str, int] = {}
    for cause in alone:
        name = likelihood.coefficients.names[int(np.flatnonzero(mixing[:, cause])[0])]
        found.setdefault(name, int(cause))
    return found


def row(likelihood: Likelihood, name: str) -> np.ndarray:
    """Errors of a coefficient that it may share with others, in its own standard error."""
    place = likelihood.coefficients.names.index(name)
    mixing, own = likelihood.coefficients.mixing, individual(likelihood)
    shared: np.ndarray = np.delete(mixing[place], list(own.values())) / mixing[place, own[name]]
    return shared


def test_each_coefficient_is_wrong_by_its_own_standard_error() -> None:
    likelihood = posed(stated=True)
    mixing, own = likelihood.coefficients.mixing, individual(likelihood)
    assert set(own) == set(likelihood.coefficients.names)
    errors = {name: mixing[likelihood.coefficients.names.index(name), place] for name, place in own.items()}
    for name in ESTIMATED:
        assert errors[f"derivatives.{name}"] == pytest.approx(STATED.get(name, 0.02) * abs(TRUTH[name])), name
    assert errors["derivatives.Nrdot"] == pytest.approx(0.02 * abs(TRUTH["Nrdot"]))


GROUPS = (
    ("Yv", "Yr"),
    ("Nv", "Nr"),
    ("Yvvv",),
    ("Nvvr",),
    ("Xu", "Xvv", "Xvr"),
    ("Xdd", "Yd", "Nd"),
    ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot"),
)
"""Terms that come from the same tests: oblique towing and rotating arm, speed, rudder, and pure motions."""


def test_terms_of_the_same_tests_are_all_too_large_or_all_too_small() -> None:
    likelihood = posed()
    rows = {name: row(likelihood, f"derivatives.{name}") for group in GROUPS for name in group}
    assert likelihood.coefficients.mixing.shape[1] - len(likelihood.coefficients.names) == len(GROUPS)
    seen = []
    for group in GROUPS:
        (cause,) = {int(np.flatnonzero(rows[name])[0]) for name in group}
        seen.append(cause)
        for name in group:
            assert np.count_nonzero(rows[name]) == 1
            # too large all of them, whatever their signs
            assert rows[name][cause] == pytest.approx(np.sign(TRUTH[name])), name
    assert len(set(seen)) == len(GROUPS)
    errors = dict(zip(likelihood.coefficients.names, likelihood.coefficients.errors, strict=True))
    assert errors["derivatives.Nr"] == pytest.approx(np.sqrt(2) * 0.02 * abs(TRUTH["Nr"]))


def test_a_group_is_not_wrong_by_more_than_a_tenth() -> None:
    likelihood = posed(stated=True)
    assert np.abs(row(likelihood, "derivatives.Nr")).max() == pytest.approx(1.0)
    assert np.abs(row(likelihood, "derivatives.Yd")).max() == pytest.approx(LARGEST_SHARE / STATED["Yd"])


@pytest.mark.parametrize(("gear", "share"), [("time_constant_s = 0.5" + GEAR, 0.02), (GEAR, 0.5)])
def test_the_gear_is_as_uncertain_as_a_coefficient_unless_it_was_assumed(gear: str, share: float) -> None:
    likelihood = posed(by_angle=False, gear=gear)
    errors = dict(zip(likelihood.coefficients.names, likelihood.coefficients.errors, strict=True))
    model = likelihood.none.model
    assumed = dict(zip(model.parameter_names, model.parameter_values(), strict=True))["steering.time_constant"]
    assert errors["steering.max_rate"] == pytest.approx(0.02 * np.deg2rad(3.0))
    assert errors["steering.time_constant"] == pytest.approx(share * assumed)
    assert np.all(row(likelihood, "steering.max_rate") == 0)


def test_of_a_measured_angle_what_the_gear_is_wrong_by_does_not_show() -> None:
    for by_angle in (True, False):
        likelihood = posed(by_angle=by_angle)
        places = [place for name, place in individual(likelihood).items() if name.startswith("steering.")]
        assert bool(np.any(likelihood.coefficient_columns[..., places])) != by_angle


@pytest.mark.parametrize("by_angle", [True, False])
def test_the_rudder_s_clock_is_known_to_half_a_sample(by_angle: bool) -> None:
    likelihood = posed(by_angle=by_angle)
    errors = dict(zip(likelihood.coefficients.names, likelihood.coefficients.errors, strict=True))
    assert errors[CLOCK] == pytest.approx(0.5 * STEP)
    # and its column is one of those that are integrated out
    place = individual(likelihood)[CLOCK]
    assert np.abs(likelihood.coefficient_columns[..., place]).max() > 0


@pytest.mark.parametrize("by_angle", [True, False])
@pytest.mark.parametrize("step", [0.5, 2.0])
def test_an_error_of_the_clock_does_what_a_late_rudder_does(by_angle: bool, step: float) -> None:
    likelihood = posed(by_angle=by_angle, step=step, duration=120)
    late = Hypothesis(likelihood.none.card, likelihood.none.driven_by, ("rudder_time_offset",))
    delay_s = 0.2 * step
    driving, _ = likelihood.added(late, np.array([delay_s]))
    by_clock = likelihood.coefficient_columns[..., individual(likelihood)[CLOCK]] * delay_s / (0.5 * step)
    np.testing.assert_allclose(by_clock, driving, atol=0.05 * np.abs(driving).max())
    # which therefore takes its place
    assert not likelihood.of_coefficients(late, np.array([delay_s]))[..., individual(likelihood)[CLOCK]].any()


def test_how_well_the_hull_is_known_says_nothing_of_gear_and_clock() -> None:
    likelihood = posed(by_angle=False)
    coefficients = likelihood.coefficients
    ratio = np.diag(coefficients.spread(2.0) @ coefficients.spread(2.0).T) / coefficients.errors**2
    for name, grown in zip(coefficients.names, ratio, strict=True):
        assert grown == pytest.approx(4.0 if name.startswith("derivatives.") else 1.0), name


def test_each_change_of_the_order_has_an_instant_of_its_own_within_a_sampling_interval() -> None:
    likelihood = posed(by_angle=False, duration=90)
    causes = likelihood.coefficients.mixing.shape[1]
    moves, clock = likelihood.coefficient_columns[..., causes:], individual(likelihood)[CLOCK]
    assert moves.shape[-1] == 2  # of the zigzag in 90 s: to 20 deg at 10 s, to the other side 50 s later
    late = likelihood.coefficient_columns[..., clock] / (0.5 * STEP)
    np.testing.assert_allclose(moves.sum(axis=-1), late * STEP / np.sqrt(12), atol=1e-12)
    begins = [
        likelihood.motion.times[0][np.flatnonzero(np.abs(moves[0, :, :, k]).max(axis=1) > 1e-12)[0]] for k in (0, 1)
    ]
    assert begins == pytest.approx([10.0, 60.0], abs=2 * likelihood.motion.block_s)
    assert not likelihood_of_angle().coefficient_columns[..., causes:].any()


def likelihood_of_angle() -> Likelihood:
    return posed(by_angle=True)


def test_noise_is_believed_to_be_that_of_the_trials() -> None:
    likelihood = posed()
    motion, believed = likelihood.motion, likelihood.belief
    from_logs = np.exp(believed.logs)
    ny = len(motion.seen)
    assert from_logs[:ny] == pytest.approx(motion.noise)
    assert from_logs[2 * ny : 3 * ny] == pytest.approx(np.full(ny, 3 * made_up_ship.LENGTH / made_up_ship.SPEED))
    assert from_logs[-1] == 1.0 and len(believed.logs) == len(believed.spread) == 3 * ny + 7
