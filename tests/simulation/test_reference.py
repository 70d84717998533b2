"""Against trajectories of the Mariner that an independent program computed (MSS in GNU Octave)."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate


@pytest.fixture(scope="module")
def reference(data):
    return lambda name: np.genfromtxt(data / "reference" / name, delimiter=",", names=True)


def test_the_35_degree_turn_agrees_within_5_cm_over_600_s(mariner, reference) -> None:
    expected = reference("mariner_turn_35.csv")
    run = simulate(mariner, parse_manoeuvre("turn:35"), duration_s=600.0).trajectory
    at = np.searchsorted(run.t, expected["t_s"] - 1e-6)
    np.testing.assert_allclose(run.t[at], expected["t_s"], atol=1e-6)
    distance = np.hypot(run["motion.x"][at] - expected["x_m"], run["motion.y"][at] - expected["y_m"])
    assert distance.max() < 0.05
    for name, column in (
        ("motion.u", "u_mps"),
        ("motion.v", "v_mps"),
        ("motion.r", "r_radps"),
        ("motion.psi", "psi_rad"),
    ):
        np.testing.assert_allclose(run[name][at], expected[column], atol=1e-6)
    np.testing.assert_allclose(run["rudder.angle"][at], -expected["delta_state_rad"], atol=1e-9)


def test_the_10_10_zigzag_overshoots_agree_within_0_02_deg(mariner, reference) -> None:
    expected = reference("mariner_zigzag_10_10.csv")
    figures = simulate(mariner, parse_manoeuvre("zigzag:10/10"), duration_s=float(expected["t_s"][-1])).figures
    heading = np.degrees(expected["psi_rad"])
    inner = heading[1:-1]
    peaks = inner[((inner >= heading[:-2]) & (inner > heading[2:])) | ((inner <= heading[:-2]) & (inner < heading[2:]))]
    overshoots = np.abs(peaks[np.abs(peaks) > 10]) - 10
    assert len(figures["overshoots_deg"]) >= len(overshoots) >= 3
    np.testing.assert_allclose(figures["overshoots_deg"][: len(overshoots)], overshoots, atol=0.02)
