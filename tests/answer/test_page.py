import hashlib
import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.page import Page, render_page
from tank2sim.answer.parts import Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.notices import caution
from tests.answer.example import example_page

NASTY = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\" ' & <!-- {{ 7*7 }}"


class Reader(HTMLParser):
    """What a browser would make of the page: its elements, and the text within each kind of element."""

    def __init__(self, html):
        super().__init__()
        self.elements, self.text, self.open = [], {}, []
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in {"meta", "img", "link", "br"}:
            self.open.append(tag)

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, text):
        for tag in set(self.open):
            self.text.setdefault(tag, []).append(text)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]

    def words(self, tag):
        return re.sub(r"\s+", " ", "".join(self.text.get(tag, [])))


@pytest.fixture(scope="module")
def html(page):
    return render_page(page)


@pytest.fixture(scope="module")
def reader(html):
    return Reader(html)


def drawings(html):
    return json.loads(re.search(r'<script type="application/json" id="drawings">(.*?)</script>', html, re.DOTALL)[1])


def test_notes_of_a_table_are_below_it_and_cautions_at_the_top_of_the_page() -> None:
    mark = caution("beyond the card").of("advance")
    notes = ("advance: the larger side", mark)
    criteria = Table(caption="Criteria", columns=[Column("criterion")], rows=[["advance"]], notes=notes)
    found = render_page(Page(title="A ship", sections=[Section("IMO", tables=[criteria])]))
    assert found.count(mark) == 1 and found.index(mark) < found.index("<main")
    assert found.index("</table>") < found.index(notes[0])


def test_the_page_fetches_nothing(html, reader):
    for tag, attributes in reader.elements:
        assert tag not in {"link", "img", "iframe", "object", "embed", "base"}
        assert "src" not in attributes
        assert attributes.get("href", "#").startswith("#")
    assert not re.search(r"url\(|@import", re.search(r"<style>.*?</style>", html, re.DOTALL)[0])
    (policy,) = (meta["content"] for meta in reader.all("meta") if "http-equiv" in meta)
    assert "default-src 'none'" in policy
    assert "http" not in policy and "*" not in policy and "connect-src" not in policy


def test_the_page_is_the_same_whenever_it_is_made(html):
    assert render_page(example_page()) == html


@pytest.mark.slow
def test_the_page_is_the_same_in_every_process(html):
    code = (
        "import hashlib\n"
        "from tests.answer.example import example_page\n"
        "from tank2sim.answer.page import render_page\n"
        "print(hashlib.sha256(render_page(example_page()).encode()).hexdigest())"
    )
    command, root = [sys.executable, "-c", code], Path(__file__).parents[2]
    seed = {**os.environ, "PYTHONHASHSEED": "4711"}
    other = subprocess.run(command, cwd=root, env=seed, capture_output=True, text=True, check=True)
    assert other.stdout.strip() == hashlib.sha256(html.encode()).hexdigest()


def test_every_section_table_note_figure_and_chart_is_on_the_page(page, html, reader):
    body = reader.words("body")
    for section in page.sections:
        assert section.heading in reader.words("h2")
        assert section.heading in reader.words("nav")
        for note in section.notes:
            assert note in body
        for table in section.tables:
            assert table.caption in reader.words("caption")
        for illustration in section.charts:
            assert illustration.caption in reader.words("figcaption")
    assert "Tactical diameter 561.2 m passed 3.5 lengths" in re.sub(r"\s+", " ", reader.words("li"))
    count = sum(len(section.charts) for section in page.sections)
    assert len(drawings(html)["charts"]) == len(reader.all("figure")) == count == 7
    assert reader.words("p").count("First paragraph.") == 1
    assert page.title in reader.words("h1") and page.title in reader.words("title")


def test_contents_and_skip_link_lead_somewhere(reader):
    places = {attributes["id"] for _, attributes in reader.elements if "id" in attributes}
    links = [link["href"].removeprefix("#") for link in reader.all("a")]
    assert set(links) <= places
    assert links[0] == "content" and {"section-1", "section-2"} <= set(links)


def test_every_chart_has_words_for_those_who_cannot_see_it(reader):
    drawn = [attributes for attributes in reader.all("div") if attributes.get("class") == "drawing"]
    assert len(drawn) == 7
    assert all(attributes["role"] == "img" and len(attributes["aria-label"]) > 20 for attributes in drawn)
    assert "JavaScript" in reader.words("noscript")


def test_the_title_of_a_chart_moves_into_its_caption(html, reader):
    assert "Figure 1. Turning circle. Caption of track." in reader.words("figcaption")
    assert all("title" not in chart for chart in drawings(html)["charts"])


