"""The parts of an answer: notices, key figures, tables, charts and sections; everything is plain text, never HTML."""

from __future__ import annotations

import dataclasses
import math
import urllib.parse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from tank2sim.answer.charts.vega import ChartSpec
from tank2sim.answer.numbers import format_number, is_number_text, without_exponents
from tank2sim.notices import Notice
from tank2sim.units import in_words

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd


class Verdict(StrEnum):
    """What a figure means, in words; sign and colour only go with them."""

    NONE = ""
    PASSED = "passed"
    CAUTION = "caution"
    FAILED = "failed"


@dataclass(frozen=True)
class KeyFigure:
    """A key figure, shown on a card at the top of the page.

    `note`: a few words under the value; `limit`: largest value allowed, in `unit`; a bar then shows the value's size.
    """

    label: str
    value: float | str
    unit: str = ""
    verdict: Verdict = Verdict.NONE
    note: str = ""
    limit: float | None = None

    @property
    def reach_percent(self) -> float:
        """Length of the bar, % of its room."""
        return self._percent(self.value)

    @property
    def limit_percent(self) -> float:
        """Place of the limit, % of the room of the bar."""
        return self._percent(self.limit)

    def _percent(self, value: float | str | None) -> float:
        sizes = [abs(size) for size in (self.value, self.limit) if isinstance(size, float | int)]
        largest = max(sizes, default=0.0)
        return round(100 * abs(value) / (_ROOM * largest), 1) if isinstance(value, float | int) and largest else 0.0


_ROOM = 1.15
"""Room of the bar of a key figure, over the larger of figure and limit. Project choice: both ends are seen."""


@dataclass(frozen=True)
class Column:
    """Head of a column: its title, the unit of its numbers, and their significant digits."""

    title: str
    unit: str = ""
    digits: int = 4

    @property
    def head(self) -> str:
        """Title with the unit in brackets."""
        return f"{self.title} ({self.unit})" if self.unit else self.title


@dataclass(frozen=True, kw_only=True)
class Link:
    """A cell that leads elsewhere: `path` names a file relative to the page, with slashes."""

    text: str
    path: str

    @property
    def address(self) -> str:
        """The path as a page has it: no character of a name means anything but itself."""
        return urllib.parse.quote(self.path)

    def __str__(self) -> str:
        return self.text


Cell = float | int | bool | str | Verdict | Link | list[float] | list[str] | None
"""A number in the unit of its column, text, a verdict, a truth value, a short list, or None (nothing known)."""

REPR_ROWS = 20
"""Rows of a table in ``repr``: with its heading it fits a screen of 24 lines. Project choice."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table, on the screen, on the page and as a data frame. :func:`table` makes one from heads with units.

    `notes`: sentences under it; `folded`: whether the page shows only the caption until the reader opens the table
    (by default if it is long; on paper all are open); `on_screen`: whether the command prints it; `wide`: names in it
    are never broken on the screen. Raises ValueError: a row has not as many cells as there are columns.
    """

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()
    folded: bool | None = None
    on_screen: bool = True
    wide: bool = False

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table {self.caption!r}: {len(row)} cells in a row of {len(self.columns)} columns")

    @property
    def heads(self) -> tuple[str, ...]:
        """Heads of the columns, units in brackets."""
        return tuple(column.head for column in self.columns)

    @property
    def df(self) -> pd.DataFrame:
        """The table as a data frame; its columns are :attr:`heads`."""
        import pandas as pd

        return pd.DataFrame([list(row) for row in self.rows], columns=list(self.heads))

    @property
    def text(self) -> str:
        """The table as text, at most :data:`REPR_ROWS` rows; numbers with five digits."""
        import pandas as pd

        cells = [[cell_text(cell) for cell in row] for row in self.rows[:REPR_ROWS]]
        lines = [self.caption, pd.DataFrame(cells, columns=list(self.heads)).to_string(index=False)]
        omitted = len(self.rows) - REPR_ROWS
        return "\n".join(lines + ([f"... {omitted} more rows in .tables"] if omitted > 0 else []))


def table(
    caption: str,
    heads: Iterable[str | Column],
    rows: Iterable[Sequence[Cell]],
    *notes: str,
    digits: int = 4,
    folded: bool | None = None,
    on_screen: bool = True,
) -> Table:
    """Return a table whose heads are texts with the unit in the last brackets: ``("run", "speed (m/s)")``.

    `digits`: significant digits of the numbers; `notes`, `folded`, `on_screen`: as of :class:`Table`.

    Examples
    --------
    >>> table("Turns", ["angle (deg)", "advance (m)"], [[35.0, 512.25]]).df.columns.to_list()
    ['angle (deg)', 'advance (m)']
    """
    columns = [head if isinstance(head, Column) else _column(head, digits) for head in heads]
    rows = [list(row) for row in rows]
    return Table(caption=caption, columns=columns, rows=rows, notes=notes, folded=folded, on_screen=on_screen)


def _column(head: str, digits: int) -> Column:
    title, bracket, unit = head.rpartition(" (")
    if not bracket or not unit.endswith(")"):
        return Column(head, digits=digits)
    return Column(title, unit.removesuffix(")"), digits=digits)


