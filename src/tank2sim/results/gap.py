"""Result of ``gap``: the missing effect, its probability, its consequences, the next test, and the improved card."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.charts.vega import ChartSpec
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, data_frame, table
from tank2sim.answer.result import Result
from tank2sim.cards import Card, parse_card
from tank2sim.cards.covariance import not_referring
from tank2sim.cards.covariance_reading import derived_card
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.files import folder_made
from tank2sim.gap.diagnosis.error_intervals import EARTH_BOUND
from tank2sim.gap.improve_card import Found, card_with_effects_text
from tank2sim.gap.outcome.export import NEXT_TEST_FILE, gap_study, joined, replaces
from tank2sim.gap.outcome.files import CORRECTED, GAP, IMPROVED, REPORT, SURROUNDED, GapFiles, put
from tank2sim.gap.outcome.study import EffectFound, GapStudy
from tank2sim.gap.proof.correct_sensors import correct_sensor_faults, corrected_text
from tank2sim.gap.proof.surroundings import with_surroundings
from tank2sim.gap.result import AMBIGUOUS, COEFFICIENTS, MISSING, NO_EFFECT_MISSING, Gap
from tank2sim.identification.trials.problem.prepare_trials import Measured, with_fitted_trials
from tank2sim.notices import Notice, foremost
from tank2sim.records.signals.writing import trial_text
from tank2sim.results.gap_cause_charts import agreement_chart, expected_chart, lacking_chart, rival_chart, when_chart
from tank2sim.results.gap_charts import (
    HISTORIES,
    SETS,
    changes_simulation,
    misfit_chart,
    place_chart,
    shown_models,
    signal_of,
    worst_replays,
    worst_tracks,
)
from tank2sim.results.gap_text import (
    EQUATION_WORDS,
    GOOD,
    as_percent,
    capital,
    effect_in_words,
    effects_of,
    found_in_words,
    meaning,
    parameter_cells,
    place_of_cause,
    probabilities_in_words,
    probability_of_none,
    sizes_of_candidates,
    trial_name,
    verdict_context,
    with_error,
)
from tank2sim.results.trial_charts import MOST_TRIALS, trial_pictures
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

NO_TRIALS = Measured((), "angle", ())
"""Trials of a result that was read from its JSON."""

_SURE = 0.9
"""Confidence from which a name is shown without caution (project choice)."""

_MOST_PASSAGES = 12
"""Passages in a table (project choice)."""

_ALL_DIGITS = 7
"""Significant digits of misfits, which are rounded to hundredths of the noise before."""

_COEFFICIENTS = (
    "Coefficients of the card fitted together with the effects (if any are named), within the card's standard errors "
    "(times a common factor that the trials determine)."
)
_ON = {"held out": "held out", "fitting": "used for fitting"}
_BEFORE_AND_AFTER = (
    "Each trial is simulated freely from its beginning to its end with the recorded inputs alone. Misfit is the root "
    "mean square of simulated less measured, in standard deviations of the measurement noise: 1 is the noise floor, "
    "which a model goes below only by chance. Held-out trials took no part in naming the effect."
)
_UNCHANGED = " Nothing was added to the card, so no model after it is shown."
_BLACK_BOX = (
    " The linear black box is the card with as many of its linear coefficients refitted as the effect has parameters, "
    "whatever the cause."
)
_FIGURES = (
    "Advance, transfer, diameters and overshoots are of turns and zigzags simulated in closed loop, the others of the "
    "trials replayed. Before is the card as given, after the improved card."
)
_AGREEMENT = (
    "A true effect has the same size in every trial. Where trials want different sizes, the name is wrong or "
    "incomplete."
)
_COULD_HIDE = "Effects up to this size could be present, besides the named ones, without showing in these data."
_COULD_REPLACE = (
    " For limits and time constants of the steering gear, which every ship has, the value furthest from the card's is "
    "reported that would not show in its place."
)
_NOISE = (
    "Misfits are counted in these standard deviations. Stated: by the files; estimated: from the records themselves."
)
_WHEN = {"signal": "When the records contradict each other", "force": "When a force is missing"}
_OVER = {
    "signal": "How the records contradict each other",
    "force": "The missing force over the state that explains it",
}
_STRIPS = (
    "Blue and orange: to either side, stronger where more is missing. Pale grey: nothing. No colour: not measured."
)
_MEANS = "Points: instants of all trials. Squares: means of bins, with 95 % bars by the spread between trials."
_LINES = (
    'Card before: as given. Card found: the improved card ("after" in the tables). The lines coincide where nothing '
    "was changed."
)
_RUN = f"Points: measured. Lines: simulated. {_LINES}"
_CAPTIONS = {
    "worst_tracks": f"The trials with the largest misfit. {_RUN}",
    "misfit": "u, v: velocity ahead and to starboard; r: yaw rate; psi: heading; x, y: north and east. The colour "
    "scale ends at 100.",
    "places": f"Points: measured. Shaded red: the time in which the misfit arises. {_LINES}",
    "when_signal": _STRIPS,
    "when_force": f"{_STRIPS} By the given card.",
    "signal": f"{_MEANS} A constant contradiction goes with every state.",
    "force": f"The force that the given card needs in addition to follow the measurements. {_MEANS}",
    "agreement": "Points: the estimate of each trial alone. Bars: 95 % intervals. Grey: all fitting trials together. "
    "Trials that determine little may leave the picture.",
    "expected": "Difference between the explanations over all readings together, beyond the effect of uncertain "
    "parameters: the larger, the clearer the manoeuvre would decide.",
}
_NO_FORCE = (
    " No force is missing, and none is shown: the evidence is the contradiction between the records of position, "
    "heading and velocity, whatever the hull does."
)


@dataclass(frozen=True, eq=False, repr=False)
class GapResult(Result[GapStudy]):
    """The effect that a model lacks to follow trials, and the card with it.

    Parameters
    ----------
    study : GapStudy
    gap : Gap, optional
        SI and radians; None if the result was read from its JSON.
    fitted, held : Measured
        Trials that name the effect, and trials that only prove it.
    written : tuple of Path
        Files that were written.
    remarks : tuple of Notice
        Messages about them.
    force : bool
        Whether the improved card is written in spite of objections.
    """

    study: GapStudy
    gap: Gap | None = None
    fitted: Measured = NO_TRIALS
    held: Measured = NO_TRIALS
    written: tuple[Path, ...] = ()
    remarks: tuple[Notice, ...] = ()
    force: bool = False
    command: ClassVar[str] = "gap"

    @property
    def verdict(self) -> str:
        """``missing effect``, ``no missing effect``, ``the coefficients explain it``, ``ambiguous`` or ``outside the
        library``."""
        return self.study.verdict

    @property
    def effects(self) -> pd.DataFrame:
        """Parameters of the effects that were named: effect, parameter, value, standard error, probability (0 to 1).

        Units are in the names of the parameters; angles are in degrees.
        """
        rows = [
            (effect.name, key, value, effect.standard_errors.get(key), effect.confidence)
            for effect in self.study.effects
            for key, value in effect.parameters.items()
        ]
        numbers = ["value", "standard_error", "probability"]
        return data_frame(rows, ["effect", "parameter", *numbers]).astype(dict.fromkeys(numbers, float))

    @property
    def surroundings(self) -> pd.DataFrame:
        """Winds and currents that differ from trial to trial: effect, trial, speed (m/s), direction (deg), errors.

        Directions count clockwise from north: from which a wind comes, towards which a current sets. Those of
        held-out trials were fitted to each such trial.
        """
        names = ["trial", "held_out", "speed_mps", "direction_deg", "speed_error_mps", "direction_error_deg"]
        rows = [{"effect": effect.name, **asdict(row)} for effect in self.study.effects for row in effect.by_trial]
        return data_frame(rows, ["effect", *names])

    @property
    def coefficients(self) -> pd.DataFrame:
        """Coefficients that were fitted together with the effects, by name; empty where the given ones were kept.

        Value and standard error now, and as the given card has them: prime or SI, rudder positive to starboard.
        """
        columns = ["name", "value", "standard_error", "before", "standard_error_before"]
        return data_frame(map(asdict, self.study.coefficients), columns, index="name")

    @property
    def misfit(self) -> pd.DataFrame:
        """Root mean square of (simulated - measured)/noise by trial, before and after: 1 is noise."""
        rows = [
            (trial_name(trial.trial), trial.held_out, trial.misfit["before"], trial.misfit["after"])
            for trial in self.study.trials
            if trial.misfit
        ]
        return data_frame(rows, ["trial", "held_out", "before", "after"], index="trial")

    @cached_property
    def improved(self) -> Card:
        """The card with the effects; the given card where none of the ship was named.

        Raises
        ------
        LookupError
            The result was read from its JSON.
        """
        gap, text = self._gap, self._improved_text("the improved card")
        if text == gap.card.text:
            return replace(parse_card(text, gap.card.source), covariance=gap.card.covariance)
        return derived_card(gap.base, text, gap.card.source)[0]

    @property
    def card(self) -> Card | None:
        """The improved card; None if the result was read from its JSON. ``ship`` is its ship."""
        return self.improved if self.gap else None

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: search for a missing effect"

    @property
    def subtitle(self) -> str:
        """Numbers of trials."""
        fitting = sum(not trial.held_out for trial in self.study.trials)
        held_out = len(self.study.trials) - fitting
        return f"{fitting} fitting trial{'s' * (fitting != 1)}, {held_out or 'none'} held out"

    @property
    def headline(self) -> tuple[str, ...]:
        """Objections to the improved card, the verdict with its probability, and the next test."""
        study, test = self.study, self.study.next_test
        return (
            *self._objections,
            f"{study.ship}: {found_in_words(study)}",
            *probabilities_in_words(study)[:1],
            *([f"Next test: {test.manoeuvre}. {capital(test.why)}"] if test else []),
        )

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Objections to the verdict, and messages about trials and files."""
        return *self.study.notices, *self.remarks

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The trials."""
        return tuple(trial.path for trial in (*self.fitted.trials, *self.held.trials))

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The verdict, its probability, misfits, and the next test."""
        study = self.study
        named = ", ".join(effect_in_words(effect.name) for effect in study.effects)
        sure = study.verdict in (MISSING, NO_EFFECT_MISSING, COEFFICIENTS) and not foremost(study.notices)
        caution = Verdict.NONE if sure else Verdict.CAUTION
        missing = study.verdict == MISSING
        value, note = (named, MISSING) if missing else (study.verdict, named)
        label = "What is missing" if missing else "Verdict"
        return (
            KeyFigure(label, value, verdict=caution, note=note),
            *_probability_figure(study),
            *_misfit_figures(study),
            *([KeyFigure("Next test", study.next_test.manoeuvre)] if study.next_test else []),
        )

    @cached_property
    def sections(self) -> Sequence[Section]:
        """Finding, certainty, next test, misfits, place of the gap, tracks, coefficients, agreement, noise."""
        study = self.study
        changed = changes_simulation(study)
        text = _BEFORE_AND_AFTER + ("" if changed else _UNCHANGED) + (_BLACK_BOX if _has_black_box(study) else "")
        test = study.next_test
        agreement = agreement_chart(study, title="Estimates of each trial alone")
        expected = expected_chart(test, title="Information of other manoeuvres") if test else None
        sections = [
            Section(
                "What was found",
                tables=[*_parameters(study), *_by_trial(study)],
                charts=_drawn("worst_tracks", worst_tracks(study, title="Tracks of the largest misfits")),
            ),
            Section(
                "How sure, and what else it could be",
                text="\n\n".join(verdict_context(study)),
                tables=[*_candidates(study), *_explanations(study)],
                charts=_drawn("rivals", rival_chart(study, title="Explanations compared")),
            ),
            *_shown("What could hide", _could_hide_text(study), tables=_could_hide(study)),
            Section("Next test", text=_next_test(study), charts=_drawn("expected", expected)),
            Section(
                "Before and after" if changed else "How well the card follows",
                text=text,
                tables=[_trials(study), _signals(study)],
                charts=_drawn("misfit", misfit_chart(study, title="Misfit by signal and manoeuvre")),
            ),
            _place_of_the_gap(study),
            Section("Tracks and motions", text=_track_text(study), charts=_motions(study)),
            *_shown("Figures of manoeuvres", _FIGURES, tables=_figures(study)),
            *_shown("Coefficients", _COEFFICIENTS, tables=_coefficients(study)),
            *_shown("Do the trials agree", _AGREEMENT, charts=_drawn("agreement", agreement)),
            Section("Noise", text=_NOISE, tables=[_noise(study)]),
        ]
        return [each for each in sections if each.text or each.tables or each.charts]

    def files(self, folder: Path) -> tuple[GapFiles, list[Notice]]:
        """Path to content of the files that belong into a folder, and messages about them.

        ``gap.json``, ``improved.toml`` with its covariance (without objections, or by force), ``report.html``,
        ``next_test.csv`` where a test would decide, ``corrected/`` where a sensor is at fault, and ``surroundings/``
        with the winds and currents of single trials as columns, with which the improved card follows them.
        """
        gap = self._gap
        text = self._improved_text(str(folder / IMPROVED))
        improved, notices = improved_files(gap.base, text, folder / IMPROVED)
        if self.study.card_objections and not self.force:
            improved, notices = {}, []
        files: GapFiles = {**improved, folder / REPORT: self.page()}
        if gap.next_test:
            files[folder / NEXT_TEST_FILE] = gap.next_test.orders
        corrected, about = self._corrected()
        for name, texts in {CORRECTED: corrected, SURROUNDED: self._surrounded()}.items():
            files |= {folder / name / f"{trial}.csv": text for trial, text in texts.items()}
        names = sorted(path.relative_to(folder).as_posix() for path in (*files, folder / GAP))
        files[folder / GAP] = self.to_json(files=names)
        return files, [*notices, *about]

    def _corrected(self) -> tuple[dict[str, str], list[Notice]]:
        """Name of each trial to its text without the fault of a sensor, if one is at fault, and messages."""
        gap, found, notices = self._gap, dict[str, str](), list[Notice]()
        at_fault = any(EFFECTS[effect.name].acts_on == "sensor" for effect in gap.effects)
        for trial in (*self.fitted.trials, *self.held.trials) if at_fault and gap.verdict == MISSING else ():
            corrected = corrected_text(trial.path, trial, self._found, gap.card.thrusters)
            if corrected is not None:
                found[trial.name] = corrected
            new = correct_sensor_faults(trial, self._found).notices[len(trial.notices) :]
            notices += [notice.of(trial.path.name) for notice in new if notice.leads]
        return found, notices

    def save(self, folder: str | Path) -> tuple[Notice, ...]:
        """Write :meth:`files` into a folder in place of those of an earlier run; return messages.

        Raises
        ------
        InputError
            The folder cannot be written.
        """
        return self.written_to(Path(folder)).remarks

    def written_to(self, folder: Path) -> GapResult:
        """Write :meth:`files` as :meth:`save` does; the result with them and with messages about them.

        Parameters
        ----------
        folder : Path
        """
        with folder_made(folder):
            files, notices = self.files(folder)
            removed = put(files, folder, [Path(self._gap.card.source), *self.inputs])
        names = tuple(sorted(path.relative_to(folder).as_posix() for path in files))
        study = replace(self.study, files=names)
        return replace(self, study=study, written=tuple(files), remarks=(*notices, *removed))

    @property
    def _objections(self) -> list[str]:
        """The line on an improved card that should not replace the given one."""
        if not self.study.card_objections:
            return []
        rule = "should not replace the given one, and is only written by force"
        return [f"The improved card {rule}: {'; '.join(self.study.card_objections)}."]

    @property
    def _gap(self) -> Gap:
        if self.gap is None:
            raise LookupError("a result that was read from its JSON has no card")
        return self.gap

    def _surrounded(self) -> dict[str, str]:
        """Name of each trial to its text with the winds and currents that were found for it."""
        gap = self._gap
        found = {effect.name: effect.by_trial for effect in gap.effects if effect.by_trial}
        if not found:
            return {}
        remark = f"{' and '.join(found)} of this trial estimated by tank2sim gap; at the size of {gap.card.source}"
        trials = (trial for group in (self.fitted, self.held) for trial in with_surroundings(group, found).trials)
        return {trial.name: trial_text(replace(trial, scale=None), [remark]) for trial in trials}

    @property
    def _found(self) -> list[Found]:
        return [(effect.name, effect.parameters, effect.standard_errors) for effect in self._gap.effects]

    def _improved_text(self, source: str) -> str:
        """Text of the improved card; raises InputError if it cannot be read again."""
        gap = self._gap
        text = gap.card.text
        if gap.improved.text != text:
            rivals = [joined(names) for names in gap.alternatives]
            names = [trial.name for trial in self.fitted.trials]
            text = card_with_effects_text(gap.improved, self._found, names, rivals, len(gap.coefficients))
            text = text if gap.card.thrusters else with_fitted_trials(text, source, self.fitted.trials)
        parse_card(text, source)
        return text


