"""Reading tows."""

import re

import numpy as np
import pytest

from tank2sim.apps.rigs.tow.records import read_tows
from tank2sim.bundled import bundled
from tank2sim.errors import InputError

GOOD = "t_s,speed_1_mps,speed_2_mps\n0,0,0\n5,0.01,0.02\n10,0.03,\n15,0.04,0.06\n20,0.05,0.07\n"


@pytest.fixture
def write(tmp_path):
    def write_text(text):
        path = tmp_path / "tow.csv"
        path.write_text(text)
        return path

    return write_text


def test_bundled_tows_are_table_1_of_the_paper():
    tows = read_tows(bundled("models", "wilinski-zellman", "tows.csv"))
    assert tows.force_N == 11.63
    assert tows.mass_kg == 2243.0
    np.testing.assert_array_equal(tows.time_s, np.arange(0, 51, 5))
    # true means of papers.md 1.2, which the paper prints except a slip at 5 s (.0148)
    means = [0, 0.0142, 0.0282, 0.0536, 0.0740, 0.0950, 0.1100, 0.1224, 0.1408, 0.1524, 0.1690]
    np.testing.assert_allclose(tows.mean_speed_mps, means, atol=1e-12)
    np.testing.assert_array_equal(tows.counts, [5, 5, 5, 5, 5, 4, 5, 5, 5, 5, 4])
    assert np.isnan(tows.speed_mps[5, 1])
    assert np.isnan(tows.speed_mps[10, 3])
    assert tows.top_speed_mps == 0.176


def test_force_and_mass_are_optional(write):
    tows = read_tows(write(GOOD))
    assert tows.force_N is None
    assert tows.mass_kg is None
    assert tows.names == ("speed_1_mps", "speed_2_mps")


def test_rows_without_a_reading_are_left_out(write):
    tows = read_tows(write(GOOD.replace("20,0.05,0.07", "17,,\n20,0.05,0.07")))
    np.testing.assert_array_equal(tows.time_s, [0, 5, 10, 15, 20])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("t_s", "time", "header: there is no column t_s"),
        ("10,0.03,", "5,0.03,", "line 4, column t_s: 5 does not come after 5 of the row before"),
        ("\n0,0,0", "\n-5,0,0", "line 2, column t_s: is before the release"),
        ("20,0.05", "2e6,0.05", "line 6, column t_s: is 2000000 s after the release"),
        (
            "5,0.01,0.02\n10,0.03,\n15,0.04,0.06\n20,0.05,0.07",
            "5,0.01,0\n10,0.03,\n15,0.04,1e-9\n20,0.05,0",
            "column speed_2_mps: never reaches 1e-06 m/s",
        ),
        ("speed_2_mps", "force_N", "column force_N: is not a speed of a tow"),
        ("speed_2_mps", "speed_mps", "column speed_mps: is not a speed of a tow"),
        ("speed_2_mps", "speed_2_knots", "column speed_2_knots: is not a speed in m/s; convert it to m/s"),
        ("speed_2_mps", "speed_2_cmps", "column speed_2_cmps: is not a speed in m/s; convert it to m/s"),
        ("0.06", "x", "line 5, column speed_2_mps: 'x' is not a number"),
        ("15,0.04,0.06\n", "", "has readings at 4 times only; give readings at 5 times or more"),
        (
            "t_s,",
            "# force_N: 0\nt_s,",
            "comment force_N: is 0; a finite number above 0 up to",
        ),
        ("t_s,", "# mass_kg: -2\nt_s,", "comment mass_kg: is -2; a finite number from 1e-06 up to 1e+12 was expected"),
        ("t_s,", "# force_N: 1 kN\nt_s,", "comment force_N: '1 kN' is not a number"),
    ],
)
def test_faulty_tows_are_refused_with_their_place(write, old, new, said):
    assert old in GOOD
    path = write(GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(f"{path}: {said}")):
        read_tows(path)


def test_a_tow_without_a_reading_is_refused(write):
    rows = "".join(f"{t},{t / 100},\n" for t in range(6))
    with pytest.raises(InputError, match="column speed_2_mps: has no reading; delete the column"):
        read_tows(write("t_s,speed_1_mps,speed_2_mps\n" + rows))


def test_a_file_without_speeds_is_refused(write):
    with pytest.raises(InputError, match="there is no speed; add a column speed_1_mps"):
        read_tows(write("t_s\n0\n1\n2\n3\n4\n"))


def test_comments_describe_the_body(tmp_path):
    path = tmp_path / "tow.csv"
    rows = "".join(f"{t},{t / 100}\n" for t in range(6))
    path.write_text(f"# length_m: 3.8\n# water_density_kgpm3: 1000\nt_s,speed_1_mps\n{rows}")
    assert read_tows(path).body == {"length_m": 3.8, "water_density_kgpm3": 1000.0}
    path.write_text(f"# length_m: -3.8\nt_s,speed_1_mps\n{rows}")
    with pytest.raises(InputError, match=r"comment length_m: is -3\.8"):
        read_tows(path)


def test_tows_one_by_one():
    tows = read_tows(bundled("models", "wilinski-zellman", "tows.csv"))
    second = tows.only(1)
    assert second.names == ("speed_2_mps",) and 25.0 not in second.time_s and len(second.time_s) == 10
    assert second.force_N == tows.force_N and second.speed_mps[2, 0] == 0.023
    others = tows.only(*(n for n in range(len(tows.names)) if n != 1))
    assert len(others.names) == 4 and others.counts.tolist() == [4, 4, 4, 4, 4, 4, 4, 4, 4, 4, 3]


TABLE = bundled("models", "wilinski-zellman", "tows.csv").read_text()


@pytest.mark.parametrize(
    "copy",
    [
        lambda speed, row: speed,
        lambda speed, row: f"{float(speed):.2f}",
        lambda speed, row: speed if row % 2 else "",
    ],
    ids=["again", "rounded", "every second row"],
)
def test_a_copy_of_a_tow_is_refused(write, copy):
    lines, row = [], 0
    for line in TABLE.splitlines():
        if line.startswith("t_s"):
            lines.append(f"{line},speed_6_mps")
        elif line.startswith("#"):
            lines.append(line)
        else:
            lines.append(f"{line},{copy(line.split(',')[3], row)}")
            row += 1
    with pytest.raises(InputError, match=r"speed_6_mps.*speed_3_mps"):
        read_tows(write("\n".join(lines) + "\n"))
