"""The report on paper: the form for reporting to IMO on its first page, and the annex with methods and figures."""

from __future__ import annotations

import io
import unicodedata
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from tank2sim.answer.parts import cell_text
from tank2sim.errors import InputError
from tank2sim.version import __version__

if TYPE_CHECKING:
    from fpdf import FPDF

    from tank2sim.answer.parts import Cell, Section
    from tank2sim.answer.result import Result
    from tank2sim.apps.trial_office.study import TrialOffice

_WIDTH_MM = 180.0
_PLAIN = dict(zip("–—−‘’“”≤≥…•", ["-", "-", "-", "'", "'", '"', '"', "<=", ">=", "...", "-"], strict=True))


def report_pdf(result: Result[TrialOffice]) -> bytes:
    """The report as PDF, A4: the form, and the sections of the page as its annex.

    Raises InputError: The library that writes PDF is not installed.
    """
    try:
        from fpdf import FPDF
    except ImportError:
        remedy = "install it with: pip install 'tank2sim[paper]'"
        raise InputError("report.pdf", "", "needs the library fpdf2, which is not installed", remedy) from None
    study, (*annex, form) = result.study, result.sections
    pdf = FPDF(format="A4")
    pdf.set_title(result.title)
    pdf.set_creator(f"tank2sim {__version__}")
    pdf.set_creation_date(datetime(2000, 1, 1, tzinfo=UTC))  # the same content gives the same bytes
    pdf.set_margins(15, 12)
    pdf.set_auto_page_break(True, 12)
    pdf.add_page()
    _heading(pdf, "Form for reporting manoeuvring data to IMO", 14)
    _text(pdf, ", ".join(part for part in (study.ship, study.place, study.date) if part))
    for box in form.tables:
        _heading(pdf, box.caption, 10)
        width = max(1, len(box.heads) - 1)
        _table(pdf, box.heads, box.rows, [0.55] + [0.45 / width] * width)
    pdf.add_page()
    _heading(pdf, "Annex: methods, corrections, and uncertainty", 14)
    _text(pdf, *(notice.line for notice in result.cautions), *result.headline)
    for section in annex:
        _section(pdf, section)
    if result.notices:
        _heading(pdf, "Notices", 11)
        _text(pdf, *(notice.line for notice in result.notices))
    return bytes(pdf.output())


def _section(pdf: FPDF, section: Section) -> None:
    """A section of the page, with its charts as pictures."""
    from tank2sim.answer.charts.picture import chart_picture

    _heading(pdf, section.heading, 11)
    _text(pdf, section.text)
    for one in section.tables:
        _text(pdf, one.caption)
        rows = [
            [cell_text(cell, column.digits) for cell, column in zip(row, one.columns, strict=True)] for row in one.rows
        ]
        _table(pdf, one.heads, rows)
    for illustration in section.charts:
        pdf.ln(1.5)  # the picture is white, and would cover the last line of a table
        pdf.image(io.BytesIO(chart_picture(illustration.chart, ".png")), w=0.8 * _WIDTH_MM)


def _heading(pdf: FPDF, text: str, size: float) -> None:
    pdf.set_font("Helvetica", "B", size)
    pdf.ln(1.5)
    pdf.multi_cell(0, 0.5 * size, _latin(text), new_x="LMARGIN", new_y="NEXT")


def _text(pdf: FPDF, *texts: str) -> None:
    for text in filter(None, texts):
        pdf.set_font("Helvetica", size=8.5)
        pdf.multi_cell(0, 4, _latin(text), align="L", new_x="LMARGIN", new_y="NEXT")


def _table(pdf: FPDF, heads: Sequence[str], rows: Sequence[Sequence[Cell]], shares: Sequence[float] = ()) -> None:
    pdf.set_font("Helvetica", size=7.5)
    columns = max(len(heads), *(len(row) for row in rows)) if rows else len(heads)
    widths = tuple(shares) or None
    with pdf.table(
        width=_WIDTH_MM, col_widths=widths, line_height=4, first_row_as_headings=any(heads), text_align="LEFT"
    ) as drawn:
        for cells in ([heads] if any(heads) else []) + list(rows):
            drawn.row([_latin(str(cell or "")) for cell in (*cells, *[""] * (columns - len(cells)))])


def _latin(text: str) -> str:
    """The text in the letters of the standard fonts of PDF: accents that they lack are dropped, others are ?."""
    plain = (
        letter if ord(letter) < 256 else unicodedata.normalize("NFKD", _PLAIN.get(letter, letter)) for letter in text
    )
    known = (letter for letter in "".join(plain) if not unicodedata.combining(letter))
    return "".join(known).encode("latin-1", "replace").decode("latin-1")
