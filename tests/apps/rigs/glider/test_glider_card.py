"""Cards of gliders: what is read, and what is refused."""

from __future__ import annotations

import pytest

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.cards import parse_card, read_card
from tank2sim.errors import InputError

PROBE = read_card("kulikovsky-velikanov")


def test_the_bundled_probe_has_the_numbers_of_the_paper() -> None:
    assert isinstance(PROBE, GliderCard) and PROBE.model.kind == "glider"
    own = PROBE.glider
    assert (own.lift_slope, own.lift_quadratic, own.drag_zero, own.drag_quadratic) == (11.76, 4.6, 0.214, 32.2)
    assert (own.mass_kg, own.volume_m3) == (50.0, 0.0628)
    assert own.reference_area_m2 == pytest.approx(0.0628 ** (2 / 3), rel=1e-9)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("reference_area_m2", -0.1, "glider.reference_area_m2"),
        ("drag_zero", 0, "glider.drag_zero"),
        ("mass_kg", float("nan"), "glider.mass_kg"),
        ("span_m", 1.0, "glider.span_m"),
    ],
)
def test_a_value_at_fault_is_refused_with_its_key(key, value, words) -> None:
    with pytest.raises(InputError, match=words):
        read_card("kulikovsky-velikanov", {f"glider.{key}": value})


def test_a_card_without_its_reference_area_is_refused() -> None:
    text = "\n".join(line for line in PROBE.text.splitlines() if not line.startswith("reference_area_m2"))
    with pytest.raises(InputError, match="reference_area_m2: is missing"):
        parse_card(text, "probe.toml")
