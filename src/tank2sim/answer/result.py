"""The result of a command: a study, declared once as findings, key figures and sections; every form is derived."""

from __future__ import annotations

import base64
import html
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar, get_args, get_origin

from tank2sim.answer.charts.vega import ChartSpec
from tank2sim.answer.parts import KeyFigure, Section, Table, notices_section
from tank2sim.files import PICTURE, json_text, refuse_other_ending, schema_name, write_together
from tank2sim.notices import Level, Notice, foremost

if TYPE_CHECKING:
    import altair as alt

    from tank2sim.answer.page import Page


_S = TypeVar("_S")


class Result(ABC, Generic[_S]):
    """What a command found. A subclass declares title, headline, notices, key figures and sections.

    Screen, ``repr``, notebook view, :attr:`tables`, page, pictures, JSON and its schema are derived from these and
    from the types of the fields of :attr:`study`.
    """

    command: ClassVar[str]
    """Command that gives the same result on the command line; its name is in :attr:`schema`."""

    subject: ClassVar[str] = ""
    """What was done, after the name of the ship in the title."""

    procedure: ClassVar[str] = ""
    """How it was done, where that is always the same: the line under the title."""

    study: _S
    """Numbers with units in the names of their fields."""

    @property
    def title(self) -> str:
        """Head of the page: the ship, and what was done."""
        study: Any = self.study
        return f"{study.ship}: {self.subject}" if self.subject else str(study.ship)

    @property
    def subtitle(self) -> str:
        """A line under the title."""
        return self.procedure

    @property
    @abstractmethod
    def headline(self) -> tuple[str, ...]:
        """One or a few sentences with the main findings."""

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Limits of the result, one sentence each, with their levels."""
        return tuple(getattr(self.study, "notices", ()))

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files that were read because other files name them; the command does not overwrite them."""
        return ()

    @property
    def written(self) -> tuple[Path, ...]:
        """Files that the function itself wrote; the command names them."""
        return ()

    @property
    def faults(self) -> tuple[str, ...]:
        """Parts of the question without an answer, a line each; the command prints them as errors and ends with 2."""
        return ()

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Cards at the top of the page."""
        return ()

    @property
    @abstractmethod
    def sections(self) -> Sequence[Section]:
        """Text, tables and charts in the order of the page."""

    @classmethod
    def read(cls, values: Mapping[str, Any], source: str) -> Self:
        """Return the result whose JSON values these are, without what the JSON does not hold (the ship, its model).

        Raises
        ------
        InputError
            The values do not make such a result; the key is named.
        """
        from tank2sim.answer.study import read_study

        study = {key: value for key, value in values.items() if key != "schema"}
        return cls(study=read_study(cls.study_type(), study, source))  # type: ignore[call-arg]

    @classmethod
    def study_type(cls) -> type[_S]:
        """The dataclass of :attr:`study`, which the class names as its parameter: ``Result[TowStudy]``."""
        kinds = (base for parent in cls.__mro__ for base in getattr(parent, "__orig_bases__", ()))
        found: type[_S] = next(get_args(base)[0] for base in kinds if issubclass(get_origin(base) or object, Result))
        return found

    def __getattr__(self, name: str) -> Any:
        """`ship`: the :class:`tank2sim.Ship` of the card found, of a result that has a `card`."""
        if name != "ship" or (card := getattr(self, "card", None)) is None:
            raise AttributeError(f"{type(self).__name__} has no {name}")
        from tank2sim import Ship  # the front page is above all rooms

        return Ship(card)

    def __dir__(self) -> list[str]:
        found_on_demand = getattr(type(self), "card", None) is not None
        return [*super().__dir__(), *(["ship"] if found_on_demand or self.__dict__.get("card") else [])]

    @property
    def tables(self) -> tuple[Table, ...]:
        """Tables of all sections."""
        return tuple(table for section in self.sections for table in section.tables)

    @property
    def schema(self) -> str:
        """Name and version of the JSON's schema, for example ``tank2sim/simulate/1``."""
        return schema_name(self.command)

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON values: lists for arrays, None for what is not a finite number."""
        from tank2sim.answer.study import study_values

        return {"schema": self.schema, **study_values(self.study)}

    def to_json(self, path: str | Path | None = None, **keys: object) -> str:
        """Return the result as JSON text, also written to `path`; `keys` are added at its end.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        text = json_text({**self.to_dict(), **keys})
        if path is not None:
            write_together({Path(path): text})
        return text

    def charts(self) -> Mapping[str, alt.TopLevelMixin]:
        """Charts of all sections by name (Altair), the main one first; empty where there are none."""
        from tank2sim.answer.charts.picture import AltairCharts

        return AltairCharts(self._charts())

    @property
    def chart_names(self) -> tuple[str, ...]:
        """Names of :meth:`charts`, the main one first."""
        return tuple(self._charts())

    def _charts(self) -> dict[str, ChartSpec | alt.TopLevelMixin]:
        """Charts of all sections by name, as the sections have them."""
        charts: dict[str, ChartSpec | alt.TopLevelMixin] = {}
        for section in self.sections:
            for illustration in section.charts:
                stem = _slug(illustration.name) or _slug(illustration.title or section.heading).lower()
                number = sum(re.fullmatch(rf"{re.escape(stem)}(_\d+)?", name) is not None for name in charts) + 1
                charts[stem if number == 1 else f"{stem}_{number}"] = illustration.chart
        return charts

    def plot(self, path: str | Path | None = None, name: str | None = None) -> alt.TopLevelMixin:
        """One chart of the result (Altair), also written to `path` as PNG, SVG or PDF, by its ending.

        Parameters
        ----------
        path : path, optional
        name : str, optional
            One of :meth:`charts`; by default the main one.

        Raises
        ------
        InputError
            The file cannot be written, or its name ends as no picture's.
        LookupError
            The chart does not exist.
        """
        from tank2sim.answer.charts.picture import altair_chart

        if path is not None:
            refuse_other_ending(Path(path), PICTURE)
            write_together({Path(path): self.picture(name, ending=Path(path).suffix)})
        return altair_chart(self._chart_of_name(name))

    def _chart_of_name(self, name: str | None) -> ChartSpec | alt.TopLevelMixin:
        charts = self._charts()
        if not charts or (name is not None and name not in charts):
            raise LookupError(
                f"no chart {name or ''} of {type(self).__name__}; there are: {', '.join(charts) or 'none'}"
            )
        return charts[name] if name is not None else next(iter(charts.values()))

    def picture(self, name: str | None = None, *, ending: str = ".png") -> bytes:
        """One chart of the result as PNG, or as SVG or PDF if that is the `ending` of its file's name."""
        from tank2sim.answer.charts.picture import chart_picture

        return chart_picture(self._chart_of_name(name), ending)

    def pictures(self) -> dict[str, bytes]:
        """All charts by name as PNG."""
        from tank2sim.answer.charts.picture import chart_png

        return {name: chart_png(chart) for name, chart in self._charts().items()}

    def layout(self) -> Page:
        """Return the page of the result, before it is HTML."""
        from tank2sim.answer.page import Page

        return Page(
            title=self.title,
            subtitle=self.subtitle,
            verdict=" ".join(self.headline),
            figures=self.key_figures,
            sections=[*self.sections, *notices_section(self.notices)],
        )

    def page(self) -> str:
        """Return the page of the result: self-contained HTML."""
        from tank2sim.answer.page import render_page

        return render_page(self.layout())

    def to_html(self, path: str | Path) -> None:
        """Write :meth:`page` to a file."""
        write_together({Path(path): self.page()})

    @property
    def cautions(self) -> tuple[Notice, ...]:
        """Notices that are shown before the result: why it failed, and doubts about it."""
        return tuple(foremost(self.notices))

    @property
    def exit_code(self) -> int:
        """Code with which the command ends: 2 if a part has no answer, 1 if a notice says that it failed, else 0."""
        return 2 if self.faults else int(any(notice.level is Level.STOP for notice in self.notices))

    @property
    def _first_lines(self) -> tuple[str, ...]:
        return (*(notice.line for notice in self.cautions), *self.headline)

    @property
    def screen_tables(self) -> tuple[Table, ...]:
        """Tables that the command prints."""
        return tuple(table for table in self.tables if table.on_screen)

    def __repr__(self) -> str:
        return "\n".join([*self._first_lines, *(table.text for table in self.screen_tables[:1])])

    def _repr_html_(self) -> str:
        parts = [f"<p>{html.escape(line)}</p>" for line in self._first_lines]
        if self._charts():
            picture = base64.b64encode(self.picture()).decode("ascii")
            parts.append(f'<img alt="{html.escape(" ".join(self.headline))}" src="data:image/png;base64,{picture}">')
        for table in self.screen_tables:
            parts.append(f"<p>{html.escape(table.caption)}</p>{table.df.to_html(index=False, na_rep='')}")
        return "\n".join(parts)


def _slug(words: str) -> str:
    return re.sub(r"\W+", "_", words).strip("_")