def gap_result(gap: Gap, fitted: Measured, held: Measured, *, force: bool = False) -> GapResult:
    """The result of a search with its trials.

    Parameters
    ----------
    gap : Gap
    fitted, held : Measured
    force : bool
        Write the improved card in spite of objections.
    """
    files = {trial.name: trial.path.name for trial in (*fitted.trials, *held.trials)}
    return GapResult(gap_study(gap, files), gap, fitted, held, force=force)


def improved_files(card: Card, text: str, path: Path) -> tuple[GapFiles, list[Notice]]:
    """Files of the improved card at `path`, with the valid part of the covariance of `card`; messages about it.

    A covariance that cannot be read is left out with a message: an hour's search is not lost for it.
    """
    try:
        found, messages = derived_card(card, text, path.name)
        return found.files(path), list(messages)
    except InputError as error:
        return {path: not_referring(text)}, [Notice(f"{path.name} has no covariance: {error}")]


def _probability_figure(study: GapStudy) -> list[KeyFigure]:
    """Probability of the least sure of the named effects, or that nothing is missing where none is named."""
    if study.effects:
        probability = min(effect.confidence for effect in study.effects)
        label = "Probability that it is there"
        note = "alone or with another effect" if len(study.effects) == 1 else "of the least sure one, in any company"
    elif (of_none := probability_of_none(study)) is not None:
        probability, label, note = of_none, "Probability that nothing is missing", "of what was tried"
    else:
        return []
    unsure = Verdict.NONE if probability >= _SURE else Verdict.CAUTION
    return [KeyFigure(label, as_percent(probability), verdict=unsure, note=note)]


