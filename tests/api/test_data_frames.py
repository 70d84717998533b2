"""A data frame in place of a trial's or a record's file gives what the file gives, or is refused with the argument."""

from __future__ import annotations

import csv
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from unittest import mock

import numpy as np
import pandas as pd
import pytest

import tank2sim as t2s
from tank2sim.bundled import bundled
from tank2sim.gap.proof.correct_sensors import corrected_text
from tank2sim.records.csv_table import read_table, table_of_frame
from tests.apps.logs.made_logs import frame as logged
from tests.yaw_truth import Truth, record, written

SHIP = t2s.load("mariner")
ORDERS = {"t_s": [0.0, 60.0, 120.0], "delta_order_deg": [0.0, 20.0, -20.0]}


def read_frame(path: Path) -> pd.DataFrame:
    """The table of a file with its comments as ``attrs``, by pandas alone."""
    lines = path.read_text().splitlines()
    comments = [line.lstrip("# ").partition(":") for line in lines if line.startswith("#")]
    rows = [line for line in lines if not line.startswith("#")]
    assert csv.Sniffer().sniff(rows[0]).delimiter == ","
    frame = pd.read_csv(StringIO("\n".join(rows)))
    frame.attrs = {key: value.strip() for key, colon, value in comments if colon and " " not in key}
    return frame


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A turn and a zigzag of the Mariner with some noise, as files."""
    folder, random = tmp_path_factory.mktemp("trials"), np.random.default_rng(1)
    made = {"turn": SHIP.turn(20, duration_s=300.0), "zigzag": SHIP.zigzag(20, 20, duration_s=400.0)}
    for name, run in made.items():
        rows = run.df[["t_s", "delta_deg", "u_mps", "v_mps", "r_degps", "psi_deg"]][::10].reset_index(drop=True)
        for column, size in {"u_mps": 0.02, "v_mps": 0.02, "r_degps": 0.01, "psi_deg": 0.1}.items():
            rows[column] = (rows[column] + size * random.standard_normal(len(rows))).round(6)
        text = "# noise: u_mps 0.02, r_degps 0.01, psi_deg 0.1\n" + rows.to_csv(index=False)
        (folder / f"{name}.csv").write_text(text)
    return {name: folder / f"{name}.csv" for name in made}


@pytest.fixture(scope="module")
def frames(files: dict[str, Path]) -> dict[str, pd.DataFrame]:
    return {name: read_frame(path) for name, path in files.items()}


def test_a_frame_is_read_as_its_file(files, frames) -> None:
    by_file, by_frame = t2s.read_trial(files["turn"]), t2s.read_trial(frames["turn"])
    pd.testing.assert_frame_equal(by_frame.df, by_file.df)
    assert by_frame.noise == by_file.noise and by_frame.noise["psi_deg"] == pytest.approx(0.1)
    indexed = t2s.read_trial(frames["turn"].set_index("t_s"))
    pd.testing.assert_frame_equal(indexed.df, by_file.df)


@pytest.mark.parametrize(
    "judge",
    [
        lambda given: t2s.audit(given).tables[0].df.drop(columns="file"),
        lambda given: t2s.signals(given, ["r_degps"]).statistics.drop(columns="trial"),
        lambda given: t2s.signals(given, ["r_degps"], filter="lowpass:0.1").filtered.df,
    ],
    ids=["audit", "signals", "filter"],
)
def test_a_frame_is_judged_as_its_file(files, frames, judge: Callable[[object], pd.DataFrame]) -> None:
    expected = judge(files["zigzag"])
    for given in (frames["zigzag"], t2s.read_trial(frames["zigzag"])):
        pd.testing.assert_frame_equal(judge(given), expected, rtol=1e-12)


def test_trials_of_all_kinds_are_identified_together(files, frames) -> None:
    options = {"method": "equation_error", "structure": "card", "members": 0}
    by_file = t2s.identify(SHIP, files["zigzag"], holdout=files["turn"], **options)
    by_frame = t2s.identify(SHIP, frames["zigzag"], holdout=[t2s.read_trial(files["turn"])], **options)
    assert by_frame.card.derivatives == by_file.card.derivatives
    mixed = t2s.identify(SHIP, [frames["zigzag"], files["turn"]], **options)
    assert {"trials[0]", "turn"} <= set(str(mixed.to_dict()).replace("'", " ").split())
    with pytest.raises(t2s.InputError, match=r"^holdout: is both fitted and held out: it is the record of zigzag"):
        t2s.identify(SHIP, files["zigzag"], holdout=frames["zigzag"], **options)


def test_a_ship_is_validated_and_searched_by_frames(files, frames) -> None:
    by_file, by_frame = (t2s.validate(SHIP, given["turn"], members=0) for given in (files, frames))
    figures = [[row[1:] for row in found.tables[0].rows] for found in (by_file, by_frame)]
    assert figures[0] == figures[1]
    fitted = []
    for given in (files, frames):  # up to the search, which sees trials alone
        searched = mock.patch("tank2sim.api.gap_search.run_gap_workflow", side_effect=InterruptedError)
        with searched as asked, pytest.raises(InterruptedError):
            t2s.find_gap(SHIP, given["turn"], effects=["current"], max_effects=1, workers=1)
        fitted.append(asked.call_args.args[1].trials[0])
    np.testing.assert_array_equal(fitted[0].time_s, fitted[1].time_s)
    for name, values in fitted[0].signals.items():
        np.testing.assert_allclose(fitted[1].signals[name], values, rtol=1e-14, err_msg=name)


def test_a_trial_without_a_file_is_corrected_in_the_trial_format(frames) -> None:
    trial = t2s.read_trial(frames["turn"]).trial
    text = corrected_text(trial.path, trial, [("heading_offset", {"angle_rad": 0.05}, {"angle_rad": 0.001})])
    assert text is not None
    corrected = pd.read_csv(StringIO(text), comment="#")
    np.testing.assert_allclose(corrected["psi_deg"], frames["turn"]["psi_deg"] - np.degrees(0.05), atol=1e-6)


@pytest.fixture(scope="module")
def otter_rows() -> list[pd.DataFrame]:
    names = ("straight:600", "spin:400", "difference:300")
    return [t2s.load("otter").simulate(name, duration_s=30).df[::20].reset_index(drop=True) for name in names]


def test_frames_of_a_craft_are_read_as_its_files(otter_rows, tmp_path) -> None:
    otter, rows = t2s.load("otter"), otter_rows
    paths = [tmp_path / f"{number}.csv" for number in range(3)]
    for path, row in zip(paths, rows, strict=True):
        row.to_csv(path, index=False)
    read = []
    for given in (paths, rows):  # up to the search, which sees trials alone
        searched = mock.patch("tank2sim.api.identification.identify_craft", side_effect=InterruptedError)
        with searched as asked, pytest.raises(InterruptedError):
            t2s.identify(otter, given[:2], holdout=given[2])
        _, fitted, held, _ = asked.call_args.args
        assert (len(fitted), len(held)) == (2, 1)
        read.append([*fitted, *held])
    for by_file, by_frame in zip(*read, strict=True):
        assert by_frame.signals.keys() == by_file.signals.keys()
        for name, values in by_file.signals.items():
            np.testing.assert_allclose(by_frame.signals[name], values, rtol=1e-14, err_msg=name)
    with pytest.raises(t2s.InputError, match=r"^trials\[1\]: header: lacks x_m"):
        t2s.identify(otter, [rows[0], rows[1].drop(columns="x_m")])


@pytest.mark.slow
def test_craft_are_identified_and_validated_by_frames(otter_rows) -> None:
    otter, rows = t2s.load("otter"), otter_rows
    found = t2s.identify(otter, rows[:2], holdout=rows[2])
    assert abs(found.card.thrusters[0].ahead_Ns2 / 0.01108 - 1) < 0.05
    checked = t2s.validate(otter, rows).to_dict()
    assert "trials[2]" in str(checked)
    shares = checked["predictions"]["determination"]  # the card is the truth
    assert all(share > 0.999 for share in shares.values()) and checked["predictions"]["end_distance_m"] < 0.01


def test_tows_and_yaw_records_are_frames(tmp_path) -> None:
    tows = bundled("models", "wilinski-zellman", "tows.csv")
    by_file, by_frame = (t2s.tow(given, terms="B3").to_dict() for given in (tows, read_frame(tows)))
    assert by_frame["methods"] == by_file["methods"] and by_frame["tows"] == "tows"
    truth = Truth(humps=1)
    path = written(tmp_path / "water.csv", truth, record(truth), length_m=0.67)
    by_file, by_frame = (t2s.yaw(given, inertia_kgm2=0.0204).to_dict() for given in (path, [read_frame(path)]))
    assert by_frame["methods"] == by_file["methods"] and by_frame["records"] == ["records[0]"]
    with pytest.raises(t2s.InputError, match=r"^simulate: has 1 records to write; give the name of one file"):
        t2s.yaw(read_frame(path), simulate="alyshev")


def test_a_log_is_a_frame(tmp_path) -> None:
    logged().to_csv(tmp_path / "voyage.csv", index=False)
    by_file, by_frame = (t2s.log(given) for given in (tmp_path / "voyage.csv", logged()))
    pd.testing.assert_frame_equal(by_frame.stretches, by_file.stretches)
    assert by_frame.study.logs[0].file == "files"


def test_a_ghost_is_a_frame() -> None:
    frame = SHIP.turn(20, duration_s=100.0).df[::10]
    assert SHIP.steering_page(ghost=frame).study.ghost == "ghost"
    with pytest.raises(t2s.InputError, match=r"^scenario: does not go with a ghost"):
        SHIP.steering_page(ghost=frame, scenario="channel")


def test_orders_and_tracks_are_frames() -> None:
    assert SHIP.steer(pd.DataFrame(ORDERS)).figures == SHIP.steer(ORDERS).figures
    track = pd.DataFrame({"x_m": [0.0, 3000.0, 6000.0], "y_m": [0.0, 0.0, 1500.0]})
    searched = mock.patch("tank2sim.analysis.heading.study.study_autopilot", side_effect=InterruptedError)
    with searched as asked, pytest.raises(InterruptedError):
        SHIP.autopilot("pd", track=track)
    np.testing.assert_array_equal(asked.call_args.args[2].waypoints, track.to_numpy())


def test_the_report_of_a_sea_trial_takes_a_frame_as_its_file(tmp_path) -> None:
    run = t2s.load("mariner").turn(35, duration_s=1100.0)
    run.to_csv(tmp_path / "turn.csv")
    by_file = t2s.trial_office(tmp_path / "turn.csv", ship="mariner", members=0)
    by_frame = t2s.trial_office(pd.read_csv(tmp_path / "turn.csv", comment="#"), ship="mariner", members=0)
    assert by_frame.study.current == by_file.study.current


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda frame: frame.assign(psi_deg="east"), "trials: column psi_deg: does not hold numbers"),
        (lambda frame: frame.assign(psi_deg=np.inf), "trials: row 0, column psi_deg: inf is too large"),
        (lambda frame: frame.drop(columns="t_s"), "trials: header: there is no column t_s"),
        (lambda frame: frame.drop(columns="delta_deg"), "trials: header: there is no rudder"),
        (lambda frame: frame[:0], "trials: has no rows"),
        (lambda frame: pd.concat([frame, frame[["psi_deg"]]], axis=1), "trials: column psi_deg: is given twice"),
        (lambda frame: frame.assign(t_s=frame["t_s"].where(frame.index != 3)), "trials: row 3, column t_s: is empty"),
        (lambda frame: frame[::-1], "trials: row 2, column t_s"),
        (
            lambda frame: {"t_s": [0.0]},
            "trials: is of the type dict; give a path, a TrialRecord, or a DataFrame",
        ),
        (lambda frame: [frame, 5], r"trials: \[1\]: is 5; give a text, a path, a TrialRecord, a DataFrame"),
    ],
)
def test_a_frame_that_is_no_trial_is_refused_with_argument_and_place(frames, change, said: str) -> None:
    with pytest.raises(t2s.InputError, match=f"^{said}") as refusal:
        t2s.identify(SHIP, change(frames["turn"]))
    assert refusal.value.remedy


@pytest.mark.parametrize(
    ("ask", "name"),
    [
        (lambda frame: t2s.identify(SHIP, frame, campaign=frame), "campaign"),
        (t2s.reduce, "campaign"),
        (t2s.load, "card"),
        (lambda frame: t2s.load("kulikovsky-velikanov").glide(programme=5), "programme"),
        (lambda frame: t2s.log([], output=frame), "output"),
    ],
)
def test_where_a_path_is_needed_a_frame_is_refused_with_the_argument(frames, ask, name: str) -> None:
    with pytest.raises(t2s.InputError, match=f"^{name}: is .*; give .*a path"):
        ask(frames["turn"])


def test_a_table_of_a_frame_is_that_of_its_file(files, frames) -> None:
    by_file, by_frame = read_table(files["turn"]), table_of_frame(frames["turn"], "turn")
    assert list(by_frame.columns) == list(by_file.columns) and by_frame.comments == by_file.comments
    for name, values in by_file.columns.items():
        np.testing.assert_allclose(by_frame.columns[name], values, rtol=1e-14)
