"""The page of an audit: what is wrong with the data of trials, then each record with the places of the findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from tank2sim.answer.charts.motion import TimeMark
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict, notices_section
from tank2sim.report.json_values import Json
from tank2sim.report.results.motions import is_columns, motions, stem_of

_MOST_RECORDS = 12
"""Records drawn in one page, a quarter of a MB each (project choice)."""

_RED = "Red in the histories: the places of findings about single values and rows."


def audit_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim audit``."""
    findings, trials = found["findings"], found["trials"]
    faults = [entry for entry in findings if entry["kind"] == "fault"]
    clean = len(trials) - len({entry["file"] for entry in findings})
    repaired = sum(entry["repaired"] for entry in findings)
    figures = [
        KeyFigure(label="Faults", value=len(faults), verdict=Verdict.FAILED if faults else Verdict.PASSED),
        KeyFigure(label="Notes", value=len(findings) - len(faults), note="smaller things, to be looked at"),
        KeyFigure(label="Repaired when the trials are read", value=f"{repaired} of {len(findings)}"),
        KeyFigure(label="Trials without a finding", value=f"{clean} of {len(trials)}"),
    ]
    first = [Section(heading="Findings", tables=[_findings(findings)])] if findings else []
    return Page(
        title="Audit of trials" if len(trials) > 1 else f"Audit of {_file_name(trials[0])}",
        subtitle=f"{len(trials)} trials" if len(trials) > 1 else "One trial",
        verdict=_verdict(faults, findings),
        figures=figures,
        sections=[
            *first,
            *record_sections(found),
            Section(heading="Trials", tables=[_trials(trials), _noise(trials)], folded=True),
            *notices_section([notice for trial in trials for notice in trial.get("notices") or ()]),
        ],
    )


def record_sections(found: Json) -> list[Section]:
    """Return what each trial measured with the places of its findings, trials with findings first.

    All but the first are folded.
    """
    # Of many records the page has as many as it can hold.
    findings = found["findings"]
    faulty = {entry["file"] for entry in findings}
    trials = [entry for entry in found["trials"] if is_columns(entry.get("histories"))]
    sections: list[Section] = []
    for trial in sorted(trials, key=lambda entry: entry["file"] not in faulty)[:_MOST_RECORDS]:
        mine = [entry for entry in findings if entry["file"] == trial["file"]]
        name, marks = _file_name(trial), _marks(mine, trial)
        charts = motions(name, {"measured": trial["histories"]}, marks=marks)
        sections.append(
            Section(
                heading=f"Record {name}",
                text=_RED if marks else "" if mine else "Nothing is found wrong.",
                charts=[_beside(chart) for chart in charts] if len(charts) > 1 else charts,
                folded=bool(sections),
            )
        )
    return sections


def _beside(illustration: Illustration) -> Illustration:
    return replace(illustration, half=True)


def _file_name(entry: Mapping[str, Json]) -> str:
    return str(entry["file"]).rpartition("/")[2]


def _verdict(faults: Sequence[Mapping[str, Json]], findings: Sequence[Mapping[str, Json]]) -> str:
    if not findings:
        return "Nothing is found wrong: signs, units, times and positions of all columns agree with each other."
    if not faults:
        return "No fault is found. What is noted below does not keep the trials from being used."
    first = faults[0]
    repaired = "repaired" if first["repaired"] else "not repaired"
    more = f" {len(faults) - 1} more faults are below." if len(faults) > 1 else ""
    return f"{first['column']} of {_file_name(first)} is wrong: {first['likely_truth']} ({repaired}).{more}"


def _findings(findings: Sequence[Mapping[str, Json]]) -> Table:
    """Faults first; columns of a file of which the same is said are in one row."""
    heads = ("column", "what", "likely truth", "", "repaired", "file")
    columns: dict[tuple[Cell, ...], list[str]] = {}
    for entry in sorted(findings, key=lambda entry: entry["kind"] != "fault"):
        kind = Verdict.FAILED if entry["kind"] == "fault" else "note"
        said = entry["what"], entry["likely_truth"], kind, entry["repaired"], _file_name(entry)
        columns.setdefault(said, []).append(entry["column"])
    rows: list[list[Cell]] = [[", ".join(names), *said] for said, names in columns.items()]
    return Table(caption="Findings", columns=[Column(title=head) for head in heads], rows=rows, folded=False)


def _trials(trials: Sequence[Mapping[str, Json]]) -> Table:
    rows: list[list[Cell]] = [
        [
            _file_name(trial),
            trial.get("duration_s"),
            trial.get("step_s"),
            trial.get("rows"),
            ", ".join(trial["columns"]),
        ]
        for trial in trials
    ]
    heads = [Column(title="file"), Column(title="duration", unit="s"), Column(title="step", unit="s", digits=3)]
    heads += [Column(title="rows", digits=6), Column(title="columns")]
    return Table(caption="Trials", columns=heads, rows=rows, folded=False)


def _noise(trials: Sequence[Mapping[str, Json]]) -> Table:
    rows: list[list[Cell]] = [
        [_file_name(trial), name, f"{noise['sigma']:.2g}", noise["from"]]
        for trial in trials
        for name, noise in (trial.get("noise") or {}).items()
    ]
    heads = ("file", "signal", "standard deviation", "from")
    return Table(caption="Noise, SI", columns=[Column(title=head) for head in heads], rows=rows)


def _marks(found: Sequence[Mapping[str, Json]], trial: Mapping[str, Json]) -> list[TimeMark]:
    """A finding about a column in its panel, one about the time in all."""
    _, *columns = trial["histories"]
    stems = dict(zip(trial["columns"], map(stem_of, columns), strict=False))  # by what the file calls them
    marks = []
    for finding in found:
        at = [stems[finding["column"]]] if finding["column"] in stems else list(stems.values())
        for begin, end in finding.get("places_s") or ():
            marks += [TimeMark(signal=name, begin_s=begin, end_s=end, text=str(finding["what"])) for name in at]
    return marks
