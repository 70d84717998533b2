"""The page as it is printed; skipped where no Chromium or no pdftotext is installed."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tank2sim.answer.page import Page, render_page
from tank2sim.answer.parts import Column, Section, Table
from tests.answer.opened_page import CHROMIUM

PRINT = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --no-pdf-header-footer".split()


def printed(sections: list[Section], folder: Path, *how: str) -> str:
    """The text of the sheets on which a page of sections is printed, as pdftotext reads it."""
    (folder / "page.html").write_text(render_page(Page(title="Print", sections=sections)), encoding="utf-8")
    out = folder / "page.pdf"
    flags = [f"--user-data-dir={folder / 'profile'}", f"--print-to-pdf={out}"]
    subprocess.run(
        [CHROMIUM, *PRINT, *flags, (folder / "page.html").as_uri()], check=True, capture_output=True, timeout=120
    )
    return subprocess.run(["pdftotext", *how, out, "-"], check=True, capture_output=True, text=True).stdout


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to print the page with")
@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no pdftotext is installed to read the print with")
@pytest.mark.parametrize("count", [7, 10, 20])
def test_no_column_of_a_wide_table_falls_off_the_sheet(count: int, tmp_path: Path) -> None:
    columns = [Column(f"standard error of the quantity{place}x", "kg m²") for place in range(count)]
    rows = [[1000.0 + 13 * row + place for place in range(count)] for row in range(6)]
    table = Table(caption="wide", columns=columns, rows=rows)
    boxes = printed([Section("Part", tables=[table])], tmp_path, "-bbox")
    sheet = float(re.search(r'<page width="([\d.]+)"', boxes)[1])
    words = re.findall(r'xMin="([\d.]+)" yMin="[\d.]+" xMax="([\d.]+)" yMax="[\d.]+">([^<]*)<', boxes)
    assert max(float(right) for _, right, _ in words) < sheet - 40  # the margin of 15 mm is 42.5 points
    digits = "".join(word for *_, word in words if re.fullmatch(r"[\d\u202f.]+", word)).replace("\u202f", "")
    assert all(f"{rows[0][place]:.0f}" in digits for place in (0, count - 1)) or count == 20


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to print the page with")
@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no pdftotext is installed to read the print with")
def test_no_table_leaves_its_head_behind_at_the_foot_of_a_sheet(tmp_path) -> None:
    """Tables as far apart as lets the foot of some sheet fall upon each part of one."""
    tables = [
        Table(
            caption=f"caption{place}x",
            columns=[Column(f"head{place}x")],
            rows=[[f"row{place}x{row}x"] for row in range(4 if place % 2 else 16)],
        )
        for place in range(24)
    ]
    sections = [Section(f"Part {n}", text="word " * 30 * (n % 5 + 1), tables=[t]) for n, t in enumerate(tables)]
    sheets = printed(sections, tmp_path, "-layout")
    for sheet in sheets.split("\f"):
        for place in re.findall(r"caption(\d+)x", sheet):
            rows = 4 if int(place) % 2 else 2  # a short table is whole, a long one has two rows under its head
            assert all(f"row{place}x{row}x" in sheet for row in range(rows)), place
