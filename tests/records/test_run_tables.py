"""Captive runs in the files of any tank: the same numbers, or an error that names file, place and remedy."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from tank2sim.errors import InputError
from tank2sim.records.campaigns import read_campaign
from tank2sim.records.spelt_units import unit_factor
from tests.identification.captive.generator import Campaign, write
from tests.records.tank_files import FORMATS, converted


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return write(Campaign(seed=3, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("made") / "plain")


@pytest.fixture(scope="module")
def plain(made):
    return read_campaign(made.path)


@pytest.mark.parametrize("name", FORMATS)
def test_runs_are_the_same_in_every_format(made, plain, tmp_path, name):
    if name.endswith(("h5", "73.mat")):
        pytest.importorskip("h5py")
    if name.endswith("tdms"):
        pytest.importorskip("nptdms")
    again = read_campaign(converted(made.path, tmp_path / "again", name))
    for run, other in zip(plain.runs, again.runs, strict=True):
        assert run.sheet.type == other.sheet.type
        for key in ("time_s", "v_mps", "r_radps", "speed_mps", "delta_rad", "X_N", "Y_N", "N_Nm", "y_m", "psi_rad"):
            values = getattr(run, key)
            size = np.abs(values).max()
            assert np.allclose(getattr(other, key), values, rtol=2e-11, atol=2e-11 * size + 1e-15), (run.name, key)


HEAD = "Zeit;Fy;Mz;Fx\ns;kN;Nm;N\n"
ROWS = "".join(f"{0.1 * k:.1f};{0.01 * k:.2f};{k};{-k}\n" for k in range(20)).replace(".", ",")


def one_run(folder, text, columns, more=""):
    (folder / "run.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    path = folder / "campaign.toml"
    path.write_text(
        '[model]\nname = "box"\nlength_m = 4.0\nmass_kg = 400.0\n'
        '[test]\nspeed_mps = 1.2\nforce_convention = "on_gauge"\n'
        f'{more}\n[columns]\n{columns}\n[[runs]]\nfile = "run.csv"\ntype = "static_drift"\ndrift_deg = 4.0\n',
        encoding="utf-8",
    )
    return read_campaign(path).runs[0]


MAP = 'Zeit = "t"\nFy = "Y"\nMz = "N"\nFx = "X"'


def test_units_of_the_row_of_units_are_converted(tmp_path):
    run = one_run(tmp_path, HEAD + ROWS, MAP)
    assert pytest.approx(10.0 * np.arange(20)) == run.Y_N
    assert pytest.approx(np.arange(20)) == run.N_Nm
    assert pytest.approx(-np.arange(20)) == run.X_N


def test_sign_factor_and_offset_of_the_map(tmp_path):
    entry = 'Fy = { quantity = "Y", unit = "kN", sign = -1, offset = 0.02 }\nMz = { quantity = "N", factor = 2.5 }'
    run = one_run(tmp_path, HEAD + ROWS, f'Zeit = "t"\nFx = "X"\n{entry}')
    assert pytest.approx(-10.0 * np.arange(20) + 20.0) == run.Y_N
    assert pytest.approx(2.5 * np.arange(20)) == run.N_Nm


def test_kilogram_force_and_a_force_in_a_file_without_units(tmp_path):
    text = HEAD.replace("s;kN;Nm;N\n", "") + ROWS
    units = 'Zeit = "t_s"\nFy = { quantity = "Y", unit = "kgf" }\nMz = "N_Nm"\nFx = "X_kN"'
    run = one_run(tmp_path, text, units)
    assert pytest.approx(0.0980665 * np.arange(20)) == run.Y_N
    assert pytest.approx(-1e3 * np.arange(20)) == run.X_N


@pytest.mark.parametrize(
    ("change", "columns", "place"),
    [
        (("", ""), MAP.replace("Fy =", "Fz ="), "header"),
        (("kN", "mm"), MAP, "columns.Fy"),
        (("kN", ""), MAP, "columns.Fy"),
        (("", ""), MAP.replace('"Y"', '{ quantity = "Y", unit = "N" }'), "columns.Fy"),
        (("", ""), MAP.replace('"Y"', '{ quantity = "Y", unit = "m" }'), "columns.Fy"),
        (("", ""), MAP.replace('"Y"', '"side force"'), "columns.Fy"),
        (("", ""), MAP.replace('"X"', '"Y"'), "columns Fy and Fx"),
        (("", ""), MAP.replace('Zeit = "t"', ""), "header"),
        (("0,05;5", "0,05;fünf"), MAP, "line 8, column Mz"),
        (("0,05;5", "1.000,05;5"), MAP, "line 8"),
        (("0,05;5;", "0,05;"), MAP, "line 8"),
    ],
)
def test_what_a_file_lacks_is_refused_with_its_place(tmp_path, change, columns, place):
    with pytest.raises(InputError) as error:
        one_run(tmp_path, (HEAD + ROWS).replace(*change, 1), columns)
    assert error.value.place == place


def test_a_column_that_is_named_as_a_quantity_is_not_passed_over_for_want_of_a_unit(tmp_path):
    with pytest.raises(InputError) as error:
        one_run(tmp_path, (HEAD + ROWS).replace("Mz", "v"), MAP.replace('Mz = "N"', ""))
    assert error.value.place == "column v"


def test_quotation_marks_keep_decimal_commas_apart_from_those_between_cells(tmp_path):
    rows = [line.split(";") for line in (HEAD.replace("s;kN;Nm;N\n", "") + ROWS).splitlines()]
    text = "\n".join(",".join(f'"{cell}"' for cell in row) for row in rows)
    run = one_run(tmp_path, text, 'Zeit = "t_s"\nFy = "Y_kN"\nMz = "N_Nm"\nFx = "X_N"')
    assert pytest.approx(10.0 * np.arange(20)) == run.Y_N


@pytest.mark.parametrize("mark", ["#", "%"])
def test_names_behind_a_comment_sign_are_names(tmp_path, mark):
    body = ROWS.replace(";", "  ").replace(",", ".")
    text = f"{mark} a preamble\n{mark} t[s]  Y[kN]  N[Nm]  X[N]\n{body}"
    (tmp_path / "run.csv").write_text(text)
    run = one_run(tmp_path, text, "")
    assert pytest.approx(10.0 * np.arange(20)) == run.Y_N


def test_a_run_may_have_a_map_of_its_own(tmp_path):
    with pytest.raises(InputError):
        one_run(tmp_path, HEAD + ROWS, 'Zeit = "t"')
    text = (tmp_path / "campaign.toml").read_text()
    (tmp_path / "campaign.toml").write_text(text + '\n[runs.columns]\nFy = "Y"\nMz = "N"\nFx = "X"\n')
    assert read_campaign(tmp_path / "campaign.toml").runs[0].Y_N[3] == pytest.approx(30.0)


def test_footers_and_words_are_faults_not_values(tmp_path):
    with pytest.raises(InputError, match="line 23"):
        one_run(tmp_path, HEAD + ROWS + "Ende der Messung\n", MAP)


@pytest.mark.parametrize(
    ("unit", "suffix", "factor"),
    [
        ("kN", "N", 1e3), ("kn", "N", 1e3), ("[N]", "N", 1.0), ("kp", "N", 9.80665), ("lbf", "N", 4.448221615),
        ("kNm", "Nm", 1e3), ("kN m", "Nm", 1e3), ("N*m", "Nm", 1.0), ("N·m", "Nm", 1.0), ("Nmm", "Nm", 1e-3),
        ("kgf m", "Nm", 9.80665), ("N-m", "Nm", 1.0), ("mm", "m", 1e-3), ("ft", "m", 0.3048), ("ms", "s", 1e-3),
        ("kn", "mps", 1852 / 3600), ("knots", "mps", 1852 / 3600), ("cm/s", "mps", 0.01), ("m/s", "mps", 1.0),
        ("mps", "mps", 1.0), ("°", "rad", np.pi / 180), ("deg", "rad", np.pi / 180), ("rad", "rad", 1.0),
        ("°/s", "radps", np.pi / 180), ("deg/min", "radps", np.pi / 10800), ("degps", "radps", np.pi / 180),
        ("kN", "m", None), ("Nm", "N", None), ("N", "Nm", None), ("m/s", "m", None), ("deg", "radps", None),
    ],
)  # fmt: skip
def test_units_are_those_of_their_kind(unit, suffix, factor):
    found = unit_factor(unit, suffix)
    assert found == (None if factor is None else pytest.approx(factor, rel=1e-9))


def test_a_missing_library_is_asked_for_in_a_line(tmp_path, monkeypatch):
    (tmp_path / "run.h5").write_bytes(b"\x89HDF\r\n\x1a\n" + b"\0" * 64)
    monkeypatch.setitem(sys.modules, "h5py", None)
    from tank2sim.records.run_tables import binary_columns

    with pytest.raises(InputError) as error:
        binary_columns(tmp_path / "run.h5")
    assert "tank2sim[tank]" in error.value.remedy


@pytest.mark.parametrize("head", [b"TDSm", b"\x89HDF\r\n\x1a\n", b"MATLAB 5.0 MAT-file"])
def test_a_broken_file_is_refused(tmp_path, head):
    pytest.importorskip("nptdms")
    with pytest.raises(InputError):
        one_run(tmp_path, head + b"\1\2\3" * 100, MAP)


def averages(folder, table):
    (folder / "table.csv").write_bytes(table.encode("latin-1"))
    path = folder / "campaign.toml"
    path.write_text(
        '[model]\nname = "box"\nlength_m = 4.0\nmass_kg = 400.0\n[test]\nspeed_mps = 1.2\n'
        'force_convention = "on_gauge"\n[averages]\nfile = "table.csv"\nscaling = "dimensional"\n'
        '[averages.columns]\ndrift_deg = "Driftwinkel"\nX = "Längskraft"\nY = "Querkraft"\nN = "Moment"\n'
    )
    return read_campaign(path).runs


AVERAGES = "Mittelwerte\nDriftwinkel;Längskraft;Querkraft;Moment\n°;N;N;Nm\n" + "".join(
    f"{b};{-5.5 - b:.2f};{3.25 * b:.2f};{b}\n".replace(".", ",") for b in (-8, -4, 0, 4, 8)
)


def test_tables_of_averages_have_semicolons_and_decimal_commas_too(tmp_path):
    runs = averages(tmp_path, AVERAGES)
    assert [run.Y_N[0] for run in runs] == pytest.approx([3.25 * b for b in (-8, -4, 0, 4, 8)])
    assert runs[0].v_mps[0] == pytest.approx(1.2 * np.sin(np.radians(8)))


@pytest.mark.parametrize(("old", "new"), [("°;N;N", "°;N;kN"), ("°;N;N", "rad;N;N")])
def test_averages_in_another_unit_than_they_are_read_in_are_refused(tmp_path, old, new):
    with pytest.raises(InputError, match="row of units"):
        averages(tmp_path, AVERAGES.replace(old, new))