def _misfit_figures(study: GapStudy) -> Iterator[KeyFigure]:
    """Misfit of each set of trials."""
    for word, held in SETS.items():
        before, after = (study.set_misfit(model, held_out=held) for model in ("before", "after"))
        if before is not None and after is not None:
            worse = Verdict.CAUTION if after > max(before, GOOD) else Verdict.NONE
            note = f"noise units; before {format_number(before, 3)}" if changes_simulation(study) else "noise units"
            label = f"Misfit, trials {_ON[word]}"
            yield KeyFigure(label, float(f"{after:.3g}"), verdict=worse, note=note)


def _drawn(name: str, chart: ChartSpec | None) -> list[Illustration]:
    return [] if chart is None else [Illustration(chart, caption=_CAPTIONS.get(name, ""), name=name)]


def _shown(
    heading: str, text: str, *, tables: Sequence[Table] = (), charts: Sequence[Illustration] = ()
) -> list[Section]:
    """A section that has tables or charts."""
    return [Section(heading, text=text, tables=tables, charts=charts)] if tables or charts else []


def _motions(study: GapStudy) -> list[Illustration]:
    """Tracks and histories of held-out, then of fitting trials."""
    return [
        chart
        for word, held in SETS.items()
        for chart in trial_pictures(
            worst_replays(study, held_out=held),
            _ON[word],
            word.replace(" ", "_"),
            captions=(_RUN, _RUN),
            signals=HISTORIES,
        )
    ]


