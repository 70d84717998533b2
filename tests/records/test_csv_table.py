"""Reading tables: what is tolerated, what is refused and where the message points."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.errors import InputError
from tank2sim.records import csv_table
from tank2sim.records.csv_table import read_table


@pytest.fixture
def write(tmp_path):
    def write_text(text, encoding="utf-8"):
        path = tmp_path / "run.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return write_text


def refusal(path):
    with pytest.raises(InputError) as caught:
        read_table(path)
    assert caught.value.source == str(path)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{path}: ")


def test_columns_hold_the_numbers_of_the_file(write):
    table = read_table(write("t_s,u_mps\n0,7.5\n0.5,-1e-3\n1,.25\n"))
    assert list(table.columns) == ["t_s", "u_mps"]
    np.testing.assert_array_equal(table.columns["t_s"], [0, 0.5, 1])
    np.testing.assert_array_equal(table.columns["u_mps"], [7.5, -1e-3, 0.25])
    np.testing.assert_array_equal(table.lines, [2, 3, 4])


def test_byte_order_mark_crlf_blank_lines_and_spaces_do_not_matter(write):
    table = read_table(write("\r\n t_s , u_mps\r\n\r\n 0 ,\t1\r\n   \r\n1, 2 \r\n\r\n", encoding="utf-8-sig"))
    assert list(table.columns) == ["t_s", "u_mps"]
    np.testing.assert_array_equal(table.columns["u_mps"], [1, 2])
    np.testing.assert_array_equal(table.lines, [4, 6])


def test_quotes_around_names_and_numbers_do_not_matter(write):
    table = read_table(write('"t_s","u_mps"\n"0","1.5"\n'))
    np.testing.assert_array_equal(table.columns["u_mps"], [1.5])


def test_an_empty_cell_is_not_recorded(write):
    table = read_table(write("t_s,a,b,c\n0,,,\n,1,,2\n, ,3,\n"))
    np.testing.assert_array_equal(table.columns["t_s"], [0, np.nan, np.nan])
    np.testing.assert_array_equal(table.columns["a"], [np.nan, 1, np.nan])
    np.testing.assert_array_equal(table.columns["b"], [np.nan, np.nan, 3])
    np.testing.assert_array_equal(table.columns["c"], [np.nan, 2, np.nan])


def test_ordinary_files_with_gaps_are_read_by_the_compiled_reader(write, monkeypatch):
    def careful(*_):
        raise AssertionError("the slow reader was used")

    monkeypatch.setattr(csv_table, "_read_with_care", careful)
    table = read_table(write("t_s, a\n0,\n1, -2.5e+3\n"))
    np.testing.assert_array_equal(table.columns["a"], [np.nan, -2500])


def test_a_file_read_in_blocks_is_the_file_read_at_once(write, monkeypatch):
    rows = [f"{i * 0.1!r},{i % 7 or ''},{-i}e-3" for i in range(500)]
    path = write("# force_N: 3\nt_s,a,b\n" + "\n".join(rows))
    whole = read_table(path)
    monkeypatch.setattr(csv_table, "_BLOCK", 61)
    parts = read_table(path)
    assert len(parts.lines) == 500
    assert parts.lines[0] == 3
    assert parts.comments == {"force_N": "3"}
    for name, values in whole.columns.items():
        np.testing.assert_array_equal(parts.columns[name], values)
    np.testing.assert_array_equal(parts.columns["b"], [-i / 1000 for i in range(500)])


def test_a_fault_in_a_late_block_is_named_by_its_line(write, monkeypatch):
    monkeypatch.setattr(csv_table, "_BLOCK", 16)
    rows = [f"{i},{i}" for i in range(40)]
    rows[30] = "30,3O"
    with pytest.raises(InputError, match=r"line 32, column a: '3O' is not a number"):
        read_table(write("t_s,a\n" + "\n".join(rows) + "\n"))


cells = st.one_of(st.none(), st.floats(-1e15, 1e15), st.integers(-(10**9), 10**9))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(cells, cells, cells), min_size=1, max_size=8))
def test_both_readers_return_what_was_written(tmp_path_factory, rows):
    lines = [",".join("" if cell is None else repr(cell) for cell in row) for row in rows]
    path = tmp_path_factory.mktemp("rows") / "run.csv"
    path.write_text("a,b,c\n" + "\n".join(lines) + "\n")
    expected = np.array([[math.nan if cell is None else float(cell) for cell in row] for row in rows])
    table = read_table(path)
    np.testing.assert_array_equal(np.column_stack(list(table.columns.values())), expected)
    careful = csv_table._read_with_care(path, ["a", "b", "c"], lines, np.arange(len(rows)))
    np.testing.assert_array_equal(careful, expected)


def test_comments_are_looked_up_by_key_and_free_text_is_kept(write):
    text = "# Tow 3: rope slack\n#force_N: 11.63\n# see https://example.org\nt_s\n0\n# note: after the run\n1\n"
    table = read_table(write(text))
    assert table.comments == {"force_N": "11.63", "note": "after the run"}
    assert table.remarks == ("Tow 3: rope slack", "see https://example.org")
    assert table.comment_number("force_N") == 11.63
    assert table.comment_number("mass_kg") is None
    np.testing.assert_array_equal(table.lines, [5, 7])


@pytest.mark.parametrize(
    ("comment", "said"),
    [
        ("# force_N: 11,63", "'11,63' is not a number"),
        ("# force_N: inf", "'inf' is not a number"),
        ("# force_N:", "'' is not a number"),
        ("# force_N: 1\n# force_N: 2", "is given more than once"),
    ],
)
def test_a_comment_that_must_be_a_number_is_checked(write, comment, said):
    table = read_table(write(f"{comment}\nt_s\n0\n"))
    with pytest.raises(InputError, match=f"comment force_N: {re.escape(said)}; write one line such as"):
        table.comment_number("force_N")


@pytest.mark.parametrize(
    "text",
    [
        "# note: 1,5; 2\nt_s;u_mps;v_mps\n0;1,5;-0,25\n\n1;;1e-2\n",
        "# note: 1,5; 2\nt_s;u_mps;v_mps\n0;1.5;-0.25\n\n1;;1e-2\n",
        "# note: 1,5; 2\nt_s\tu_mps\tv_mps\n0\t1,5\t-0,25\n\n1\t\t1e-2\n",
        "\ufeff# note: 1,5; 2\r\nt_s ; u_mps ; v_mps\r\n0 ; 1,5 ; -0,25\r\n\r\n1 ; ; 0,01\r\n",
    ],
)
def test_semicolons_tabs_and_decimal_commas_are_understood(write, text):
    table = read_table(write(text))
    np.testing.assert_array_equal(table.column("t_s"), [0, 1])
    np.testing.assert_array_equal(table.column("u_mps"), [1.5, np.nan])
    np.testing.assert_array_equal(table.column("v_mps"), [-0.25, 0.01])
    assert table.lines.tolist() == [3, 5] and table.comments == {"note": "1,5; 2"}


def test_a_folder_is_refused_as_one(tmp_path):
    assert refusal(tmp_path) == "is a folder, and a file was expected; give the file in it"


def test_missing_file(tmp_path):
    assert refusal(tmp_path / "none.csv") == "the file does not exist; check the name"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "there is no header"),
        ("# only: a comment\n\n", "there is no header"),
        ("0,1\n1,2\n", "line 1: there is no header: the first line has numbers"),
        ("t_s,u_mps\n\n# end\n", "there are no rows under the header"),
        ("# a\nt_s,,u\n0,1,2\n", "line 2: column 2 has no name"),
        ("t_s,u_mps, t_s\n0,1,2\n", "line 1, column t_s: is given twice"),
        ("t_s;u_mps\n0;1,5\n1;2.5\n", "line 3: has a point, and other numbers have decimal commas"),
        ("t_s;u_mps\n0;1,5;2\n", "line 2: there are 3 cells for 2 columns"),
        ("t_s,u_mps\n0,1\n\n1,2,3\n", "line 4: there are 3 cells for 2 columns"),
        ("t_s,u_mps\n0,1\n1\n", "line 3: there are 1 cells for 2 columns"),
        ("t_s,u_mps\n0,1\n1,fast\n2,slow\n", "line 3, column u_mps: 'fast' is not a number; write digits"),
        ("t_s,u_mps\n0,1 2\n", "line 2, column u_mps: '1 2' is not a number"),
        ("t_s,u_mps\n0,1.2.3\n", "line 2, column u_mps: '1.2.3' is not a number"),
        ("t_s,u_mps\n0,1_000\n", "line 2, column u_mps: '1_000' is not a number"),
        ("t_s,u_mps\n0,１\n", "line 2, column u_mps: '１' is not a number"),
        ("t_s,u_mps\n0,0x10\n", "line 2, column u_mps: '0x10' is not a number"),
        ("t_s,u_mps\n0,NaN\n", "line 2, column u_mps: 'NaN' is not a number; leave the cell empty"),
        ("t_s,u_mps\n0,-inf\n", "line 2, column u_mps: '-inf' is not a number; leave the cell empty"),
        ("t_s,u_mps\n0,-\n", "line 2, column u_mps: '-' is not a number; leave the cell empty"),
        ("t_s,u_mps\n0,1e999\n", "line 2, column u_mps: '1e999' is too large"),
        ("t_s,u_mps\n0," + "x" * 300 + "\n", "line 2, column u_mps: '" + "x" * 30 + "...' is not a number"),
        ("t_s,u_mps\n0," + "x" * 200_000 + "\n", "line 2: cannot be read"),
    ],
)
def test_a_faulty_table_is_refused_with_its_place(write, text, said):
    assert refusal(write(text)).startswith(said)


def test_text_that_is_not_utf8_is_refused(write):
    assert "is not UTF-8" in refusal(write("t_s,ü\n0,1\n", encoding="latin-1"))


def test_si_converts_values_and_names_and_messages_keep_the_names_of_the_file(write):
    table = read_table(write("t_s,psi_deg,n_rpm,r_degps\n0,180,60,\n1,90,30,2\n")).si()
    assert list(table.columns) == ["t_s", "psi_rad", "n_radps", "r_radps"]
    np.testing.assert_allclose(table.columns["psi_rad"], [math.pi, math.pi / 2], rtol=1e-15)
    np.testing.assert_allclose(table.columns["n_radps"], [2 * math.pi, math.pi], rtol=1e-15)
    np.testing.assert_allclose(table.columns["r_radps"], [np.nan, math.pi / 90], rtol=1e-15)
    assert table.place(1, "psi_rad") == "line 3, column psi_deg"
    again = table.si()
    assert again.place(1, "psi_rad") == "line 3, column psi_deg"
    np.testing.assert_array_equal(again.columns["psi_rad"], table.columns["psi_rad"])


def test_si_refuses_one_quantity_in_two_units(write):
    table = read_table(write("t_s,psi_deg,psi_rad\n0,1,2\n"))
    with pytest.raises(InputError, match="columns psi_deg and psi_rad: are one quantity in two units"):
        table.si()


def test_a_missing_column_is_named_with_those_present(write):
    table = read_table(write("t_s,psi_deg\n0,1\n")).si()
    with pytest.raises(InputError, match="there is no column u_mps; add it; the columns are t_s, psi_deg"):
        table.column("u_mps")


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0\n1\n1\n", "line 4, column t_s: 1 does not come after 1 of the row before"),
        ("0\n2\n1.5\n", "line 4, column t_s: 1.5 does not come after 2 of the row before"),
        ("0,\n,1\n1,\n", "line 3, column t_s: is empty"),
    ],
)
def test_a_time_that_does_not_rise_is_refused(write, rows, said):
    header = "t_s,a\n" if "," in rows else "t_s\n"
    with pytest.raises(InputError, match=re.escape(said)):
        read_table(write(header + rows)).increasing("t_s")
