"""Spreadsheets: the same trial, table and captive run as from a CSV, and what is refused."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import pytest

from tank2sim.api.trial import trial_files
from tank2sim.errors import InputError
from tank2sim.records.campaign_form import ColumnEntry, FilesSection
from tank2sim.records.csv_table import read_table
from tank2sim.records.reading import read_trial_file
from tank2sim.records.run_tables import read_run_table

NAMESPACE = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
RELATIONS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
TRIAL = (
    ("# rudder_sign: port",),
    ("# noise: u_mps 0.03, psi_deg 0.1",),
    (),
    ("t_s", "delta_deg", "u_mps", "r_degps", "psi_deg"),
    (0, 0, 1.5, 0, 350),
    (1, 10, None, 1, 359),
    (2, -10, 3, -1, 8),
)


def cell(row: int, column: int, value: object, strings: list[str]) -> str:
    place = f"{chr(ord('A') + column)}{row}"
    if isinstance(value, str):
        strings.append(value)
        return f'<c r="{place}" t="s"><v>{len(strings) - 1}</v></c>'
    return f'<c r="{place}" s="1"><v>{value!r}</v></c>'


def workbook(path: Path, rows: Sequence[Sequence[object]], sheet: str = "", declaration: str = "") -> Path:
    """A spreadsheet by the standard (ECMA-376), its first sheet not the first part; or with a sheet of one's own."""
    strings: list[str] = []
    body = "".join(
        f'<row r="{n}">'
        + "".join(cell(n, column, value, strings) for column, value in enumerate(row) if value is not None)
        + "</row>"
        for n, row in enumerate(rows, start=1)
        if row
    )
    shared = "".join(f"<si><r><t>{escape(one[:1])}</t></r><r><t>{escape(one[1:])}</t></r></si>" for one in strings)
    kind = f"{RELATIONS}/worksheet"
    parts = {
        "xl/workbook.xml": f'<workbook xmlns="{NAMESPACE}" xmlns:r="{RELATIONS}"><sheets>'
        '<sheet name="run" sheetId="2" r:id="rId7"/><sheet name="notes" sheetId="1" r:id="rId1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        f'<Relationship Id="rId1" Type="{kind}" Target="worksheets/sheet1.xml"/>'
        f'<Relationship Id="rId7" Type="{kind}" Target="worksheets/sheet2.xml"/></Relationships>',
        "xl/sharedStrings.xml": f'<sst xmlns="{NAMESPACE}">{shared}</sst>',
        "xl/worksheets/sheet1.xml": f'<worksheet xmlns="{NAMESPACE}"><sheetData/></worksheet>',
        "xl/worksheets/sheet2.xml": f'{declaration}<worksheet xmlns="{NAMESPACE}"><sheetData>{sheet or body}'
        "</sheetData></worksheet>",
    }
    with zipfile.ZipFile(path, "w") as book:
        for name, text in parts.items():
            book.writestr(name, text)
    return path