_SIZE_HEADS = ("effect", "parameter", "value", "unit", "meaning")


def _sizes(effect: EffectFound, *more: Cell) -> Iterator[list[Cell]]:
    """A row for each parameter of an effect."""
    return ([effect_in_words(effect.name), *parameter_cells(effect, name), *more] for name in effect.parameters)


def _parameters(study: GapStudy) -> list[Table]:
    rows = [row for effect in study.effects for row in _sizes(effect)]
    what = "What the best of the candidates would be" if study.verdict == AMBIGUOUS else "What was found"
    return [table(f"{what}, ± one standard error", _SIZE_HEADS, rows)] if rows else []


def _by_trial(study: GapStudy) -> list[Table]:
    """Winds and currents that differ from trial to trial."""
    heads = ("trial", "set", "speed (m/s)", "direction (deg from north)")
    return [
        replace(
            table(
                f"{effect_in_words(effect.name).capitalize()} of each trial, ± one standard error",
                heads,
                [
                    [
                        row.trial,
                        "held out" if row.held_out else "fitting",
                        with_error(row.speed_mps, row.speed_error_mps),
                        with_error(row.direction_deg, row.direction_error_deg),
                    ]
                    for row in effect.by_trial
                ],
            ),
            wide=True,
        )
        for effect in study.effects
        if effect.by_trial
    ]


