"""The pilot card and the poster: figures where they are known, blanks where not, one sheet when printed."""

from __future__ import annotations

import re
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest

from tank2sim.apps.bridge.boxes import OUTSIDE, draughts, particulars, steering, stopping, telegraph, turning, zigzags
from tank2sim.apps.bridge.drawings import circles_drawing, clock, knots
from tank2sim.apps.bridge.result import pilot_card_page, poster_page
from tank2sim.apps.bridge.study import Bridge, bridge_of
from tank2sim.cards import read_card
from tank2sim.notices import Notice
from tests.answer.browser import browser, measured_in_browser

BLANK = 'class="blank"'


@pytest.fixture(scope="module")
def bridge() -> Bridge:
    return bridge_of(read_card("esso-osaka-estimated"))


@pytest.fixture(scope="module")
def mariner_bridge(mariner_card) -> Bridge:
    return bridge_of(mariner_card)


@pytest.fixture(scope="module")
def tanker_bridge() -> Bridge:
    """Of a ship whose turning circles leave her card's range at 60 degrees."""
    return bridge_of(read_card("kvlcc2-captive", {"model.valid_yaw_rate_prime": 1.0, "model.valid_rudder_deg": 40.0}))


@pytest.fixture(scope="module")
def crowded(bridge) -> Bridge:
    """As many and as long words as a card and a command can bring."""
    orders = {"Full ahead": 600.0, "Half ahead": 450.0, **{f"{'N' * 23}{one}": 500.0 + one for one in range(3)}}
    own = bridge_of(bridge.card, orders)
    ship = own.card.ship.model_copy(
        update={"name": "Motor tanker " + "Verylong" * 9, "source": "S" * 60 + " words" * 99}
    )
    notices = tuple(Notice(f"{place} {'a long notice ' * 30}") for place in range(12))
    study = replace(own.study, notices=notices)
    return replace(own, card=replace(own.card, ship=ship), study=study)


def test_known_values_are_printed_and_unknown_ones_are_blanks(mariner_bridge) -> None:
    rows = {row.label: row.values for row in steering(mariner_bridge).rows}
    assert rows["Maximum rudder angle"] == ("40°",)
    assert rows["Type of rudder(s)"] == (None,)
    page = poster_page(mariner_bridge)
    assert "Mariner class" in page and "160.93 m" in page
    assert page.count(BLANK) > 60
    assert "The card has no propulsion" in page


def test_a_name_in_a_card_is_no_html(mariner_bridge) -> None:
    ship = mariner_bridge.card.ship.model_copy(update={"name": "<script>x</script>"})
    own = replace(mariner_bridge, card=replace(mariner_bridge.card, ship=ship))
    for page in (poster_page(own), pilot_card_page(own)):
        assert "<script" not in page and "&lt;script" in page


def test_a_ballast_card_names_the_conditions_and_fills_its_column(bridge) -> None:
    box = telegraph(bridge, bridge)
    assert box.heads == ("Rpm / pitch", "kn, Loaded", "kn, Ballast")
    assert box.rows[0].values == ("600", "0.62", "0.62")
    assert box.rows[4].values == ("120", OUTSIDE, OUTSIDE)  # slower than the card's range
    assert box.rows[-1].values == (None, None, None)  # astern
    assert telegraph(bridge, None).rows[0].values == ("600", "0.62", None)
    assert poster_page(bridge, bridge).count(BLANK) < poster_page(bridge).count(BLANK)


def test_circles_are_drawn_to_one_scale_with_starboard_to_the_right(bridge) -> None:
    drawing = circles_drawing(bridge.deep, 3.0, 0.489, width=90.0, height=60.0)
    tracks = {line.style: line.points for line in drawing.lines}
    points = [tuple(map(float, pair.split(","))) for pair in tracks["track starboard"].split()]
    across, up = max(x for x, _ in points) - points[0][0], points[0][1] - min(y for _, y in points)
    figures = bridge.deep[0].figures
    largest = max(bridge.deep[0].starboard_m), max(bridge.deep[0].ahead_m)
    assert across / up == pytest.approx(largest[0] / largest[1], rel=0.01) and across > 0
    assert all(0 <= x <= 90 and 0 <= y <= 60 for x, y in points)
    assert any(clock(figures["time_180_s"]) in word.text for word in drawing.words)


