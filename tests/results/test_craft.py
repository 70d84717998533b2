"""Results of a craft's trials hold the numbers of their studies."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tank2sim.cards import SteeredBy
from tank2sim.identification.craft.fit import CoefficientVerdict
from tank2sim.identification.craft.study import (
    CandidateTrial,
    CompassDeviation,
    CraftCoefficient,
    CraftIdentificationStudy,
    PredictionStudy,
    ThrusterResponse,
    TrialPrediction,
)
from tank2sim.notices import Notice
from tank2sim.results.craft_identification import CraftIdentificationResult
from tank2sim.results.validation import ValidationResult, ValidationStudy

IDENTIFIED = CraftIdentificationStudy(
    ship="A craft",
    method="kalman",
    trials=("steps", "spin"),
    coefficients={
        "Xu": CraftCoefficient(
            value=-70.0,
            standard_error=5.0,
            before=-60.0,
            prior_standard_error=30.0,
            verdict=CoefficientVerdict.IDENTIFIED,
            by="steps",
        ),
        "port.astern": CraftCoefficient(
            value=0.005,
            standard_error=0.004,
            before=0.005,
            prior_standard_error=0.004,
            verdict=CoefficientVerdict.PRIOR,
            by=None,
        ),
    },
    compass=CompassDeviation(a_deg=0.1, a_error_deg=0.5, b_deg=6.0, b_error_deg=1.0, c_deg=0.3, c_error_deg=1.1),
    noise={"x_m": 0.1},
    determination={"u": 0.98, "v": 0.9, "r": 0.95},
    driven_by="revolutions",
    order_responses={
        "port": ThrusterResponse(
            lag_s=0.3,
            lag_error_s=0.05,
            dead_band_rpm=None,
            dead_band_error_rpm=None,
            rest_rpm=0.0,
            turning_rpm=90.0,
        )
    },
    held_out=("zigzag",),
    next_trials=(CandidateTrial("going astern", (0.0, 20.0), (-0.4, 0.4), (-0.4, 0.4), ("port.astern",)),),
    notices=(Notice("a notice"),),
)

PREDICTED = PredictionStudy(
    determination={"u": 0.98, "v": 0.9, "r": 0.95},
    end_distance_m=1.5,
    end_heading_deg=None,
    trials={
        "zigzag": TrialPrediction(
            predictions=12,
            rms_u_mps=0.05,
            rms_v_mps=0.02,
            rms_r_degps=1.0,
            end_distance_m=1.5,
            end_heading_deg=None,
        )
    },
)
VALIDATED = ValidationStudy(
    ship="A craft",
    source="made up",
    documentation={"Ship": "length 2 m"},
    coefficients={},
    steered_by=SteeredBy.THRUSTERS,
    propulsion=True,
    verdict="12 free-running predictions",
    counts={},
    figures=(),
    members=0,
    verification=(),
    imo=(),
    replays=(),
    notices=(),
    predictions=PREDICTED,
)


def test_coefficients_have_their_verdicts_and_the_next_trial_is_named() -> None:
    result = CraftIdentificationResult(IDENTIFIED)
    coefficients, following, responses, compass = (table.df for table in result.tables)
    assert coefficients["verdict"].to_list() == ["identified", "not determined"]
    assert following["would determine"].to_list() == ["port.astern"]
    assert responses["turned at (rpm)"].to_list() == [90.0]
    assert compass.iloc[0].to_list() == [0.1, 0.5, 6.0, 1.0, 0.3, 1.1]
    assert "2 trials determine 1 of 2 coefficients" in result.headline[0] and "going astern" in result.headline[2]


def test_predictions_of_each_trial_are_a_table() -> None:
    result = ValidationResult(VALIDATED)
    predictions = result.tables[0].df
    assert predictions["position (m)"].to_list() == [1.5] and predictions["predictions"].to_list() == [12]
    assert "12 free-running predictions" in result.headline[0] and result.headline[1].endswith("1.5 m.")


def test_results_read_from_their_json_have_the_same_pages() -> None:
    for result in (CraftIdentificationResult(IDENTIFIED), ValidationResult(VALIDATED)):
        again = type(result).read(result.to_dict(), "c.json")
        assert again.page() == result.page() and again.to_dict() == result.to_dict()


def test_one_trial_determines_in_the_singular() -> None:
    found = CraftIdentificationResult(replace(IDENTIFIED, trials=("steps",)))
    assert "1 trial determines 1 of 2 coefficients" in found.headline[0]


def test_the_coefficients_of_a_craft_are_drawn_next_to_those_of_its_card() -> None:
    result = CraftIdentificationResult(IDENTIFIED)
    assert result.chart_names == ("coefficients",)
    drawn = result._charts()["coefficients"]
    rows = [row for part in drawn["hconcat"][0]["layer"] for row in part["data"]["values"]]
    found = next(row for row in rows if row.get("name") == "Xu" and row["run"] == "estimate")
    assert found["v"] == pytest.approx(-10 / 30)
    assert found["high"] - found["v"] == pytest.approx(1.96 * 5 / 30, rel=1e-3)
    assert result.picture().startswith(b"\x89PNG")
