"""The page of a fleet: each ship with what she lacks and the way to her own page."""

from __future__ import annotations

import json
from dataclasses import replace

from tank2sim.answer.parts import Link
from tank2sim.apps.fleet.result import FleetResult
from tank2sim.apps.fleet.summary import BeforeAfter, ShipSummary, TrialCounts, fleet_study
from tank2sim.gap.outcome.study import EffectFound, MisfitBySet
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING

CURRENT = EffectFound(
    name="current",
    parameters={"speed_mps": 0.4512, "direction_deg": 90.0},
    standard_errors={"speed_mps": 0.0021},
    confidence=0.99,
)
ONE = ShipSummary(
    folder="gamma ray #1",
    name="Mariner <b>",
    verdict=MISSING,
    effects=(CURRENT,),
    misfit=BeforeAfter(before=MisfitBySet(fit=8.123, holdout=9.0), after=MisfitBySet(fit=1.0, holdout=1.2345)),
    trials=TrialCounts(fit=2, holdout=1),
    report="gamma ray #1/report.html",
)
FITTED = TrialCounts(fit=2, holdout=0)
LOST = replace(ONE, folder="beta", verdict=NO_EFFECT_MISSING, effects=(), trials=FITTED, misfit=None)
BAD = ShipSummary(folder="bad", fault="bad/ship.toml: line 2: is torn; correct it")


def fleet(*ships: ShipSummary, linked: bool = True) -> FleetResult:
    return FleetResult(fleet_study("ours", ships), linked)


def test_ships_stand_in_a_table_with_what_they_lack() -> None:
    result = fleet(BAD, LOST, ONE)
    ships, without = result.sections
    findings, sizes = ships.tables
    beta, gamma = findings.rows
    assert gamma[2:] == [MISSING, "current", 9.0, 1.23, "held out"]
    assert [row[:5] for row in sizes.rows] == [
        ["gamma ray #1", "current", "speed", "0.4512 ± 0.0021", "m/s"],
        ["gamma ray #1", "current", "direction towards", "90", "deg"],
    ]
    assert beta[2:] == [NO_EFFECT_MISSING, "", None, None, "fitting"]
    assert without.tables[0].rows == [["bad", BAD.fault]]
    assert {one.label: one.value for one in result.key_figures} == {
        "Ships": "3",
        MISSING.capitalize(): "1",
        NO_EFFECT_MISSING.capitalize(): "1",
        "Without a result": "1",
    }


def test_the_chart_has_each_ship_before_and_after() -> None:
    (chart,) = fleet(LOST, ONE).sections[0].charts
    rows = chart.chart["layer"][1]["data"]["values"]
    assert [(one["name"], one["v"]) for one in rows] == [("gamma ray #1", 9.0), ("gamma ray #1", 1.23)]


def test_all_that_an_ambiguous_ship_may_lack_is_reported() -> None:
    ship = replace(
        ONE, verdict=AMBIGUOUS, effects=(replace(CURRENT, parameters={}),), alternatives=("wind", "rudder_bias")
    )
    (row,) = fleet(ship).sections[0].tables[0].rows
    assert row[3] == "current or wind or rudder bias"


def test_a_link_leads_to_the_ship_whatever_her_folder_is_called() -> None:
    text = fleet(replace(ONE, misfit=None)).page()
    assert '<a href="gamma%20ray%20%231/report.html">gamma ray #1</a>' in text
    assert "Mariner &lt;b&gt;" in text
    for name, address in (("javascript:alert(1)", "javascript%3Aalert%281%29"), ('a"b?', "a%22b%3F")):
        assert Link(text=name, path=name).address == address


def test_the_json_of_a_fleet_gives_its_page_again_without_links() -> None:
    result = fleet(BAD, LOST, ONE, linked=False)
    read = FleetResult.read(json.loads(result.to_json()), "fleet.json")
    assert read.page() == result.page()
    assert read.tables[0].rows[1][0] == "gamma ray #1" and "report.html" in read.sections[0].text