def quantities(caption: str, values: Mapping[str, Cell], **options: Any) -> Table:
    """Return a table with one row a value: its words, the value, and its unit, both from its name.

    `values`: names with their units (``Kd_s``) to values; what is not known (None) has no row; **options: as of
    :func:`table`.

    Examples
    --------
    >>> quantities("Gains", {"Kp": 1.0, "Kd_s": 24.5}).df.to_dict("list")
    {'quantity': ['Kp', 'Kd'], 'value': ['1', '24.5'], 'unit': ['', 's']}
    """
    rows: list[list[Cell]] = []
    for name, value in values.items():
        if value is not None:
            words, unit = in_words(name)
            rows.append([words, format_number(value) if is_number_text(value) else value, unit])
    return table(caption, ("quantity", "value", "unit"), rows, **options)


def records_table(
    caption: str,
    records: Mapping[str, Any] | Sequence[Any],
    *,
    first: str = "",
    fields: Mapping[str, str] | Iterable[str] = (),
    **options: Any,
) -> Table:
    """Return a table with one row a record (a dataclass); its fields are the columns, with units from their names.

    `first`: head of the names of records that are a mapping; `fields`: those to show, by default all; a mapping also
    gives the words of each ("" to use its name); **options: as of :func:`table`.
    """
    values = list(records.values()) if isinstance(records, Mapping) else list(records)
    words = dict(fields) if isinstance(fields, Mapping) else dict.fromkeys(fields, "")
    if not words:
        words = dict.fromkeys((field.name for field in dataclasses.fields(values[0])) if values else (), "")
    heads = [Column(first)] if isinstance(records, Mapping) else []
    for name, title in words.items():
        own, unit = in_words(name)
        heads.append(Column(title or own, unit, digits=options.get("digits", 4)))
    rows: list[list[Cell]] = [[getattr(record, name) for name in words] for record in values]
    if isinstance(records, Mapping):
        rows = [[name, *row] for name, row in zip(records, rows, strict=True)]
    return table(caption, heads, rows, **options)


def data_frame(rows: Any, columns: Sequence[str] | None = None, *, index: str = "") -> pd.DataFrame:
    """Return a data frame of rows, or of columns by name; the column `index` becomes its index."""
    import pandas as pd

    found = pd.DataFrame(rows, columns=columns)
    return found.set_index(index) if index else found


def records_frame(
    records: Mapping[str, Any] | Iterable[Any], fields: type | Iterable[str], *, index: str = ""
) -> pd.DataFrame:
    """Return a data frame with one row a record, whose columns are fields of it.

    `fields`: their names, or a dataclass, of which all are taken; `index`: name of the index, of records that are a
    mapping.
    """
    import pandas as pd

    names = [field.name for field in dataclasses.fields(fields)] if isinstance(fields, type) else list(fields)
    named = records if isinstance(records, Mapping) else dict(enumerate(records))
    rows = [[getattr(record, name) for name in names] for record in named.values()]
    if not isinstance(records, Mapping):
        return pd.DataFrame(rows, columns=names)
    return pd.DataFrame(rows, columns=names, index=pd.Index(list(named), name=index or None))


def cell_text(value: object, digits: int = 5) -> str:
    """A value as the screen shows it: numbers with `digits` significant digits, ``-`` for None and NaN."""
    match value:
        case None:
            return "-"
        case float() if math.isnan(value):
            return "-"
        case bool():
            return "yes" if value else "no"
        case float() if math.isinf(value):
            return "∞" if value > 0 else "-∞"
        case float():
            return f"{value + 0.0:.{digits}g}"  # -0.0 + 0.0 is 0.0
        case list() | tuple():
            return ", ".join(cell_text(item, digits) for item in value)
        case _:
            return str(value)


@dataclass(frozen=True)
class Illustration:
    """A chart and what the reader should see in it; the chart's own title becomes the heading of its caption.

    `half`: two such charts that follow each other are side by side where the page is wide; `name`: in ``charts()``
    and of its picture; by default from the title of the chart or the heading of its section.
    """

    chart: ChartSpec | alt.TopLevelMixin
    caption: str = ""
    half: bool = False
    name: str = ""

    @property
    def title(self) -> str:
        """Title of the chart; empty if it has none."""
        if isinstance(self.chart, dict):
            title = self.chart.get("title", "")
            return str(title["text"] if isinstance(title, dict) else title)
        title = getattr(self.chart, "title", "")
        text = getattr(title, "text", title)
        return text if isinstance(text, str) else ""


@dataclass(frozen=True)
class Section:
    """A part of an answer.

    `text`: an empty line starts a paragraph; `notes`: what the reader must not miss; `folded`: whether the page shows
    only the heading until the reader opens the section; on paper it is open.
    """

    heading: str
    text: str = ""
    tables: Sequence[Table] = ()
    charts: Sequence[Illustration] = ()
    notes: Sequence[str] = ()
    folded: bool = False


def notices_section(notices: Sequence[Notice]) -> list[Section]:
    """Return the section with the notices of a result, empty without any."""
    notes = [Notice(without_exponents(notice), notice.level) for notice in notices]
    return [Section("Notices", notes=notes)] if notes else []
