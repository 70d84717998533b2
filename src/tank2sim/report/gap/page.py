"""The page of a gap: the missing effect, its probability, its consequences, and the next test."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import altair as alt

from tank2sim.dynamics.effects import EFFECTS
from tank2sim.gap.diagnosis.error_intervals import acting, contradiction, earth_bound, missing_force_intervals
from tank2sim.gap.outcome.export import (
    NEXT_TEST_FILE,
    hidden,
    in_file_units,
    measured_in,
    paired_figures,
    replaces,
    signal_display_name,
)
from tank2sim.gap.proof.cross_check import proof_cautions
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, Gap
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
)
from tank2sim.report.gap.text import (
    GOOD,
    as_percent,
    effect_in_words,
    meaning,
    parameter_cells,
    sizes_of_candidates,
    verdict_context,
    verdict_in_words,
)
from tank2sim.report.kit.numbers import format_number
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable, Verdict
from tank2sim.units import in_words

_SURE = 0.9
"""Confidence from which a name is shown without caution (project choice)."""


def gap_charts(gap: Gap) -> dict[str, alt.TopLevelMixin]:
    """File stem to chart; what a gap has nothing for is left out."""
    test = gap.next_test
    lacking = {"signal": contradiction(gap), "force": missing_force_intervals(gap)}
    made: dict[str, alt.TopLevelMixin | None] = {
        "rivals": rival_chart(gap, title="Explanations compared"),
        "misfit": misfit_chart(gap, title="Misfit by signal and manoeuvre"),
        "places": place_chart(gap, title="Where the misfit is worst"),
        **{f"when_{what}": when_chart(values, title=_WHEN[what]) for what, values in lacking.items() if values},
        **{what: lacking_chart(values, title=_OVER[what]) for what, values in lacking.items() if values},
        **{
            f"tracks_{word.replace(' ', '_')}": gap_tracks(gap, held_out=held, title=f"Tracks, trials {_ON[word]}")
            for word, held in SETS.items()
        },
        **{
            f"histories_{word.replace(' ', '_')}_{sheet + 1}": chart
            for word, held in SETS.items()
            for sheet, chart in enumerate(gap_histories(gap, held_out=held, title=f"Motions, trials {_ON[word]}"))
        },
        "agreement": agreement_chart(gap, title="What each trial alone would have"),
        "expected": expected_chart(test, title="Information of other manoeuvres") if test else None,
    }
    return {stem: chart for stem, chart in made.items() if chart is not None}


def gap_page(gap: Gap, charts: Mapping[str, alt.TopLevelMixin]) -> Page:
    """The page; `charts` as :func:`gap_charts` gives them."""

    def drawn(*stems: str) -> list[Illustration]:
        names = [name for stem in stems for name in charts if name == stem or name.rpartition("_")[0] == stem]
        return [Illustration(chart=charts[stem], caption=_CAPTIONS.get(stem, _RUN)) for stem in names]

    sections = [
        PageSection(
            heading="Verdict",
            text="\n\n".join([verdict_in_words(gap), *verdict_context(gap)]),
            tables=[*_parameters(gap), *_candidates(gap), *_explanations(gap)],
            charts=drawn("rivals"),
        ),
        PageSection(
            heading="Before and after" if changes_simulation(gap) else "How well the card follows",
            text=_BEFORE_AND_AFTER
            + ("" if changes_simulation(gap) else _UNCHANGED)
            + (_BLACK_BOX if _black_box(gap) else ""),
            tables=[_signals(gap), _trials(gap)],
            charts=drawn("misfit"),
        ),
        PageSection(
            heading="Where the gap is",
            text="\n\n".join([_place_text(gap), _acting_text(gap)]),
            tables=[*_places(gap), *_passages(gap)],
            charts=drawn("when_signal", "signal", "when_force", "force", "places"),
        ),
        PageSection(heading="Tracks and motions", text=_track_text(gap), charts=drawn(*_RUNS)),
    ]
    if figures := _figures(gap):
        sections.append(PageSection(heading="Figures of manoeuvres", text=_FIGURES, tables=figures))
    if "agreement" in charts:
        sections.append(PageSection(heading="Do the trials agree", text=_AGREEMENT, charts=drawn("agreement")))
    if hidden := _could_hide(gap):
        sections.append(PageSection(heading="What could hide", text=_COULD_HIDE, tables=[hidden]))
    sections.append(PageSection(heading="Next test", text=_next_test(gap), charts=drawn("expected")))
    # One section: a tenth would not find room for its number in the list of contents.
    noise = [_noise(gap), *([_table("Notices", ("",), [[notice] for notice in gap.notices])] if gap.notices else [])]
    sections.append(PageSection(heading="Noise and notices" if gap.notices else "Noise", text=_NOISE, tables=noise))
    fitting = sum(not replay.held_out for replay in gap.passed)
    subtitle = (
        f"What the model lacks, from {_count(fitting, 'trial')} and {len(gap.passed) - fitting or 'none'} held out"
    )
    shown = [section for section in sections if section.text or section.tables or section.charts]
    return Page(title=gap.card.ship.name, subtitle=subtitle, figures=_key_figures(gap), sections=shown)


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
    "misfit": "u, v: velocity ahead and to starboard; r: yaw rate; psi: heading; x, y: north and east. The colour "
    "scale ends at 100.",
    "places": f"Points: measured. Shaded red: the time in which the misfit arises. {_LINES}",
    "when_signal": _STRIPS,
    "when_force": f"{_STRIPS} By the given card.",
    "signal": f"{_MEANS} What is constant goes with every state.",
    "force": f"The force that the given card needs in addition to follow the measurements. {_MEANS}",
    "agreement": "Points: each trial's own estimate; bars: 95 % intervals. Grey: all fitting trials together. Trials "
    "that determine little may leave the picture.",
    "expected": "The larger, the clearer the manoeuvre would decide; the difference is beyond what uncertain "
    "parameters can make up for.",
}


def _key_figures(gap: Gap) -> list[KeyFigure]:
    named = ", ".join(effect_in_words(effect.name) for effect in gap.effects)
    caution = (
        Verdict.NONE if gap.verdict in (MISSING, NO_EFFECT_MISSING) and not proof_cautions(gap) else Verdict.CAUTION
    )
    figures = [KeyFigure(label="Verdict", value=gap.verdict, verdict=caution, note=named)]
    if gap.effects:
        least = min(effect.confidence for effect in gap.effects)
        unsure = Verdict.CAUTION if not least >= _SURE else Verdict.NONE
        note = "alone or with another effect" if len(gap.effects) == 1 else "of the less sure one, in any company"
        figures.append(
            KeyFigure(label="Probability that it is there", value=as_percent(least), verdict=unsure, note=note)
        )
    for word, held in SETS.items():
        before, after = (gap.misfit(model, held_out=held) for model in ("before", "after"))
        if before is not None and after is not None:
            worse = Verdict.CAUTION if after > max(before, GOOD) else Verdict.NONE
            note = f"noise units; before {format_number(before, 3)}" if changes_simulation(gap) else "noise units"
            figures.append(
                KeyFigure(label=f"Misfit, trials {_ON[word]}", value=_rounded(after), verdict=worse, note=note)
            )
    if gap.next_test:
        figures.append(KeyFigure(label="Next test", value=gap.next_test.manoeuvre))
    return figures


def _parameters(gap: Gap) -> list[PageTable]:
    rows: list[list[Cell]] = [
        [effect_in_words(effect.name), *parameter_cells(effect, name)]
        for effect in gap.effects
        for name in effect.parameters
    ]
    heads = ("effect", "parameter", "value", "unit", "meaning")
    what = "What the best of the candidates would be" if gap.verdict == AMBIGUOUS else "What was found"
    return [_table(f"{what}, ± one standard error", heads, rows)] if rows else []


def _candidates(gap: Gap) -> list[PageTable]:
    """The sizes of the other effects that it could be."""
    rows: list[list[Cell]] = [
        [effect_in_words(candidate.name), *parameter_cells(candidate, name), as_percent(candidate.confidence)]
        for candidate in sizes_of_candidates(gap)
        for name in candidate.parameters
    ]
    heads = ("effect", "parameter", "value", "unit", "meaning", "probability that it is there")
    return [_table("What the others would be, ± one standard error", heads, rows)] if rows else []


def _explanations(gap: Gap) -> list[PageTable]:
    """The consequences of each effect that is only possible."""
    named = [effect.name for effect in gap.effects] if gap.verdict == AMBIGUOUS else []
    possible = dict.fromkeys([*named, *(name for alternative in gap.alternatives for name in alternative)])
    rows: list[list[Cell]] = [
        [effect_in_words(name), EFFECTS[name].description] for name in possible if name in EFFECTS
    ]
    return [_table("Effects that these data cannot distinguish", ("effect", "in words"), rows)] if rows else []


def _black_box(gap: Gap) -> bool:
    return any(replay.black_box for replay in gap.passed)


def _trials(gap: Gap) -> PageTable:
    rows: list[list[Cell]] = [
        [replay.name, word]
        + [
            _cell(None if model == "black_box" and not replay.black_box else replay.misfit(model))
            for model in _compared(gap)
        ]
        for word, held in SETS.items()
        for replay in gap.passed
        if replay.held_out == held and measured_in(replay)
    ]
    heads = ("trial", "set", *(model.replace("_", " ") for model in _compared(gap)))
    return _table("Misfit of each trial, noise units", heads, rows, digits=_ALL)


def _signals(gap: Gap) -> PageTable:
    measured = {name for replay in gap.passed for name in measured_in(replay)}
    words = [word for word, held in SETS.items() if any(replay.held_out == held for replay in gap.passed)]
    columns = [(word, model) for word in words for model in _compared(gap)]
    rows: list[list[Cell]] = [
        [signal_display_name(name).words]
        + [_cell(signal_misfit(gap, model, name, held_out=SETS[word])) for word, model in columns]
        for name in gap.noise
        if name in measured
    ]
    rows.append(["all", *(_cell(gap.misfit(model, held_out=SETS[word])) for word, model in columns)])
    heads = ("signal", *(f"{word}, {model.replace('_', ' ')}" for word, model in columns))
    return _table("Misfit of each signal, noise units", heads, rows, digits=_ALL)


def _compared(gap: Gap) -> tuple[str, ...]:
    return (*shown_models(gap), *(("black_box",) if _black_box(gap) else ()))


_ALL = 7
"""Significant digits that cut nothing off: misfits are rounded to hundredths of the noise before, in every column."""


def _cell(misfit: float | None) -> float | None:
    return misfit if misfit is None or not math.isfinite(misfit) else round(misfit, 2)


def _place_text(gap: Gap) -> str:
    if not gap.where:
        return "No part of any trial exceeds the noise. The largest misfits are shown all the same."
    first, name = gap.where[0], signal_display_name(gap.where[0].signal)
    return (
        f"The largest part of the misfit beyond the noise, {100 * first.share:.0f} %, arises in {name.words} "
        f"({name.file}) of {first.trial}, from {first.t_start_s:.0f} s to {first.t_end_s:.0f} s. Positions and "
        "headings count while their difference grows: a track that was left once stays left."
    )


def _acting_text(gap: Gap) -> str:
    """When the model itself is wrong, in a sentence; or why no force is shown."""
    found = acting(gap)
    without = _NO_FORCE if earth_bound(gap) and missing_force_intervals(gap) is None else ""
    if not found:
        none = "the records do not contradict each other" if earth_bound(gap) else "no force exceeds its error"
        return f"At what moments the cause acts cannot be said: {none}." + without
    first = found[0]
    text = (
        f"The cause acts most in {_ACTING.get(first.equation, first.equation)}, from "
        f"{first.t_start_s:.0f} s to {first.t_end_s:.0f} s of {first.trial}."
    )
    return text + without


def _passages(gap: Gap) -> list[PageTable]:
    rows: list[list[Cell]] = [
        [
            passage.trial,
            _ACTING.get(passage.equation, passage.equation),
            passage.t_start_s,
            passage.t_end_s,
            passage.size,
        ]
        for passage in acting(gap)[:_MOST_PASSAGES]
    ]
    columns = [
        *(Column(title=head) for head in ("trial", "equation")),
        *(Column(title=head, unit="s", digits=3) for head in ("from", "to")),
        Column(title="size", unit="standard errors", digits=2),
    ]
    return [PageTable(caption="When the cause acts", columns=columns, rows=rows)] if rows else []


_MOST_PASSAGES = 12
"""Passages in a table (project choice)."""

_ACTING = {
    "surge": "the force ahead",
    "sway": "the force to the side",
    "yaw": "the turning moment",
    "track": "the motion over the ground",
    "heading": "heading against yaw rate",
}
_NO_FORCE = (
    " No force is missing, and none is shown: what counts is by how much the records of position, heading and velocity "
    "contradict each other, whatever the hull does."
)


def _places(gap: Gap) -> list[PageTable]:
    rows: list[list[Cell]] = [
        [
            location.trial,
            signal_display_name(location.signal).words,
            location.t_start_s,
            location.t_end_s,
            100 * location.share,
        ]
        for location in gap.where
    ]
    columns = [
        *(Column(title=head) for head in ("trial", "signal")),
        *(Column(title=head, unit="s", digits=3) for head in ("from", "to")),
        Column(title="share of the misfit", unit="%", digits=2),
    ]
    return [PageTable(caption="Where the misfit arises, beyond the noise", columns=columns, rows=rows)] if rows else []


def _track_text(gap: Gap) -> str:
    counts = {word: sum(replay.held_out == held for replay in gap.passed) for word, held in SETS.items()}
    many = [
        f"{word}: the {MOST_TRIALS_DRAWN} of {count} with the largest misfit before"
        for word, count in counts.items()
        if count > MOST_TRIALS_DRAWN
    ]
    return f"Trials {'; '.join(many)}." if many else ""


def _figures(gap: Gap) -> list[PageTable]:
    held = {replay.name: replay.held_out for replay in gap.passed}
    groups: dict[str, list[list[Cell]]] = {}
    for before, after in sorted(paired_figures(gap), key=lambda pair: not held.get(pair[1].trial)):
        words, unit = in_words(after.name)
        word = "held out" if held.get(after.trial) else "fitting"
        simulated = [before.predicted if before else None, *([after.predicted] if changes_simulation(gap) else [])]
        groups.setdefault(unit, []).append([after.trial, word, words, after.measured, *simulated])
    heads = ("trial", "set", "figure", "measured", *shown_models(gap))
    return [
        _table(f"Figures in {unit}" if unit else "Figures without unit", heads, rows, digits=4)
        for unit, rows in groups.items()
    ]


def _could_hide(gap: Gap) -> PageTable | None:
    rows: list[list[Cell]] = []
    for effect, sizes in hidden(gap).items():
        for name, size in sizes.items():
            parameter, value = in_file_units(name, size)
            words, unit = in_words(parameter)
            shown = format_number(value, 2)
            shown = f"{shown} in place of the card's" if replaces(effect, name) else f"up to {shown}"
            rows.append([effect_in_words(effect), words, shown, unit or "-", meaning(effect, name)])
    heads = ("effect", "parameter", "would not show", "unit", "meaning")
    return _table("Sizes that these data cannot show", heads, rows) if rows else None


def _next_test(gap: Gap) -> str:
    test = gap.next_test
    if test is None:
        return "" if gap.verdict in (MISSING, NO_EFFECT_MISSING) else "No manoeuvre was found that would decide more."
    # The command has a line of its own: among other words it is broken at its hyphens.
    command = f"tank2sim simulate improved.toml --manoeuvre {test.manoeuvre}"
    why = f"{test.why[0].upper()}{test.why[1:].rstrip('.')}."
    return f"{why}\n\nIts orders are in {NEXT_TEST_FILE}. To see it beforehand:\n\n{command}"


def _noise(gap: Gap) -> PageTable:
    rows: list[list[Cell]] = []
    for variable, (sigma, origin) in gap.noise.items():
        name = signal_display_name(variable)
        rows.append([name.words, name.file, format_number(name.factor * sigma, 3), name.unit, origin])
    heads = ("signal", "column", "standard deviation", "unit", "from")
    return _table("Measurement noise", heads, rows)


def _table(caption: str, heads: Sequence[str], rows: Sequence[Sequence[Cell]], *, digits: int = 4) -> PageTable:
    return PageTable(caption=caption, columns=[Column(title=head, digits=digits) for head in heads], rows=rows)


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
