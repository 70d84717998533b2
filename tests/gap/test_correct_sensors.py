"""Trials of which sensors were at fault, corrected: the numbers, and their files cell by cell."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tank2sim.gap.proof.correct_sensors import correct_sensor_faults, corrected_text
from tank2sim.records.audit import repair_trial
from tank2sim.records.reading import read_trial_file
from tank2sim.records.trials import Trial, froude_scaled

TIME = np.arange(0.0, 200.0, 0.5)
RATE = np.where(TIME < 50, 0.0, 1.5)  # deg/s
HEADING = 350.0 + np.concatenate([[0.0], np.cumsum(0.5 * (RATE[1:] + RATE[:-1]) * 0.5)])  # through north
X, Y = 5.0 * TIME, np.zeros(TIME.size)
ORDER = np.where(TIME < 50, 0.0, 10.0)
BIAS = ("gyro_bias", {"rate_radps": math.radians(0.052)}, {"rate_radps": math.radians(0.001)})


def sheet(
    shown: dict[str, np.ndarray],
    head: str = "# a turn\n# noise: r_degps 0.01\n",
    end: str = "\n",
    order: np.ndarray = ORDER,
) -> str:
    """A trial file; numbers to three decimals, revolutions as integers, and the third row lacks its rate."""
    columns = {"t_s": TIME, "delta_order_deg": order, "n_rpm": np.full(TIME.size, 84), **shown}
    lines = [",".join(columns)]
    for row in range(TIME.size):
        cells = [f"{values[row]:.0f}" if name == "n_rpm" else f"{values[row]:.3f}" for name, values in columns.items()]
        if row == 2 and "r_degps" in columns:
            cells[list(columns).index("r_degps")] = ""
        lines.append(",".join(cells))
    return (head + "\n".join(lines) + "\n").replace("\n", end)


def written(folder: Path, text: str, name: str = "turn.csv") -> Trial:
    path = folder / name
    path.write_bytes(text.encode())
    return read_trial_file(path)


def degrees(trial: Trial, name: str) -> np.ndarray:
    return np.rad2deg(trial.signals[name])


TRUE = {"r_degps": RATE, "psi_deg": HEADING % 360, "x_m": X, "y_m": Y}


def reread(folder: Path, text: str | None, name: str = "new.csv") -> Trial:
    assert text is not None
    return written(folder, text, name)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_biased_gyro_is_set_right_and_nothing_else_is_touched(tmp_path: Path, end: str) -> None:
    text = "\ufeff" + sheet({**TRUE, "r_degps": RATE + 0.052}, end=end)
    trial = written(tmp_path, text)
    fixed = corrected_text(trial.path, trial, [BIAS])
    assert fixed is not None
    old, new = text.split(end), fixed.split(end)
    assert new[0].startswith("\ufeff# r_degps corrected by tank2sim gap for gyro_bias (rate 0.052 deg/s")
    assert len(new) == len(old) + 1 and new[1:4] == [old[0].removeprefix("\ufeff"), *old[1:3]]
    for before, after in zip(old[3:-1], new[4:-1], strict=True):
        cells, corrected = before.split(","), after.split(",")
        assert cells[:3] + cells[4:] == corrected[:3] + corrected[4:]
        assert (cells[3] == "") == (corrected[3] == "")
    assert new[4].split(",")[3] == "0.0000", "the digits of the file, and one more that the correction needs"
    again = reread(tmp_path, fixed)
    np.testing.assert_allclose(np.delete(degrees(again, "r_radps"), 2), np.delete(RATE, 2), atol=1e-9)
    assert again.noise == trial.noise
    np.testing.assert_allclose(
        again.signals["r_radps"], correct_sensor_faults(trial, [BIAS]).signals["r_radps"], atol=1e-9
    )


def test_a_heading_keeps_the_range_of_the_file(tmp_path: Path) -> None:
    fault = ("heading_offset", {"angle_rad": math.radians(2.0)}, {})
    ranges = {
        "compass": lambda psi: psi % 360,
        "half turns": lambda psi: (psi + 180) % 360 - 180,
        "continuous": lambda psi: psi,
    }
    for name, wrapped in ranges.items():
        trial = written(tmp_path, sheet({**TRUE, "psi_deg": wrapped(HEADING + 2.0)}))
        text = corrected_text(trial.path, trial, [fault])
        assert text is not None
        rows = [line.split(",") for line in text.splitlines() if line[0].isdigit()]
        shown = np.array([float(row[4]) for row in rows])
        np.testing.assert_allclose(shown, wrapped(HEADING), atol=1.1e-3, err_msg=name)


def test_a_rudder_recorded_early_is_moved_in_the_sign_of_the_file(tmp_path: Path) -> None:
    late = ("rudder_time_offset", {"delay_s": 2.0}, {})
    for head, sign in (("# rudder_sign: port\n", -1.0), ("", 1.0)):
        trial = written(tmp_path, sheet({"delta_deg": sign * ORDER, **TRUE}, head=head, order=sign * ORDER))
        fixed = corrected_text(trial.path, trial, [late])
        again = reread(tmp_path, fixed)
        np.testing.assert_allclose(degrees(again, "delta_order_rad"), np.where(TIME < 52, 0.0, 10.0), atol=1e-9)
        np.testing.assert_allclose(degrees(again, "delta_rad"), np.where(TIME < 52, 0.0, 10.0), atol=1e-9)
        assert fixed is not None and (head in fixed)
        rows = [line.split(",")[1] for line in fixed.splitlines() if line[0].isdigit()]
        assert rows[0] == "0.000" and rows[-1] == f"{sign * 10:.3f}", "the sign of the file"


def test_an_antenna_off_the_middle_is_brought_back_by_the_heading(tmp_path: Path) -> None:
    psi = np.deg2rad(HEADING)
    shown = {**TRUE, "x_m": X - 40 * np.cos(psi) - 5 * np.sin(psi), "y_m": Y - 40 * np.sin(psi) + 5 * np.cos(psi)}
    trial = written(tmp_path, sheet(shown))
    arm = ("antenna_lever_arm", {"forward_m": -40.0, "starboard_m": 5.0}, {})
    again = reread(tmp_path, corrected_text(trial.path, trial, [arm]))
    np.testing.assert_allclose(again.signals["x_m"], X, atol=2e-3)
    np.testing.assert_allclose(again.signals["y_m"], Y, atol=2e-3)
    blind = written(tmp_path, sheet({name: values for name, values in shown.items() if name != "psi_deg"}))
    assert corrected_text(blind.path, blind, [arm]) is None
    assert correct_sensor_faults(blind, [arm]).notices == (
        "left as it is: antenna_lever_arm cannot be corrected without psi_rad",
    )


def test_the_last_of_two_faults_is_taken_off_first() -> None:
    trial = Trial(Path("turn.csv"), TIME, {"delta_order_rad": 0 * TIME, "r_radps": 1.05 * (RATE + 0.1)})
    found = [("gyro_bias", {"rate_radps": 0.1}, {}), ("gyro_scale", {"factor": 0.05}, {}), ("current", {}, {})]
    np.testing.assert_allclose(correct_sensor_faults(trial, found).signals["r_radps"], RATE, atol=1e-12)
    assert correct_sensor_faults(trial, found).notices == ("corrected for gyro_scale", "corrected for gyro_bias")


def test_a_fault_found_at_the_size_of_the_ship_is_taken_off_a_models_file_at_its_size(tmp_path: Path) -> None:
    scale = 25.0
    trial = written(tmp_path, sheet({**TRUE, "r_degps": RATE + 0.05}, head=f"# scale: {scale}\n"))
    ship = froude_scaled(trial, scale)
    found = [("gyro_bias", {"rate_radps": math.radians(0.05) / math.sqrt(scale)}, {})]
    np.testing.assert_allclose(
        np.delete(correct_sensor_faults(ship, found).signals["r_radps"], 2),
        np.delete(np.deg2rad(RATE) / 5, 2),
        atol=1e-12,
    )
    again = reread(tmp_path, corrected_text(trial.path, ship, found))
    np.testing.assert_allclose(np.delete(degrees(again, "r_radps"), 2), np.delete(RATE, 2), atol=1e-9)
    lever = [("log_lever_arm", {"forward_m": 10.0}, {})]
    drifting = written(tmp_path, sheet({**TRUE, "v_mps": 0.4 * np.deg2rad(RATE)}, head=f"# scale: {scale}\n"))
    again = reread(tmp_path, corrected_text(drifting.path, froude_scaled(drifting, scale), lever))
    np.testing.assert_allclose(np.delete(again.signals["v_mps"], 2), 0.0, atol=2e-3)


def test_a_trial_without_what_the_sensor_shows_needs_no_file(tmp_path: Path) -> None:
    trial = written(tmp_path, sheet(TRUE))
    assert corrected_text(trial.path, trial, [("log_scale", {"factor": 0.1}, {})]) is None
    assert corrected_text(trial.path, trial, [("current", {"speed_mps": 1.0}, {})]) is None


@pytest.mark.slow
def test_a_published_record_becomes_a_trial_csv(data: Path, tmp_path: Path) -> None:
    path = next(iter(sorted((data / "data" / "kvlcc2_hsva").glob("*.dat"))))
    trial, _ = repair_trial(read_trial_file(path))
    again = reread(tmp_path, corrected_text(path, trial, [("log_scale", {"factor": 0.05}, {})]))
    assert again.scale == trial.scale
    np.testing.assert_allclose(again.signals["u_mps"], trial.signals["u_mps"] / 1.05, rtol=1e-9)
    np.testing.assert_allclose(again.signals["delta_rad"], trial.signals["delta_rad"], atol=1e-9)
    assert np.corrcoef(again.signals["delta_rad"], read_trial_file(path).signals["delta_rad"])[0, 1] == pytest.approx(1)


def test_a_quoted_header_is_written_in_the_trial_format(tmp_path: Path) -> None:
    trial = written(tmp_path, sheet({**TRUE, "r_degps": RATE + 0.052}).replace("x_m", '"x_m"'))
    again = reread(tmp_path, corrected_text(trial.path, trial, [BIAS]))
    np.testing.assert_allclose(np.delete(degrees(again, "r_radps"), 2), np.delete(RATE, 2), atol=1e-6)
    np.testing.assert_allclose(again.signals["x_m"], X)


SWINGS = {
    # headings of the file before, deg; those after 5 deg to port, deg
    "0 to 360, through north": (lambda psi: (psi + 340) % 360, lambda psi: (psi + 335) % 360),
    "0 to 360, both ends in it": (
        lambda psi: np.clip(1.2 * psi, 0, 360),
        lambda psi: (np.clip(1.2 * psi, 0, 360) - 5) % 360,
    ),
    "about 0": (lambda psi: (psi + 160) % 360 - 180, lambda psi: (psi + 155) % 360 - 180),
    "about 0, both ends in it": (
        lambda psi: np.clip(1.2 * psi - 180, -180, 180),
        lambda psi: (np.clip(1.2 * psi - 180, -180, 180) + 175) % 360 - 180,
    ),
    "continuous, more than a turn": (lambda psi: 1.3 * psi, lambda psi: 1.3 * psi - 5),
    "less than half a turn": (lambda psi: 0.59 * psi, lambda psi: 0.59 * psi - 5),
    "less than half a turn, to port": (lambda psi: -0.59 * psi, lambda psi: -0.59 * psi - 5),
    "through south, of no known range": (lambda psi: psi - 200, lambda psi: psi - 205),
    "beyond a turn, of no known range": (lambda psi: psi + 100, lambda psi: psi + 95),
}  # fmt: skip


@pytest.mark.parametrize("radians", [False, True])
@pytest.mark.parametrize("name", SWINGS)
def test_headings_stay_in_the_range_that_the_file_has_and_in_none_where_it_has_none(
    tmp_path: Path, name: str, radians: bool
) -> None:
    """A ship that turns through 300 deg at 1.5 deg/s, its compass 5 deg too far to starboard."""
    before, after = SWINGS[name]
    swing = np.minimum(1.5 * TIME, 300.0)
    scale, column = (math.pi / 180, "psi_rad") if radians else (1.0, "psi_deg")
    trial = written(tmp_path, sheet({column: np.trunc(1000 * scale * before(swing)) / 1000}, head="# a turn\n"))
    text = corrected_text(trial.path, trial, [("heading_offset", {"angle_rad": math.radians(5.0)}, {})])
    assert text is not None
    rows = [line.split(",") for line in text.splitlines() if line[0].isdigit()]
    shown, expected = np.array([float(row[3]) for row in rows]), scale * after(swing)
    turn = 360 * scale
    # where the wrapped heading jumps, three decimals may fall to either side
    at_the_edge = np.abs(np.abs(shown - expected) - turn) < 2.1e-3
    assert at_the_edge.sum() <= 2
    np.testing.assert_allclose(shown[~at_the_edge], expected[~at_the_edge], atol=2.1e-3, rtol=0)
