"""Captive tests as equations in a model's parameters: against derivatives that made them, and together with a trial."""

from dataclasses import replace

import numpy as np
import pytest

from tank2sim.cards import parse_card
from tank2sim.errors import InputError
from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.identification.captive.result_card import card_contents, reduced_card_text
from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns, captive_tests
from tank2sim.identification.trials.problem.estimation_problem import driven_model
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import Campaign, write

QUIET = Campaign(seed=4, noise=0.0, zero_error=0.0, vibration=False, rate_hz=10.0)


@pytest.fixture(scope="module")
def posed(tmp_path_factory):
    """Campaign without noise, its truth, the ship's card at 25 times the model's size, and the equations."""
    written = write(QUIET, tmp_path_factory.mktemp("campaign"))
    campaign = read_campaign(written.path)
    reduction = reduce_campaign(campaign)
    card = parse_card(reduced_card_text(reduction, card_contents(reduction), 25.0), "ship.toml")
    free = tuple(f"derivatives.{name}" for name in reduction.derivatives if name[0] in "YN")
    model = driven_model(card, "angle")
    return (
        campaign,
        written.derivatives,
        card,
        model,
        captive_tests(card, model, free, CaptiveRuns(campaign, reduction.runs)),
        free,
    )


def solved(tests, model, start):
    """One Gauss-Newton step from `start`, by the equations of Y and N: exact, since forces are linear in these."""
    residual, slopes = tests.residuals(model.parameter_values(start))
    lateral = tests.force > 0
    step = np.linalg.lstsq(slopes[lateral], -residual[lateral], rcond=None)[0]
    return dict(zip(start, np.array(list(start.values())) + step, strict=True))


@pytest.mark.slow
def test_the_derivatives_that_made_the_forces_come_back_at_another_scale(posed):
    _, truth, card, model, tests, free = posed
    found = solved(tests, model, {name: 0.5 * card.derivatives[name.partition(".")[2]] for name in free})
    for name, value in found.items():
        assert value == pytest.approx(truth[name.partition(".")[2]], rel=3e-4, abs=1e-10), name


def test_equations_in_some_of_the_parameters_are_those_columns(posed):
    _, _, _, model, tests, free = posed
    p = model.parameter_values()
    some, every = tests.of([3, 1]).residuals(p)[1], tests.residuals(p)[1]
    np.testing.assert_allclose(some, every[:, [3, 1]], rtol=1e-12, atol=1e-15)
    assert len(free) == every.shape[1]


def test_a_gain_between_tank_and_ship_costs_little_and_a_misfit_much(posed):
    """2 % more of Y alone is within the gain's standard error of 5 %; a term that is off by as much is not."""
    _, _, card, model, tests, free = posed
    sharp = replace(tests, noise=np.full(3, 1e-6))
    p = model.parameter_values()
    exact = sharp.normal(p)[2]
    gained = replace(sharp, measured=np.where(sharp.force == 1, 1.02 * sharp.measured, sharp.measured)).normal(p)[2]
    other = model.parameter_values({"derivatives.Yvvv": 1.3 * card.derivatives["Yvvv"]})
    assert gained - exact < 1.0
    assert sharp.normal(other)[2] - exact > 1e3
    information = sharp.normal(p)[0]
    assert np.linalg.eigvalsh(information).min() > -1e-6 * np.abs(information).max() and len(information) == len(free)


def test_a_campaign_of_another_form_is_refused_by_its_key(posed):
    campaign, _, card, model, _, free = posed
    wide = replace(campaign, model=campaign.model.model_copy(update={"beam_m": 1.3 * campaign.model.beam_m}))
    if not card.ship.beam_m:
        pytest.skip("the campaign of the generator states no beam")
    with pytest.raises(InputError) as caught:
        captive_tests(card, model, free, CaptiveRuns(wide, ()))
    assert caught.value.place == "model.beam_m" and "ship.toml" in caught.value.problem
