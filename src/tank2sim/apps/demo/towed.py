"""First half of the demo: the five tows of paper 1 become an FMU, which is towed again next to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.picture import chart_png
from tank2sim.answer.charts.vega import ChartSpec, PlotAxis
from tank2sim.answer.parts import Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.answer.study import study_values
from tank2sim.apps.demo.fmu_helpers import DemoOutcome, Workshop, error_words, largest_error
from tank2sim.apps.rigs.tow.identify import TowIdentification, identify_tow, tow_card_text
from tank2sim.apps.rigs.tow.output_error import TowModel
from tank2sim.apps.rigs.tow.records import Tows, read_tows
from tank2sim.apps.rigs.tow.surge import TOW_PARAMETERS
from tank2sim.arrays import Array
from tank2sim.bundled import bundled
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.fmu.check import CheckReport
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.fmu.running import replay
from tank2sim.units import in_words

WELL_POSED = TowModel(("B3",))
"""Drag terms that these tows determine (with M); the B1 and B2 of the paper in addition cannot be identified."""


NAME = "Wilinski-Zellman underwater vehicle"
SOURCE = "Table 1 of Wilinski and Zellman (1984), M and B3 by output error (tank2sim demo)"
LENGTH_M = 3.8
"""Number of the vehicle, paper 1."""


def towed_vehicle(workshop: Workshop) -> DemoOutcome:
    """Identify, write the card, export and check the FMU, and tow it through fmpy next to the measured tows."""
    workshop.begin("five tows of an underwater vehicle: identifying mass and drag")
    tows = read_tows(bundled("models", "wilinski-zellman", "tows.csv"))
    paper, chosen = identify_tow(tows), identify_tow(tows, model=WELL_POSED)
    text = tow_card_text(chosen, chosen.methods["output_error"], name=NAME, source=SOURCE, length_m=LENGTH_M)
    card = parse_card(text, workshop.write("towed-vehicle.toml", text).name)
    model = build(card)
    checked = [workshop.checked_fmu(card, model, "towed-vehicle", fmi) for fmi in (2, 3)]
    workshop.begin("towed vehicle: co-simulating the five tows")
    times, speed = _towed_again(model, checked[0][0], tows, chosen.force_N)
    rows = "\n".join(f"{t:.10g},{v:.10g}" for t, v in zip(times, speed, strict=True))
    workshop.write("towed-vehicle.csv", f"t_s,speed_mps\n{rows}\n")
    chart = _chart(tows, times, speed)
    workshop.write("towed-vehicle.png", chart_png(chart))
    misses = _misses(tows, times, speed)
    reports = [report for _, report in checked]
    result: dict[str, object] = {
        "four_unknowns": study_values(paper),
        "two_unknowns": study_values(chosen),
        "tows": misses,
        "checks": [study_values(report) for report in reports],
    }
    return DemoOutcome(_figures(chosen, misses, reports), [_section(paper, chosen, misses, chart)], result)


def _towed_again(model: Model, fmu: Path, tows: Tows, force_N: float) -> tuple[Array, Array]:
    """Times (s) and speeds (m/s) of the FMU under the force of the tows."""
    # A tenth of the readings' interval, so that every reading falls on a communication point.
    times = np.linspace(tows.time_s[0], tows.time_s[-1], 10 * (len(tows.time_s) - 1) + 1)
    held = np.full((len(times) - 1, 1), force_N)
    return times, replay(fmu, InputSequence(times, held), model)["motion.u"]


def _chart(tows: Tows, times: Array, speed: Array) -> ChartSpec:
    measured = [
        PlotSeries(f"tow {k + 1}", x=tows.time_s, y=column, points=True) for k, column in enumerate(tows.speed_mps.T)
    ]
    return curve_chart(
        Plot([PlotSeries("FMU", x=times, y=speed), *measured], up=PlotAxis("speed (m/s)", zero=True)),
        PlotAxis("time (s)", nice=False, zero=True),
        title="Speed of the vehicle: five tows, and the FMU under the same force",
        described="Speed over time of five tows; points were measured, the line is the FMU.",
        shown={"run:N": "tow"},
    )


def _section(
    paper: TowIdentification, chosen: TowIdentification, misses: list[dict[str, float]], chart: ChartSpec
) -> Section:
    return Section(
        "A towed vehicle: from five tows to an FMU",
        text=(
            "An underwater vehicle was towed from rest by a known force (Wilinski and Zellman 1984, Table 1). Its mass "
            "with added mass M and its drag follow from M dv/dt + B1 v⁴ + B2 v³ + B3 v² = T.\n\n"
            "The published method asks for four unknowns. The condition numbers say that these tows cannot separate "
            "them; M and B3 alone they can. The card, and the FMU made from it, have those two, by output error."
        ),
        tables=[
            _estimates(paper, "Four unknowns, as published"),
            _estimates(chosen, "Two unknowns, as in the card"),
            _miss_table(misses),
        ],
        charts=[Illustration(chart, caption="Points were measured; the line is the exported FMU, run by FMPy.")],
        notes=[*paper.notices[:1], *chosen.notices],
    )


def _figures(chosen: TowIdentification, misses: list[dict[str, float]], reports: list[CheckReport]) -> list[KeyFigure]:
    fit = chosen.methods["output_error"]
    return [
        KeyFigure(
            "Vehicle's mass with added mass",
            f"{fit.estimates['total_mass_kg']:.0f} ± {fit.standard_errors['total_mass_kg']:.0f}",
            "kg",
            note="from five tows, without a start delay; ± one standard error",
        ),
        KeyFigure(
            "FMU against the tows",
            max(miss["largest_mps"] for miss in misses),
            "m/s",
            note="largest difference of any reading",
        ),
        KeyFigure(
            "Vehicle's FMU, Co-Simulation",
            error_words(largest_error(reports, "CoSimulation")),
            verdict=Verdict.PASSED,
            note="largest difference from the model, relative",
        ),
    ]


def _misses(tows: Tows, times: Array, speed: Array) -> list[dict[str, float]]:
    """Root mean square and largest difference of the FMU from each tow, m/s."""
    at_readings = np.interp(tows.time_s, times, speed)
    differences = tows.speed_mps - at_readings[:, None]
    return [
        {
            "tow": k + 1,
            "rms_mps": float(np.sqrt(np.nanmean(column**2))),
            "largest_mps": float(np.nanmax(np.abs(column))),
            "at_s": float(tows.time_s[np.nanargmax(np.abs(column))]),
        }
        for k, column in enumerate(differences.T)
    ]


def _miss_table(misses: list[dict[str, float]]) -> Table:
    return Table(
        caption="The FMU next to each tow",
        columns=[
            Column("tow", digits=1),
            Column("rms difference", "m/s", digits=2),
            Column("largest difference", "m/s", digits=2),
            Column("at", "s", digits=2),
        ],
        rows=[[int(miss["tow"]), miss["rms_mps"], miss["largest_mps"], miss["at_s"]] for miss in misses],
    )


def _estimates(result: TowIdentification, caption: str) -> Table:
    unknowns = next(iter(result.methods.values())).unknowns
    rows = []
    for method, fit in result.methods.items():
        errors = [None] * len(unknowns) if fit.errors is None else fit.errors.tolist()
        pairs = [cell for pair in zip(fit.values.tolist(), errors, strict=True) for cell in pair]
        rows.append([method.replace("_", " "), *pairs, fit.condition_scaled])
    columns = [Column("method")]
    for name in unknowns:
        unit = in_words(TOW_PARAMETERS[name])[1]
        columns += [Column(name, unit), Column("±", unit, digits=2)]
    return Table(caption=caption, columns=[*columns, Column("condition", digits=2)], rows=rows, folded=True)
