"""Texts of charts as they are drawn: none is printed on another, none leaves its axes or the picture."""

from __future__ import annotations

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.answer.charts.labels import Spot, label_layers, place_labels, spots_about, spots_along
from tank2sim.answer.charts.parts import Frame
from tank2sim.answer.charts.vega import ChartSpec, layer, layered
from tests.made_results import OWN_DOCUMENTS, RESULTS, marked

from .written import faults, written_texts

FRAME = Frame(across=(0.0, 400.0), up=(0.0, 200.0), width_px=400, height_px=200)
POSITION = FRAME.axes(across=("x", "across"), up=("y", "up"))


def drawn(labels: list[tuple[str, list[Spot]]], lines: tuple[tuple[np.ndarray, np.ndarray], ...] = ()) -> ChartSpec:
    return layered(label_layers(labels, FRAME, POSITION, lines), size=(400, 200))


@pytest.mark.parametrize(
    ("ship", "manoeuvre"),
    [
        ("mariner", "turn:35"),  # advance and tactical diameter cross in the middle of both
        ("mariner", "zigzag:20/20"),
        ("kvlcc2", "stop"),
        pytest.param("mariner", "turn:-35", marks=pytest.mark.slow),
        pytest.param("kvlcc2", "turn:35", marks=pytest.mark.slow),
        pytest.param("kvlcc2", "zigzag:-20/20", marks=pytest.mark.slow),
        pytest.param("mariner", "spiral", marks=pytest.mark.slow),
        pytest.param("kvlcc2", "spiral", marks=pytest.mark.slow),
        pytest.param("esso-osaka", "turn:20", marks=pytest.mark.slow),
        pytest.param("container", "zigzag:10/10", marks=pytest.mark.slow),
        pytest.param("otter", "difference:300", marks=pytest.mark.slow),
    ],
)
def test_labels_of_manoeuvres_are_apart(ship: str, manoeuvre: str) -> None:
    charts = t2s.load(ship).simulate(manoeuvre)._charts()
    assert charts
    assert {name: found for name, chart in charts.items() if (found := faults(chart))} == {}


def test_every_figure_of_a_turn_is_on_its_chart() -> None:
    texts, _ = written_texts(t2s.load("mariner").turn(35).plot())
    written = [one.text for one in texts if one.role == "mark"]
    assert sorted(text.split(" ")[0] for text in written) == ["advance", "tactical", "transfer"]


@pytest.mark.slow
@pytest.mark.parametrize("name", marked(name for name in RESULTS if name.split()[0] not in (*OWN_DOCUMENTS, "export")))
def test_texts_of_every_result_are_apart(name: str, tmp_path) -> None:
    charts = RESULTS[name](tmp_path)._charts()
    assert {title: found for title, chart in charts.items() if (found := faults(chart))} == {}


def test_labels_of_one_place_are_moved_apart() -> None:
    labels = [(f"figure {number}", spots_along((100.0, 100.0), (300.0, 100.0), FRAME)) for number in range(4)]
    chart = drawn(labels)
    assert faults(chart) == []
    assert [one.role for one in written_texts(chart)[0]].count("mark") == 4


def test_labels_of_one_place_without_a_choice_are_seen_as_a_fault_and_the_second_is_left_out() -> None:
    spot = Spot((200.0, 100.0))
    one, other = (drawn([(text, [spot])]) for text in ("advance 570 m", "tactical diameter 1029 m"))
    over = one | {"layer": [*one["layer"], *other["layer"]]}
    assert faults(over) == ["'advance 570 m' on 'tactical diameter 1029 m'"]
    assert [text for text, _ in place_labels([("advance 570 m", [spot]), ("transfer", [spot])], FRAME)] == [
        "advance 570 m"
    ]


def test_a_label_does_not_leave_the_plot() -> None:
    row = {"x": 395, "y": 100, "t": "advance 570 m"}
    edge = layered([layer("text", [row], {**POSITION, "text": "t:N"})], size=(400, 200))
    assert "'advance 570 m' leaves its axes" in faults(edge)
    for corner in ((0.0, 0.0), (400.0, 0.0), (0.0, 200.0), (400.0, 200.0)):
        assert faults(drawn([("7.78°", spots_about(corner))])) == []


def test_a_line_is_left_free() -> None:
    spots = spots_along((100.0, 100.0), (300.0, 100.0), FRAME)
    across = np.linspace(150.0, 250.0, 20)
    ((_, spot),) = place_labels([("figure", spots)], FRAME, [(across, np.full(20, 109.0))])
    assert spot.dy > 0, "the line runs where the label would be first"
    ((_, spot),) = place_labels([("figure", spots)], FRAME)
    assert spot.dy < 0 and spot.at == (200.0, 100.0)
