"""What is drawn of the JSON of each command: the data in the charts are those of the JSON."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.page import Page, render_page
from tank2sim.answer.parts import Illustration, Section
from tank2sim.files import json_text
from tank2sim.report.results.page import result_page
from tests.cli.command_line import tank2sim
from tests.report.drawn import line, panels, rows_of
from tests.report.opened_page import CHROMIUM, opened

TIMES = [0.0, 1.0, 2.0, 3.0]
HISTORIES = {
    "t_s": TIMES,
    "delta_deg": [0.0, 10.0, 10.0, 10.0],
    "n_rpm": [60.0] * 4,
    "u_mps": [7.0, 6.9, None, 6.7],
    "r_degps": [0.0, 0.1, 0.2, 0.3],
    "psi_deg": [0.0, 0.05, 0.2, 0.45],
    "x_m": [0.0, 7.0, 14.0, 21.0],
    "y_m": [0.0, 0.1, 0.3, 0.6],
}
WAY = {"name": "starboard", "figures": {}, "ahead_m": [0.0, 500.0, 600.0], "starboard_m": [0.0, 50.0, 400.0]}
POSTER = {"ship": "A ship", "turning_circles_deep": [WAY], "turning_circles_shallow": [], "stops": [], "telegraph": []}


def line_of(chart: Illustration, up: str, run: str | None = None) -> list[float]:
    return line(chart.chart, up, run)


def panels_of(chart: Illustration) -> dict[str, list[dict[str, Any]]]:
    return panels(chart.chart)


def charts_of(page: Page) -> dict[str, Illustration]:
    found = {}
    for section in page.sections:
        for one in section.charts:
            title = chart_specification(one.chart).get("title", "")
            found[title["text"] if isinstance(title, dict) else title] = one
    return found


def drawn(result: Any) -> dict[str, Illustration]:
    """The charts of the page of a result, after its way through a file."""
    return charts_of(result_page(json.loads(json_text(result)), "r.json"))


def test_the_turning_circle_of_a_poster_is_drawn_with_the_way_ahead_up() -> None:
    track = [row for row in rows_of(drawn(POSTER)["Turning circles in deep water"].chart) if row.get("i") is not None]
    assert [(row["x"], row["y"]) for row in track[:3]] == list(zip(WAY["ahead_m"], WAY["starboard_m"], strict=True))


@pytest.mark.slow
def test_influence_has_the_page_of_the_command(tmp_path: Any) -> None:
    command = "influence mariner --figure criterion_C K_per_s --json i.json --page i.html".split()
    assert tank2sim(*command, cwd=tmp_path).returncode == 0
    assert tank2sim("report", "i.json", "-o", "r.html", cwd=tmp_path).returncode == 0
    assert (tmp_path / "i.html").read_bytes() == (tmp_path / "r.html").read_bytes()
    reported = json.loads((tmp_path / "i.json").read_text())
    chart = charts_of(result_page(reported, "i.json"))["Influence on criterion C"]
    bars = {(row["name"], row["exact"]) for row in rows_of(chart.chart) if row.get("run") == "exact slope"}
    exact = reported["influence_percent"]["criterion_C"]["derivatives.Nr"]["exact"]
    assert any(name == "Nr" and value == pytest.approx(exact, rel=1e-5) for name, value in bars)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to open the page in")
def test_the_charts_of_every_kind_open_without_a_word_in_the_console(tmp_path: Any) -> None:
    results = [POSTER]
    pages = [result_page(json.loads(json_text(one)), "r.json") for one in results]
    sections = [
        Section(heading=page.title, charts=[chart for section in page.sections for chart in section.charts])
        for page in pages
    ]
    html = render_page(Page(title="All", sections=sections))
    assert len(html.encode()) < 6e6
    seen, console = opened(html, tmp_path)
    assert console == []
    assert 'data-charts="drawn"' in seen
    assert seen.count("<svg") >= sum(len(section.charts) for section in sections)
