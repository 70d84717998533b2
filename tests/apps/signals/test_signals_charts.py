import numpy as np
import pytest

from tank2sim.answer.charts.picture import chart_specification
from tank2sim.apps.signals.result import (
    autocorrelation_chart,
    cross_correlation_chart,
    density_chart,
    effect_chart,
    spectrum_chart,
    transfer_chart,
)
from tank2sim.apps.signals.study import SignalSettings, analyse
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.signals.filtering import FilterType, butterworth
from tank2sim.records.signals.spectra import spectrum, transfer_function
from tank2sim.records.signals.statistics import autocorrelation, cross_correlation
from tests.records.signals.made import first_order, nomoto, series, trial

YAW, RUDDER = SignalName("r_radps"), SignalName("delta_rad")


@pytest.fixture(scope="module")
def rate():
    return series(0.01 * first_order(1, 10.0))


@pytest.fixture(scope="module")
def column(rate):
    """A yaw rate in the study."""
    return analyse(trial(rate.time_s, r_radps=rate.values), SignalSettings()).columns["r_degps"]


def panels(chart):
    specification = chart_specification(chart)
    return specification, specification.get("vconcat", [specification])


def rows(specification, panel, mark):
    (layer,) = [one for one in panel["layer"] if one["mark"]["type"] == mark and "y2" not in one["encoding"]][:1]
    source = next(place["data"] for place in (layer, panel, specification) if "data" in place)
    return specification["datasets"][source["name"]], layer["encoding"]


def test_the_density_is_in_degrees_and_its_area_is_one(column):
    specification, (panel,) = panels(density_chart(YAW, column.probability_density))
    points, encoding = rows(specification, panel, "line")
    assert encoding["x"]["title"] == "yaw rate (deg/s)"
    assert encoding["y"]["title"] == "probability density (1/(deg/s))"
    for label in ("estimated", "normal"):
        curve = [(row["x"], row["v"]) for row in points if row["run"] == label]
        x, y = np.array(curve).T
        assert np.trapezoid(y, x) == pytest.approx(1.0, abs=0.01)
    assert np.max(np.abs(x)) > 1.0  # 0.01 rad/s is 0.57 deg/s


def test_the_spectrum_is_in_degrees_with_its_band(rate, column):
    found = spectrum(rate)
    specification, (panel,) = panels(spectrum_chart(YAW, column.spectrum))
    points, encoding = rows(specification, panel, "line")
    assert encoding["x"]["title"] == "frequency (Hz)"
    assert encoding["y"]["title"] == "power density ((deg/s)²/Hz)"
    assert encoding["x"]["scale"]["type"] == encoding["y"]["scale"]["type"] == "log"
    first = points[0]
    assert first["v"] == pytest.approx(found.density[0] * (180 / np.pi) ** 2, rel=1e-5)
    assert (first["low"], first["high"]) == pytest.approx(
        (found.low[0] * (180 / np.pi) ** 2, found.high[0] * (180 / np.pi) ** 2), rel=1e-5
    )
    assert any(layer["mark"]["type"] == "area" for layer in panel["layer"])


def test_the_correlation_time_and_the_lag_of_the_largest_are_marked(rate, column):
    text = str(chart_specification(autocorrelation_chart(YAW, column.autocorrelation)))
    assert f"'x': {autocorrelation(rate).correlation_time_s:.6g}" in text
    later = series(np.roll(rate.values, 30))
    crossed = cross_correlation(rate, later)
    text = str(chart_specification(cross_correlation_chart(RUDDER, YAW, crossed)))
    assert "'x': 3.0}" in text
    assert f"'v': {crossed.bound_if_independent:.6g}" in text


def test_gain_and_phase_of_the_ship_are_drawn_where_they_are_sure():
    rudder = np.repeat(0.3 * first_order(2, 1.0, 400), 10)
    rate = nomoto(rudder, 0.1, 0.08, 3.0)
    found = transfer_function(series(rudder, name="delta_rad"), series(rate))
    steered = trial(series(rate).time_s, delta_rad=rudder, r_radps=rate)
    steering = analyse(steered, SignalSettings()).rudder_to_yaw_rate
    specification, drawn = panels(transfer_chart(RUDDER, YAW, steering.transfer))
    titles = [panel["layer"][0]["encoding"]["y"]["title"] for panel in drawn]
    assert titles == ["gain (1/s)", "phase (deg), below zero: later", "coherence; dotted: by chance"]
    gains, _ = rows(specification, drawn[0], "point")
    assert gains[0]["v"] == pytest.approx(found.gain[0], rel=1e-5)
    assert gains[0]["low"] < gains[0]["v"] < gains[0]["high"]
    phases, _ = rows(specification, drawn[1], "point")
    assert phases[0]["v"] == pytest.approx(np.rad2deg(found.phase_rad[0]), rel=1e-5)
    assert phases[0]["v"] < 0
    assert len(gains) <= np.count_nonzero(found.sure)


def test_what_a_filter_does_is_drawn_in_decibel_degrees_and_seconds(rate):
    effect = butterworth(rate, FilterType.LOW, [0.5], causal=True).effect
    specification, drawn = panels(effect_chart("lowpass:0.5,causal", effect))
    titles = [panel["layer"][0]["encoding"]["y"]["title"] for panel in drawn]
    assert titles == ["gain (dB)", "phase (deg), below zero: later", "group delay (s)"]
    gain, phase, delay = (rows(specification, panel, "line")[0] for panel in drawn)
    place = int(np.argmin(np.abs(effect.frequency_hz - 0.5)))
    assert gain[place]["v"] == pytest.approx(-3.0, abs=0.3)
    assert phase[place]["v"] == pytest.approx(-180.0, abs=4.0)
    assert delay[place]["v"] > 0
