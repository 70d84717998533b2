"""The manual's pages on formats name every key, effect and column that the program takes."""

from __future__ import annotations

import importlib
import json
import re
from itertools import chain

import pytest
from pydantic import BaseModel

from tank2sim.apps.rigs import kinds as rig_kinds
from tank2sim.apps.rigs.glider import card as glider_card
from tank2sim.apps.rigs.yaw import card as yaw_card
from tank2sim.cards import form
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.records import campaign_form

from .examples import MANUAL

TEXT = "\n".join(page.read_text(encoding="utf-8") for page in (MANUAL / "formats").glob("*.md"))
SECTIONS = [
    one
    for one in chain(*(vars(module).values() for module in (form, campaign_form, glider_card, rig_kinds, yaw_card)))
    if isinstance(one, type) and issubclass(one, BaseModel) and one.__module__.startswith("tank2sim")
]


@pytest.mark.parametrize("section", SECTIONS, ids=lambda one: one.__name__)
def test_every_key_is_in_the_manual(section: type[BaseModel]) -> None:
    if f"<!-- keys: {section.__name__} -->" in TEXT:
        return
    words = set(re.findall(r"\w+", TEXT))
    spellings = {"_radps": ("_degps", "_rpm"), "_rad": ("_deg",)}
    for key in section.model_fields:
        suffix = next((end for end in spellings if key.endswith(end)), "")
        known = {key, *(key.removesuffix(suffix) + other for other in spellings.get(suffix, ()))}
        assert known & words, f"{section.__name__}.{key} is in no page on formats"


def test_every_derivative_is_in_the_manual() -> None:
    words = set(re.findall(r"\w+", TEXT))
    for term in chain.from_iterable(ABKOWITZ_TERMS.values()):
        assert term in words or re.sub("^N", "Y", term) in words, term


def test_the_page_of_effects_is_generated_from_the_library() -> None:
    assert "<!-- effects -->" in (MANUAL / "formats" / "effects.md").read_text(encoding="utf-8")
    assert len(EFFECTS) > 40


def test_project_choices_are_listed_with_value_place_and_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(MANUAL))
    generated = importlib.import_module("generated")
    rows = [line.split(" | ") for line in generated.project_choices().splitlines() if line.startswith("| `")]
    assert len(rows) > 50 and all(len(row) == 5 for row in rows)
    assert any("`answer.parts.REPR_ROWS`" in row[0] and row[1] == "`20`" for row in rows)
    names = {row[0].removeprefix("| ").strip("`") for row in rows}
    measured = json.loads((MANUAL / "static" / "project_choices.json").read_text(encoding="utf-8"))
    assert set(measured) <= names  # benchmarks/choices.py forgets what is no constant any more when it runs again
