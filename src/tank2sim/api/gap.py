"""The missing physical effect of a model, by trials: a result with the improved card."""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import Count, Effects, NumberArgument, checked
from tank2sim.api.gap_files import CORRECTED, REPORT, SURROUNDED, GapFiles, folder_made, put
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.ship import Ship, as_ship
from tank2sim.api.trial import TrialPaths, fitted_and_held
from tank2sim.cards import Card, ManoeuvringCard, parse_card
from tank2sim.cards.covariance import not_referring
from tank2sim.cards.covariance_reading import derived_card
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing, processes_to_begin
from tank2sim.gap.fleet.search import nonlinear_card
from tank2sim.gap.fleet.ships import GAP, IMPROVED
from tank2sim.gap.inference.fit_all import StageReport
from tank2sim.gap.outcome.correct_sensors import REMAINING_FAULTS, correct_sensor_faults, corrected_text
from tank2sim.gap.outcome.export import (
    NEXT_TEST_FILE,
    gap_as_json,
    joined,
    measured_in,
    signal_display_name,
)
from tank2sim.gap.outcome.improve_card import Found, card_with_effects_text
from tank2sim.gap.outcome.surroundings import with_surroundings
from tank2sim.gap.result import AMBIGUOUS, MISSING, OUTSIDE_LIBRARY, Gap
from tank2sim.gap.search.model_choice import SUREST
from tank2sim.gap.workflow import MOST_EFFECTS, GapOptions
from tank2sim.gap.workflow import run_gap_workflow as run_workflow
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.signatures import fitted_as, with_fitted_trials
from tank2sim.records.signals.writing import trial_text
from tank2sim.units import in_words

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd


SUREST_WRONG = round(1 - SUREST, 9)
"""Probability with which even the surest name may be wrong."""


