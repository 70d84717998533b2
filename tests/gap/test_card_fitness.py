"""An improved card that lost a manoeuvre, or a held-out trial, is withheld; one that did not is written."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.cards.reading import revised
from tank2sim.gap.proof.card_fitness import improvement_objections
from tank2sim.results.gap import NO_TRIALS, gap_result
from tests.gap import made_up


def mariner() -> ManoeuvringCard:
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    return card


def changed(**factors: float) -> ManoeuvringCard:
    card = mariner()
    return revised(card, {name: (card.derivatives[name] * factor, 0.0) for name, factor in factors.items()})


def test_a_card_that_still_turns_and_checks_is_not_objected_to() -> None:
    assert improvement_objections(mariner(), mariner(), ()) == ()
    assert improvement_objections(mariner(), changed(Nd=1.1, Yv=0.9), ()) == ()


def test_a_ship_whose_rudder_lost_its_moment_no_longer_turns_nor_zigzags() -> None:
    lines = improvement_objections(mariner(), changed(Nd=-1.0), ())
    assert [line.split()[0] for line in lines] == ["turn:35", "turn:-35", "zigzag:10/10", "zigzag:20/20"]
    # The fault of the given card is no objection to the improved one.
    assert improvement_objections(changed(Nd=-1.0), changed(Nd=-1.1), ()) == ()


def test_a_turn_that_stops_the_ship_is_named_with_its_speed() -> None:
    card = mariner()
    drag = revised(card, {"Xdd": (60 * card.derivatives["Xdd"], 0.0)})
    lines = improvement_objections(card, drag, ())
    assert lines[0].startswith("turn:35 ")
    assert "m/s" in lines[0]


@pytest.mark.parametrize(
    ("before", "after", "held_out", "objected"),
    [
        (4.0, 5.1, True, True),
        (4.0, 4.9, True, False),
        (4.0, 5.1, False, False),  # a fitted trial is part of the verdict
        (0.9, 1.4, True, False),  # still noise
        (4.0, math.nan, True, True),  # its simulation left all bounds
    ],
)
def test_a_held_out_trial_that_is_clearly_worse_is_an_objection(before, after, held_out, objected) -> None:
    trial = made_up.passed("turn20", before, after, held_out=held_out)
    assert bool(improvement_objections(mariner(), changed(Nd=1.01), (trial,))) == objected


def test_a_held_out_trial_that_diverges_is_reported_in_words() -> None:
    trial = made_up.passed("turn20", 4.0, math.nan, held_out=True)
    (line,) = improvement_objections(mariner(), changed(Nd=1.01), (trial,))
    assert "diverges with it" in line and "inf" not in line


def test_a_card_with_objections_is_only_written_by_force_and_the_first_line_says_so(tmp_path: Path) -> None:
    gap = replace(made_up.missing(), objections=("turn:35 never reaches 180 deg",))
    result = gap_result(gap, NO_TRIALS, NO_TRIALS)
    assert result.study.card_objections == gap.objections
    assert "turn:35 never reaches 180 deg" in result.headline[0]
    made_by_force = gap_result(gap, NO_TRIALS, NO_TRIALS, force=True)
    assert made_by_force.headline[0] == result.headline[0]
    made_by_force.save(tmp_path)
    assert (tmp_path / "improved.toml").exists()
    result.save(tmp_path)  # the card of the earlier run would be taken for one of this run
    assert not (tmp_path / "improved.toml").exists() and (tmp_path / "gap.json").exists()
    gap_result(made_up.missing(), NO_TRIALS, NO_TRIALS).save(tmp_path)
    assert (tmp_path / "improved.toml").exists()
