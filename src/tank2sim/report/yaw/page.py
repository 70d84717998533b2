"""The page of the yaw rig: record and programme, energy balance, estimates by method, residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from tank2sim.dynamics.yaw_theory import TheoryValue
from tank2sim.files import plain_json
from tank2sim.identification.yaw.identify import YAW_METHODS, YawIdentification
from tank2sim.identification.yaw.intervals import ENERGY_TERMS
from tank2sim.report.kit.json_values import Json
from tank2sim.report.kit.numbers import format_number
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable, Verdict
from tank2sim.report.yaw.charts import (
    angle_residual_chart,
    balance_chart,
    energy_residual_chart,
    estimates_chart,
    record_chart,
)

_HOW = {
    "energy_least_squares": "all subintervals, measured speeds, the programme for instruments",
    "as_many_equations": "(1) and sums (2) of three parts",
    "two_intervals": "(1) and (2), measured speeds",
    "output_error": "(3) integrated, fitted to the angle",
    "energy_least_squares_reference": "all subintervals, the programme's speeds",
    "two_intervals_reference": "(1) and (2), the programme's speeds",
}


def yaw_page(result: YawIdentification, theory: Sequence[TheoryValue] = ()) -> Page:
    """The page of a result, and what `theory` gives for the body's form."""
    names = ", ".join(record.path.name for record in result.records)
    estimates, balance, *more = yaw_drawn(plain_json(result.as_json()))
    return Page(
        title="Added yaw inertia by the energy method",
        subtitle=f"{names}, in {result.medium}",
        figures=_figures(result),
        sections=[
            replace(estimates, tables=[_estimates(result)], notes=result.notes),
            replace(balance, tables=[_friction(result)]),
            *more,
            *_theory(theory),
        ],
    )


def yaw_drawn(found: Json) -> list[PageSection]:
    """The sections with the charts of a result, from its JSON: estimates, energy balance, record and, where it is
    known, what the integrated equation leaves of the angle."""
    records = [Illustration(chart=record_chart(name, columns)) for name, columns in found["histories"].items()]
    estimates = Illustration(chart=estimates_chart(found["methods"]), caption="Dashed: the energy least squares.")
    balance = Illustration(
        chart=balance_chart(found["energy_balance"]), caption="The mean over all pairs of intervals."
    )
    residuals = Illustration(chart=energy_residual_chart(found["energy_residuals"]))
    sections = [
        PageSection(heading="Estimates by method", text=_ESTIMATES, charts=[estimates]),
        PageSection(heading="Energy balance", text=_BALANCE, charts=[balance, residuals]),
        PageSection(heading="Record and programme", text="The rate is shown where it is evaluated.", charts=records),
    ]
    if found["angle_residual"]:
        chart = Illustration(chart=angle_residual_chart(found["angle_residual"]))
        sections.append(PageSection(heading="Nonlinear least squares", text=_ANGLE, charts=[chart]))
    return sections


_ESTIMATES = (
    "Inertia and dissipation of one accelerating interval. Bars are 95 % intervals of scatter; a bias that is the same "
    "in every pair of intervals is not in them."
)
_BALANCE = "Over each part of the intervals the work of the motor is kinetic energy plus what friction and water take."
_ANGLE = (
    "Equation (3) integrated under the recorded current from a start of its own for each hump, less the recorded angle."
)


def _theory(values: Sequence[TheoryValue]) -> list[PageSection]:
    if not values:
        return []
    columns = [
        Column(title="formula"),
        Column(title="added inertia", unit="10⁻⁴ kg m²", digits=5),
        Column(title="paper's Table 1", unit="10⁻⁴ kg m²", digits=5),
        Column(title="remark"),
    ]
    rows: list[list[Cell]] = [
        [
            own.formula,
            1e4 * own.value_kgm2,
            None if own.printed_kgm2 is None else 1e4 * own.printed_kgm2,
            own.remark,
        ]
        for own in values
    ]
    text = "Added yaw inertia from the body's form, by the formulas (7), (8) and (9) of Alyshev (2019)."
    return [
        PageSection(
            heading="Theory", text=text, tables=[PageTable(caption="From the form", columns=columns, rows=rows)]
        )
    ]


