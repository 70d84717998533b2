"""A card as C99: the same figures in double precision, what float loses, and cards without manoeuvres."""

from __future__ import annotations

import functools
import re

import pytest

import tank2sim as t2s
from tank2sim.apps.programs import c99
from tank2sim.apps.programs.c99 import c99_files
from tank2sim.apps.programs.program_files import ProgramFiles
from tests.marks import first_fast


@functools.cache
def files_of(card: str) -> ProgramFiles:
    return c99_files(t2s.load(card).card)


@first_fast("card", ["mariner", "otter", "container", "esso-osaka-ship"])
def test_figures_are_the_same_in_double_and_nearly_the_same_in_single_precision(card: str) -> None:
    made = files_of(card)
    assert set(made.files) == {"ship.h", "ship.c", "self_test.c"}
    assert len(made.changes) > 10
    for one in made.changes:
        assert one.before == one.after and one.before is not None, one
    percent, degrees = map(float, re.findall(r"by ([\d.e-]+) (?:%|deg)", made.losses[0]))
    assert 1e-4 < percent < 0.1 and 1e-8 < degrees < 1e-3


def test_a_turn_by_the_files_is_that_of_the_model() -> None:
    made = {(one.manoeuvre, one.figure): one.after for one in files_of("mariner").changes}
    figures = t2s.load("mariner").turn(35).figures
    assert made["turn:35", "tactical_diameter_m"] == pytest.approx(figures["tactical_diameter_m"], rel=1e-12)
    assert made["turn:35", "tactical_diameter_m"] != made["turn:-35", "tactical_diameter_m"]


def test_without_a_compiler_or_manoeuvres_the_files_are_there_and_nothing_is_claimed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    surge = c99_files(t2s.load("wilinski-zellman").card)
    assert surge.changes == () and "not measured" in surge.losses[0] and len(surge.files) == 3
    monkeypatch.setattr(c99, "find_compiler", lambda: None)
    ship = c99_files(t2s.load("mariner").card)
    assert ship.changes == () and "no C compiler" in ship.losses[0] and len(ship.files) == 3