def test_the_tables_have_the_figures_of_the_simulation(bridge) -> None:
    rows = {row.label: row.values for row in turning(bridge, bridge.deep).rows}
    advance = bridge.deep[0].figures["advance_m"]
    assert rows["Advance"][0] == f"{advance:.1f} m ({advance / 3:.2f} L)"
    assert rows["Time to 90°"][0] == "0:41"
    assert knots(7.7175) == "15.0" and clock(59.6) == "1:00"


def test_the_drawings_are_well_formed(bridge) -> None:
    drawings = re.findall(r"<svg.*?</svg>", poster_page(bridge), flags=re.S)
    assert len(drawings) == 2  # circles and stops
    for drawing in drawings:
        ET.fromstring(drawing)


def test_a_figure_beyond_the_card_is_not_printed(tanker_bridge) -> None:
    assert tanker_bridge.deep[0].figures["tactical_diameter_m"] < 520  # MARIN measured 981 m
    rows = {row.label: row.values for row in turning(tanker_bridge, tanker_bridge.deep).rows}
    assert set(rows.values()) == {(OUTSIDE, OUTSIDE)}
    assert OUTSIDE not in zigzags(tanker_bridge).rows[3].values  # they stay within
    for page in (poster_page(tanker_bridge), pilot_card_page(tanker_bridge)):
        assert "510 m" not in page and "528 m" not in page and "3:03" not in page
        assert page.count('title="outside') == 16 and "not for use there" in page
        assert "range of the card ends" in page


def test_a_track_is_drawn_as_far_as_the_card_holds(tanker_bridge) -> None:
    drawing = circles_drawing(tanker_bridge.deep, 320.0, 58.0, width=90.0, height=60.0)
    texts = [word.text for word in drawing.words if word.style in ("word", "warn")]
    assert any("60°" in text for text in texts) and not any("90°" in text for text in texts)
    first = tanker_bridge.deep[0]
    assert first.inside < 0.5 * len(first.ahead_m)


def test_a_stop_ends_where_the_card_does(bridge) -> None:
    assert all(row.values == (OUTSIDE, OUTSIDE) for row in stopping(bridge).rows)
    assert "assumption" in stopping(bridge).note


def test_circles_are_with_the_largest_rudder_and_say_so(mariner_bridge, bridge) -> None:
    page = poster_page(mariner_bridge)
    assert mariner_bridge.study.rudder_deg == pytest.approx(40) and "rudder 40°" in page
    assert "Turning circles at maximum rudder angle" in page
    assert "Turning circles at 35° rudder: the card states no maximum angle" in poster_page(bridge)


def test_orders_that_are_not_given_stay_blanks(crowded) -> None:
    box = telegraph(crowded, None)
    labels = [row.label for row in box.rows]
    assert labels[:5] == ["Full sea speed", "Full ahead", "Half ahead", "Slow ahead", "Dead slow ahead"]
    assert box.rows[0].values == (None, None, None) and box.rows[1].values[:2] == ("600", "0.62")
    assert box.rows[5].values[0] == "500" and labels[-1] == "Full astern"
    assert [row.label for row in stopping(crowded).rows][3:5] == ["Slow ahead", "Dead slow ahead"]


