"""Coefficients identified from free-running trials, as a result with its card."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tank2sim.analysis.ensemble.draws import by_file_name
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import Count, DrawsOfChain, PositiveArgument, SmallEnsemble, checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.ship import Ship, as_ship
from tank2sim.api.trial import TrialPaths, fitted_and_held
from tank2sim.cards import Card, ManoeuvringCard, parse_card
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.files import plain_json
from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
from tank2sim.identification.trials.as_json import (
    SET_KEYS,
    estimate_rows,
    figure_rows,
    following_rows,
    identification_as_json,
    identified_card_text,
    posterior_rows,
    replays,
    replays_as_json,
    structure_rows,
)
from tank2sim.identification.trials.assessment.notices import remarks
from tank2sim.identification.trials.identify import Identification, identify_trials, undetermined_notice
from tank2sim.identification.trials.methods.posterior_sampling import DRAWS_OF_CHAIN
from tank2sim.identification.trials.options import BY_RESIDUALS, TRIAL_METHODS, IdentificationOptions
from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns
from tank2sim.identification.trials.problem.estimation_problem import SearchReport, silent
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.signatures import with_fitted_trials
from tank2sim.identification.trials.problem.structures import AUTO, AVERAGE, BY_EVIDENCE, STRUCTURES
from tank2sim.identification.trials.problem.water_current import card_in
from tank2sim.records.campaigns import read_campaign
from tank2sim.units import in_words

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd


class IdentificationResult(OldResult):
    """Coefficients identified from trials, and how well the new card follows trials.

    Parameters
    ----------
    before : ManoeuvringCard
        The card that was given.
    identification : Identification
        SI and radians.
    fitted, held : Measured
        Trials that were fitted, and trials that were only compared with.
    """

    command = "identify"

    def __init__(
        self, before: ManoeuvringCard, identification: Identification, fitted: Measured, held: Measured
    ) -> None:
        self.before, self.identification, self.fitted, self.held = before, identification, fitted, held
        self.remarks = tuple(remarks(identification))
        self._found: Mapping[str, Any] = plain_json(identification_as_json(identification, self.remarks))
        notices = (*self._found["notices"], *self._found["identifiability"]["notices"], *self.remarks)
        self.notices = tuple(notice for notice in notices if notice not in self.headline)

    @cached_property
    def card(self) -> Card:
        """The card found, with the covariance of its estimates; ``card.save("better.toml")`` writes it."""
        found = self.identification
        captive = self.fitted.captive
        tank = [f"{len(captive.runs)} captive tests of {captive.campaign.path.name}"] if captive else []
        text = identified_card_text(found, [*(trial.name for trial in self.fitted.trials), *tank])
        text = with_fitted_trials(text, "the card found", self.fitted.trials)
        estimate = found.estimate
        covariance = by_file_name(found.card, estimate.free, estimate.covariance, estimate.samples)
        return replace(parse_card(text, "the card found"), covariance=covariance)

    @property
    def ship(self) -> Ship:
        """The ship of the card found."""
        return Ship(self.card)

    @property
    def estimates(self) -> pd.DataFrame:
        """What was estimated, by name: value and standard error, prime or SI, rudder positive to starboard."""
        import pandas as pd

        estimate = self.identification.estimate
        columns = {"value": estimate.values, "standard_error": estimate.standard_errors}
        return pd.DataFrame(columns, index=pd.Index(estimate.free, name="name"))

    @property
    def figures(self) -> pd.DataFrame:
        """Figures of each trial, units in their names: measured, by the card before and now, and the 95 % interval.

        The interval (``low_95``, ``high_95``) is that in which the figure of a held-out trial was expected.
        """
        import pandas as pd

        keys = ("figure", "measured", "before", "predicted")
        rows = [
            (figure["trial"], word, *(figure[key] for key in keys), *(figure["interval_95"] or (None, None)))
            for word, key in SET_KEYS.items()
            for figure in self._found["figures"][key]
        ]
        columns = ["trial", "set", "figure", "measured", "before", "now", "low_95", "high_95"]
        return pd.DataFrame(rows, columns=columns)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {**self._found, "replays": self._replays}

    @property
    def headline(self) -> tuple[str, ...]:
        """That the trials do not determine the current, and that the posterior has not converged; else none: the first
        table says it."""
        samples, current = self.identification.posterior, self.identification.current
        unfinished = () if samples is None or samples.converged else tuple(samples.notices)
        return (*(() if current is None or current.determined else (undetermined_notice(current),)), *unfinished)

    @property
    def samples(self) -> pd.DataFrame | None:
        """Draws of the posterior, a column for each parameter in the units of `estimates`; None where it was not
        sampled."""
        import pandas as pd

        samples = self.identification.posterior
        return None if samples is None else pd.DataFrame(samples.flat, columns=list(samples.free))

    @property
    def tables(self) -> tuple[Table, ...]:
        """Estimates, errors of the yaw rate, figures; bootstrap and cross-validation where asked for."""
        found = self.identification
        estimate = found.estimate
        count = len({run.name.partition(" at ")[0] for run in found.problem.runs})
        trials = f"{count} trial{'s' * (count > 1)}"
        title = f"{found.card.ship.name}: {len(estimate.free)} coefficients from {trials}"
        tables = [screen_table(title, ("", "found", "before", "from trials"), estimate_rows(self._found))]
        if found.posterior is not None:
            heads = ("", "95 %", "R-hat", "effective size")
            tables.append(
                screen_table(f"Posterior, {len(found.posterior.flat)} draws", heads, posterior_rows(self._found))
            )
        if found.bootstrap is not None:
            scatter = found.bootstrap.std(axis=0, ddof=1)
            triples = zip(estimate.free, estimate.standard_errors, scatter, strict=True)
            tables.append(
                screen_table(
                    f"Standard errors, and scatter over {len(found.bootstrap)} sets of trials simulated again",
                    ("", "standard error", "bootstrap"),
                    [[name, float(error), float(deviation)] for name, error, deviation in triples],
                )
            )
        tables.append(
            screen_table(
                "Yaw rate: error over windows of 5 ship lengths, of its root mean square",
                ("trial", "", "before", "now"),
                following_rows(self._found),
            )
        )
        if rows := structure_rows(self._found):
            columns = ("structure", "one at a time, mean", "those of largest amplitude")
            tables.append(screen_table("Yaw-rate error of trials left out of the fit, %", columns, rows))
        if rows := figure_rows(self._found):
            tables.append(
                screen_table(
                    "Figures, simulated in closed loop from the measured start, with the rudder rate and lag of each "
                    "trial",
                    ("trial", "", "figure", "measured", "before", "now", "error", "95 %"),
                    [[trial, word, ", ".join(in_words(str(name))), *values] for trial, word, name, *values in rows],
                )
            )
        return tuple(tables)

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Tracks, histories, errors and parameters, by file stem."""
        from tank2sim.report.identification.page import identification_charts

        return identification_charts(self.to_dict())

    @cached_property
    def _replays(self) -> list[dict[str, object]]:
        """Every trial, fitted or held out, next to both cards in the same current."""
        current = self.identification.current
        before = self.before if current is None else card_in(self.before, current)
        return [
            entry
            for held_out, group in ((False, self.fitted), (True, self.held))
            if group.trials
            for entry in replays_as_json(replays(before, self.identification, group), held_out=held_out)
        ]


