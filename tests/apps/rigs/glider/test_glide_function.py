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
