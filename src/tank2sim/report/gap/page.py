"""The page of a gap: the missing effect, its probability, its consequences, and the next test."""

from __future__ import annotations

import math
from collections.abc import Sequence

import altair as alt

from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.error_intervals import EARTH_BOUND
from tank2sim.gap.outcome.export import NEXT_TEST_FILE, replaces
from tank2sim.gap.result import AMBIGUOUS, COEFFICIENTS, MISSING, NO_EFFECT_MISSING
from tank2sim.report.gap.cause_charts import agreement_chart, expected_chart, lacking_chart, rival_chart, when_chart
from tank2sim.report.gap.charts import (
    MOST_TRIALS_DRAWN,
    SETS,
    changes_simulation,
    gap_histories,
    gap_tracks,
    misfit_chart,
    place_chart,
    shown_models,
    signal_misfit,
    signal_of,
    worst_tracks,
)
from tank2sim.report.gap.text import (
    EQUATION_WORDS,
    GOOD,
    as_percent,
    effect_in_words,
    effects_of,
    meaning,
    or_nan,
    parameter_cells,
    place_of_cause,
    set_misfit,
    sizes_of_candidates,
    trial_name,
    verdict_context,
    verdict_in_words,
    with_error,
)
from tank2sim.report.json_values import Json, as_number
from tank2sim.units import in_words

_SURE = 0.9
"""Confidence from which a name is shown without caution (project choice)."""


def gap_charts(found: Json) -> dict[str, alt.TopLevelMixin]:
    """Return the charts of the JSON by file stem; what a gap has nothing for is left out."""
    test = found["next_test"]
    lacking = {"signal": found["missing_signal"], "force": found["missing_force"]}
    made: dict[str, alt.TopLevelMixin | None] = {
        "worst_tracks": worst_tracks(found, title="Measured tracks, and those of the card before and after"),
        "rivals": rival_chart(found, title="Explanations compared"),
        "misfit": misfit_chart(found, title="Misfit by signal and manoeuvre"),
        "places": place_chart(found, title="Where the misfit is worst"),
        **{f"when_{what}": when_chart(values, title=_WHEN[what]) for what, values in lacking.items() if values},
        **{what: lacking_chart(values, title=_OVER[what]) for what, values in lacking.items() if values},
        **{
            f"tracks_{word.replace(' ', '_')}": gap_tracks(found, held_out=held, title=f"Tracks, trials {_ON[word]}")
            for word, held in SETS.items()
        },
        **{
            f"histories_{word.replace(' ', '_')}_{sheet + 1}": chart
            for word, held in SETS.items()
            for sheet, chart in enumerate(gap_histories(found, held_out=held, title=f"Motions, trials {_ON[word]}"))
        },
        "agreement": agreement_chart(found, title="What each trial alone would have"),
        "expected": expected_chart(test, title="Information of other manoeuvres") if test else None,
    }
    return {stem: chart for stem, chart in made.items() if chart is not None}


