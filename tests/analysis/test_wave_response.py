"""Waves on a Wigley hull by the mesh: long waves, symmetry, and the sense of what short ones do."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.analysis.wave_response import HullInWaves, _frequencies, _inertia
from tank2sim.cards import parse_card
from tank2sim.cards.wave_table import WaveTable, wave_table
from tank2sim.errors import InputError

from .wigley import write_wigley_gdf

# It takes seconds to import, in each process that collects tests.
pytestmark = pytest.mark.skipif(find_spec("capytaine") is None, reason="capytaine is not installed (extra waves)")

LONG, MIDDLE, SHORT = 0.12, 0.8, 1.1  # rad/s: waves of 27, 0.60 and 0.32 lengths
G, RHO = 9.80665, 1025.0


@pytest.fixture(scope="module")
def hull(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("hull") / "wigley.gdf"
    write_wigley_gdf(path, 160.93, 23.17, 7.468, (22, 4))
    return path


OPTIONS: Mapping[str, object] = {
    "metacentric_height_m": 3.0,
    "frequencies_radps": [LONG, MIDDLE, SHORT],
    "directions_deg": [0.0, 45.0, 90.0, 135.0, 180.0],
}


@pytest.fixture(scope="module")
def in_waves(hull: Path) -> t2s.Ship:
    return t2s.load("mariner").with_waves(hull, **OPTIONS)


@pytest.fixture(scope="module")
def answer(in_waves: t2s.Ship) -> WaveTable:
    section = in_waves.manoeuvring().waves
    assert section is not None
    return wave_table(section.columns, section.rows)


@pytest.mark.slow
def test_in_long_waves_the_hull_follows_the_surface_and_its_slope(answer: WaveTable) -> None:
    beta, slope = answer.directions, LONG**2 / G
    np.testing.assert_allclose(answer.motions["heave"][0], -1.0, atol=0.01)
    np.testing.assert_allclose(answer.motions["pitch"][0] / slope, 1j * np.cos(beta), atol=0.02)
    np.testing.assert_allclose(answer.motions["surge"][0], 1j * np.cos(beta), atol=0.02)
    np.testing.assert_allclose(answer.motions["sway"][0], 1j * np.sin(beta), atol=0.02)
    # the slope, magnified as an oscillator far below its natural frequency of roll, 0.6 rad/s, is
    roll = answer.motions["roll"][0] / slope
    np.testing.assert_allclose(roll, -1j * np.sin(beta), atol=0.08)


@pytest.mark.slow
def test_very_long_waves_do_not_drift_the_hull_and_short_ones_push_it_along(answer: WaveTable) -> None:
    reflected = 0.5 * RHO * G * 160.93  # of a wall of the ship's length
    for force in ("X", "Y"):
        assert np.max(np.abs(answer.drift[force][0])) < 1e-5 * reflected
    X, Y = answer.drift["X"][2], answer.drift["Y"][2]
    assert X[0] < 0 < X[4] and X[1] < 0 < X[3]
    assert np.all(Y[1:4] < 0)
    assert 0.2 * reflected < -Y[2] < reflected


@pytest.mark.slow
def test_a_hull_alike_fore_and_aft_is_pushed_and_turned_alike(answer: WaveTable) -> None:
    X, Y, N = (answer.drift[force][1] for force in ("X", "Y", "N"))
    np.testing.assert_allclose(X[::-1], -X, atol=0.05 * np.max(np.abs(X)))
    np.testing.assert_allclose(Y[::-1], Y, atol=0.05 * np.max(np.abs(Y)))
    np.testing.assert_allclose(N[::-1], -N, atol=0.05 * np.max(np.abs(N)))
    assert abs(N[1]) > 10 * abs(N[2])


@pytest.mark.parametrize(("mesh", "shortest"), [(1.0, 20.0), (30.0, 30.0)])
def test_frequencies_are_of_waves_from_twelve_lengths_to_an_eighth_or_what_the_mesh_shows(mesh, shortest) -> None:
    body = SimpleNamespace(minimal_computable_wavelength=mesh)
    found = _frequencies(body, HullInWaves(3.0, 8.0, 40.0), G, 160.0)
    np.testing.assert_allclose(2 * np.pi * G / found[[0, -1]] ** 2, [12 * 160.0, shortest], rtol=1e-9)
    assert len(found) == 24 and np.ptp(found[1:] / found[:-1]) < 1e-9
    given = HullInWaves(3.0, 8.0, 40.0, frequencies_radps=[0.4, 0.9])
    np.testing.assert_array_equal(_frequencies(body, given, G, 160.0), [0.4, 0.9])


def test_the_mass_matrix_has_the_kinetic_energy_of_points() -> None:
    """About the origin, x forward, y to port, z up: of a body of eight points about its centre at (3, 0, -2)."""
    radii = np.array([2.0, 5.0, 5.0])
    squares = (radii @ radii) / 2 - radii**2  # mean squares of x, y and z about the centre that give these radii
    corners = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    points = np.array([3.0, 0.0, -2.0]) + corners * np.sqrt(squares)
    motion = np.array([0.3, -0.7, 0.2, 0.05, -0.02, 0.11])
    velocities = motion[:3] + np.cross(motion[3:], points)
    energy = 0.5 * 80.0 * np.mean(np.sum(velocities**2, axis=1))
    matrix = _inertia(80.0, np.array([3.0, 0.0, -2.0]), HullInWaves(3.0, 2.0, 5.0))
    assert 0.5 * motion @ matrix @ motion == pytest.approx(energy, rel=1e-12)


def with_sea(ship: t2s.Ship, period_s: float) -> t2s.Ship:
    given = f"{{height_m = 3.0, period_s = {period_s}, direction_deg = 90.0}}"
    return t2s.Ship(parse_card(f'{ship.card.text}\n[[effects]]\nname = "waves"\nparameters = {given}\n', "ship.toml"))


@pytest.mark.slow
def test_the_ship_in_waves_is_pushed_away_from_them(in_waves: t2s.Ship) -> None:
    ship = with_sea(in_waves, period_s=7.0)
    straight = {"t_s": [0.0], "delta_order_deg": [0.0]}
    calm, rough = (one.steer(straight, duration_s=20.0).df["y_m"].iloc[-1] for one in (in_waves, ship))
    assert rough < calm - 0.05  # to port of a ship that heads north, in waves from east


def test_a_mesh_of_another_size_and_a_file_that_is_none_are_refused(hull: Path, tmp_path: Path) -> None:
    ship = t2s.load("mariner")
    model = tmp_path / "model.gdf"
    write_wigley_gdf(model, 7.0, 1.0, 0.3, (6, 2))
    with pytest.raises(InputError, match="is 7 m long, and the ship"):
        ship.with_waves(model, **OPTIONS)
    wrong = tmp_path / "wrong.gdf"
    wrong.write_text("nothing\n")
    for name, message in ((wrong, "cannot be read as a mesh"), (tmp_path / "none.gdf", "does not exist")):
        with pytest.raises(InputError, match=message):
            ship.with_waves(name, **OPTIONS)
    for given in ({"frequencies_radps": [0.0, 1.0]}, {"directions_deg": [0.0, 50.0, 180.0]}):
        with pytest.raises(InputError, match="give other frequencies_radps or directions_deg"):
            ship.with_waves(hull, **{**OPTIONS, **given})
    with pytest.raises(InputError, match=r"ship\.metacentric_height_m: is missing"):
        ship.with_waves(hull)
