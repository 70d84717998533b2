"""Sections and charts of the audit's result hold the findings and records of its study."""

from __future__ import annotations

import numpy as np
import pytest

from tank2sim.answer.charts.picture import chart_specification
from tank2sim.notices import Notice
from tank2sim.records.audit import AuditedTrial, AuditStudy, ColumnNoise
from tank2sim.records.audit.finding import ColumnFinding
from tank2sim.results.audit import AuditResult

STUDY = AuditStudy(
    findings=(
        ColumnFinding(
            file="a/turn.csv",
            column="psi [deg]",
            what="2 spikes",
            likely_truth="disturbed readings",
            kind="note",
            repaired=True,
            evidence={},
            places_s=((1.0, 1.0),),
        ),
        ColumnFinding(
            file="a/turn.csv",
            column="t_s",
            what="1 gaps",
            likely_truth="rows were not recorded",
            kind="fault",
            repaired=False,
            evidence={"gap_s": np.nan},
            places_s=((2.0, 3.0),),
        ),
    ),
    trials=(
        AuditedTrial(
            file="a/turn.csv",
            duration_s=3.0,
            step_s=1.0,
            rows=4,
            columns=("psi [deg]", "u_mps"),
            noise={"u_mps": ColumnNoise(column="u_mps", sigma=0.02, stated=False)},
            notices=(Notice("a column is left out"),),
            histories={
                "t_s": np.arange(4.0),
                "psi_deg": np.array([0.0, 0.05, 0.2, 0.45]),
                "u_mps": np.array([7.0, 6.9, np.nan, 6.7]),
            },
        ),
    ),
)


def test_places_of_findings_are_marked_in_the_panel_of_their_column_and_those_of_the_time_in_all() -> None:
    specification = chart_specification(AuditResult(STUDY)._charts()["record_turn_csv"])
    marked = []
    for panel in specification["vconcat"]:
        layers = [layer for layer in panel["layer"] if layer["mark"].get("style") == "region"]
        rows = [specification["datasets"][layer["data"]["name"]] for layer in layers]
        marked.append([(row["x"], row["end"], row["text"]) for one in rows for row in one])
    assert marked == [[(1.0, 1.0, "2 spikes"), (2.0, 3.0, "1 gaps")], [(2.0, 3.0, "1 gaps")]]


def test_the_fault_comes_first_in_the_table_and_the_headline() -> None:
    result = AuditResult(STUDY)
    findings, trials, noise = result.tables
    assert findings.df["column"].to_list() == ["t_s", "psi [deg]"] == result.findings["column"].to_list()
    assert "rows were not recorded" in result.headline[1] and not result.passed
    assert trials.df["findings"].to_list() == [2] and noise.df["u_mps"].to_list() == ["0.02*"]
    assert result.noise.to_dict("records") == [
        {"file": "a/turn.csv", "column": "u_mps", "sigma": pytest.approx(0.02), "stated": False}
    ]