def _figures(result: YawIdentification) -> list[KeyFigure]:
    best = result.estimates[YAW_METHODS[0]]
    added = result.added_inertia(YAW_METHODS[0])
    value, error = added or (best.total_inertia_kgm2, best.inertia_error_kgm2)
    worst = 100 * max(result.mirror)
    two = result.estimates["two_intervals"]
    bias = 100 * (two.bias_kgm2 or 0.0) / best.total_inertia_kgm2
    return [
        KeyFigure(
            label="Added yaw inertia" if added else "Yaw inertia",
            value=float(f"{1e4 * value:.5g}"),
            unit="10⁻⁴ kg m²",
            note="energy least squares" + (f", ± {1e4 * error:.2g}" if error is not None else ""),
        ),
        KeyFigure(
            label="Dissipation B + D",
            value=float(f"{1e4 * best.dissipation_J:.4g}"),
            unit="10⁻⁴ J",
            note=f"± {1e4 * (best.dissipation_error_J or 0):.2g}",
        ),
        KeyFigure(
            label="Bias of the two-interval formula",
            value=float(f"{bias:.2g}"),
            unit="%",
            note="of the total inertia",
            verdict=Verdict.CAUTION if abs(bias) > 1 else Verdict.NONE,
        ),
        KeyFigure(
            label="Mirror images differ by",
            value=float(f"{worst:.3g}"),
            unit="%",
            note="of the largest rate, in the worst pair",
        ),
    ]


def _estimates(result: YawIdentification) -> PageTable:
    rows: list[list[Cell]] = []
    for method, estimate in result.estimates.items():
        added, error = result.added_inertia(method) or (None, None)
        bias = estimate.bias_kgm2
        numbers = (
            added,
            error,
            estimate.total_inertia_kgm2,
            estimate.dissipation_J,
            estimate.dissipation_error_J,
            bias,
        )
        scaled = [None if number is None else 1e4 * number for number in numbers]
        rows.append([method.replace("_", " "), _HOW[method], *scaled])
    heads = ("method", "how", "added inertia", "±", "total inertia", "B + D", "±", "bias")
    units = ("", "", "10⁻⁴ kg m²", "", "10⁻⁴ kg m²", "10⁻⁴ J", "", "10⁻⁴ kg m²")
    digits = (4, 4, 5, 3, 5, 4, 3, 3)
    columns = [
        Column(title=head, unit=unit, digits=count) for head, unit, count in zip(heads, units, digits, strict=True)
    ]
    return PageTable(caption="Estimates with standard errors", columns=columns, rows=rows)


def _friction(result: YawIdentification) -> PageTable:
    """A row for each term, a column for each method that gives it."""
    methods = [method for method, estimate in result.estimates.items() if estimate.friction]
    rows: list[list[Cell]] = []
    for term in result.fit.balance.terms[1:]:
        row: list[Cell] = [term.replace("_", " "), _UNITS[ENERGY_TERMS[term][1]]]
        for method in methods:
            value, error = result.estimates[method].friction.get(term, (None, None))
            shown = None if value is None else format_number(1e4 * value)
            row.append(shown if error is None else f"{shown} ± {format_number(1e4 * error, 2)}")
        rows.append(row)
    columns = [Column(title="term"), Column(title="unit"), *(Column(title=name.replace("_", " ")) for name in methods)]
    return PageTable(caption="Friction and water, times 10⁴", columns=columns, rows=rows)


_UNITS = {"Nm": "N m", "Nms": "N m s", "Nms2": "N m s²", "kgm2": "kg m²"}