class GapResult(OldResult):
    """The effect that a model lacks to follow trials, and the card with it.

    Parameters
    ----------
    gap : Gap
        SI and radians.
    fitted, held : Measured
        Trials that name the effect, and trials that only prove it.
    """

    command = "gap"

    def __init__(self, gap: Gap, fitted: Measured, held: Measured) -> None:
        self.gap, self.fitted, self.held = gap, fitted, held
        self.notices = tuple(gap.notices)

    @property
    def verdict(self) -> str:
        """``missing effect``, ``no missing effect``, ``the coefficients explain it``, ``ambiguous`` or ``outside the
        library``."""
        return self.gap.verdict

    @property
    def effects(self) -> pd.DataFrame:
        """Parameters of the effects that were named: effect, parameter, value, standard error, probability (0 to 1).

        Units are in the names of the parameters; angles are in degrees.
        """
        import pandas as pd

        rows = [
            (effect["name"], key, value, effect["standard_errors"].get(key), effect["confidence"])
            for effect in self._results["effects"]
            for key, value in effect["parameters"].items()
        ]
        numbers = ["value", "standard_error", "probability"]
        return pd.DataFrame(rows, columns=["effect", "parameter", *numbers]).astype(dict.fromkeys(numbers, float))

    @property
    def surroundings(self) -> pd.DataFrame:
        """Winds and currents that differ from trial to trial: effect, trial, speed (m/s), direction (deg), errors.

        Directions count clockwise from north: from which a wind comes, towards which a current sets. Of a trial held
        out they were fitted to that trial itself.
        """
        import pandas as pd

        columns = [
            "effect",
            "trial",
            "held_out",
            "speed_mps",
            "direction_deg",
            "speed_error_mps",
            "direction_error_deg",
        ]
        rows = [
            [
                *(effect["name"], row["trial"], row["held_out"], row["speed_mps"], row["direction_deg"]),
                *row["standard_errors"].values(),
            ]
            for effect in self._results["effects"]
            for row in effect["by_trial"]
        ]
        return pd.DataFrame(rows, columns=columns)

    @property
    def coefficients(self) -> pd.DataFrame:
        """Coefficients that were fitted together with the effects, by name; empty where the given ones were kept.

        Value and standard error now, and as the given card has them: prime or SI, rudder positive to starboard.
        """
        import pandas as pd

        columns = ["name", "value", "standard_error", "before", "standard_error_before"]
        return pd.DataFrame(self._results["coefficients"], columns=columns).set_index("name")

    @property
    def misfit(self) -> pd.DataFrame:
        """Root mean square of (simulated - measured)/noise by trial, before and after: 1 is noise."""
        import pandas as pd

        rows = [
            (trial.name, trial.held_out, trial.misfit("before"), trial.misfit("after"))
            for trial in self.gap.passed
            if measured_in(trial)
        ]
        return pd.DataFrame(rows, columns=["trial", "held_out", "before", "after"]).set_index("trial")

    @cached_property
    def improved(self) -> Card:
        """The card with the effects; the given card where none of the ship was named."""
        text = self._improved_text("the improved card")
        if text == self.gap.card.text:
            return replace(parse_card(text, self.gap.card.source), covariance=self.gap.card.covariance)
        return derived_card(self.gap.base, text, self.gap.card.source)[0]

    @property
    def ship(self) -> Ship:
        """The ship of the improved card."""
        return Ship(self.improved)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return self._results

    @cached_property
    def _results(self) -> Mapping[str, Any]:
        trials = (*self.fitted.trials, *self.held.trials)
        return gap_as_json(self.gap, {trial.name: trial.path.name for trial in trials})

    @property
    def headline(self) -> tuple[str, ...]:
        """The verdict, its probabilities, and what these data cannot distinguish."""
        from tank2sim.report.gap.text import place_of_cause, probabilities_in_words, verdict_in_words

        gap = self.gap
        lines = [f"{gap.card.ship.name}: {verdict_in_words(self._results)}", *probabilities_in_words(self._results)]
        if gap.alternatives:
            lines.append(
                f"these data cannot distinguish it from: {'; '.join(joined(names) for names in gap.alternatives)}"
            )
        for place in gap.where[:1]:
            signal = signal_display_name(place.signal).file
            lines.append(
                f"most of the misfit arises in {signal} of {place.trial}, {place.t_start_s:.4g} s to "
                f"{place.t_end_s:.4g} s ({100 * place.share:.0f} %)"
            )
        if self._results["acting"] and gap.verdict != OUTSIDE_LIBRARY:
            lines.append(f"the cause acts most in {place_of_cause(self._results)}")
        if gap.next_test:
            lines.append(f"next test: {gap.next_test.manoeuvre}. {gap.next_test.why}")
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Parameters of what was found and of other candidates, and the misfit before and after."""
        from tank2sim.report.gap.text import sizes_of_candidates

        gap = self.gap
        columns = ("effect", "parameter", "value", "standard error", "unit")
        found = "What the best of the candidates would be" if gap.verdict == AMBIGUOUS else "What was found"
        candidates = sizes_of_candidates(self._results)
        tables = [
            screen_table(title, columns, rows, wide=True)
            for title, effects in ((found, self._results["effects"]), ("What the others would be", candidates))
            if (rows := [row for effect in effects for row in _parameter_rows(effect)])
        ]
        tables += [
            screen_table(
                f"{effect['name'].replace('_', ' ').capitalize()} of each trial",
                ("trial", "set", "speed", "standard error", "direction", "standard error "),
                [_by_trial_row(row) for row in effect["by_trial"]],
                wide=True,
            )
            for effect in self._results["effects"]
            if effect["by_trial"]
        ]
        heads = ("trial", "set", "before", "after")
        title = "Misfit in units of the noise (1 is noise)"
        return (*tables, screen_table(title, heads, self._misfit_rows(), wide=True))

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Tracks before and after, misfits, the missing force and rivals, by name."""
        from tank2sim.report.gap.page import gap_charts

        return gap_charts(self.to_dict())

    def files(self, folder: Path) -> tuple[GapFiles, list[str]]:
        """Path to content of the files that belong into a folder, and messages about them.

        ``gap.json``, ``improved.toml`` with its covariance, ``report.html``, ``next_test.csv`` where a test would
        decide, ``corrected/`` where a sensor is at fault, and ``surroundings/`` with the winds and currents of single
        trials as columns, with which the improved card follows them.
        """
        gap, trials = self.gap, (*self.fitted.trials, *self.held.trials)
        text = self._improved_text(str(folder / IMPROVED))
        improved, notices = improved_files(gap.base, text, folder / IMPROVED)
        files: GapFiles = {**improved, folder / REPORT: self.page()}
        if gap.next_test:
            files[folder / NEXT_TEST_FILE] = gap.next_test.orders
        if gap.verdict == MISSING and any(EFFECTS[effect.name].acts_on == "sensor" for effect in gap.effects):
            for trial in trials:
                corrected = corrected_text(trial.path, trial, self._found)
                if corrected is not None:
                    files[folder / CORRECTED / f"{trial.name}.csv"] = corrected
                new = correct_sensor_faults(trial, self._found).notices[len(trial.notices) :]
                notices += [f"{trial.path.name}: {text}" for text in new if text.startswith(REMAINING_FAULTS)]
        files |= {folder / SURROUNDED / f"{name}.csv": text for name, text in self._surrounded().items()}
        names = sorted(path.relative_to(folder).as_posix() for path in (*files, folder / GAP))
        files[folder / GAP] = self.to_json(files=names)
        return files, notices

    def save(self, folder: str | Path) -> tuple[str, ...]:
        """Write :meth:`files` into a folder in place of those of an earlier run; return messages.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        inputs = [trial.path for trial in (*self.fitted.trials, *self.held.trials)]
        with folder_made(Path(folder)):
            files, notices = self.files(Path(folder))
            return *notices, *put(files, Path(folder), inputs)

    def _surrounded(self) -> dict[str, str]:
        """Name of each trial to its text with the winds and currents that were found for it."""
        found = {effect.name: effect.by_trial for effect in self.gap.effects if effect.by_trial}
        if not found:
            return {}
        remark = f"{' and '.join(found)} of this trial estimated by tank2sim gap; at the size of {self.gap.card.source}"
        trials = (trial for group in (self.fitted, self.held) for trial in with_surroundings(group, found).trials)
        return {trial.name: trial_text(replace(trial, scale=None), [remark]) for trial in trials}

    @property
    def _found(self) -> list[Found]:
        return [(effect.name, effect.parameters, effect.standard_errors) for effect in self.gap.effects]

    def _improved_text(self, source: str) -> str:
        """Text of the improved card; raises InputError if it cannot be read again."""
        gap = self.gap
        text = gap.card.text
        if gap.improved.text != text:
            rivals = [joined(names) for names in gap.alternatives]
            names = [trial.name for trial in self.fitted.trials]
            text = card_with_effects_text(gap.improved, self._found, names, rivals, len(gap.coefficients))
            text = with_fitted_trials(text, source, self.fitted.trials)
        parse_card(text, source)
        return text

    def _misfit_rows(self) -> list[list[object]]:
        gap = self.gap
        rows: list[list[object]] = [
            [
                trial.name,
                "held out" if trial.held_out else "fitted",
                *(misfit_text(trial.misfit(model)) for model in ("before", "after")),
            ]
            for trial in gap.passed
            if measured_in(trial)
        ]
        for word, held in (("fitted", False), ("held out", True)):
            before, after = (gap.misfit(model, held_out=held) for model in ("before", "after"))
            if before is not None and after is not None:
                rows.append(["all", word, misfit_text(before), misfit_text(after)])
        return rows


def improved_files(card: Card, text: str, path: Path) -> tuple[GapFiles, list[str]]:
    """Files of the improved card at `path`, with what of the covariance of `card` still holds; messages about it.

    A covariance that cannot be read is left out with a message: an hour's search is not lost for it.
    """
    try:
        found, messages = derived_card(card, text, path.name)
        return found.files(path), list(messages)
    except InputError as error:
        return {path: not_referring(text)}, [f"{path.name} has no covariance: {error}"]


def misfit_text(misfit: float) -> str:
    """A misfit as tables show it."""
    return f"{misfit:.2f}" if math.isfinite(misfit) else "ran away"


def _parameter_rows(effect: Mapping[str, Any]) -> list[list[object]]:
    rows: list[list[object]] = []
    for key, value in effect["parameters"].items():
        error = effect["standard_errors"].get(key)
        words, unit = in_words(key)
        rows.append([effect["name"], words, value, None if error is None else float(f"{error:.2g}"), unit or "-"])
    return rows


def _by_trial_row(row: Mapping[str, Any]) -> list[object]:
    errors = row["standard_errors"]
    numbers = [row["speed_mps"], errors["speed_mps"], row["direction_deg"], errors["direction_deg"]]
    speed, speed_error, direction, direction_error = (float(f"{number:.3g}") for number in numbers)
    which = "held out" if row["held_out"] else "fitted"
    return [row["trial"], which, f"{speed:g} m/s", speed_error, f"{direction:g} deg", direction_error]


@checked
def find_gap(
    card: Ship | Card | str | Path,
    trials: TrialPaths,
    *,
    holdout: TrialPaths = (),
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    max_effects: Effects = MOST_EFFECTS,
    false_discovery: NumberArgument = 0.5,
    executor: str = PROCESSES,
    workers: Count | None = None,
    progress: StageReport = lambda text: None,
) -> GapResult:
    """Find the physical effect that a model lacks to follow free-running trials, add it, and prove it.

    Parameters
    ----------
    card : Ship, Card, str or path
        The ship as it is known (an ``abkowitz`` card).
    trials, holdout : path or sequence of paths
        Trials that name the effect, and trials that only prove it; a folder means the trials in it.
    effects, without : sequence of str
        Look for these alone; do not look for these. By default the whole library.
    max_effects : int
        Effects named at most, 1 to 4.
    false_discovery : float
        Largest probability with which a name that is given alone may be wrong, 0.01 to 0.5; what is less sure is one of
        several candidates.
    executor : str
        ``processes`` or ``dask://host:port``.
    workers : int, optional
        Processes; by default one for each core.
    progress : callable
        Called with the stage that begins.

    Raises
    ------
    InputError
        A file is at fault, a trial is too short, an effect is not known or cannot be tried on this card, or an option
        is out of its range.
    """
    ship = nonlinear_card(as_ship(card).card)
    options = gap_options(effects, without, max_effects, workers, false_discovery)
    with _workers(executor, workers) as pool:
        fitted, held = fitted_and_held(trials, holdout, ship, report_unused=False)  # a search uses them
        fitted = replace(fitted, notices=(*fitted.notices, *identified_from(ship, fitted)))
        return GapResult(run_workflow(ship, fitted, held, options, progress, pool), fitted, held)


def identified_from(card: ManoeuvringCard, fitted: Measured) -> list[str]:
    """A notice if the card was identified from some of these trials: its coefficients may hold what is missing.

    Parameters
    ----------
    card : ManoeuvringCard
    fitted : Measured
        Trials that name the effect.
    """
    names = [trial.name for trial in fitted.trials if fitted_as(card, trial) is not None]
    if not names:
        return []
    return [
        f"{card.source} was fitted to {', '.join(names)}: its coefficients may hold a part of what is missing. "
        "Give gap the card as it was before these trials, and identify on the improved card afterwards"
    ]


@checked
def gap_options(
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    max_effects: Effects = MOST_EFFECTS,
    workers: Count | None = None,
    false_discovery: NumberArgument = 0.5,
) -> GapOptions:
    """Options of the search. Raises InputError for an effect that is not known, or a number out of its range.

    Parameters
    ----------
    effects, without, max_effects, workers, false_discovery
        As of :func:`find_gap`.
    """
    for option, names in (("--effects", effects), ("--without", without)):
        if isinstance(names, str):
            raise InputError(option, "", f"is the text {names!r}", f"give a list of names: [{names!r}]")
        for name in names:
            if EFFECTS.get(name) is None:
                raise InputError(option, "", f"{name!r} is not an effect", EFFECTS.remedy(name))
    if not SUREST_WRONG <= false_discovery <= 0.5:
        problem = f"is {false_discovery:g}: no name is surer than {1 - SUREST_WRONG:g}, and half is a guess"
        raise InputError("--false-discovery", "", problem, f"give {SUREST_WRONG:g} to 0.5")
    return GapOptions(
        tuple(effects) or None, tuple(without), max_effects, workers=workers, false_discovery=false_discovery
    )


@contextmanager
def _workers(executor: str, workers: int | None) -> Iterator[Executor | None]:
    """The cluster, or processes of this machine, which load what they need while the trials are read; None for one."""
    local = check_executor(executor) == PROCESSES
    count = processes_to_begin(workers)
    if local and count == 1:
        yield None
        return
    with executing(executor, count) as pool:
        for _ in range(count if local else 0):
            pool.submit(importlib.import_module, "tank2sim.gap.workflow")
        yield pool