def test_numbers_stand_right_with_their_unit_in_the_head(reader):
    heads, cells = reader.all("th"), reader.all("td")
    assert [head.get("class") for head in heads] == ["short", "number", "short"]
    assert [cell.get("class") for cell in cells] == ["short", "number", "short"] * 3
    assert "Advance (m)" in reader.words("thead")
    # One number of decimals down the column, a true minus sign, a dash for what is not known.
    assert "−1235 " in reader.words("tbody") and " 87 " in reader.words("tbody") and "–" in reader.words("tbody")


def test_verdicts_are_words_and_not_only_colours(reader):
    assert "passed" in reader.words("tbody") and "failed" in reader.words("tbody")


def test_nothing_a_card_says_becomes_markup():
    chart = track_chart([TrackData(NASTY, x_m=[0, 1], y_m=[0, 1]), TrackData("b", x_m=[0, 1], y_m=[0, 1])], title=NASTY)
    page = Page(
        title=NASTY,
        subtitle=NASTY,
        figures=[KeyFigure(NASTY, NASTY, NASTY, note=NASTY)],
        sections=[
            Section(
                NASTY,
                text=NASTY,
                notes=[NASTY],
                tables=[Table(caption=NASTY, columns=[Column(NASTY, NASTY)], rows=[[NASTY]])],
                charts=[Illustration(chart, caption=NASTY)],
            )
        ]
        * 2,
    )
    html = render_page(page)
    reader = Reader(html)
    assert len(reader.all("script")) == 3
    assert not reader.all("img")
    assert "49" not in reader.words("h1")
    assert reader.words("h1") == NASTY
    embedded = drawings(html)["charts"][0]
    assert embedded["layer"][0]["encoding"]["color"]["scale"]["domain"][0] == NASTY
    assert "<" not in re.search(r'id="drawings">(.*?)</script>', html, re.DOTALL)[1]


def test_the_page_stays_below_6_mb_with_twenty_charts_of_long_runs(charts):
    section = Section("Many", charts=[Illustration(charts["track"]), Illustration(charts["history"])] * 10)
    assert len(render_page(Page(title="Long", sections=[section])).encode()) < 6e6


def test_a_page_without_charts_carries_no_library():
    html = render_page(Page(title="Tables alone", sections=[Section("One", text="Text.")]))
    assert len(html) < 30_000
    assert "<script" not in html


def test_a_row_that_does_not_fit_its_table_is_refused():
    with pytest.raises(ValueError, match="1 cells in a row of 2 columns"):
        Table(caption="Figures", columns=[Column("a"), Column("b")], rows=[[1.0]])


def test_truth_values_and_missing_ones_are_words():
    table = Table(caption="Checks", columns=[Column("valid"), Column("n")], rows=[[True, 1], [False, None]])
    reader = Reader(render_page(Page(title="t", sections=[Section("s", tables=[table])])))
    assert reader.words("tbody").split() == ["yes", "1", "no", "–"]


@pytest.mark.parametrize(
    ("count", "across"), [(1, 3), (4, 4), (5, 5), (6, 3), (7, 4), (8, 4), (9, 3), (10, 5), (12, 4)]
)
def test_cards_leave_few_gaps_in_their_last_row(count, across):
    page = Page(title="t", figures=[KeyFigure(str(n), n, verdict=Verdict.NONE) for n in range(count)])
    html = render_page(page)
    assert f'class="cards across-{across}"' in html
    assert f".cards.across-{across} " in html


def one_section(**content):
    return Reader(render_page(Page(title="T", sections=[Section("H", **content)])))


@pytest.mark.parametrize(("rows", "folded", "details"), [(10, None, 0), (11, None, 1), (11, False, 0), (1, True, 1)])
def test_a_long_table_is_folded_unless_it_says_otherwise(rows, folded, details):
    table = Table(caption="Long", columns=[Column("a")], rows=[[1.0]] * rows, folded=folded)
    reader = one_section(tables=[table])
    assert len(reader.all("details")) == details
    assert "Long" in reader.words("summary" if details else "caption")


def test_two_notices_are_seen_and_more_are_folded():
    reader = one_section(notes=["first", "second", "third"])
    assert reader.words("summary").strip() == "1 more notice"
    assert "third" in reader.words("details") and "second" not in reader.words("details")


def test_a_caution_is_at_the_top_of_the_page_alone():
    mark = caution("beyond the card")
    reader = one_section(text="Text.", notes=[mark])
    assert mark in reader.words("header") and mark not in reader.words("main")


def test_the_bar_of_a_figure_is_in_proportion_to_its_limit():
    below, above = (KeyFigure("a", value, limit=4.0) for value in (1.0, -8.0))
    assert below.reach_percent / below.limit_percent == pytest.approx(0.25, rel=1e-2)
    assert above.reach_percent / above.limit_percent == pytest.approx(2.0, rel=1e-2)
    assert 0 < below.limit_percent < 100 and 0 < above.reach_percent < 100
