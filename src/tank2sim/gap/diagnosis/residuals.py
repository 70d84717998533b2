"""Residuals of a fitted explanation: the missing force, and the estimates of each trial."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.dynamics.effects.forces import with_forces
from tank2sim.dynamics.model import Parameter
from tank2sim.gap.diagnosis.misfit_location import effect_passages, missing_force_by_state
from tank2sim.gap.improve_card import Found
from tank2sim.gap.inference.fit import ExplanationFit
from tank2sim.gap.inference.hypothesis import Hypothesis, parameter_places
from tank2sim.gap.inference.kalman_filter import FORCE_STATES
from tank2sim.gap.inference.likelihood import Likelihood
from tank2sim.gap.result import Acting, MissingForce, Surroundings


def force_lacking(likelihood: Likelihood, fit: ExplanationFit) -> MissingForce | None:
    """The force that an explanation lacks, as the smoother needs it to follow the measurements."""
    motion, hypothesis = likelihood.motion, fit.hypothesis
    states, spread = likelihood.smooth(fit)
    inertia = _inertia(hypothesis)
    force = np.einsum("ij,rtj->rti", inertia, states[..., 6 : 6 + FORCE_STATES])
    errors = np.sqrt(np.einsum("ij,rtjk,ik->rti", inertia, spread, inertia))
    part = motion.inside[:, :-1]  # inputs and states between the blocks
    u, v, r, psi, _, _ = np.moveaxis(motion.block_states, -1, 0)
    columns = {
        "rudder": hypothesis.steered(motion.block_inputs),
        "drift": -np.arcsin(np.clip(v / np.maximum(np.hypot(u, v), 1e-9), -1, 1)),
        "yaw rate": r,
        "speed": np.hypot(u, v),
        "heading": psi,
    }
    names = np.repeat(np.array(motion.names)[:, None], part.shape[1], axis=1)[part]
    return missing_force_by_state(
        list(names),
        motion.times[:, :-1][part],
        force[:, :-1][part],
        errors[:, :-1][part],
        {name: values[part] for name, values in columns.items()},
    )


def effects_at_work(likelihood: Likelihood, fit: ExplanationFit) -> tuple[Acting, ...]:
    """Intervals in which the forces of an explanation's effects act (:func:`.misfit_location.effect_passages`)."""
    motion, hypothesis = likelihood.motion, fit.hypothesis
    spread = likelihood.smooth(fit)[1]
    inertia = _inertia(likelihood.none)
    driving, _ = likelihood.added(hypothesis, fit.theta)
    force = np.einsum("ij,rtj->rti", inertia, driving[..., :FORCE_STATES] / motion.block_s)
    errors = np.sqrt(np.einsum("ij,rtjk,ik->rti", inertia, spread, inertia))[:, :-1]
    part = motion.inside[:, 1:]
    names = np.repeat(np.array(motion.names)[:, None], part.shape[1], axis=1)[part]
    return effect_passages(list(names), motion.times[:, :-1][part], force[part], errors[part])


def _inertia(hypothesis: Hypothesis) -> Array:
    """Mass matrix (3, 3): forces X, Y (N) and N (N m) by accelerations of surge, sway and yaw at the design speed."""
    pushes = [Parameter(name=f"push.{axis}", unit="1", description="A force", start=0.0) for axis in "XYN"]
    X, Y, N = (push.symbol for push in pushes)
    model = with_forces(hypothesis.model.extend(*pushes), X=X, Y=Y, N=N)
    places = [model.state_names.index(name) for name in ("motion.u", "motion.v", "motion.r")]
    slope = ca.jacobian(model.rates[places], ca.vertcat(X, Y, N))
    mobility = ca.Function("mobility", [model.x, model.u, model.p], [slope])
    p = model.parameter_values()
    return np.linalg.inv(np.array(mobility(np.array(model.initial(p)).ravel(), model.input_values(), p)))


def each_trial(likelihood: Likelihood, fit: ExplanationFit) -> dict[str, dict[str, tuple[float, float]]]:
    """Estimates of the effects' parameters by each trial alone: variable to {trial: (value, standard error)}.

    Not of parameters that act in one trial only. The other parameters have the covariance of the fit to all trials;
    the card's coefficients and the forms of the effects as before.
    """
    whitened, _ = likelihood.whiten(fit)
    k = len(fit.theta)
    estimated = fit.hypothesis.estimated
    shared = parameter_places(estimated)
    by_trial: dict[str, dict[str, tuple[float, float]]] = {estimated[place].variable: {} for place in shared}
    for run, name in enumerate(likelihood.motion.names):
        flat = whitened[run].reshape(-1, whitened.shape[-1])
        gram = flat.T @ flat
        held = gram[1 + k :, 1 + k :] + np.eye(len(gram) - 1 - k)
        mixed = gram[: 1 + k, 1 + k :]
        reduced = gram[: 1 + k, : 1 + k] - mixed @ np.linalg.solve(held, mixed.T)
        for place in shared:
            remaining = np.delete(np.arange(k), place)
            prior = np.linalg.inv(fit.covariance[np.ix_(remaining, remaining)] + 1e-300 * np.eye(k - 1))
            rows, columns = 1 + remaining, np.array([1 + place, 0])
            solved = np.linalg.solve(reduced[np.ix_(rows, rows)] + prior, reduced[np.ix_(rows, columns)])
            information, pull = reduced[1 + place, columns] - reduced[1 + place, rows] @ solved
            if information > 0:
                value = float(fit.theta[place] - pull / information)
                by_trial[estimated[place].variable][name] = value, float(1 / np.sqrt(information))
    return by_trial


def estimates(fit: ExplanationFit) -> list[Found]:
    """Each effect of a fit with its parameters and their standard errors, SI, by the names of the parameters.

    Those of single trials are in :func:`surroundings_by_trial`. What the trials do not determine at all (an angle
    between two orders) has the standard deviation of a uniform distribution between its bounds.
    """
    low, high = fit.hypothesis.bounds
    errors = np.minimum(np.sqrt(np.maximum(np.diag(fit.covariance), 0.0)), (high - low) / np.sqrt(12))
    found: list[Found] = []
    for effect in fit.hypothesis.effects:
        places = parameter_places(fit.hypothesis.estimated, effect)
        names = [fit.hypothesis.estimated[place].parameter.name for place in places]
        values, spread = (map(float, numbers[places]) for numbers in (fit.theta, errors))
        found.append((effect, dict(zip(names, values, strict=True)), dict(zip(names, spread, strict=True))))
    return found


def surroundings_by_trial(fit: ExplanationFit, trials: Sequence[str]) -> dict[str, dict[str, Surroundings]]:
    """Each wind or current that differs from trial to trial: effect to the name of each of the `trials` to its own."""
    errors = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    spread = fit.hypothesis.of_each_trial(errors)
    return {
        effect: {
            name: Surroundings.of_parts(part, error)
            for name, part, error in zip(trials, parts, spread[effect], strict=True)
        }
        for effect, parts in fit.hypothesis.of_each_trial(fit.theta).items()
    }
