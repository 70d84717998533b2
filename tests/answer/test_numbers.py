import math

import numpy as np
import pytest

from tank2sim.answer.numbers import format_column, format_number, is_number_text, without_exponents
from tank2sim.answer.parts import cell_text


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (561.24, "561.2"),
        (0.25, "0.25"),
        (5.0, "5"),
        (-3.14159, "−3.142"),
        (12345.678, "12\u202f346"),
        (1234567, "1\u202f234\u202f567"),
        (6000, "6000"),
        (3.1e-12, "3.1×10⁻¹²"),
        (-2.5e9, "−2.5×10⁹"),
        (1e-9, "1×10⁻⁹"),
        (0.0, "0"),
        (-0.0, "0"),
        (math.nan, "–"),
        (-math.inf, "−∞"),
        (np.float64(0.001), "0.001"),
        (np.int64(100), "100"),
        (9.9999, "10"),
    ],
)
def test_a_number_is_shown_with_four_significant_digits(value, shown):
    assert format_number(value) == shown


@pytest.mark.parametrize("value", [0.0123456, 1.23456, 123.456, 1234.56, 98765.4, 1.5e-8])
def test_what_is_shown_is_the_value_to_four_digits(value):
    text = format_number(value).replace("\u202f", "").replace("−", "-")
    mantissa, _, exponent = text.partition("×10")
    power = int(exponent.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))) if exponent else 0
    assert float(mantissa) * 10.0**power == pytest.approx(value, rel=5e-4)


def test_a_column_has_one_number_of_decimals():
    assert format_column([468.21, 212.7, -470.0]) == ["468.2", "212.7", "−470.0"]


def test_a_column_has_no_decimals_that_say_nothing():
    assert format_column([5.0, 10.0, 35.0]) == ["5", "10", "35"]
    assert format_column([0.1, 0.2]) == ["0.1", "0.2"]


def test_a_column_of_far_apart_sizes_hides_none_of_them_as_zero():
    assert format_column([1234.5, 2e-9]) == ["1234", "2×10⁻⁹"]


def test_a_column_keeps_gaps_and_zeros():
    assert format_column([1.25, math.nan, 0.0]) == ["1.25", "–", "0.00"]
    assert format_column([0.0, math.nan]) == ["0", "–"]


def test_truth_values_are_no_numbers():
    assert is_number_text(np.float32(1)) and is_number_text(3)
    assert not is_number_text(True) and not is_number_text("3")


def test_numbers_in_text_lose_their_exponents_and_all_else_stays() -> None:
    text = "B1, B2: 2.2e+04 (qr) and -3e-09 kg, above 225; 1e5 and file_2e+04x"
    assert without_exponents(text) == "B1, B2: 22\u202f000 (qr) and −3×10⁻⁹ kg, above 225; 1e5 and file_2e+04x"


@pytest.mark.parametrize(
    ("value", "shown"),
    [(-0.0, "0"), (math.inf, "∞"), (-math.inf, "-∞"), (math.nan, "-"), (-1.25, "-1.25"), ([-0.0], "0")],
)
def test_the_screen_shows_no_negative_zero_and_no_word_for_infinity(value, shown):
    assert cell_text(value) == shown
