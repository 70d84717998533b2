"""Glides as a user of the API has them: against the balance of forces and the geometry of a path."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s


@pytest.fixture(scope="module")
def glider() -> t2s.Ship:
    return t2s.load("kulikovsky-velikanov")


def test_lift_drag_and_buoyancy_balance_in_degrees(glider: t2s.Ship) -> None:
    """(3) and (9) of the paper; 1 kg of net buoyancy is g N."""
    glides = glider.glide([25, -30, 60], roll_deg=10, buoyancy_kg=2.0, views=False).glides
    path, roll = np.radians(glides["path_angle_deg"]), np.radians(glides["roll_deg"])
    lift, drag = glides["lift_N"] * np.cos(roll), glides["drag_N"]
    assert glides["path_angle_deg"].tolist() == pytest.approx([25, -30, 60])
    assert glides["buoyancy_kg"].tolist() == [2.0, -2.0, 2.0]
    along = np.sign(path)  # drag is against the path, buoyancy along it
    np.testing.assert_allclose(drag, 2.0 * 9.81 * np.abs(np.sin(path)), rtol=2e-3)
    np.testing.assert_allclose(lift, -along * 2.0 * 9.81 * np.cos(path), rtol=2e-3)
    q = glides["drag_N"] / glides["drag_coefficient"]
    np.testing.assert_allclose(glides["lift_N"], q * glides["lift_coefficient"], rtol=1e-12)


def test_a_programme_of_one_step_is_a_straight_path(glider: t2s.Ship, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("duration_s,path_angle_deg\n100,-30\n")
    found = glider.glide(-30, programme=tmp_path / "p.csv", views=False)
    speed, last = found.glides["speed_mps"].iloc[0], found.path.iloc[-1]
    assert last["x_m"] == pytest.approx(100 * speed * math.cos(math.radians(30)))
    assert last["height_m"] == pytest.approx(-100 * speed * math.sin(math.radians(30)))
    assert last["y_m"] == pytest.approx(0.0, abs=1e-9)


def test_a_range_is_the_way_of_its_cycles(glider: t2s.Ship) -> None:
    """Each metre down and each metre up takes 1/tan(angle) over the ground."""
    ranges = glider.glide(budget_kg=50, depth_m=200, views=False).ranges
    assert len(ranges) == 2
    way = ranges["cycles"] * 2 * 200 / np.tan(np.radians(ranges["path_angle_deg"].abs()))
    np.testing.assert_allclose(ranges["range_m"], way, rtol=1e-9)


@pytest.mark.slow
def test_a_result_fits_a_screen_and_has_a_picture(glider: t2s.Ship) -> None:
    found = glider.glide([25, 30])
    assert len(repr(found).splitlines()) <= 24
    assert "data:image/png;base64," in found._repr_html_()
    assert found.to_dict()["schema"] == "tank2sim/glide/1"
    assert list(found.charts()) == [
        "glide_polar",
        "error_of_the_quasi_steady_motion_swings",
        "error_of_the_quasi_steady_path_steps",
    ]
    assert found.smallest_angle_deg == pytest.approx(abs(float(str(found.best["path_angle_deg"]))))


def test_what_cannot_be_asked_is_refused_at_its_place(glider: t2s.Ship, tmp_path: Path) -> None:
    with pytest.raises(t2s.InputError) as refusal:
        t2s.load("mariner").glide(30)
    assert refusal.value.place == "model.kind" and "glider" in refusal.value.remedy
    with pytest.raises(t2s.InputError) as refusal:
        glider.glide(budget_kg=10, views=False)
    assert str(refusal.value.source) == "depth_m" and refusal.value.remedy
    with pytest.raises(t2s.InputError) as refusal:
        glider.glide(programme=tmp_path / "none.csv", views=False)
    assert str(refusal.value.source).endswith("none.csv")
    for angle in (20, 95, math.nan):
        with pytest.raises(t2s.InputError) as refusal:
            glider.glide(angle, views=False)
        assert refusal.value.remedy
