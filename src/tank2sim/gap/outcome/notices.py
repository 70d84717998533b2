"""Notices on a gap besides the verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.strangeness import Strange, trial_consistency
from tank2sim.gap.inference.wave_band import WaveBand
from tank2sim.gap.proof.cross_check import MUCH, worse_trials
from tank2sim.gap.proof.judge import Judged
from tank2sim.gap.proof.refit import effects_like
from tank2sim.gap.result import AMBIGUOUS, MISSING, OUTSIDE_LIBRARY, misfit_of
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.structures import structure_that_adds
from tank2sim.notices import Notice

SHOWN = 5
"""Names of effects in a notice at most (project choice)."""

DOUBT = 1e-3
"""Probability below which trials that disagree about a parameter are reported."""


def gap_notices(
    card: SteeredCard,
    judged: Judged,
    agreement: Mapping[str, Mapping[str, tuple[float, float]]],
    trials: tuple[Measured, Measured],
    waves: WaveBand | None,
) -> tuple[Notice, ...]:
    """Notices besides the verdict, one sentence each.

    Parameters
    ----------
    card : SteeredCard
        As given.
    judged : Judged
    agreement : mapping
        Variable of an effect to the name of a trial to its value and standard error by this trial alone.
    trials : tuple of Measured
        Fitted ones and those held out, as given.
    waves : WaveBand, optional
        Found in the fitted trials.
    """
    named = {name for name, *_ in judged.proof.named.estimated}
    notices = [
        *trials[0].notices,
        *trials[1].notices,
        *_partly_measured(trials[0]),
        *([Notice(_of_waves(waves))] if waves else []),
        *([Notice(judged.by_simulation)] if judged.by_simulation else []),
        *(Notice(_in_words(strange)) for strange in judged.decision.strange),
        *_of_names(card, judged, held_out=bool(trials[1].trials)),
        *(_of_what_remains(card, judged) if judged.decision.verdict != OUTSIDE_LIBRARY else []),
    ]
    notices += [
        Notice(
            f"{name}: these trials cannot distinguish it from an error of {coefficient.name}, now "
            f"{coefficient.moved:.2g} standard errors off"
        )
        for name, coefficient in effects_like(card, judged.proof.coefficients, named).items()
    ]
    if judged.decision.verdict in (MISSING, AMBIGUOUS):
        notices += [
            Notice(f"{name}: the improved card follows it worse than the given one")
            for name in worse_trials(judged.proof.results)
        ]
    for variable, values in agreement.items():
        if len(values) > 1 and (said := trial_consistency(values)).p < DOUBT:
            notices.append(Notice(f"the trials do not agree about {variable} (Cochran Q {said.q:.3g}, p {said.p:.1g})"))
    return tuple(dict.fromkeys(notices))


def _of_names(card: SteeredCard, judged: Judged, *, held_out: bool) -> list[Notice]:
    """Notices of effects that are withheld, fitted to trials held out, or on the card."""
    notices = []
    if judged.withheld:
        notices.append(
            Notice(
                f"{judged.withheld}: fits best from instant to instant, but simulations with it are no closer than "
                "without: not named"
            )
        )
    if held_out and judged.proof.named.by_trial:
        notices.append(
            Notice(
                f"{' and '.join(judged.proof.named.by_trial)} of the trials held out: fitted to each of them, two "
                "numbers to a record; all else is as the fitting trials have it"
            )
        )
    if card.effects:
        have = ", ".join(entry.name for entry in card.effects)
        notices.append(Notice(f"{have}: kept as on the card, and not sought"))
    return notices


def _of_what_remains(card: SteeredCard, judged: Judged) -> list[Notice]:
    """That the trials are still missed by far, and how the named effects are fitted together with the hull."""
    remaining = misfit_of(judged.proof.results, "after")
    if remaining <= MUCH:
        return []
    much = f"missed by {remaining:.3g} times the noise" if math.isfinite(remaining) else "not followed (one diverges)"
    notices = [
        Notice(
            f"all trials together are still {much}: gusts, waves, coefficients that "
            "are off, or something more that is missing; the standard errors do not cover it"
        )
    ]
    effects = judged.decision.best.hypothesis.effects
    by_rudder = card.steered_by is SteeredBy.RUDDER
    if structure := structure_that_adds(card.manoeuvring(), effects) if by_rudder else None:
        notices.append(
            Notice(
                f"identify with structure {structure} fits {' and '.join(effects)} to the trials together with the "
                "hull's derivatives, from the card as it was given"
            )
        )
    return notices


def of_tried_effects(tried: Sequence[str], possible: Sequence[str]) -> tuple[Notice, ...]:
    """That not all effects were tried which the card and the trials allow; empty if all were."""
    if set(possible) <= set(tried):
        return ()
    count = f"{len(possible)} possible effects; another one may be missing"
    left_out = [name for name in possible if name not in tried]
    if len(left_out) < min(len(tried), SHOWN + 1):
        return (Notice(f"not tried, as asked: {', '.join(left_out)} of {count}"),)
    shown = ", ".join(tried) if len(tried) <= SHOWN else f"{len(tried)}"
    return (Notice(f"tried, as asked: {shown} of {count}"),)


def _partly_measured(fitted: Measured) -> list[Notice]:
    """Notices of winds and currents that some of the fitted trials recorded, and not all."""
    notices = []
    for name, effect in EFFECTS.items():
        signals = set(effect.measured_as.values()) if effect.surroundings else set()
        having = [trial.name for trial in fitted.trials if signals and signals <= set(trial.signals)]
        if 0 < len(having) < len(fitted.trials):
            notices.append(
                Notice(
                    f"{name} was measured in {len(having)} of {len(fitted.trials)} trials ({', '.join(having)}). It is "
                    "not used, but estimated in each trial: give its columns in all trials, or only trials with them"
                )
            )
    return notices


def _of_waves(waves: WaveBand) -> str:
    speed, rate = waves.motion["motion.v"], np.rad2deg(waves.motion["motion.r"])
    return (
        f"waves or a swell with a period of {waves.period_s:.3g} s move the ship in the fitted trials (standard "
        f"deviation {speed:.2g} m/s in sway, {rate:.2g} deg/s in yaw): counted as noise, not as a missing effect; "
        f"{' and '.join(name for name, effect in EFFECTS.items() if effect.resonant)}, which they hide, is not sought"
    )


def _in_words(strange: Strange) -> str:
    when = f"from {strange.begin_s:.0f} to {strange.end_s:.0f} s"
    if strange.kind == "period":
        return f"all trials: an oscillation with a period of {strange.begin_s:.3g} s that no tried effect causes"
    return f"{strange.trial}: {when} a motion of the ship that no tried effect explains"