def _candidates(study: GapStudy) -> list[Table]:
    """The sizes of the other effects that it could be."""
    rows = [row for each in sizes_of_candidates(study) for row in _sizes(each, as_percent(each.confidence))]
    heads = (*_SIZE_HEADS, "probability that it is there")
    return [table("What the others would be, ± one standard error", heads, rows)] if rows else []


def _explanations(study: GapStudy) -> list[Table]:
    """The consequences of each effect that is only possible."""
    named = [effect.name for effect in study.effects] if study.verdict == AMBIGUOUS else []
    possible = dict.fromkeys([*named, *(name for text in study.alternatives for name in effects_of(text))])
    rows = [[effect_in_words(name), EFFECTS[name].description] for name in possible if name in EFFECTS]
    caption = "Effects that these data cannot distinguish"
    return [table(caption, ("effect", "in words"), rows, on_screen=False)] if rows else []


def _has_black_box(study: GapStudy) -> bool:
    return any("black_box" in trial.misfit for trial in study.trials)


def _compared(study: GapStudy) -> tuple[str, ...]:
    return (*shown_models(study), *(("black_box",) if _has_black_box(study) else ()))


def _trials(study: GapStudy) -> Table:
    models = _compared(study)
    rows, together = list[list[Cell]](), list[list[Cell]]()
    for word, held in SETS.items():
        trials = [trial for trial in study.trials if trial.held_out == held and trial.signals]
        for trial in trials:
            rows.append([trial_name(trial.trial), word, *_hundredths(map(trial.misfit.get, models))])
        if len(trials) > 1:
            sets = (study.set_misfit(model, held_out=held) for model in models)
            together.append(["all", word, *_hundredths(sets)])
    heads = ("trial", "set", *(model.replace("_", " ") for model in models))
    lost = any(math.inf in row for row in (*rows, *together))
    notes = ["Infinite: the simulation left all bounds."] * lost
    caption = "Misfit of each trial in units of the noise"
    return replace(table(caption, heads, [*rows, *together], *notes, digits=_ALL_DIGITS), wide=True)


