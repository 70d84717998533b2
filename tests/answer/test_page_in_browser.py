"""The page as a browser shows it; skipped where no Chromium is installed."""

import json
import re
from html import escape, unescape

import altair as alt
import pytest

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.charts.vega import STACKS, PlotAxis
from tank2sim.answer.page import Page, render_page
from tank2sim.answer.parts import Illustration, Section
from tests.answer.opened_page import CHROMIUM, opened

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to open the page in")

# Keeps the views the page makes, and turns the wheel over the first chart, without and with Ctrl.
KEEP_VIEWS = """<script>{
  const embed = vegaEmbed;
  window.views = [];
  window.vegaEmbed = async (...all) => { const made = await embed(...all); views.push(made.view); return made; };
}</script>"""
TURN_WHEEL = """<script>
const shown = () => {
  const view = views.findLast((one) => one.container().isConnected);
  const span = (axis) => {
    try { const [low, high] = view.scale(axis).domain(); return high - low; } catch { return null; }
  };
  return { x: span("x"), y: span("y"), width: view.width(), height: view.height() };
};
setTimeout(() => {
  const chart = document.querySelector("figure svg");
  const target = chart.querySelector(".role-scope .background") ?? chart.querySelector(".role-frame .background");
  const box = target.getBoundingClientRect();
  const turn = (ctrlKey) => target.dispatchEvent(new WheelEvent("wheel", {
    bubbles: true, cancelable: true, deltaY: -300, ctrlKey, clientX: box.left + 150, clientY: box.top + 80 }));
  const seen = [shown()];
  turn(false);
  setTimeout(() => { seen.push(shown()); turn(true); }, 200);
  setTimeout(() => { seen.push(shown()); document.body.dataset.seen = JSON.stringify(seen); }, 400);
}, 1500);
</script>"""


@pytest.mark.essential
@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_draws_every_chart_without_a_word_in_the_console(page, tmp_path, scheme):
    flags = ["--blink-settings=preferredColorScheme=0"] if scheme == "dark" else []
    seen, console = opened(render_page(page), tmp_path, *flags)
    assert console == []
    assert 'data-charts="drawn"' in seen
    charts = seen.split('class="drawing')[1:]
    assert len(charts) == 7
    paper = {"light": "rgb(255, 255, 255)", "dark": "rgb(21, 28, 35)"}[scheme]
    assert all("<svg" in chart and f"background-color: {paper}" in chart for chart in charts)
    assert all(chart.count("<path") > 3 for chart in charts)


def wheel_over(chart, folder, *flags):
    """What a chart shows at first, after the wheel alone, and after the wheel with Ctrl."""
    html = render_page(Page(title="Wheel", sections=[Section("Chart", charts=[Illustration(chart)])]))
    place = html.rindex('<script>\n"use strict"')
    html = html[:place] + KEEP_VIEWS + html[place:].replace("</body>", TURN_WHEEL + "</body>")
    seen, console = opened(html, folder, *flags)
    assert console == []
    return json.loads(unescape(re.search(r'data-seen="(.*?)"', seen)[1]))


@pytest.mark.slow
@pytest.mark.parametrize("width", [1200, 420])
def test_a_track_keeps_equal_scales_when_it_is_zoomed_and_when_the_window_is_narrow(tmp_path, width):
    track = TrackData("run", x_m=[0, 300, 500], y_m=[0, 50, 900])
    before, wheel, zoomed = wheel_over(track_chart([track]), tmp_path, f"--window-size={width},900")
    assert before["width"] < width
    assert before["x"] / before["width"] == pytest.approx(before["y"] / before["height"], rel=1e-9)
    assert wheel == before
    assert zoomed["x"] / zoomed["width"] == pytest.approx(zoomed["y"] / zoomed["height"], rel=1e-9)
    assert zoomed["x"] < 0.9 * before["x"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["history", "bode"])
def test_stacked_charts_are_zoomed_along_their_common_axis(charts, tmp_path, name):
    before, wheel, zoomed = wheel_over(charts[name], tmp_path)
    assert wheel == before
    assert zoomed["x"] < 0.9 * before["x"]


def test_a_name_that_is_a_script_is_not_run(tmp_path):
    name = "</script><script>document.body.dataset.run = 1</script><img src=x onerror='document.body.dataset.run = 2'>"
    chart = track_chart([TrackData(name, x_m=[0, 1], y_m=[0, 1]), TrackData("b", x_m=[0, 1], y_m=[0, 1])], title=name)
    page = Page(title=name, sections=[Section(name, text=name, charts=[Illustration(chart, caption=name)])])
    seen, console = opened(render_page(page), tmp_path)
    assert console == []
    assert 'data-charts="drawn"' in seen
    assert "data-run" not in seen


MEASURE = """<script>
const frame = document.querySelector("iframe");
const measure = () => {
  const page = frame.contentDocument;
  if (page?.documentElement?.dataset.charts !== "drawn") return setTimeout(measure, 100);
  const charts = [...page.querySelectorAll(".drawing")].map((drawing) => ({
    room: drawing.clientWidth, chart: drawing.querySelector("svg").width.baseVal.value }));
  document.body.dataset.seen = JSON.stringify({ page: page.documentElement.scrollWidth, charts });
};
measure();
</script>"""


