"""The pilot card and the poster: figures where they are known, blanks where not, one sheet when printed."""

from __future__ import annotations

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest

from tank2sim.analysis.practice.bridge import Bridge, bridge_of
from tank2sim.cards import read_card
from tank2sim.report.bridge_boxes import steering, telegraph, turning
from tank2sim.report.bridge_drawings import circles_drawing, clock, knots
from tank2sim.report.bridge_pages import pilot_card_page, poster_page

BLANK = 'class="blank"'


@pytest.fixture(scope="module")
def bridge() -> Bridge:
    return bridge_of(read_card("esso-osaka"))


@pytest.fixture(scope="module")
def mariner_bridge(mariner_card) -> Bridge:
    return bridge_of(mariner_card)


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


@pytest.mark.slow
@pytest.mark.parametrize(("draw", "size"), [(poster_page, (420, 297)), (pilot_card_page, (210, 297))])
def test_each_prints_on_one_sheet(tmp_path, bridge, draw, size) -> None:
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium to print with")
    (tmp_path / "page.html").write_text(draw(bridge, bridge), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
    options += [f"--user-data-dir={tmp_path / 'profile'}", "--no-pdf-header-footer"]
    target = [f"--print-to-pdf={tmp_path / 'page.pdf'}", (tmp_path / "page.html").as_uri()]
    subprocess.run([browser, *options, *target], check=True, capture_output=True, timeout=120)
    printed = (tmp_path / "page.pdf").read_bytes()
    assert len(re.findall(rb"/Type\s*/Page[^s]", printed)) == 1
    box = [float(one) for one in re.search(rb"MediaBox\s*\[([^\]]*)\]", printed)[1].split()]
    assert [25.4 * one / 72 for one in box[2:]] == pytest.approx(size, abs=1.0)