def _signals(study: GapStudy) -> Table:
    measured = {name for trial in study.trials for name in trial.signals}
    held = {trial.held_out for trial in study.trials}
    columns = [(word, model) for word, of_held in SETS.items() if of_held in held for model in _compared(study)]
    named = {signal_of(name).words: name for name in study.misfit.noise if name in measured}
    rows: list[list[Cell]] = []
    for label, signal in [*named.items(), ("all", None)]:
        misfits = (study.set_misfit(model, held_out=SETS[word], signal=signal) for word, model in columns)
        rows.append([label, *_hundredths(misfits)])
    heads = ("signal", *(f"{word}, {model.replace('_', ' ')}" for word, model in columns))
    caption = "Misfit of each signal in units of the noise"
    return table(caption, heads, rows, digits=_ALL_DIGITS, on_screen=False)


def _hundredths(misfits: Iterable[float | None]) -> list[float | None]:
    return [misfit if misfit is None or not math.isfinite(misfit) else round(misfit, 2) for misfit in misfits]


def _place_of_the_gap(study: GapStudy) -> Section:
    """Where and when the gap arises, and the missing force or signal."""
    places: list[list[Cell]] = [
        [
            trial_name(place.trial),
            signal_of(place.signal).words,
            place.t_start_s,
            place.t_end_s,
            100 * place.share_of_misfit,
        ]
        for place in study.where
    ]
    passages: list[list[Cell]] = [
        [
            trial_name(passage.trial),
            EQUATION_WORDS.get(passage.equation, passage.equation),
            passage.t_start_s,
            passage.t_end_s,
            passage.standard_errors,
        ]
        for passage in study.acting[:_MOST_PASSAGES]
    ]
    interval = [Column(head, "s", digits=4) for head in ("from", "to")]
    share = Column("share of the misfit", "%", digits=2)
    size = Column("size", "standard errors", digits=3)
    tables = [
        table(
            "Where the misfit arises, beyond the noise", ["trial", "signal", *interval, share], places, on_screen=False
        ),
        table("When the cause acts", ["trial", "equation", *interval, size], passages, on_screen=False),
    ]
    charts = []
    for what, lacking in {"signal": study.missing_signal, "force": study.missing_force}.items():
        if lacking:
            charts += _drawn(f"when_{what}", when_chart(lacking, title=_WHEN[what]))
            charts += _drawn(what, lacking_chart(lacking, title=_OVER[what]))
    return Section(
        "Where the gap is",
        text=f"{_place_text(study)}\n\n{_acting_text(study)}",
        tables=[each for each in tables if each.rows],
        charts=[*charts, *_drawn("places", place_chart(study, title="Where the misfit is worst"))],
    )


