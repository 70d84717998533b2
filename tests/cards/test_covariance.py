"""The covariance next to a card: what is written is read again, and what cannot be is refused in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cards.covariance import Covariance, covariance_file, not_referring, referring
from tank2sim.cards.covariance_reading import carried, read_covariance
from tank2sim.cards.reading import changed_text
from tank2sim.errors import InputError

NAMES = ("derivatives.Yv", "derivatives.Nv")
MATRIX = np.array([[4e-10, 3e-10], [3e-10, 9e-10]])


def card_with(folder: Path, covariance: Covariance, text: str) -> ManoeuvringCard:
    path = folder / "ship.toml"
    path.write_text(referring(text, path))
    covariance_file(path).write_text(covariance.as_text())
    card = read_card(path)
    assert isinstance(card, ManoeuvringCard)
    return card


@pytest.fixture
def text(mariner_card: ManoeuvringCard) -> str:
    return mariner_card.text + "\n[uncertainty]\nYv = 2e-5\nNv = 3e-5\n"


def test_what_is_written_is_read_again_to_the_last_figure(tmp_path: Path, text: str) -> None:
    matrix = MATRIX * (1 + 1e-3 * np.pi)
    found = read_covariance(card_with(tmp_path, Covariance(NAMES, matrix), text))
    assert found is not None and found.names == NAMES
    np.testing.assert_array_equal(found.matrix, matrix)


SAMPLES = np.random.default_rng(2).multivariate_normal([-0.011, -0.003], MATRIX, 50)
OF_SAMPLES = np.cov(SAMPLES.T)


def sampled(samples=SAMPLES) -> Covariance:
    return Covariance(NAMES, OF_SAMPLES, samples)


@pytest.fixture
def text_of_samples(mariner_card: ManoeuvringCard) -> str:
    errors = np.sqrt(np.diag(OF_SAMPLES))
    return mariner_card.text + f"\n[uncertainty]\nYv = {errors[0]:.6g}\nNv = {errors[1]:.6g}\n"


def test_samples_are_read_again_to_the_last_figure(tmp_path: Path, text_of_samples: str) -> None:
    found = read_covariance(card_with(tmp_path, sampled(), text_of_samples))
    assert found is not None and found.samples is not None
    np.testing.assert_array_equal(found.samples, SAMPLES)


@pytest.mark.parametrize("samples", [SAMPLES[:, :1], 2 * SAMPLES, SAMPLES[:1], np.full((5, 2), np.nan)])
def test_samples_that_are_not_of_the_covariance_are_refused(tmp_path: Path, text_of_samples: str, samples) -> None:
    with pytest.raises(InputError) as error:
        read_covariance(card_with(tmp_path, sampled(samples), text_of_samples))
    assert error.value.place == "samples"


def test_samples_follow_a_number_that_was_tuned(tmp_path: Path, text_of_samples: str) -> None:
    card = card_with(tmp_path, sampled(), text_of_samples)
    before = card.derivatives["Nv"]
    kept = carried(card, changed_text(card.text, card.source, {"derivatives.Nv": before + 1e-6}))
    assert kept is not None and kept.samples is not None
    np.testing.assert_allclose(kept.samples - SAMPLES, np.tile([0.0, 1e-6], (50, 1)), rtol=1e-6, atol=1e-15)


def test_a_card_without_the_line_has_none(mariner_card: ManoeuvringCard) -> None:
    assert read_covariance(mariner_card) is None


def test_a_new_reference_takes_the_place_of_the_old_one(text: str) -> None:
    once = referring(text, Path("a.toml"))
    twice = referring(once, Path("b.toml"))
    assert twice.count("# covariance:") == 1 and twice == referring(text, Path("b.toml"))


@pytest.mark.parametrize(
    ("names", "matrix", "word"),
    [
        (NAMES, [[4e-10, 3e-10], [2e-10, 9e-10]], "symmetric"),
        (NAMES, [[4e-10, 7e-10], [7e-10, 9e-10]], "semidefinite"),
        (NAMES, [[4e-10, 3e-10]], "rows"),
        (("derivatives.Yv", "derivatives.Yq"), MATRIX.tolist(), "not a number"),
        (("derivatives.Yv", "ship.name"), MATRIX.tolist(), "not a number"),
        (("derivatives.Yv", "derivatives.Yv"), MATRIX.tolist(), "twice"),
        (NAMES, [[4.4e-10, 3e-10], [3e-10, 9e-10]], "uncertainty.Yv"),
        (NAMES, [[0.0, 3e-10], [3e-10, 9e-10]], "exact"),
    ],
)
def test_a_covariance_at_fault_is_refused(tmp_path: Path, text: str, names, matrix, word: str) -> None:
    card = card_with(tmp_path, Covariance(tuple(names), np.array(matrix)), text)
    with pytest.raises(InputError, match=word):
        read_covariance(card)


@pytest.mark.parametrize("content", ["", "[1]", json.dumps({"format": "other"}), '{"format": "tank2sim-covariance/1"}'])
def test_a_file_that_is_none_is_refused(tmp_path: Path, text: str, content: str) -> None:
    card = card_with(tmp_path, Covariance(NAMES, MATRIX), text)
    covariance_file(tmp_path / "ship.toml").write_text(content)
    with pytest.raises(InputError):
        read_covariance(card)


def test_a_missing_file_is_reported(tmp_path: Path, text: str) -> None:
    card = card_with(tmp_path, Covariance(NAMES, MATRIX), text)
    covariance_file(tmp_path / "ship.toml").unlink()
    with pytest.raises(InputError, match="is missing"):
        read_covariance(card)


def test_a_changed_card_keeps_the_covariance_of_what_is_the_same(tmp_path: Path, text: str) -> None:
    effect = "\n[[effects]]\nname = 'rudder_bias'\nparameters = {angle_deg = 1.0}\nuncertainty = {angle_deg = 0.1}\n"
    names = (*NAMES, "effects.0.parameters.angle_deg")
    root = np.array([[2e-5, 0, 0], [1e-5, np.sqrt(8) * 1e-5, 0], [0.06, 0.0, 0.08]])
    card = card_with(tmp_path, Covariance(names, root @ root.T), text + effect)
    whole = carried(card, card.text)
    assert whole is not None and whole.names == names
    found = carried(card, changed_text(card.text, card.source, {"derivatives.Yv": -1170e-5}))
    assert found is not None and found.names == names[1:]
    np.testing.assert_array_equal(found.matrix, (root @ root.T)[1:, 1:])
    within = carried(card, changed_text(card.text, card.source, {"derivatives.Yv": -1160e-5 + 1.9e-5}))
    beyond = carried(card, changed_text(card.text, card.source, {"derivatives.Yv": -1160e-5 + 2.1e-5}))
    assert within is not None and within.names == names and beyond is not None and beyond.names == names[1:]
    less_sure = changed_text(card.text, card.source, {"effects.0.uncertainty.angle_deg": 0.2})
    other = card.text.replace("'rudder_bias'", "'fixed_rudder_offset'")
    for changed in (less_sure, other):
        found = carried(card, changed)
        assert found is not None and found.names == NAMES
    assert carried(parse_card(not_referring(card.text), card.source), card.text) is None


def test_samples_may_be_some_of_those_that_the_covariance_is_of(tmp_path: Path, mariner_card: ManoeuvringCard) -> None:
    drawn = np.random.default_rng(3).multivariate_normal([-0.011, -0.003], MATRIX, 2000)
    matrix = np.cov(drawn.T)
    errors = np.sqrt(np.diag(matrix))
    text = mariner_card.text + f"\n[uncertainty]\nYv = {errors[0]:.6g}\nNv = {errors[1]:.6g}\n"
    kept = drawn[:500]
    assert np.any(np.abs(kept.std(axis=0, ddof=1) / errors - 1) > 0.006)
    found = read_covariance(card_with(tmp_path, Covariance(NAMES, matrix, kept), text))
    assert found is not None and len(found.samples) == 500
