"""What of an added inertia goes into a card."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from tank2sim.apps.rigs.yaw.found_card import known_added_inertia, nrdot_prime
from tank2sim.errors import InputError


def found(value: float | None, error: float | None = None) -> SimpleNamespace:
    estimate = SimpleNamespace(added_inertia_kgm2=value, added_inertia_standard_error_kgm2=error)
    return SimpleNamespace(records=["yaw.csv"], methods={"output_error": estimate})


RECORDS = [SimpleNamespace(constants={"water_density_kgpm3": 1000.0})]


@pytest.mark.parametrize(("value", "error"), [(-0.01, 0.02), (0.0, 0.02), (-0.01, None)])
def test_an_added_inertia_that_no_body_has_is_refused(value, error) -> None:
    with pytest.raises(InputError, match=r"yaw\.csv: gives a negative added inertia"):
        known_added_inertia(found(value, error), "output_error")


def test_an_added_inertia_that_is_not_known_is_refused() -> None:
    with pytest.raises(InputError) as refusal:
        known_added_inertia(found(None), "output_error")
    assert refusal.value.source == "yaw.csv" and "inertia_kgm2" in refusal.value.remedy


def test_nrdot_is_less_than_zero_and_its_error_has_the_same_scale() -> None:
    """1/2 rho L^5 is 16000 kg m2 in water of 1000 kg/m3 at 2 m."""
    assert nrdot_prime(found(0.32, 0.016), RECORDS, "output_error", 2.0) == pytest.approx((-2e-5, 1e-6))
    assert nrdot_prime(found(0.32), RECORDS, "output_error", 2.0) == (pytest.approx(-2e-5), None)


def test_the_length_of_the_model_must_be_known() -> None:
    with pytest.raises(InputError, match="does not state the length of the model"):
        nrdot_prime(found(0.32), RECORDS, "output_error", None)
