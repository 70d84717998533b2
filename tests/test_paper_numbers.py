"""The benchmarks of the five papers name the numbers that the papers print, and find those that can be found."""

from __future__ import annotations

import glide
import krezelewski_misiag
import poznyakov_yudin
import pytest
import wilinski_zellman
import yaw_rig
from paper_numbers import PaperNumbers

PRINTED = {
    "wilinski_zellman": [
        # means of Table 1, Table 2 with (2.1) and (2.2)
        *(0.0148, 0.0282, 0.0536, 0.074, 0.095, 0.11, 0.1224, 0.1408, 0.1524, 0.169),
        *(0.0878, 0.0549, 0.00134, 0.0035, 0.0050, -0.00493, 0.0043, -0.000017, 0.0034),
        *(-0.0021, 0.0034, 0.00003, -0.000001, 0.0028, -0.000034),
        # inner products, (2.3), (2.4), J, deviation, (2.5)
        *(0.0006072, 0.0000264, 0.0001971, 0.0015685, 0.0000041, 0.0000276, 0.0001867, 0.001286, 0.009083),
        *(2.00615, 0.10564, 0.77341, 5.99223, 2550, 92418, -26096, 26096, 2015, 4.464, 0.014, 2489, 2243, 2520, 3),
        # what others make of the same tows
        *(2775.71, 13033.2, -4553.94, 557.27, 0.515, 2817.9, 3063, 3124, 2742, 2687, 2816, 2857, 2870),
    ],
    "krezelewski_misiag": [16, 22, 55.25, 410.7, 110.5, 1161.6, 4, 10, 0.1, 7.5],
    "yaw_rig": [
        *(9, 13.3, 4.4, 0.25e5, 509.7, 263, 797.6, 456.6, 1056.8, 464.4, 1070.3),
        *(330.7, 318.7, 300.4, 450.0, 377.5, 302.0, 690.7, 562.9, 531.1),
        *(8.0, 8.5, 11.0, 11.7, 12.2, 14.9, 14.8, 17.0, 5.1, 25),
        *(10.9, 7.6, 204.3, 7.9, 117.4, 381.0, 10.3, 10.7, 179.6, 9.8, 43.5, 1434.6, 2.7, 216.7, 1480.9),
        *(298.3, 287.8, 279.7, 270.0, 502.8, 488.6),
    ],
    "poznyakov_yudin": [
        *(865.7, 622.9, 521.1, 462.2, 422.9, 394.3, 372.4, 30.6, 71.1, 10.8, 27.8),
        *(814.8, 561.0, 458.1, 399.6, 361.0, 333.3, 312.2, 32.5, 84.8, 8.0, 21.2),
        *(459.9, 465.5, 460.3, 464.5, 450.6, 475.2, 469.5, 442.5, 470.6, 465.4),
        *(407.0, 392.7, 399.7, 396.4, 403.0, 399.5, 376.4, 427.8, 403.2, 385.1, 406.8, 400.9),
        *(1.85, -1.73, -5.8, 7.1, 0.85, -3.63, 1.8, 0.3, 20.1529, -19.642, 22.322, 5.164, 2.75, 410.6, 411.5),
        *(-0.58, -0.66, 0.008889, -6.73, 2.317, -0.087, -4.22, 4.05, 47, 61, 0.78, 0.48),
    ],
    "glide": [0.214, 32.2, 4.6, 11.76, 50, 23.385, 12.75, 0.0619, 127.018, 118.279],
}
"""Printed numbers (of the glider, whose paper prints hardly any, those of its corrected equations too)."""


@pytest.fixture(scope="module")
def found() -> dict[str, PaperNumbers]:
    numbers = {name: PaperNumbers() for name in PRINTED}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wilinski_zellman, "beside", numbers["wilinski_zellman"])
        wilinski_zellman.main()
        patch.setattr(glide, "number", numbers["glide"])
        glide.of_the_paper()
    yaw_rig.numbers(numbers["yaw_rig"])
    poznyakov_yudin.numbers(numbers["poznyakov_yudin"])
    krezelewski_misiag.numbers(numbers["krezelewski_misiag"])
    return numbers


@pytest.mark.parametrize("name", PRINTED)
def test_every_printed_number_is_named_with_a_verdict(name: str, found: dict[str, PaperNumbers]) -> None:
    reported = {number.printed for number in found[name].numbers if number.verdict}
    missing = [value for value in PRINTED[name] if not any(abs(value - own) <= 1e-9 * abs(value) for own in reported)]
    assert not missing


@pytest.mark.parametrize("name", PRINTED)
def test_what_should_be_reproduced_is(name: str, found: dict[str, PaperNumbers]) -> None:
    assert not found[name].failed


def test_a_number_that_differs_fails_the_benchmark() -> None:
    number = PaperNumbers()
    number("agrees", 2.0, 2.05, 0.1)
    number("known not to", 2.0, 5.0, None, "misprint")
    assert number.end() == 0
    number("differs", 2.0, 2.2, 0.1)
    number("is none", 2.0, float("nan"), 0.1)
    assert number.end() == 1 and number.failed == ["differs", "is none"]
