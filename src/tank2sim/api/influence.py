"""Influence coefficients of a ship's card, and the card tuned to figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from tank2sim.analysis.ensemble.results import EnsembleRequest, FigureBands, named_bands
from tank2sim.analysis.influence.card_influence import CardInfluence, influence
from tank2sim.analysis.influence.figures import InfluenceFigure, parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.analysis.tuning.result import Means, Tuned, tuned_text
from tank2sim.analysis.tuning.targets import TARGET_OPTION, Target, parse_target
from tank2sim.analysis.tuning.tune import tune
from tank2sim.analysis.validation.standard_trials import craft_trials
from tank2sim.api.ensemble import FEW_IN_LANES, EnsembleOptions
from tank2sim.cards import Card, CraftCard
from tank2sim.cards.covariance_reading import derived_card
from tank2sim.errors import InputError
from tank2sim.native.compiler import find_compiler
from tank2sim.results.influence import InfluenceResult, TuningResult
from tank2sim.simulation.integrator import NO_COMPILER
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, StraightRun

if TYPE_CHECKING:
    from tank2sim.analysis.influence.card_influence import InfluenceStudy
    from tank2sim.dynamics.vessel import Vessel


DEFAULT_FIGURES = (
    "criterion_C",
    "steady_radius_m@20",
    "advance_m@35",
    "tactical_diameter_m@35",
    "overshoot1_deg@20/20",
)
"""Figures where none is given. Project choice: one of each kind that is looked at most."""

_INDEPENDENT = (
    "tuning takes standard errors as if they were independent: its bounds, and what counts as a small move, leave out "
    "the covariance next to the card"
)


def influence_of_ship(
    ship: Vessel, figures: Sequence[str], joint_variation: Mapping[str, float], ensemble: EnsembleOptions
) -> InfluenceResult:
    """Influence coefficients of a ship. Raises as :meth:`.Ship.influence`.

    Parameters
    ----------
    ship, figures, joint_variation
        As of :meth:`.Ship.influence`.
    ensemble : EnsembleOptions
        Of its bands.
    """
    card = ship.steered()
    asked = [parse_figure(text) for text in dict.fromkeys(figures)]
    if not asked:
        asked = craft_figures(card) if isinstance(card, CraftCard) else [parse_figure(text) for text in DEFAULT_FIGURES]
    study = Study(card, asked)
    found = _reported(influence(study, joint_variation))
    return InfluenceResult(replace(found, ensemble=_bands(ship, study, ensemble)), ship)


def craft_figures(card: CraftCard) -> list[InfluenceFigure]:
    """Figures of a craft where none is given: top speed, a turn by half of the largest difference, and a spin.

    Parameters
    ----------
    card : CraftCard
    """
    names = {StraightRun: ["final_speed_mps"], DifferenceTurn: ["steady_diameter_m", "steady_rate_degps"]}
    trials = craft_trials([card]).values()
    return [
        parse_figure(f"{name}@{trial.words}")
        for trial in trials
        for name in names.get(type(trial), ["final_rate_degps"])
    ]


def tune_ship(
    ship: Vessel, targets: Sequence[str], figures: Sequence[str], means: Means, ensemble: EnsembleOptions
) -> TuningResult:
    """Tune a ship's card to targets. Raises as :meth:`.Ship.tune`.

    Parameters
    ----------
    ship, targets, figures
        As of :meth:`.Ship.tune`.
    means : Means
        How the card may be changed.
    ensemble : EnsembleOptions
        Of the bands of its figures.
    """
    if not targets:
        raise InputError(TARGET_OPTION, "", "has no target", "give FIGURE=VALUE, as steady_radius_m@20=424")
    parsed: list[Target] = [parse_target(text) for text in targets]
    asked = [*(parse_figure(text) for text in figures), *(target.figure for target in parsed)]
    study = Study(ship.steered(), list(dict.fromkeys(asked)))
    tuned = tune(study, parsed, means)
    found = influence(study, means.agreed)
    after = dict(zip((figure.text for figure in study.figures), study.figures_at(tuned.values).tolist(), strict=True))
    card, notices = _tuned_card(ship, tuned) if tuned.reached else (None, ())
    if found.errors.together:
        notices = (_INDEPENDENT, *notices)
    reported = replace(_reported(found, notices), tuned=tuned.reported(after), ensemble=_bands(ship, study, ensemble))
    return TuningResult(reported, ship, card)


def _tuned_card(ship: Vessel, tuned: Tuned) -> tuple[Card, tuple[str, ...]]:
    """The tuned card, and notices on its covariance."""
    card = ship.steered()
    return derived_card(card, tuned_text(card, tuned), "the tuned card")


def _reported(found: CardInfluence, notices: Sequence[str] = ()) -> InfluenceStudy:
    """The study, with further notices."""
    compiler = () if find_compiler() else (NO_COMPILER,)
    return replace(found.reported(), notices=tuple(dict.fromkeys([*found.notices, *notices, *compiler])))


def _bands(ship: Vessel, study: Study, ensemble: EnsembleOptions) -> FigureBands | None:
    if not ensemble.members:
        return None
    names = [figure.text for figure in study.figures]
    with ensemble.computing(FEW_IN_LANES) as executor:
        return named_bands(ship.manoeuvring(), names, EnsembleRequest(ensemble.members, ensemble.seed), executor)