@checked
def identify(
    card: Ship | Card | str | Path,
    trials: TrialPaths,
    *,
    holdout: TrialPaths = (),
    method: str = BY_RESIDUALS,
    structure: str = BY_EVIDENCE,
    campaign: str | Path | None = None,
    inertia: bool = False,
    piece_s: PositiveArgument | None = None,
    trust_card: bool = False,
    hold: Sequence[str] = (),
    force: bool = False,
    members: SmallEnsemble = 100,
    bootstrap: SmallEnsemble = 0,
    posterior: str = "",
    draws: DrawsOfChain = DRAWS_OF_CHAIN,
    executor: str = PROCESSES,
    workers: Count | None = None,
    progress: SearchReport = silent,
) -> IdentificationResult:
    """Identify the coefficients of a ship from free-running trials.

    Parameters
    ----------
    card : Ship, Card, str or path
        What is known of the ship beforehand; its standard errors say how well.
    trials, holdout : path, TrialRecord, or sequence of them
        Trials to fit, and trials only to compare with; a folder means the trials in it.
    method : str
        ``output_error``, ``equation_error``, ``kalman`` or ``recursive``; ``residuals``: the Kalman filter for trials
        at sea in which output error leaves more than the noise of the sensors, else output error.
    structure : str
        One of :data:`tank2sim.identification.trials.problem.structures.STRUCTURES`; ``auto``: by cross-validation;
        ``average``: intervals of all structures, weighted by their predictions, with the card of the best;
        ``evidence``: cross-flow drag, unless the trials prefer the card's own terms very strongly by the Bayesian
        information criterion.
    campaign : path, optional
        ``campaign.toml`` of captive tests with a model of the ship, fitted together with the trials: its forces,
        Froude-scaled, with the gain of each force, of the rudder, an offset of X and the moment's reference point
        uncertain between tank and ship.
    inertia : bool
        Estimate acceleration derivatives, too.
    piece_s : float, optional
        Length of the pieces of output error, s; by default 5 L/u0.
    trust_card : bool
        Take the card's standard errors as they are.
    hold : sequence of str
        Derivatives or parameters of effects that stay as the card has them.
    force : bool
        Fit trials also where they look like another ship's; the result is marked.
    members : int
        Simulations behind the intervals of the figures of held-out trials.
    bootstrap : int
        Sets of trials simulated again with the estimate and fitted, for its scatter.
    posterior : str
        ``nuts``: sample the posterior by the no-U-turn sampler; ``ensemble``: by an ensemble of walkers. Estimates,
        their covariance and all intervals are then those of the samples, which the card carries next to it; about 2 min
        for 20 coefficients. Needs ``tank2sim[posterior]``.
    draws : int
        Draws of each of the sampler's four chains.
    executor : str
        ``processes`` or ``dask://host:port``.
    workers : int, optional
        Processes for cross-validation and bootstrap.
    progress : callable
        Called with stage, values and cost of each better estimate.

    Raises
    ------
    InputError
        A file is at fault, the trials are not of the card's ship, or they do not determine the coefficients.
    """
    for name, value, known in (
        ("method", method, TRIAL_METHODS),
        ("structure", structure, (*STRUCTURES.names(), AUTO, AVERAGE, BY_EVIDENCE)),
    ):
        if value not in known:
            raise InputError(name, "", f"{value!r} is not known", f"there are: {', '.join(known)}")
    ship = as_ship(card).manoeuvring()
    options = IdentificationOptions(
        method=method,
        structure=structure,
        inertia=inertia,
        piece_s=piece_s,
        scale_prior=not trust_card,
        members=members,
        bootstrap=bootstrap,
        hold=tuple(hold),
        force=force,
        posterior=posterior,
        draws=draws,
    )
    fitted, held = fitted_and_held(trials, holdout, ship)
    if campaign is not None:
        fitted = replace(fitted, captive=captive_runs(campaign))
    with _computing(options, executor, workers, held=bool(held.trials)) as pool:
        found = identify_trials(ship, fitted, held, options, progress, pool)
    return IdentificationResult(ship, found, fitted, held)