def _place_text(study: GapStudy) -> str:
    if not study.where:
        return "No part of any trial exceeds the noise. The largest misfits are shown all the same."
    first = study.where[0]
    return (
        f"The largest part of the misfit beyond the noise, {100 * first.share_of_misfit:.0f} %, arises in "
        f"{signal_of(first.signal).words} ({first.signal}) of {trial_name(first.trial)}, from {first.t_start_s:.0f} s "
        f"to {first.t_end_s:.0f} s. Positions and headings count while their difference grows: the offset of a "
        "track that was left once does not count again."
    )


def _acting_text(study: GapStudy) -> str:
    """When the model itself is wrong, in a sentence; or why no force is shown."""
    earth_bound = study.equation in EARTH_BOUND
    without = _NO_FORCE if earth_bound and study.missing_force is None else ""
    if not study.acting:
        none = "the records do not contradict each other" if earth_bound else "no force exceeds its error"
        return f"The moments at which the cause acts are not known: {none}.{without}"
    return f"The cause acts most in {place_of_cause(study)}.{without}"


def _track_text(study: GapStudy) -> str:
    counts = {word: sum(trial.held_out == held for trial in study.trials) for word, held in SETS.items()}
    many = [
        f"{word}: the {MOST_TRIALS} of {count} with the largest misfit before"
        for word, count in counts.items()
        if count > MOST_TRIALS
    ]
    return f"Trials {'; '.join(many)}." if many else ""


