"""Charts of analyses: Bode, Nyquist and poles of known systems, errors and limits, before and after."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from tank2sim.answer.charts.analysis import (
    FrequencyResponse,
    OutputError,
    PolesZeros,
    bode_chart,
    error_chart,
    nyquist_chart,
    pole_zero_chart,
    sensitivity_chart,
)
from tank2sim.answer.charts.before_after import ALL, BOTH, before_after_switch, switch
from tank2sim.answer.charts.picture import chart_png, chart_specification
from tank2sim.answer.charts.theme import DARK, DARK_TONE
from tank2sim.answer.page import render_page
from tank2sim.gap.outcome.export import gap_study
from tank2sim.results.gap import NO_TRIALS, gap_result
from tank2sim.results.gap_charts import HISTORIES, misfit_chart, place_chart, worst_replays
from tank2sim.results.trial_charts import history_grid, track_grid
from tests.answer.drawn import rows, rows_of_layer
from tests.answer.opened_page import CHROMIUM, opened
from tests.gap import made_up


def bode_of(response):
    omega = np.logspace(-2, 2, 401)
    system = FrequencyResponse("system", omega_radps=omega, response=response(1j * omega))
    specification = chart_specification(bode_chart([system]))
    panels = [panel["layer"][0] for panel in specification["vconcat"]]
    at = [{round(row["x"], 6): row["v"] for row in rows(specification, panel)} for panel in panels]
    return specification, at[0], at[1]


def test_an_integrator_has_0_db_and_minus_90_degrees_at_1_rad_per_second():
    _, magnitude, phase = bode_of(lambda s: 1 / s)
    assert magnitude[1.0] == pytest.approx(0, abs=1e-9)
    assert magnitude[10.0] == pytest.approx(-20)
    assert set(phase.values()) == {-90.0}


def test_the_phase_of_three_integrations_is_minus_270_and_not_90():
    # Two of the three come in above 1 rad/s, so that the phase passes -180 on its way.
    _, _, phase = bode_of(lambda s: 1 / (s * (1 + s) ** 2))
    assert phase[1.0] == pytest.approx(-180)
    assert phase[100.0] == pytest.approx(-270, abs=1.5)


def test_phase_is_ticked_in_parts_of_a_right_angle_around_all_of_it():
    specification, _, phase = bode_of(lambda s: 1 / (s * (1 + s) ** 2))
    ticks = specification["vconcat"][1]["layer"][0]["encoding"]["y"]["axis"]["values"]
    assert ticks == [-270, -240, -210, -180, -150, -120, -90]
    assert ticks[0] <= min(phase.values()) and ticks[-1] >= max(phase.values())


def test_bode_axes_name_their_units_and_the_frequency_is_logarithmic():
    specification, _, _ = bode_of(lambda s: 1 / s)
    upper, lower = (panel["layer"][0]["encoding"] for panel in specification["vconcat"])
    assert upper["y"]["title"] == "magnitude (dB)"
    assert lower["y"]["title"] == "phase (deg)"
    assert lower["x"]["title"] == "angular frequency (rad/s)"
    assert {upper["x"]["scale"]["type"], lower["x"]["scale"]["type"]} == {"log"}


def test_a_pole_tells_its_natural_frequency_and_damping():
    specification = chart_specification(pole_zero_chart([PolesZeros("yaw", poles=[-3 + 4j, -3 - 4j], zeros=[-2])]))
    upper, _, zero = rows(specification, specification["layer"][-1])
    assert (upper["kind"], upper["re"], upper["im"], upper["wn"], upper["zeta"]) == ("pole", -3, 4, 5, 0.6)
    assert (zero["kind"], zero["re"]) == ("zero", -2)


@pytest.mark.parametrize("poles", [[-0.1, -0.01], [0.02], [-0.05 + 2j, -0.05 - 2j], [0.0]])
def test_the_complex_plane_has_one_scale_and_shows_the_border_of_stability(poles):
    specification = chart_specification(pole_zero_chart([PolesZeros("yaw", poles=poles)]))
    encoding = specification["layer"][-1]["encoding"]
    (left, right), (low, high) = encoding["x"]["scale"]["domain"], encoding["y"]["scale"]["domain"]
    assert (right - left) / specification["width"] == pytest.approx((high - low) / specification["height"], rel=1e-12)
    assert left < 0 < right
    assert all(left < complex(pole).real < right and low < complex(pole).imag < high for pole in poles)


def test_errors_are_held_against_their_limits():
    errors = [
        OutputError(kind="FMI 2 CS", output="motion.x", error=1e-9, limit=1e-9),
        OutputError(kind="FMI 2 CS", output="motion.y", error=1.1e-9, limit=1e-9),
        OutputError(kind="FMI 3 ME", output="motion.x", error=1.1e-9, limit=1e-6),
        OutputError(kind="FMI 3 ME", output="motion.y", error=math.nan, limit=1e-6),
    ]
    specification = chart_specification(error_chart(errors))
    verdicts = [row["verdict"] for row in rows(specification, specification)]
    assert verdicts == ["within the limit", "above the limit", "within the limit", "above the limit"]
    assert "Above the limit: motion.y." in specification["description"]
    assert specification["facet"]["sort"] == ["FMI 2 CS", "FMI 3 ME"]


def test_every_error_has_a_place_on_the_logarithmic_scale():
    errors = [
        OutputError(kind="CS", output=f"output {place}", error=error, limit=1e-9)
        for place, error in enumerate([0.0, 3e-15, 1e-3, math.inf])
    ]
    specification = chart_specification(error_chart(errors))
    low, high = specification["spec"]["layer"][2]["encoding"]["x"]["scale"]["domain"]
    drawn = rows(specification, specification)
    assert [row["e"] for row in drawn] == [low, 3e-15, 1e-3, high]
    assert 0 < low < 3e-15 and high > 1e-3
    assert drawn[0]["error"] == "0 (exactly)" and drawn[3]["error"] == "inf"


def test_errors_of_exactly_zero_alone_can_be_drawn():
    specification = chart_specification(error_chart([OutputError(kind="CS", output="x", error=0.0, limit=1e-9)]))
    assert "All are within their limits." in specification["description"]


OMEGA = np.logspace(-2, 2, 400)
LOOP = 2 / (1j * OMEGA * (1j * OMEGA + 1))


def test_the_nyquist_curve_touches_the_circle_of_its_peak() -> None:
    peak = float(1 / np.abs(1 + LOOP).min())
    chart = nyquist_chart([FrequencyResponse("L", omega_radps=OMEGA, response=LOOP)], peak)
    circle, curve = (np.array([complex(row["x"], row["v"]) for row in rows_of_layer(chart, n)]) for n in (4, 2))
    np.testing.assert_allclose(np.abs(circle + 1), 1 / peak, rtol=1e-4)
    assert np.abs(curve + 1).min() == pytest.approx(1 / peak, rel=2e-3)
    assert chart_png(chart, scale=0.2)[:4] == b"\x89PNG"


def test_sensitivities_are_in_decibel_over_frequency() -> None:
    chart = sensitivity_chart([FrequencyResponse("S", omega_radps=OMEGA, response=1 / (1 + LOOP))])
    rows = rows_of_layer(chart, 1)
    for row in rows[:: len(rows) // 7]:
        s = 1j * row["x"]
        wanted = 20 * math.log10(abs(s * (s + 1) / (s * (s + 1) + 2)))
        assert row["v"] == pytest.approx(wanted, abs=1e-3)


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
        lambda found: track_grid(worst_replays(found, held_out=False)),
        lambda found: history_grid(worst_replays(found, held_out=True), signals=HISTORIES),
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
