"""Registry of the subjects: the page of the results of each command, or the sections that are drawn of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tank2sim.answer.page import Page
from tank2sim.answer.parts import Section
from tank2sim.report.json_values import Json


@dataclass(frozen=True)
class _Sections:
    """Sections of a page; the keys that they `need` with the type of each (older versions wrote none of them); and the
    paths of what is `taken` by them (with dots between keys; * is any), which is not repeated in tables."""

    sections: Callable[[Json], list[Section]]
    needs: Mapping[str, type]
    taken: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Page:
    """A whole page, and the keys that it `needs` with the type of each."""

    make: Callable[[Json], Page]
    needs: Mapping[str, type]


_WAY = ("ahead_m", "starboard_m")

_SECTIONS: Mapping[str, _Sections] = {}

_PAGES: Mapping[str, _Page] = {}
"""Subjects whose whole page is made of their JSON."""


_LISTS = {"notices": list, "warnings": list, "notes": list}


def needs_of(kind: str) -> Mapping[str, type]:
    """Return the keys that the page of a kind needs, with the type of each."""
    subject = _SECTIONS.get(kind) or _PAGES.get(kind)
    return subject.needs if subject else {}


def misshapen(kind: str, result: Mapping[str, Json]) -> str:
    """Return the first key whose value has another type than the command writes; empty without any."""
    forms = _LISTS | dict(needs_of(kind))
    notices = result.get("notices")
    if isinstance(notices, list) and not all(isinstance(text, str) for text in notices):
        return "notices"
    return next((key for key, form in forms.items() if not isinstance(result.get(key, None), form | None)), "")


def whole_page(kind: str, result: Json) -> Page | None:
    """Return the page of a result, where it is made as a whole; None for an older file, which lacks some keys."""
    page = _PAGES.get(kind)
    return page.make(result) if page and all(key in result for key in page.needs) else None


def render_charts(kind: str, result: Mapping[str, Json]) -> tuple[list[Section], Json]:
    """Return the sections with the charts of a result, and its remaining parts for tables.

    `kind` is one of :data:`tank2sim.report.results.result_types.RESULT_TYPES`.
    """
    subject = _SECTIONS.get(kind)
    if subject is None or not all(key in result for key in subject.needs):
        return [], result
    remaining: Json = result
    for path in subject.taken:
        remaining = _without(remaining, path.split("."))
    return subject.sections(result), remaining


def _without(value: Json, path: list[str]) -> Json:
    key, *deeper = path
    if isinstance(value, list):
        return [_without(item, deeper) for item in value] if key == "*" and deeper else value
    if not isinstance(value, Mapping):
        return value
    keys = [name for name in value if key in (name, "*")]
    if not deeper:
        return {name: item for name, item in value.items() if name not in keys}
    return {name: _without(item, deeper) if name in keys else item for name, item in value.items()}
