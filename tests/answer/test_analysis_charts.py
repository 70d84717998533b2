import math

import numpy as np
import pytest

from tank2sim.answer.charts.analysis import (
    FrequencyResponse,
    OutputError,
    PolesZeros,
    bode_chart,
    error_chart,
    pole_zero_chart,
)
from tank2sim.answer.charts.picture import chart_specification


def rows(specification, layer):
    return specification["datasets"][layer["data"]["name"]]


def bode_of(response):
    omega = np.logspace(-2, 2, 401)
    system = FrequencyResponse("system", omega_radps=omega, response=response(1j * omega))
    specification = chart_specification(bode_chart([system]))
    panels = [panel["layer"][0] for panel in specification["vconcat"]]
    at = [{round(row["x"], 6): row["v"] for row in rows(specification, panel)} for panel in panels]
    return specification, at[0], at[1]


def test_an_integrator_has_0_db_and_minus_90_degrees_at_1_rad_per_second():
    _, magnitude, phase = bode_of(lambda s: 1 / s)
    assert magnitude[1.0] == pytest.approx(0, abs=1e-9)
    assert magnitude[10.0] == pytest.approx(-20)
    assert set(phase.values()) == {-90.0}


def test_the_phase_of_three_integrations_is_minus_270_and_not_90():
    # Two of the three come in above 1 rad/s, so that the phase passes -180 on its way.
    _, _, phase = bode_of(lambda s: 1 / (s * (1 + s) ** 2))
    assert phase[1.0] == pytest.approx(-180)
    assert phase[100.0] == pytest.approx(-270, abs=1.5)


def test_phase_is_ticked_in_parts_of_a_right_angle_around_all_of_it():
    specification, _, phase = bode_of(lambda s: 1 / (s * (1 + s) ** 2))
    ticks = specification["vconcat"][1]["layer"][0]["encoding"]["y"]["axis"]["values"]
    assert ticks == [-270, -240, -210, -180, -150, -120, -90]
    assert ticks[0] <= min(phase.values()) and ticks[-1] >= max(phase.values())


def test_bode_axes_name_their_units_and_the_frequency_is_logarithmic():
    specification, _, _ = bode_of(lambda s: 1 / s)
    upper, lower = (panel["layer"][0]["encoding"] for panel in specification["vconcat"])
    assert upper["y"]["title"] == "magnitude (dB)"
    assert lower["y"]["title"] == "phase (deg)"
    assert lower["x"]["title"] == "angular frequency (rad/s)"
    assert {upper["x"]["scale"]["type"], lower["x"]["scale"]["type"]} == {"log"}


def test_a_pole_tells_its_natural_frequency_and_damping():
    specification = chart_specification(pole_zero_chart([PolesZeros("yaw", poles=[-3 + 4j, -3 - 4j], zeros=[-2])]))
    upper, _, zero = rows(specification, specification["layer"][-1])
    assert (upper["kind"], upper["re"], upper["im"], upper["wn"], upper["zeta"]) == ("pole", -3, 4, 5, 0.6)
    assert (zero["kind"], zero["re"]) == ("zero", -2)


@pytest.mark.parametrize("poles", [[-0.1, -0.01], [0.02], [-0.05 + 2j, -0.05 - 2j], [0.0]])
def test_the_complex_plane_has_one_scale_and_shows_the_border_of_stability(poles):
    specification = chart_specification(pole_zero_chart([PolesZeros("yaw", poles=poles)]))
    encoding = specification["layer"][-1]["encoding"]
    (left, right), (low, high) = encoding["x"]["scale"]["domain"], encoding["y"]["scale"]["domain"]
    assert (right - left) / specification["width"] == pytest.approx((high - low) / specification["height"], rel=1e-12)
    assert left < 0 < right
    assert all(left < complex(pole).real < right and low < complex(pole).imag < high for pole in poles)


def test_errors_are_held_against_their_limits():
    errors = [
        OutputError(kind="FMI 2 CS", output="motion.x", error=1e-9, limit=1e-9),
        OutputError(kind="FMI 2 CS", output="motion.y", error=1.1e-9, limit=1e-9),
        OutputError(kind="FMI 3 ME", output="motion.x", error=1.1e-9, limit=1e-6),
        OutputError(kind="FMI 3 ME", output="motion.y", error=math.nan, limit=1e-6),
    ]
    specification = chart_specification(error_chart(errors))
    verdicts = [row["verdict"] for row in rows(specification, specification)]
    assert verdicts == ["within the limit", "above the limit", "within the limit", "above the limit"]
    assert "Above the limit: motion.y." in specification["description"]
    assert specification["facet"]["sort"] == ["FMI 2 CS", "FMI 3 ME"]


def test_every_error_has_a_place_on_the_logarithmic_scale():
    errors = [
        OutputError(kind="CS", output=f"output {place}", error=error, limit=1e-9)
        for place, error in enumerate([0.0, 3e-15, 1e-3, math.inf])
    ]
    specification = chart_specification(error_chart(errors))
    low, high = specification["spec"]["layer"][2]["encoding"]["x"]["scale"]["domain"]
    drawn = rows(specification, specification)
    assert [row["e"] for row in drawn] == [low, 3e-15, 1e-3, high]
    assert 0 < low < 3e-15 and high > 1e-3
    assert drawn[0]["error"] == "0 (exactly)" and drawn[3]["error"] == "inf"


def test_errors_of_exactly_zero_alone_can_be_drawn():
    specification = chart_specification(error_chart([OutputError(kind="CS", output="x", error=0.0, limit=1e-9)]))
    assert "All are within their limits." in specification["description"]