@pytest.mark.slow
def test_charts_fit_a_window_of_400_px_at_the_size_of_their_letters(charts, tmp_path):
    shown = [Illustration(charts[name]) for name in ("track", "history", "bode")]
    inner = render_page(Page(title="Narrow", sections=[Section("Charts", charts=shown)]))
    html = f'<body><iframe width="400" height="800" srcdoc="{escape(inner)}"></iframe>{MEASURE}</body>'
    seen, _ = opened(html, tmp_path)
    found = json.loads(unescape(re.search(r'data-seen="(.*?)"', seen)[1]))
    assert found["page"] <= 400
    assert all(chart["chart"] <= chart["room"] + 1 for chart in found["charts"]), found


PLACES = """<script>
const frames = [...document.querySelectorAll("iframe")];
const measure = () => {
  const pages = frames.map((frame) => frame.contentDocument);
  if (pages.some((page) => page?.documentElement?.dataset.charts !== "drawn")) return setTimeout(measure, 100);
  document.body.dataset.seen = JSON.stringify(pages.map((page) => {
    page.querySelector("details.part").open = true;
    const tops = (found) => [...found].map((one) => one.getBoundingClientRect())
      .filter((box) => box.width > 100 && box.height > 100).map((box) => Math.round(box.top));
    return {
      page: page.documentElement.scrollWidth,
      halves: tops(page.querySelectorAll("figure.half")),
      panels: [...page.querySelectorAll("figure:not(.half)")].slice(0, 3)
        .map((figure) => tops(figure.querySelectorAll(".background"))),
      folded: page.querySelector("details.part svg").getBoundingClientRect().width,
    };
  }));
};
measure();
</script>"""


@pytest.mark.slow
def test_halves_and_panels_are_side_by_side_only_where_there_is_room_and_folded_charts_are_drawn(charts, tmp_path):
    half = Illustration(charts["track"], half=True)
    panel = alt.Chart(alt.Data(values=[{"a": 1}])).mark_point().encode(x="a:Q", y="a:Q").properties(width=300)
    kinds = (
        alt.Chart(alt.Data(values=[{"a": 1, "k": "one"}, {"a": 2, "k": "two"}])).mark_point().encode(x="a:Q", y="a:Q")
    )
    grids = [
        alt.hconcat(panel, panel, usermeta=STACKS),
        alt.concat(panel, panel, columns=3),
        alt.vconcat(kinds.properties(width=300).facet(column="k:N"), usermeta=STACKS),
    ]
    sections = [
        Section("First", charts=[half, half, *(Illustration(grid) for grid in grids)]),
        Section("Folded", charts=[Illustration(charts["history"])], folded=True),
    ]
    inner = escape(render_page(Page(title="Places", verdict="It fits.", sections=sections)))
    frames = (f'<iframe width="{width}" height="800" srcdoc="{inner}"></iframe>' for width in (1300, 400))
    seen, _ = opened(f"<body>{''.join(frames)}{PLACES}</body>", tmp_path)
    wide, narrow = json.loads(unescape(re.search(r'data-seen="(.*?)"', seen)[1]))
    assert narrow["page"] <= 400 and wide["folded"] > 400 and 200 < narrow["folded"] < 400
    assert wide["halves"][0] == wide["halves"][1] and narrow["halves"][0] < narrow["halves"][1]
    for side_by_side, stacked in zip(wide["panels"], narrow["panels"], strict=True):
        assert len(set(side_by_side)) == 1 and stacked[0] < stacked[-1]


PLOTS = """<script>
const plots = [...document.querySelectorAll("iframe")].map((frame) => frame.contentDocument);
const widths = () => {
  if (plots.some((page) => page?.documentElement?.dataset.charts !== "drawn")) return setTimeout(widths, 100);
  document.body.dataset.seen = JSON.stringify(plots.map((page) =>
    page.querySelector(".role-frame .background").getBoundingClientRect().width));
};
setTimeout(widths, 300);
</script>"""


@pytest.mark.slow
def test_a_legend_as_wide_as_the_window_does_not_squeeze_the_plot(tmp_path):
    times = [0.0, 1.0, 2.0]
    lines = [PlotSeries(name, x=times, y=times) for name in ("fit", "0.4 rad/s", "0.6 rad/s")]
    chart = curve_chart(Plot(lines, up=PlotAxis("Yv")), PlotAxis("v'"), described="three lines")
    inner = escape(render_page(Page(title="x", sections=[Section("x", charts=[Illustration(chart)])])))
    frames = "".join(
        f'<iframe width="{width}" height="800" srcdoc="{inner}"></iframe>' for width in range(340, 430, 10)
    )
    seen, _ = opened(f"<body>{frames}{PLOTS}</body>", tmp_path)
    assert min(json.loads(unescape(re.search(r'data-seen="(.*?)"', seen)[1]))) > 120
