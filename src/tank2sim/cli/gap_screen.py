"""What ``tank2sim gap`` prints."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

from tank2sim.api.result import cell_text
from tank2sim.cli.console import screen
from tank2sim.gap.diagnosis.error_intervals import acting
from tank2sim.gap.outcome.export import estimate_in_file, in_file_units, joined, measured_in, signal_display_name
from tank2sim.gap.result import AMBIGUOUS, Gap, Named
from tank2sim.units import in_words


def show_gap(gap: Gap) -> None:
    """Print what was found of one ship."""
    from tank2sim.report.gap.text import probabilities_in_words, sizes_of_candidates, verdict_in_words

    line(f"{gap.card.ship.name}: {verdict_in_words(gap)}")
    if rows := [row for one in gap.effects for row in _parameters(one)]:
        what = "What the best of the candidates would be" if gap.verdict == AMBIGUOUS else "What was found"
        wide_table(what, ["effect", "parameter", "value", "standard error", "unit"], rows)
    for told in probabilities_in_words(gap):
        line(told)
    if gap.alternatives:
        line(f"these data cannot tell it from: {'; '.join(joined(one) for one in gap.alternatives)}")
    if rows := [row for one in sizes_of_candidates(gap) for row in _parameters(one)]:
        wide_table("What the others would be", ["effect", "parameter", "value", "standard error", "unit"], rows)
    for place in gap.where[:1]:
        line(
            f"most of the misfit arises in {signal_display_name(place.signal).file} of {place.trial}, "
            f"{place.t_start_s:.4g} s to {place.t_end_s:.4g} s ({100 * place.share:.0f} %)"
        )
    for one in acting(gap)[:1]:
        line(
            f"the cause acts most in {one.equation} of {one.trial}, {one.t_start_s:.4g} s to {one.t_end_s:.4g} s "
            f"({one.size:.2g} standard errors)"
        )
    wide_table("Misfit in units of the noise (1 is noise)", ["trial", "set", "before", "after"], _misfits(gap))
    if gap.next_test:
        line(f"next test: {gap.next_test.manoeuvre}. {gap.next_test.why}")


def _misfits(gap: Gap) -> list[list[object]]:
    rows: list[list[object]] = [
        [one.name, "held out" if one.held_out else "fitted", *(hundredths(one.misfit(w)) for w in ("before", "after"))]
        for one in gap.passed
        if measured_in(one)
    ]
    for word, held in (("fitted", False), ("held out", True)):
        before, after = (gap.misfit(which, held_out=held) for which in ("before", "after"))
        if before is not None and after is not None:
            rows.append(["all", word, hundredths(before), hundredths(after)])
    return rows


def _parameters(one: Named) -> list[list[object]]:
    rows: list[list[object]] = []
    for parameter, value in one.parameters.items():
        own, there = estimate_in_file(parameter, value)
        error = (
            in_file_units(parameter, one.standard_errors[parameter])[1]
            if parameter in one.standard_errors
            else math.nan
        )
        words, unit = in_words(own)
        rows.append([one.name, words, there, float(f"{error:.2g}"), unit or "-"])
    return rows


def hundredths(misfit: float) -> str:
    """A misfit as tables show it."""
    return f"{misfit:.2f}" if math.isfinite(misfit) else "ran away"


def line(text: str) -> None:
    """Print a line as it is, however long."""
    screen.print(text, soft_wrap=True, markup=False)


def wide_table(title: str, heads: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """A table as wide as it must be: names of trials and effects are never broken; a dash for what is no number."""
    table = Table(header_style="bold", pad_edge=False)
    for place, head in enumerate(heads):
        numeric = all(isinstance(row[place], int | float) for row in rows)
        table.add_column(head, justify="right" if numeric else "left", no_wrap=True)
    for row in rows:
        told = [None if isinstance(value, float) and not math.isfinite(value) else value for value in row]
        table.add_row(*(escape(cell_text(value)) for value in told))
    width = Measurement.get(screen, screen.options.update(width=_WIDE), table).maximum
    screen.print(title, style="italic", soft_wrap=True, markup=False)
    Console(width=max(width, screen.width), highlight=False).print(table)


_WIDE = 1000
"""Characters in which any table of ours has room."""
