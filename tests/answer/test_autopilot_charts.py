"""Charts of a control loop: what they draw is where it belongs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tank2sim.answer.charts.analysis import FrequencyResponse, nyquist_chart, sensitivity_chart
from tank2sim.answer.charts.picture import chart_png, chart_specification

OMEGA = np.logspace(-2, 2, 400)
LOOP = 2 / (1j * OMEGA * (1j * OMEGA + 1))


def rows_of(chart: object, layer: int) -> list[dict[str, float]]:
    specification = chart_specification(chart)
    return specification["datasets"][specification["layer"][layer]["data"]["name"]]


def test_the_nyquist_curve_touches_the_circle_of_its_peak() -> None:
    peak = float(1 / np.abs(1 + LOOP).min())
    chart = nyquist_chart([FrequencyResponse("L", omega_radps=OMEGA, response=LOOP)], peak)
    circle, curve = (np.array([complex(row["x"], row["v"]) for row in rows_of(chart, n)]) for n in (4, 2))
    np.testing.assert_allclose(np.abs(circle + 1), 1 / peak, rtol=1e-4)
    assert np.abs(curve + 1).min() == pytest.approx(1 / peak, rel=2e-3)
    assert chart_png(chart, scale=0.2)[:4] == b"\x89PNG"


def test_sensitivities_are_in_decibel_over_frequency() -> None:
    chart = sensitivity_chart([FrequencyResponse("S", omega_radps=OMEGA, response=1 / (1 + LOOP))])
    rows = rows_of(chart, 1)
    for row in rows[:: len(rows) // 7]:
        s = 1j * row["x"]
        wanted = 20 * math.log10(abs(s * (s + 1) / (s * (s + 1) + 2)))
        assert row["v"] == pytest.approx(wanted, abs=1e-3)
