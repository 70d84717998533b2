"""Coefficients and thrust curves of a craft with thrusters from trials in which its revolutions were recorded."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.ship import Ship, as_ship
from tank2sim.cards import Card, CraftCard
from tank2sim.cards.examination import doubts
from tank2sim.errors import InputError
from tank2sim.identification.craft.card import identified_craft
from tank2sim.identification.craft.fit import (
    PREDICTION_LEAD_S,
    SHORTEST_PREDICTION_S,
    CoefficientVerdict,
    CraftFit,
    FreePrediction,
    determination,
    fit_craft,
    predict_free,
)
from tank2sim.identification.craft.next_trial import CandidateTrial, next_trials
from tank2sim.identification.craft.order_response import OrderResponse, order_responses
from tank2sim.identification.craft.problem import craft_driven_by, craft_problem
from tank2sim.identification.trials.problem.estimation_problem import SearchReport, silent
from tank2sim.marks import CHECK
from tank2sim.records.craft_trials import read_craft_trial
from tank2sim.records.same_record import refuse_copies
from tank2sim.units import from_si

CraftTrialPaths = str | Path | Sequence[str | Path]
"""Trials: a file, a folder with CSV files, or several of them."""


class CraftIdentificationResult(OldResult):
    """Coefficients and thrust curves of a craft.

    Parameters
    ----------
    before : Ship
        With the card that was given.
    fit : CraftFit
    predictions : list of FreePrediction
        Of held-out trials.
    held : sequence of str
        Names of the held-out trials, those that are too short to be predicted with them.
    driven_by : str
        ``revolutions`` of the thrusters, or their ``orders``.
    responses : mapping, optional
        Thruster to its response to orders, where the trials hold them next to the revolutions.
    """

    command = "identify"

    def __init__(
        self,
        before: Ship,
        fit: CraftFit,
        predictions: Sequence[FreePrediction],
        held: Sequence[str] = (),
        driven_by: str = "revolutions",
        responses: Mapping[str, OrderResponse] | None = None,
        alike: Sequence[str] = (),
    ) -> None:
        assert isinstance(before.card, CraftCard)
        self.before, self.fit, self.predictions, self.held = before, fit, list(predictions), list(held)
        self.driven_by, self.responses = driven_by, dict(responses or {})
        self.card = identified_craft(before.card, fit, self.responses)
        self.notices = (*dict.fromkeys((*doubts(before.card), *doubts(self.card))), *alike, *self._notices())

    def _notices(self) -> list[str]:
        of_thrust = [
            name
            for name, verdict in zip(self.fit.problem.free, self.fit.verdicts, strict=True)
            if name.endswith((".ahead", ".astern")) and verdict is CoefficientVerdict.PRIOR
        ]
        notices = []
        if of_thrust:
            notices.append(f"{CHECK} the trials do not determine {', '.join(of_thrust)}: it is that of the card")
        if self.held and not self.predictions:
            notices.append(
                f"no held-out trial is longer than {PREDICTION_LEAD_S + SHORTEST_PREDICTION_S:g} s: none is predicted"
            )
        if self.driven_by == "orders":
            notices.append(
                "the trials have orders and no revolutions: a full order counts as the largest revolutions of the card"
            )
        notices += self._dead_band_notices()
        notices.append(
            "the mass on the card is taken as exact: motion determines forces over masses, so that an error of the "
            "mass is one of all forces, in the same share"
        )
        return notices

    def _dead_band_notices(self) -> list[str]:
        card = self.before.card
        assert isinstance(card, CraftCard)
        if not self.responses:
            words = "orders" if self.driven_by == "orders" else "revolutions"
            other = "revolutions" if self.driven_by == "orders" else "orders"
            return [f"dead bands are those of the card: the trials have {words}, and need {other} next to them"]
        notices = []
        for thruster in card.thrusters:
            response = self.responses.get(thruster.name)
            if response is None or response.dead_band is not None:
                continue
            least = from_si("n_rpm", response.turning_radps)
            text = f"the dead band of thruster {thruster.name} is that of the card: no order left the propeller at rest"
            if thruster.dead_band_radps >= response.turning_radps:
                text = f"{CHECK} {text}, and one of {least:.3g} rpm, within it, turned it"
            else:
                text += f"; one of {least:.3g} rpm turned it"
            notices.append(text)
        return notices

    @property
    def ship(self) -> Ship:
        """The craft with the card found."""
        return Ship(self.card)

    @cached_property
    def next_trials(self) -> list[CandidateTrial]:
        """Manoeuvres of five minutes, the one first that would determine most of what these trials do not."""
        assert isinstance(self.before.card, CraftCard)
        return next_trials(self.before.card, self.fit)

    @property
    def determination(self) -> dict[str, float] | None:
        """R^2 of u, v and r of all 30 s predictions of held-out trials, next to the smoothed motion."""
        if not self.predictions:
            return None
        predicted = np.concatenate([entry.predicted for entry in self.predictions])
        smoothed = np.concatenate([entry.smoothed for entry in self.predictions])
        return dict(zip("uvr", map(float, determination(predicted, smoothed)), strict=True))

    def _rows(self) -> list[list[object]]:
        fit, rows = self.fit, []
        estimate = fit.estimate
        for place, name in enumerate(fit.problem.free):
            verdict = fit.verdicts[place]
            known = verdict is not CoefficientVerdict.PRIOR
            rows.append(
                [
                    name.removeprefix("derivatives.").removeprefix("thrusters."),
                    float(estimate.values[place]),
                    float(estimate.standard_errors[place]),
                    float(fit.problem.prior_mean[place]),
                    float(fit.problem.prior_error[place]),
                    verdict.value,
                    fit.problem.runs[fit.best_run(place)].name if known else None,
                ]
            )
        return rows

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        keys = ("value", "standard_error", "before", "prior_standard_error", "verdict", "by")
        return {
            "ship": self.before.name,
            "method": self.fit.estimate.method,
            "trials": [run.name for run in self.fit.problem.runs],
            "coefficients": {str(name): dict(zip(keys, row, strict=True)) for name, *row in self._rows()},
            "noise": dict(self.fit.estimate.measurement_noise),
            "determination": self.determination,
            "driven_by": self.driven_by,
            "order_responses": {
                name: dict(zip(_RESPONSE_KEYS, _response_row(response), strict=True))
                for name, response in self.responses.items()
            },
            "held_out": self.held,
            "next_trials": [candidate.as_json() for candidate in self.next_trials],
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """How many coefficients the trials determine, how well held-out trials are predicted, and what to run next."""
        verdicts = self.fit.verdicts
        count = sum(verdict is not CoefficientVerdict.PRIOR for verdict in verdicts)
        sure = sum(verdict is CoefficientVerdict.IDENTIFIED for verdict in verdicts)
        lines = [
            f"{self.before.name}: {len(self.fit.problem.runs)} trials determine {count} of {len(verdicts)} "
            f"coefficients, {sure} of them within a quarter of their value"
        ]
        if found := self.determination:
            words = ", ".join(f"{name} {value:.3f}" for name, value in found.items())
            lines.append(f"free-running predictions of up to 30 s of held-out trials: R^2 of {words}")
        if self.next_trials and self.next_trials[0].determines:
            best = self.next_trials[0]
            lines.append(f"next: {best.words}; it would determine {', '.join(best.determines)}")
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Coefficients with their verdict, and the next trials."""
        heads = ("SI", "value", "standard error", "card", "its error", "verdict", "mostly by")
        found = [screen_table("Coefficients", heads, self._rows())]
        if self.responses:
            heads = ("thruster", "lag (s)", "its error", "dead band (rpm)", "its error", "rested at", "turned at")
            responses = [[name, *_response_row(response)] for name, response in self.responses.items()]
            found.append(screen_table("Response to orders", heads, responses))
        rows = [[entry.words, ", ".join(entry.determines) or None] for entry in self.next_trials]
        if rows:
            found.append(screen_table("Next five minutes", ("orders", "would determine"), rows))
        return tuple(found)