def _figures(study: GapStudy) -> list[Table]:
    """Figures of manoeuvres, a table for each unit."""
    held = {trial.trial: trial.held_out for trial in study.trials}
    groups: dict[str, list[list[Cell]]] = {}
    for figure in sorted(study.figures, key=lambda figure: not held.get(figure.trial)):
        words, unit = in_words(figure.figure)
        word = "held out" if held.get(figure.trial) else "fitting"
        simulated = [getattr(figure, model) for model in shown_models(study)]
        groups.setdefault(unit, []).append([trial_name(figure.trial), word, words, figure.measured, *simulated])
    heads = ("trial", "set", "figure", "measured", *shown_models(study))
    return [
        table(f"Figures in {unit}" if unit else "Figures without unit", heads, rows, on_screen=False)
        for unit, rows in groups.items()
    ]


def _coefficients(study: GapStudy) -> list[Table]:
    """Coefficients that were fitted together with the effects, those that moved most first."""
    rows = [
        [
            entry.name,
            with_error(entry.before, entry.standard_error_before),
            with_error(entry.value, entry.standard_error),
            f"{entry.moved:.2f}",
        ]
        for entry in sorted(study.coefficients, key=lambda entry: entry.moved, reverse=True)
    ]
    heads = ("coefficient", "given card", "improved card", "moved by (standard errors)")
    caption = "Coefficients before and after, prime or SI, rudder to starboard"
    return [table(caption, heads, rows, on_screen=False)] if rows else []


def _could_hide_text(study: GapStudy) -> str:
    replaced = any(replaces(effect, name) for effect, sizes in study.could_hide.items() for name in sizes)
    return _COULD_HIDE + (_COULD_REPLACE if replaced else "")


def _could_hide(study: GapStudy) -> list[Table]:
    rows: list[list[Cell]] = []
    for effect, sizes in study.could_hide.items():
        for name, size in sizes.items():
            words, unit = in_words(name)
            shown = format_number(size, 2)
            shown = f"{shown} in place of the card's" if replaces(effect, name) else f"up to {shown}"
            rows.append([effect_in_words(effect), words, shown, unit or "-", meaning(effect, name)])
    heads = ("effect", "parameter", "would not show", "unit", "meaning")
    return [table("Sizes that these data cannot show", heads, rows, on_screen=False)] if rows else []


def _next_test(study: GapStudy) -> str:
    test = study.next_test
    if test is None:
        return "No manoeuvre was found that would decide more." if study.verdict == AMBIGUOUS else ""
    # The command has a line of its own: among other words it is broken at its hyphens.
    command = f"tank2sim simulate improved.toml --manoeuvre {test.manoeuvre}"
    begin = f"{capital(test.why)}\n\nIts orders are in {NEXT_TEST_FILE}."
    return begin if study.card_objections else f"{begin} To see it beforehand:\n\n{command}"


def _noise(study: GapStudy) -> Table:
    rows = []
    for column, noise in study.misfit.noise.items():
        name = signal_of(column)
        rows.append([name.words, column, format_number(noise.sigma, 3), name.unit, noise.origin])
    heads = ("signal", "column", "standard deviation", "unit", "from")
    return table("Measurement noise", heads, rows, on_screen=False)
