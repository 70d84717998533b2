"""Positions that a recorder repeats, because its receiver is slower, are left out; those of a craft at rest stay."""

from __future__ import annotations

import numpy as np

from tank2sim.dynamics.vessel import as_vessel
from tank2sim.records.craft_trials import read_craft_trial


def test_repeated_positions_are_left_out_and_those_at_rest_stay(tmp_path) -> None:
    time = np.arange(40) / 10
    moving = np.repeat(np.arange(10) * 0.5, 2)  # a receiver of 5 Hz in a log of 10 Hz
    x = np.concatenate([np.zeros(20), moving])
    columns = np.column_stack([time, x, 2 * x, np.zeros(40), np.full((40, 2), 600.0)])
    path = tmp_path / "trial.csv"
    header = "t_s,x_m,y_m,psi_deg,n_port_rpm,n_starboard_rpm"
    np.savetxt(path, columns, delimiter=",", header=header, comments="")
    trial = read_craft_trial(path, as_vessel("otter").steered().thrusters)
    known = np.isfinite(trial.signals["x_m"])
    assert known[:20].all()
    np.testing.assert_array_equal(known[22:], np.tile([True, False], 9))
    np.testing.assert_array_equal(known, np.isfinite(trial.signals["y_m"]))