_RESPONSE_KEYS = ("lag_s", "lag_error_s", "dead_band_rpm", "dead_band_error_rpm", "rest_rpm", "turning_rpm")


def _response_row(response: OrderResponse) -> list[object]:
    band, error = response.dead_band or (None, None)
    speeds = (band, error, response.rest_radps, response.turning_radps)
    rpm = [None if speed is None else float(from_si("n_rpm", speed)) for speed in speeds]
    return [response.lag_s, response.lag_error_s, *rpm]


@checked
def identify_craft(
    card: Ship | Card | str | Path,
    trials: CraftTrialPaths,
    *,
    holdout: CraftTrialPaths = (),
    progress: SearchReport = silent,
) -> CraftIdentificationResult:
    """Identify hull and thrust curves of a craft with thrusters from trials with position, heading and revolutions.

    The trials are those that :func:`tank2sim.log` cuts: columns ``t_s``, ``x_m``, ``y_m``, ``psi_deg`` and, of each
    thruster, ``n_<name>_rpm``; ``r_degps`` is used where it is there. A current and a mean wind are estimated for each
    trial.

    Parameters
    ----------
    card : Ship, Card, str or path
        Of kind ``small_craft``: mass and places of the thrusters are taken as exact, all else with the standard errors
        that it states, or wide ones.
    trials, holdout : path or sequence of paths
        Trials to fit, and trials only to predict; a folder means the CSV files in it.
    progress : callable
        Called with each better estimate.

    Raises
    ------
    InputError
        The card is of another kind, a file is at fault, or a trial is given twice.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import tank2sim as t2s
    >>> otter, folder = t2s.load("otter"), Path(tempfile.mkdtemp())
    >>> for name in ("straight:600", "spin:400", "difference:300"):
    ...     rows = otter.simulate(name, duration_s=10).df[::40]
    ...     rows.to_csv(folder / f"{name.partition(':')[0]}.csv", index=False)
    >>> found = t2s.identify_craft(otter, folder)
    >>> abs(found.card.thrusters[0].ahead_Ns2 / 0.01108 - 1) < 0.05
    True
    """
    ship = as_ship(card)
    if not isinstance(ship.card, CraftCard):
        raise InputError(ship.card.source, "model.kind", "is not small_craft", "t2s.identify takes cards of ships")
    fitted, held = craft_trial_files(trials), craft_trial_files(holdout)
    if not fitted:
        raise InputError("trials", "", "there are none", "give trial files, or a folder with CSV files")
    twice = {path.resolve() for path in fitted} & {path.resolve() for path in held}
    if twice:
        raise InputError(sorted(twice)[0], "", "is fitted and held out", "give it once")
    read = [read_craft_trial(path, ship.card.thrusters) for path in (*fitted, *held)]
    alike = (*refuse_copies(read[: len(fitted)]), *refuse_copies(read[: len(fitted)], read[len(fitted) :]))
    problem, driven_by = craft_problem(ship.card, read), craft_driven_by(ship.card, read)
    runs = problem.runs
    try:
        # A step of the search may be one to an unstable craft. Threads of the linear algebra only wait for each other.
        with np.errstate(all="ignore"), threadpool_limits(limits=1, user_api="blas"):
            fit = fit_craft(problem.with_runs(runs[: len(fitted)]), progress)
    except np.linalg.LinAlgError:
        remedy = "check mass, thrust curves and damping of the card, and the places and signs of the thrusters"
        raise InputError(ship.card.source, "", "does not move as the trials do, not even roughly", remedy) from None
    predictions = predict_free(fit, runs[len(fitted) :]) if held else []
    responses = order_responses(ship.card, read[: len(fitted)])
    names = [run.name for run in runs[len(fitted) :]]
    return CraftIdentificationResult(ship, fit, predictions, names, driven_by, responses, alike)


def craft_trial_files(paths: CraftTrialPaths) -> list[Path]:
    """The files of paths, those of folders in the order of their names."""
    given: Iterable[str | Path] = [paths] if isinstance(paths, str | Path) else paths
    found: list[Path] = []
    for path in map(Path, given):
        found += sorted(path.glob("*.csv")) if path.is_dir() else [path]
    return found
