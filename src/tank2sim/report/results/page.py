"""A page of any result: figures, tables and charts of what the JSON of a command holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tank2sim.answer.charts.columns import motions
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Illustration, Section, Table
from tank2sim.answer.study import not_as_written
from tank2sim.files import schema_command
from tank2sim.report.json_values import (
    LONGEST_LIST,
    Json,
    alike,
    grouped,
    is_matrix,
    is_number_value,
    is_objects,
    is_scalar,
    is_series,
    json_quantities,
    numbered,
    rows_of,
    scalars,
    short_columns,
    titled,
    words,
)
from tank2sim.report.results import charts
from tank2sim.report.results.headlines import headlines
from tank2sim.report.results.json_path import drawn_from
from tank2sim.report.results.motions import is_columns
from tank2sim.report.results.result_types import ResultType, kind_of
from tank2sim.report.results.subjects import misshapen, render_charts, whole_page

_NOTES = ("notices", "warnings", "notes")
_DEEPEST = 5
_MOST_PARTS = 12
_BODE = {"omega_radps", "magnitude_dB", "phase_deg"}


@dataclass
class _Parts:
    """What a section is filled with, in the order of the JSON."""

    tables: list[Table] = field(default_factory=list)
    charts: list[Illustration] = field(default_factory=list)
    left_out: int = 0

    def draw(self, chart: Illustration | None) -> None:
        if chart is not None:
            self.charts.append(chart)


def result_page(result: Json, source: str) -> Page:
    """The page of a result that a command wrote as JSON.

    Parameters
    ----------
    result : dict
        Content of the file.
    source : str
        Name of the file, for the head of the page and for messages.

    Raises
    ------
    InputError
        It is not a result of a command of tank2sim, or a value in it has another form.
    """
    kind = kind_of(result, source)
    if key := misshapen(kind.title, result):
        raise not_as_written(source, key)
    return drawn_from(result, source, lambda watched: _page(watched, kind, source))


def _page(result: Mapping[str, Json], kind: ResultType, source: str) -> Page:
    if whole := whole_page(kind.title, result):
        return whole
    notices = [str(note) for key in _NOTES for note in result.get(key) or []]
    name = next((result[key] for key in ("ship", "campaign", "glider", "path") if isinstance(result.get(key), str)), "")
    checked = charts.errors("Errors of the outputs", result.get("errors"), result.get("limits"))
    drawn, remaining = render_charts(kind.title, result)
    if checked:  # all but the largest errors, which the table of all of them has again
        remaining = {key: value for key, value in remaining.items() if key != "max_error"}
    sections = [_section(key, value) for key, value in remaining.items() if key not in _NOTES and not is_scalar(value)]
    overview = {key: value for key, value in scalars(result).items() if key not in (*_NOTES, "kind", "schema")}
    table = [json_quantities("The result", overview)] if overview else []
    first = [
        Section(heading="Overview", text=kind.note, tables=table, charts=[checked] if checked else [], notes=notices)
    ]
    return Page(
        title=f"{kind.title}: {Path(name).name}" if name else kind.title,
        subtitle=f"From {_origin(result, source)}",
        figures=headlines(result, kind),
        sections=[
            *(first if overview or notices or kind.note else []),
            *drawn,
            *(section for section in sections if section.tables or section.charts),
        ],
    )


def _origin(result: Mapping[str, Json], source: str) -> str:
    """The command that wrote a result, which any copy of the file states; of older files, which do not, the file."""
    command = schema_command(result.get("schema"))
    return f"tank2sim {command}" if command else source


def _section(key: str, value: Json) -> Section:
    parts = _Parts()
    title = words(key)[0]
    heading = "IMO criteria" if key == "imo" else title[:1].upper() + title[1:]
    _fill(parts, heading, key, value, 0)
    notes = [f"{parts.left_out} longer or deeper parts are in the JSON only."] if parts.left_out else []
    tables = [table for table in parts.tables if table.rows and [column.title for column in table.columns] != ["name"]]
    return Section(heading=heading, tables=tables, charts=parts.charts, notes=notes)


def _fill(parts: _Parts, caption: str, key: str, value: Json, depth: int) -> None:
    """Add a value that is not a scalar, and all under it, to the parts of a section."""
    if depth > _DEEPEST:
        parts.left_out += 1
    elif isinstance(value, Mapping):
        _fill_object(parts, caption, key, value, depth)
    elif is_objects(value):
        _fill_objects(parts, caption, key, value, depth)
    elif key in ("eigenvalues", "poles") and is_matrix(value):
        parts.tables.append(rows_of(caption, [("", {"real_per_s": a, "imaginary_per_s": b}) for a, b in value], ""))
        if depth == 0:
            parts.charts.append(charts.poles(caption, caption, value))
    elif is_matrix(value) and len(value) * len(value[0]) <= LONGEST_LIST**2:
        rows = [("", {str(place + 1): item for place, item in enumerate(row)}) for row in value]
        parts.tables.append(rows_of(caption, rows, ""))
    elif is_series(value) and all(isinstance(item, str) for item in value):
        parts.tables.append(rows_of(caption, [("", {words(key)[0]: item}) for item in value], ""))
    elif value:
        parts.left_out += 1


def _fill_object(parts: _Parts, caption: str, key: str, value: Mapping[str, Json], depth: int) -> None:
    if drawn := charts.matrix_chart(caption, value):
        parts.draw(drawn)
        return
    if is_columns(value):
        parts.charts += motions(caption, {caption: value})
        return
    if set(value) >= _BODE:
        parts.draw(charts.bode(caption, caption, value))
        return
    columns = short_columns(value)
    plain = {name: item for name, item in scalars(value).items() if name not in columns}
    if plain:
        parts.tables.append(json_quantities(caption, plain, words(key)[1]))
    if columns:
        parts.tables.append(numbered(caption, {name: value[name] for name in columns}))
    _draw_series(parts, caption, {name: item for name, item in value.items() if is_series(item)})
    remaining = {name: item for name, item in value.items() if not is_scalar(item) and not is_series(item)}
    parts.draw(charts.errors(f"{caption}: errors", value.get("errors"), value.get("limits")))
    if key == "influence_percent":
        parts.draw(charts.influences(f"{caption} (%)", value))
    _deeper(parts, caption, remaining, depth)


def _deeper(parts: _Parts, caption: str, values: Mapping[str, Json], depth: int) -> None:
    """Add named values: objects of one kind in one table, all others one by one."""
    if alike(values):
        _fill_named(parts, caption, values, depth)
    else:
        _each(parts, caption, values, depth)


def _fill_named(parts: _Parts, caption: str, objects: Mapping[str, Mapping[str, Json]], depth: int) -> None:
    """Objects of one kind under names: one table of what they have in cells, then what is deeper in each."""
    parts.draw(charts.error_bars(caption, objects))
    if any(scalars(item) for item in objects.values()):
        parts.tables.append(rows_of(caption, [(titled(name), item) for name, item in objects.items()], "name"))
    shared = _shared(objects)
    for key in shared:
        rows = [(titled(name), item[key]) for name, item in objects.items() if item.get(key)]
        parts.tables.append(rows_of(f"{caption}: {titled(key)}", rows, "name"))
    for name, item in objects.items():
        deeper = {k: v for k, v in item.items() if not is_scalar(v) and k not in shared}
        _draw_series(parts, f"{caption}: {words(name)[0]}", {k: v for k, v in deeper.items() if is_series(v)})
        _deeper(parts, f"{caption}: {words(name)[0]}", {k: v for k, v in deeper.items() if not is_series(v)}, depth)


def _shared(objects: Mapping[str, Mapping[str, Json]]) -> list[str]:
    """Keys under which two or more of the objects have a small object of one kind."""
    keys = dict.fromkeys(key for item in objects.values() for key in item)
    found = {key: {name: item[key] for name, item in objects.items() if item.get(key)} for key in keys}
    return [key for key, parts in found.items() if alike(parts) and all(map(_is_small, parts.values()))]


def _is_small(value: Mapping[str, Json]) -> bool:
    return all(map(is_scalar, value.values()))


def _fill_objects(parts: _Parts, caption: str, key: str, value: list[Mapping[str, Json]], depth: int) -> None:
    drawn = charts.misfits(f"{caption}: misfit", value) if key == "trials" else None
    parts.draw(drawn)
    if all("predicted" in item for item in value):
        parts.draw(charts.force_fit(caption, value))
    elif len(value) > LONGEST_LIST:
        keys = [name for name in value[0] if all(is_number_value(item.get(name)) for item in value)]
        parts.draw(charts.series_chart(caption, {name: [item[name] for item in value] for name in keys}))
    if any(scalars(item) for item in value):
        parts.tables.append(rows_of(caption, [("", item) for item in value], ""))
    if drawn:
        return
    deep = [item for item in value if any(not is_scalar(v) for v in item.values())]
    if len(deep) > _MOST_PARTS:
        parts.left_out += len(deep)
        return
    for place, item in enumerate(deep, start=1):
        label = _label(item) or f"no. {place}"
        if "poles" in item and isinstance(item.get("zeros"), list):
            parts.draw(charts.poles(f"{label}: poles and zeros", label, item["poles"], item["zeros"]))
        deeper = {k: v for k, v in item.items() if not is_scalar(v) and k not in ("poles", "zeros")}
        _draw_series(parts, f"{caption}: {label}", {k: v for k, v in deeper.items() if is_series(v)})
        _each(parts, f"{caption}: {label}", {k: v for k, v in deeper.items() if not is_series(v)}, depth)


def _each(parts: _Parts, caption: str, values: Mapping[str, Json], depth: int) -> None:
    small = {k: v for k, v in values.items() if isinstance(v, Mapping) and v and all(map(is_scalar, v.values()))}
    if len(small) > 1:  # one table in place of many of two rows
        parts.tables.append(grouped(caption, small))
        values = {name: value for name, value in values.items() if name not in small}
    for name, value in values.items():
        _fill(parts, f"{caption}: {words(name)[0]}", name, value, depth + 1)


def _draw_series(parts: _Parts, caption: str, series: Mapping[str, list[Json]]) -> None:
    """A chart for the series of each length."""
    for length in dict.fromkeys(len(numbers) for numbers in series.values()):
        together = {name: numbers for name, numbers in series.items() if len(numbers) == length}
        drawn = charts.series_chart(caption, together)
        parts.draw(drawn)
        parts.left_out += drawn is None


def _label(item: Mapping[str, Json]) -> str:
    named = ("name", "system", "trial", "record", "run", "label", "title", "path", "file", "figure")
    return next((str(item[key]) for key in named if isinstance(item.get(key), str)), "")
