"""The page of the yaw rig: record and programme, energy balance, estimates by method, residuals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from tank2sim.answer.numbers import format_number
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.identification.yaw.identify import YAW_METHODS
from tank2sim.identification.yaw.intervals import ENERGY_TERMS
from tank2sim.report.json_values import Json
from tank2sim.report.yaw.charts import (
    angle_residual_chart,
    balance_chart,
    energy_residual_chart,
    estimates_chart,
    record_chart,
)

_HOW = {
    "energy_least_squares": "all subintervals, measured speeds, the programme for instruments",
    "as_many_equations": "as many equations as unknowns: an interval, and sums over three parts",
    "two_intervals": "an accelerating and a braking interval, measured speeds",
    "output_error": "equation of motion integrated, fitted to the angle",
    "energy_least_squares_reference": "all subintervals, the programme's speeds",
    "two_intervals_reference": "an accelerating and a braking interval, the programme's speeds",
}


_ESTIMATES = (
    "Inertia and dissipation of one accelerating interval. Bars are 95 % intervals of scatter; a bias that is the same "
    "in every pair of intervals is not in them."
)
_BALANCE = "Over each part of the intervals the work of the motor is kinetic energy plus what friction and water take."
_ANGLE = (
    "The equation of motion, integrated under the recorded current from a start of its own for each hump, less the "
    "recorded angle."
)


def yaw_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim yaw``."""
    estimates = Illustration(chart=estimates_chart(found["methods"]), caption="Dashed: the energy least squares.")
    balance = Illustration(
        chart=balance_chart(found["energy_balance"]), caption="The mean over all pairs of intervals."
    )
    residuals = Illustration(chart=energy_residual_chart(found["energy_residuals"]))
    records = [Illustration(chart=record_chart(name, columns)) for name, columns in found["histories"].items()]
    sections = [
        Section(
            heading="Estimates by method",
            text=_ESTIMATES,
            tables=[_estimates(found["methods"])],
            charts=[estimates],
            notes=found["notes"],
        ),
        Section(heading="Energy balance", text=_BALANCE, tables=[_friction(found)], charts=[balance, residuals]),
        Section(heading="Record and programme", text="The rate is shown where it is evaluated.", charts=records),
    ]
    if residual := found["angle_residual"]:
        chart = Illustration(chart=angle_residual_chart(residual))
        sections.append(Section(heading="Nonlinear least squares", text=_ANGLE, charts=[chart]))
    names = ", ".join(PurePath(record).name for record in found["records"])
    return Page(
        title="Added yaw inertia by the energy method",
        subtitle=f"{names}, in {found['medium']}",
        verdict=_verdict(found),
        figures=_figures(found),
        sections=[*sections, *_theory(found.get("theory") or ())],
    )


def _theory(values: Sequence[Json]) -> list[Section]:
    if not values:
        return []
    columns = [
        Column(title="formula"),
        Column(title="added inertia", unit="10⁻⁴ kg m²", digits=5),
        Column(title="as printed", unit="10⁻⁴ kg m²", digits=5),
        Column(title="remark"),
    ]
    rows: list[list[Cell]] = [
        [value["formula"], _scaled(value["value_kgm2"]), _scaled(value["printed_kgm2"]), value["remark"]]
        for value in values
    ]
    text = "Added yaw inertia from the body's form, by the formulas of Alyshev (2019)."
    table = Table(caption="From the form", columns=columns, rows=rows)
    return [Section(heading="Theory", text=text, tables=[table])]


def _scaled(value: float | None) -> float | None:
    """A value in 10⁻⁴ of its unit."""
    return None if value is None else 1e4 * value


def _verdict(found: Json) -> str:
    best = found["methods"][YAW_METHODS[0]]
    kind = "total" if best["added_inertia_kgm2"] is None else "added"
    inertia, error = best[f"{kind}_inertia_kgm2"], best[f"{kind}_inertia_standard_error_kgm2"]
    shown = f"{1e4 * inertia:.4g}" if error is None else f"({1e4 * inertia:.4g} ± {1e4 * error:.2g})"
    return f"The {kind} yaw inertia is {shown} · 10⁻⁴ kg m² by the energy least squares; ± is one standard error."


def _figures(found: Json) -> list[KeyFigure]:
    best = found["methods"][YAW_METHODS[0]]
    kind = "total" if best["added_inertia_kgm2"] is None else "added"
    inertia, error = best[f"{kind}_inertia_kgm2"], best[f"{kind}_inertia_standard_error_kgm2"]
    bias = 100 * (found["methods"]["two_intervals"].get("bias_against_least_squares_kgm2") or 0.0)
    bias /= best["total_inertia_kgm2"]
    return [
        KeyFigure(
            label="Added yaw inertia" if kind == "added" else "Yaw inertia",
            value=float(f"{1e4 * inertia:.5g}"),
            unit="10⁻⁴ kg m²",
            note="energy least squares" + (f", ± {1e4 * error:.2g}" if error is not None else ""),
        ),
        KeyFigure(
            label="Dissipation B + D",
            value=float(f"{1e4 * best['dissipation_J']:.4g}"),
            unit="10⁻⁴ J",
            note=f"± {1e4 * (best['dissipation_standard_error_J'] or 0):.2g}",
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
            value=float(f"{100 * max(found['mirror_difference']):.3g}"),
            unit="%",
            note="of the largest rate, in the worst pair",
        ),
    ]


_COLUMNS = (
    ("added inertia", "10⁻⁴ kg m²", 5, "added_inertia_kgm2"),
    ("±", "", 3, "added_inertia_standard_error_kgm2"),
    ("total inertia", "10⁻⁴ kg m²", 5, "total_inertia_kgm2"),
    ("B + D", "10⁻⁴ J", 4, "dissipation_J"),
    ("±", "", 3, "dissipation_standard_error_J"),
    ("bias", "10⁻⁴ kg m²", 3, "bias_against_least_squares_kgm2"),
)


def _estimates(methods: Json) -> Table:
    rows: list[list[Cell]] = [
        [method.replace("_", " "), _HOW[method], *(_scaled(estimate.get(key)) for *_, key in _COLUMNS)]
        for method, estimate in methods.items()
    ]
    columns = [Column(title=title, unit=unit, digits=digits) for title, unit, digits, _ in _COLUMNS]
    heads = [Column(title="method"), Column(title="how")]
    return Table(caption="Estimates with standard errors", columns=[*heads, *columns], rows=rows, folded=True)


def _friction(found: Json) -> Table:
    """A row for each term, a column for each method that gives it."""
    _, *terms = found["energy_balance"]["spent_J"]
    units = {term: ENERGY_TERMS[term][1] for term in terms}
    methods = {
        name: estimate
        for name, estimate in found["methods"].items()
        if any(f"{term}_{unit}" in estimate for term, unit in units.items())
    }
    rows: list[list[Cell]] = []
    for term, unit in units.items():
        row: list[Cell] = [term.replace("_", " "), _UNITS[unit]]
        for estimate in methods.values():
            value, error = _scaled(estimate.get(f"{term}_{unit}")), estimate.get(f"{term}_standard_error_{unit}")
            shown = None if value is None else format_number(value)
            row.append(shown if error is None else f"{shown} ± {format_number(1e4 * error, 2)}")
        rows.append(row)
    columns = [Column(title=title) for title in ("term", "unit", *(name.replace("_", " ") for name in methods))]
    return Table(caption="Friction and water, times 10⁴", columns=columns, rows=rows, folded=True)


_UNITS = {"Nm": "N m", "Nms": "N m s", "Nms2": "N m s²", "kgm2": "kg m²"}
