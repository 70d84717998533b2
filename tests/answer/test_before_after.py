"""Before and after are switched in the page itself: by the switch's own words, and never on paper."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html import unescape

import pytest

from tank2sim.answer.charts.before_after import ALL, BOTH, before_after_switch, switch
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.charts.theme import DARK, DARK_TONE
from tank2sim.answer.page import render_page
from tank2sim.gap.outcome.export import gap_study
from tank2sim.results.gap import NO_TRIALS, gap_result
from tank2sim.results.gap_charts import gap_histories, gap_tracks, misfit_chart, place_chart
from tests.answer.opened_page import CHROMIUM, opened
from tests.gap import made_up

# Of every chart with a switch: what is drawn at first, after a key or click on "after", on paper, and afterwards.
SWITCH = """<script>
const count = (figure) => figure.querySelectorAll(".mark-line path[d*='L'], .mark-rect path, .mark-text text").length;
const drawn = () => new Promise((resolve) => setTimeout(resolve, 200));
setTimeout(async () => {
  const figures = [...document.querySelectorAll("figure:has(.choice)")];
  const all = figures.map((figure) => {
    const inputs = [...figure.querySelectorAll(".choice input[type=radio]")];
    const hidden = inputs.some((input) => input.closest("[role=img]"));
    return { words: inputs.map(({ value }) => value), hidden, seen: [count(figure)] };
  });
  for (const value of ["after", "before"]) {
    for (const figure of figures) figure.querySelector(`.choice input[value=${value}]`).click();
    await drawn();
    figures.forEach((figure, place) => all[place].seen.push(count(figure)));
  }
  for (const kind of ["beforeprint", "afterprint"]) {
    dispatchEvent(new Event(kind));
    await drawn();
    figures.forEach((figure, place) => all[place].seen.push(count(figure)));
  }
  figures.forEach((figure, place) => { all[place].checked = figure.querySelectorAll("input:checked").length; });
  document.body.dataset.switched = JSON.stringify(all);
}, 4000);
</script></body>"""


def test_a_switch_is_at_all_together_and_one_model_needs_none() -> None:
    (two,), (three,) = (switch(words) for words in (["before", "after"], ["before", "after", "black box"]))
    assert two["value"] == BOTH and three["value"] == ALL
    assert two["bind"]["options"] == ["before", "after", BOTH]
    assert switch(["before"]) == [] and before_after_switch({"before": "card before"}) == "true"


@pytest.mark.parametrize(
    "chart",
    [
        misfit_chart,
        place_chart,
        lambda found: gap_tracks(found, held_out=False),
        lambda found: gap_histories(found, held_out=True)[0],
    ],
    ids=["misfit", "places", "tracks", "histories"],
)
def test_every_chart_of_before_and_after_has_the_switch(chart) -> None:
    specification = chart_specification(chart(gap_study(made_up.missing())))
    (parameter,) = (one for one in specification["params"] if "bind" in one)
    assert parameter["bind"]["input"] == "radio" and parameter["bind"]["options"] == ["before", "after", BOTH]
    assert f"[{parameter['name']}]" in json.dumps(specification)


def test_titles_of_colour_bars_are_read_on_a_dark_screen() -> None:
    assert DARK["legend"]["titleColor"] == DARK["legend"]["labelColor"] == DARK_TONE.ink


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to open the page in")
def test_the_switches_of_a_gap_page_work_and_paper_shows_both(tmp_path) -> None:
    page = gap_result(made_up.missing(), NO_TRIALS, NO_TRIALS).layout()
    whole = {"Before and after", "Tracks and motions"}
    page = replace(page, sections=[one for one in page.sections if one.heading in whole])
    head, _, tail = render_page(page).rpartition("</body>")
    seen, console = opened(head + SWITCH + tail, tmp_path)
    assert console == []
    charts = json.loads(unescape(re.search(r'data-switched="(.*?)"', seen)[1]))
    assert len(charts) == 5
    for chart in charts:
        first, after, before, paper, again = chart["seen"]
        assert chart["words"] == ["before", "after", "both"] and not chart["hidden"] and chart["checked"] == 1
        assert first > after > 0 and first > before > 0
        assert paper == first and again == before