def captive_runs(campaign: str | Path) -> CaptiveRuns:
    """The reduced runs of a campaign, rudder tests at other speeds included.

    Raises
    ------
    InputError
        The campaign is at fault, see :func:`tank2sim.reduce`.
    """
    read = read_campaign(campaign)
    if heeled := next((run.name for run in read.runs if run.heel_rad), ""):
        raise InputError(
            campaign, "runs", f"{heeled} is at a heel", "identify takes captive tests upright: leave it out"
        )
    return CaptiveRuns(read, reduce_campaign(read, ReductionOptions(off_speed=True)).runs)


@contextmanager
def _computing(
    options: IdentificationOptions, executor: str, workers: int | None, *, held: bool
) -> Iterator[Executor | None]:
    """For cross-validation and bootstrap; a cluster for the intervals of what is held out, too."""
    on_this_machine = check_executor(executor) == PROCESSES
    several = options.structure in (AUTO, AVERAGE)
    if not on_this_machine and not (several or options.bootstrap or (held and options.members)):
        remedy = f"give --structure {AUTO}, --bootstrap N or --holdout TRIAL, too"
        raise InputError("--executor", "", "has nothing to do", remedy)
    if on_this_machine and not several and not options.bootstrap:
        yield None
        return
    with executing(executor, workers) as pool:
        yield pool