def test_the_forms_ask_for_all_that_the_resolution_does(mariner_bridge) -> None:
    pilot, poster = pilot_card_page(mariner_bridge), poster_page(mariner_bridge)
    for words in (
        "Present draught",
        "☐ single  ☐ dual",
        "Compass system",
        "Electronic position fixing, type",
        "Number of power units operating",
        "Doppler",
    ):
        assert words in pilot, words
    for words in ("Sound the alarm", "Keep the look-out", "Cast a buoy", "with two power units", "delay to reverse"):
        assert words in poster, words
    head = {row.label: row.values for row in particulars(mariner_bridge)}
    # Whether the card is of the summer draught it does not say.
    assert head["Block coefficient, summer draught"] == (None,) == head["Max. displacement, summer draught"]
    own = {row.label: row.values for row in draughts(mariner_bridge, None).rows}
    assert own["Mean"][0] == "7.468 m" and own["Displacement"][0] is None


MEASURE = """<script>{
const rect = (one) => one.getBoundingClientRect();
const meet = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 0.5 &&
  Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.5;
const found = [];
document.querySelectorAll(".sheet").forEach((sheet, number) => {
  const pairs = (list, what) => list.forEach((one, place) => list.slice(place + 1).forEach((other) => {
    if (meet(rect(one), rect(other)))
      found.push(`${number} ${what}: ${one.textContent.slice(0, 40)} | ${other.textContent.slice(0, 40)}`);
  }));
  pairs([...sheet.querySelectorAll(":scope > header, footer, .box, .panel")], "boxes");
  sheet.querySelectorAll("svg").forEach((svg) => pairs([...svg.querySelectorAll("text")], "labels"));
  sheet.querySelectorAll(".box, .panel, header").forEach((box) => box.querySelectorAll("*").forEach((one) => {
    const inner = rect(one), outer = rect(box);
    if (inner.width && (inner.right > outer.right + 1 || inner.bottom > outer.bottom + 1))
      found.push(`${number} sticks out: ${one.textContent.slice(0, 40)}`);
  }));
  const paper = rect(sheet);
  sheet.querySelectorAll(".box, .panel, header, footer").forEach((one) => {
    if (rect(one).right > paper.right || rect(one).bottom > paper.bottom)
      found.push(`${number} leaves the sheet: ${one.textContent.slice(0, 40)}`);
  });
  const height = (rect(sheet).height / sheet.currentCSSZoom) * 25.4 / 96; // on paper, whatever the screen
  if (height > 297.2) found.push(`${number} is ${height} mm high`);
});
document.body.dataset.found = JSON.stringify(found);
}</script>"""


@pytest.mark.slow
def test_no_box_and_no_label_lies_over_another_on_any_ship(
    tmp_path, bridge, mariner_bridge, tanker_bridge, crowded
) -> None:
    ships = ((bridge, None), (mariner_bridge, None), (tanker_bridge, None), (crowded, crowded), (tanker_bridge, bridge))
    pages = [draw(*both) for both in ships for draw in (poster_page, pilot_card_page)]
    # All sheets in one page: Chromium is slow to start.
    sheets = "".join(re.search(r"<main.*</main>", page, flags=re.S)[0] for page in pages)
    one = re.sub(r"<main.*</main>", lambda _: sheets + MEASURE, pages[0], flags=re.S)
    assert measured_in_browser(one, tmp_path, "found", "--window-size=1700,2000") == []


@pytest.mark.slow
@pytest.mark.parametrize(("draw", "size"), [(poster_page, (420, 297)), (pilot_card_page, (210, 297))])
def test_each_prints_on_one_sheet(tmp_path, crowded, draw, size) -> None:
    (tmp_path / "page.html").write_text(draw(crowded, crowded), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
    options += [f"--user-data-dir={tmp_path / 'profile'}", "--no-pdf-header-footer"]
    target = [f"--print-to-pdf={tmp_path / 'page.pdf'}", (tmp_path / "page.html").as_uri()]
    subprocess.run([browser(), *options, *target], check=True, capture_output=True, timeout=120)
    printed = (tmp_path / "page.pdf").read_bytes()
    assert len(re.findall(rb"/Type\s*/Page[^s]", printed)) == 1
    box = [float(one) for one in re.search(rb"MediaBox\s*\[([^\]]*)\]", printed)[1].split()]
    assert [25.4 * one / 72 for one in box[2:]] == pytest.approx(size, abs=1.0)