def test_a_trial_of_a_spreadsheet_is_that_of_the_csv(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(
        "\n".join(",".join("" if v is None else str(v) for v in row) for row in TRIAL[3:]), encoding="utf-8"
    )
    expected = read_trial_file(path)
    read = read_trial_file(workbook(tmp_path / "run.xlsx", TRIAL))
    np.testing.assert_array_equal(read.time_s, expected.time_s)
    np.testing.assert_array_equal(read.signals["delta_rad"], -expected.signals["delta_rad"])  # positive to port
    np.testing.assert_array_equal(read.signals["u_mps"], [1.5, np.nan, 3.0])
    np.testing.assert_array_equal(read.signals["psi_rad"], expected.signals["psi_rad"])
    assert read.noise == pytest.approx({"u_mps": 0.03, "psi_rad": np.deg2rad(0.1)})


def test_lines_of_messages_are_rows_of_the_sheet(tmp_path: Path) -> None:
    rows = [*TRIAL[:5], (1, 10, "fast", 1, 359)]
    with pytest.raises(InputError, match="line 6, column u_mps: 'fast' is not a number"):
        read_table(workbook(tmp_path / "run.xlsx", rows))
    assert read_table(workbook(tmp_path / "good.xlsx", TRIAL)).lines.tolist() == [5, 6, 7]


def test_a_folder_takes_spreadsheets_of_trials_and_leaves_others(tmp_path: Path) -> None:
    trial = workbook(tmp_path / "a.xlsx", TRIAL)
    workbook(tmp_path / "notes.xlsx", [("weather", "fine"), (1, 2)])
    (tmp_path / "broken.xlsx").write_bytes(b"PK\x03\x04 and nothing")
    assert trial_files(tmp_path) == [trial]


def test_a_captive_run_of_a_spreadsheet_takes_the_map_of_columns(tmp_path: Path) -> None:
    path = workbook(tmp_path / "run.xlsx", [("time", "side force"), ("s", "kN"), (0, 1), (0.5, 2), (1, 2.5)])
    columns = {"time": "t", "side force": ColumnEntry(quantity="Y", sign=-1)}
    table = read_run_table(path, columns, FilesSection())
    np.testing.assert_allclose(table.column("Y_N"), [-1000, -2000, -2500])
    np.testing.assert_allclose(table.column("t_s"), [0, 0.5, 1])


@pytest.mark.parametrize(
    ("sheet", "said"),
    [
        ('<row r="1"><c r="A1" t="e"><v>#DIV/0!</v></c></row>', "cell A1: holds the error #DIV/0!"),
        ('<row r="1"><c r="A1"><f>1+1</f><v></v></c></row>', "cell A1: holds a formula without its result"),
        ('<row r="1"><c r="A1" t="s"><v>99</v></c></row>', "is not a spreadsheet that can be read"),
        ('<row r="9999999"><c r="A1"><v>1</v></c></row>', "is not a spreadsheet that can be read"),
        ('<row r="1"><c r="ZZZ1"><v>1</v></c></row>', "is not a spreadsheet that can be read"),
        ("<row", "is not a spreadsheet that can be read"),
        ('<row r="1"/>', "there is no header"),
    ],
)
def test_a_faulty_sheet_is_refused(tmp_path: Path, sheet: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_table(workbook(tmp_path / "run.xlsx", [], sheet))


def test_definitions_that_would_grow_are_refused(tmp_path: Path) -> None:
    path = workbook(tmp_path / "run.xlsx", TRIAL, declaration='<!DOCTYPE a [<!ENTITY b "bbbb">]>')
    with pytest.raises(InputError, match="has definitions that no spreadsheet has"):
        read_table(path)


@pytest.mark.parametrize("packed", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_damaged_bytes_give_a_table_or_one_clear_refusal(tmp_path: Path, packed: int) -> None:
    good = workbook(tmp_path / "good.xlsx", TRIAL)
    chance = np.random.default_rng(1)
    with zipfile.ZipFile(good) as book, zipfile.ZipFile(tmp_path / "packed.xlsx", "w", packed) as other:
        for name in book.namelist():
            other.writestr(name, book.read(name))
    data = (tmp_path / "packed.xlsx").read_bytes()
    path, refused = tmp_path / "bad.xlsx", 0
    for _ in range(200):
        bad = bytearray(data)
        for place in chance.integers(4, len(bad), size=chance.integers(1, 4)):
            bad[place] = chance.integers(0, 256)
        path.write_bytes(bad)
        try:
            read_table(path)
        except InputError as error:
            assert error.source == str(path)
            refused += 1
    assert refused > 100


def test_damaged_texts_give_a_table_or_one_clear_refusal(tmp_path: Path) -> None:
    good = workbook(tmp_path / "good.xlsx", TRIAL)
    chance = np.random.default_rng(2)
    for _ in range(200):
        with zipfile.ZipFile(good) as book, zipfile.ZipFile(tmp_path / "bad.xlsx", "w") as other:
            chosen = book.namelist()[chance.integers(len(book.namelist()))]
            for name in book.namelist():
                text = bytearray(book.read(name))
                if name == chosen:
                    begin = int(chance.integers(len(text)))
                    text[begin : begin + int(chance.integers(1, 12))] = b"" if chance.random() < 0.5 else b'9"'
                other.writestr(name, bytes(text))
        try:
            read_table(tmp_path / "bad.xlsx")
        except InputError as error:
            assert error.source == str(tmp_path / "bad.xlsx")


def test_another_zip_file_is_no_spreadsheet(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "ship.csv", "w") as book:
        book.writestr("modelDescription.xml", "<a/>")
    with pytest.raises(InputError, match="is not a spreadsheet that can be read"):
        read_table(tmp_path / "ship.csv")