def gap_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim gap``."""
    charts = gap_charts(found)

    def drawn(*stems: str) -> list[Illustration]:
        names = [name for stem in stems for name in charts if name == stem or name.rpartition("_")[0] == stem]
        return [Illustration(chart=charts[stem], caption=_CAPTIONS.get(stem, _RUN)) for stem in names]

    sections = [
        Section(
            heading="What was found",
            tables=[*_parameters(found), *_by_trial(found)],
            charts=drawn("worst_tracks"),
        ),
        Section(
            heading="How sure, and what else it could be",
            text="\n\n".join(verdict_context(found)),
            tables=[*_candidates(found), *_explanations(found)],
            charts=drawn("rivals"),
        ),
    ]
    if hidden := _could_hide(found):
        sections.append(Section(heading="What could hide", text=_COULD_HIDE, tables=[hidden]))
    sections += [
        Section(heading="Next test", text=_next_test(found), charts=drawn("expected")),
        Section(
            heading="Before and after" if changes_simulation(found) else "How well the card follows",
            text=_BEFORE_AND_AFTER
            + ("" if changes_simulation(found) else _UNCHANGED)
            + (_BLACK_BOX if _black_box(found) else ""),
            tables=[_signals(found), _trials(found)],
            charts=drawn("misfit"),
        ),
        Section(
            heading="Where the gap is",
            text="\n\n".join([_place_text(found), _acting_text(found)]),
            tables=[*_places(found), *_passages(found)],
            charts=drawn("when_signal", "signal", "when_force", "force", "places"),
        ),
        Section(heading="Tracks and motions", text=_track_text(found), charts=drawn(*_RUNS)),
    ]
    if figures := _figures(found):
        sections.append(Section(heading="Figures of manoeuvres", text=_FIGURES, tables=figures))
    if coefficients := _coefficients(found):
        sections.append(Section(heading="Coefficients", text=_COEFFICIENTS, tables=[coefficients]))
    if "agreement" in charts:
        sections.append(Section(heading="Do the trials agree", text=_AGREEMENT, charts=drawn("agreement")))
    notices = found["notices"][len(found["cautions"]) :]
    noise = [_noise(found), *([_table("Notices", ("",), [[notice] for notice in notices])] if notices else [])]
    sections.append(Section(heading="Noise and notices" if notices else "Noise", text=_NOISE, tables=noise))
    fitting = sum(not trial["held_out"] for trial in found["trials"])
    held_out = len(found["trials"]) - fitting
    subtitle = f"What the model lacks, from {_count(fitting, 'trial')} and {held_out or 'none'} held out"
    shown = [section for section in sections if section.text or section.tables or section.charts]
    return Page(
        title=found["ship"],
        subtitle=subtitle,
        verdict=verdict_in_words(found),
        figures=_key_figures(found),
        sections=shown,
    )


def _coefficients(found: Json) -> Table | None:
    """Coefficients that were fitted together with the effects, those that moved most first."""

    def moved(entry: Json) -> float:
        return abs(or_nan(entry["value"]) - or_nan(entry["before"])) / or_nan(entry["standard_error_before"])

    rows: list[list[Cell]] = [
        [
            entry["name"],
            with_error(or_nan(entry["before"]), or_nan(entry["standard_error_before"])),
            with_error(or_nan(entry["value"]), or_nan(entry["standard_error"])),
            f"{moved(entry):.2f}",
        ]
        for entry in sorted(found["coefficients"], key=moved, reverse=True)
    ]
    heads = ("", "given card", "improved card", "moved by, standard errors")
    return _table("Coefficients before and after, prime or SI, rudder to starboard", heads, rows) if rows else None


_COEFFICIENTS = (
    "Coefficients of the card fitted together with the effects, within the card's standard errors (times a common "
    "factor that the trials determine)."
)
_ON = {"held out": "held out", "fitting": "used for fitting"}
_BEFORE_AND_AFTER = (
    "Each trial is simulated freely from its beginning to its end with the recorded inputs alone. Misfit is the root "
    "mean square of simulated less measured, in standard deviations of the measurement noise: 1 is the noise floor, "
    "which no model gets below but by chance. Trials held out took no part in naming the effect."
)
_UNCHANGED = " Nothing was added to the card, so that no model after it is shown."
_BLACK_BOX = (
    " The chart also shows a linear black box: the card with as many of its linear coefficients refitted as the effect "
    "has parameters, whatever the cause."
)
_FIGURES = (
    "Advance, transfer, diameters and overshoots are of turns and zigzags simulated in closed loop, the others of the "
    "trials replayed. Before is the card as given, after the one with the effect."
)
_AGREEMENT = (
    "A true effect has the same size in every trial. Where trials want different sizes, the name is wrong or not all."
)
_COULD_HIDE = (
    "Effects up to this size could be there without showing in these data, each with what was found. Limits and time "
    "constants of the gear have no size of this kind, for the ship has them anyway: of them the value furthest from "
    "the card's is reported that would not show in its place."
)
_NOISE = (
    "By these standard deviations misfits are counted. Stated: by the files; estimated: from the records themselves."
)
_WHEN = {"signal": "When the records contradict each other", "force": "When a force is missing"}
_OVER = {"signal": "How the records contradict each other", "force": "The missing force over what explains it"}
_STRIPS = (
    "Blue and orange: to either side, stronger where more is missing; pale grey is nothing, no colour: not measured."
)
_MEANS = "Points: instants of all trials; squares: means of bins, with 95 % bars by the spread between trials."
_LINES = (
    "Card before: as given. Card found: with what was found, which is called after elsewhere; one upon the other where "
    "nothing was added."
)
_RUN = f"Points: measured. Lines: simulated. {_LINES}"
_RUNS = ("tracks_held_out", "histories_held_out", "tracks_fitting", "histories_fitting")


_CAPTIONS = {
    "rivals": "",
    "worst_tracks": f"The trials with the largest misfit. Points: measured. Lines: simulated. {_LINES}",
    "misfit": "u, v: velocity ahead and to starboard; r: yaw rate; psi: heading; x, y: north and east. The colour "
    "scale ends at 100.",
    "places": f"Points: measured. Shaded red: the time in which the misfit arises. {_LINES}",
    "when_signal": _STRIPS,
    "when_force": f"{_STRIPS} By the given card.",
    "signal": f"{_MEANS} What is constant goes with every state.",
    "force": f"The force that the given card needs in addition to follow the measurements. {_MEANS}",
    "agreement": "Points: each trial's own estimate; bars: 95 % intervals. Grey: all fitting trials together. Trials "
    "that determine little may leave the picture.",
    "expected": "Difference between the explanations, of all readings together, beyond what uncertain parameters can "
    "make up for: the larger, the clearer the manoeuvre would decide.",
}


def _key_figures(found: Json) -> list[KeyFigure]:
    effects = found["effects"]
    named = ", ".join(effect_in_words(effect["name"]) for effect in effects)
    sure = found["verdict"] in (MISSING, NO_EFFECT_MISSING, COEFFICIENTS) and not found["cautions"]
    caution = Verdict.NONE if sure else Verdict.CAUTION
    missing = found["verdict"] == MISSING
    value, note = (named, MISSING) if missing else (found["verdict"], named)
    label = "What is missing" if missing else "Verdict"
    figures = [KeyFigure(label=label, value=value, verdict=caution, note=note)]
    if effects:
        least = min(or_nan(effect["confidence"]) for effect in effects)
        unsure = Verdict.CAUTION if not least >= _SURE else Verdict.NONE
        note = "alone or with another effect" if len(effects) == 1 else "of the less sure one, in any company"
        figures.append(
            KeyFigure(label="Probability that it is there", value=as_percent(least), verdict=unsure, note=note)
        )
    for word, held in SETS.items():
        before, after = (set_misfit(found, model, held_out=held) for model in ("before", "after"))
        if before is not None and after is not None:
            worse = Verdict.CAUTION if after > max(before, GOOD) else Verdict.NONE
            note = f"noise units; before {format_number(before, 3)}" if changes_simulation(found) else "noise units"
            figures.append(
                KeyFigure(label=f"Misfit, trials {_ON[word]}", value=_rounded(after), verdict=worse, note=note)
            )
    if found["next_test"]:
        figures.append(KeyFigure(label="Next test", value=found["next_test"]["manoeuvre"]))
    return figures


def _parameters(found: Json) -> list[Table]:
    rows: list[list[Cell]] = [
        [effect_in_words(effect["name"]), *parameter_cells(effect, name)]
        for effect in found["effects"]
        for name in effect["parameters"]
    ]
    heads = ("effect", "parameter", "value", "unit", "meaning")
    what = "What the best of the candidates would be" if found["verdict"] == AMBIGUOUS else "What was found"
    return [_table(f"{what}, ± one standard error", heads, rows)] if rows else []


def _by_trial(found: Json) -> list[Table]:
    """Winds and currents that differ from trial to trial."""
    tables = []
    for effect in found["effects"]:
        rows: list[list[Cell]] = [
            [
                trial_name(row["trial"]),
                "held out" if row["held_out"] else "fitted",
                with_error(or_nan(row["speed_mps"]), or_nan(row["standard_errors"]["speed_mps"])),
                with_error(or_nan(row["direction_deg"]), or_nan(row["standard_errors"]["direction_deg"])),
            ]
            for row in effect.get("by_trial") or []
        ]
        title = f"{effect_in_words(effect['name']).capitalize()} of each trial, ± one standard error"
        heads = ("trial", "set", "speed, m/s", "direction, deg from north")
        tables += [_table(title, heads, rows)] if rows else []
    return tables


def _candidates(found: Json) -> list[Table]:
    """The sizes of the other effects that it could be."""
    rows: list[list[Cell]] = [
        [effect_in_words(candidate["name"]), *parameter_cells(candidate, name), as_percent(candidate["confidence"])]
        for candidate in sizes_of_candidates(found)
        for name in candidate["parameters"]
    ]
    heads = ("effect", "parameter", "value", "unit", "meaning", "probability that it is there")
    return [_table("What the others would be, ± one standard error", heads, rows)] if rows else []


def _explanations(found: Json) -> list[Table]:
    """The consequences of each effect that is only possible."""
    named = [effect["name"] for effect in found["effects"]] if found["verdict"] == AMBIGUOUS else []
    possible = dict.fromkeys([*named, *(name for text in found["alternatives"] for name in effects_of(text))])
    rows: list[list[Cell]] = [
        [effect_in_words(name), EFFECTS[name].description] for name in possible if name in EFFECTS
    ]
    return [_table("Effects that these data cannot distinguish", ("effect", "in words"), rows)] if rows else []


def _black_box(found: Json) -> bool:
    return any("black_box" in trial["misfit"] for trial in found["trials"])


def _trials(found: Json) -> Table:
    models = _compared(found)
    rows: list[list[Cell]] = [
        [trial_name(trial["trial"]), word]
        + [_cell(as_number(trial["misfit"][model]) if model in trial["misfit"] else None) for model in models]
        for word, held in SETS.items()
        for trial in found["trials"]
        if trial["held_out"] == held and trial["signals"]
    ]
    heads = ("trial", "set", *(model.replace("_", " ") for model in models))
    return _table("Misfit of each trial, noise units", heads, rows, digits=_ALL)


def _signals(found: Json) -> Table:
    measured = {name for trial in found["trials"] for name in trial["signals"]}
    words = [word for word, held in SETS.items() if any(trial["held_out"] == held for trial in found["trials"])]
    columns = [(word, model) for word in words for model in _compared(found)]
    rows: list[list[Cell]] = [
        [signal_of(name).words]
        + [_cell(signal_misfit(found, model, name, held_out=SETS[word])) for word, model in columns]
        for name in found["misfit"]["noise"]
        if name in measured
    ]
    rows.append(["all", *(_cell(set_misfit(found, model, held_out=SETS[word])) for word, model in columns)])
    heads = ("signal", *(f"{word}, {model.replace('_', ' ')}" for word, model in columns))
    return _table("Misfit of each signal, noise units", heads, rows, digits=_ALL)


def _compared(found: Json) -> tuple[str, ...]:
    return (*shown_models(found), *(("black_box",) if _black_box(found) else ()))


_ALL = 7
"""Significant digits that cut nothing off: misfits are rounded to hundredths of the noise before, in every column."""


def _cell(misfit: float | None) -> float | None:
    return misfit if misfit is None or not math.isfinite(misfit) else round(misfit, 2)


def _place_text(found: Json) -> str:
    if not found["where"]:
        return "No part of any trial exceeds the noise. The largest misfits are shown all the same."
    first = found["where"][0]
    share, begin, end = (or_nan(first[key]) for key in ("share_of_misfit", "t_start_s", "t_end_s"))
    return (
        f"The largest part of the misfit beyond the noise, {100 * share:.0f} %, arises in "
        f"{signal_of(first['signal']).words} ({first['signal']}) of {trial_name(first['trial'])}, from {begin:.0f} s "
        f"to {end:.0f} s. Positions and headings count while their difference grows: a track that was left once stays "
        "left."
    )


def _acting_text(found: Json) -> str:
    """When the model itself is wrong, in a sentence; or why no force is shown."""
    earth_bound = found["equation"] in EARTH_BOUND
    without = _NO_FORCE if earth_bound and found["missing_force"] is None else ""
    if not found["acting"]:
        none = "the records do not contradict each other" if earth_bound else "no force exceeds its error"
        return f"At what moments the cause acts cannot be said: {none}." + without
    text = f"The cause acts most in {place_of_cause(found)}."
    return text + without


def _passages(found: Json) -> list[Table]:
    rows: list[list[Cell]] = [
        [
            trial_name(passage["trial"]),
            EQUATION_WORDS.get(passage["equation"], passage["equation"]),
            *(passage[key] for key in ("t_start_s", "t_end_s", "standard_errors")),
        ]
        for passage in found["acting"][:_MOST_PASSAGES]
    ]
    columns = [
        *(Column(title=head) for head in ("trial", "equation")),
        *(Column(title=head, unit="s", digits=3) for head in ("from", "to")),
        Column(title="size", unit="standard errors", digits=2),
    ]
    return [Table(caption="When the cause acts", columns=columns, rows=rows)] if rows else []


_MOST_PASSAGES = 12
"""Passages in a table (project choice)."""

_NO_FORCE = (
    " No force is missing, and none is shown: what counts is by how much the records of position, heading and velocity "
    "contradict each other, whatever the hull does."
)


def _places(found: Json) -> list[Table]:
    rows: list[list[Cell]] = [
        [
            trial_name(place["trial"]),
            signal_of(place["signal"]).words,
            place["t_start_s"],
            place["t_end_s"],
            100 * or_nan(place["share_of_misfit"]),
        ]
        for place in found["where"]
    ]
    columns = [
        *(Column(title=head) for head in ("trial", "signal")),
        *(Column(title=head, unit="s", digits=3) for head in ("from", "to")),
        Column(title="share of the misfit", unit="%", digits=2),
    ]
    return [Table(caption="Where the misfit arises, beyond the noise", columns=columns, rows=rows)] if rows else []


def _track_text(found: Json) -> str:
    counts = {word: sum(trial["held_out"] == held for trial in found["trials"]) for word, held in SETS.items()}
    many = [
        f"{word}: the {MOST_TRIALS_DRAWN} of {count} with the largest misfit before"
        for word, count in counts.items()
        if count > MOST_TRIALS_DRAWN
    ]
    return f"Trials {'; '.join(many)}." if many else ""


def _figures(found: Json) -> list[Table]:
    held = {trial["trial"]: trial["held_out"] for trial in found["trials"]}
    groups: dict[str, list[list[Cell]]] = {}
    for figure in sorted(found["figures"], key=lambda figure: not held.get(figure["trial"])):
        words, unit = in_words(figure["figure"])
        word = "held out" if held.get(figure["trial"]) else "fitting"
        simulated = [figure[model] for model in shown_models(found)]
        groups.setdefault(unit, []).append([trial_name(figure["trial"]), word, words, figure["measured"], *simulated])
    heads = ("trial", "set", "figure", "measured", *shown_models(found))
    return [
        _table(f"Figures in {unit}" if unit else "Figures without unit", heads, rows, digits=4)
        for unit, rows in groups.items()
    ]


def _could_hide(found: Json) -> Table | None:
    rows: list[list[Cell]] = []
    for effect, sizes in found["could_hide"].items():
        for name, size in sizes.items():
            words, unit = in_words(name)
            shown = format_number(or_nan(size), 2)
            shown = f"{shown} in place of the card's" if replaces(effect, name) else f"up to {shown}"
            rows.append([effect_in_words(effect), words, shown, unit or "-", meaning(effect, name)])
    heads = ("effect", "parameter", "would not show", "unit", "meaning")
    return _table("Sizes that these data cannot show", heads, rows) if rows else None


def _next_test(found: Json) -> str:
    test = found["next_test"]
    if test is None:
        sure = found["verdict"] in (MISSING, NO_EFFECT_MISSING, COEFFICIENTS)
        return "" if sure else "No manoeuvre was found that would decide more."
    # The command has a line of its own: among other words it is broken at its hyphens.
    command = f"tank2sim simulate improved.toml --manoeuvre {test['manoeuvre']}"
    why = f"{test['why'][0].upper()}{test['why'][1:].rstrip('.')}."
    return f"{why}\n\nIts orders are in {NEXT_TEST_FILE}. To see it beforehand:\n\n{command}"


def _noise(found: Json) -> Table:
    rows: list[list[Cell]] = []
    for column, noise in found["misfit"]["noise"].items():
        name = signal_of(column)
        rows.append([name.words, column, format_number(or_nan(noise["sigma"]), 3), name.unit, noise["from"]])
    heads = ("signal", "column", "standard deviation", "unit", "from")
    return _table("Measurement noise", heads, rows)


def _table(caption: str, heads: Sequence[str], rows: Sequence[Sequence[Cell]], *, digits: int = 4) -> Table:
    return Table(caption=caption, columns=[Column(title=head, digits=digits) for head in heads], rows=rows)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
