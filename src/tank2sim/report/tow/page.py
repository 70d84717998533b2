"""The page of tows: estimates, speeds and residuals, what the tows determine, drag coefficients, theory."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

from numpy.polynomial import Polynomial

from tank2sim.answer.numbers import format_number, without_exponents
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.dynamics.surge import SurgeCoefficients
from tank2sim.dynamics.surge_theory import DragPolynomial, TowedBody, drag_polynomial
from tank2sim.identification.conditioning import COLLINEAR
from tank2sim.identification.tow import paper as tow_paper
from tank2sim.identification.tow.fit import DELAY, TOW_PARAMETERS
from tank2sim.identification.tow.force import force_words
from tank2sim.report.json_values import Json
from tank2sim.report.tow.charts import drag_chart, ellipse_chart, model_chart, tow_speed_chart

_LARGEST_CONDITION = COLLINEAR**2
"""Scaled condition number up to which the unknowns can be distinguished."""

_UNITS = {"M": "kg", "B1": "kg s²/m³", "B2": "kg s/m²", "B3": "kg/m", "delay": "s"}


def tow_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim tow``."""
    best = _best_model(found)
    sections = [_speeds(found), _models(found)]
    if found.get("body"):
        sections += [_drag(found, best), _theory(found, best)]
    sections.append(_estimates(found))
    if found["tow_by_tow"]:
        sections.append(_by_tow(found["tow_by_tow"]))
    count = len(found["speeds"]["measured_mps"])
    tows = f"{count} tows" if count > 1 else "one tow"
    force = force_words(Polynomial(found["force_polynomial"]))
    return Page(
        title="Surge mass and drag from accelerating tows",
        subtitle=f"{PurePath(found['tows']).name}: {tows}, {force}, m = {found['mass_kg']:g} kg",
        verdict=_verdict(found, best),
        figures=_figures(found, best),
        sections=sections,
    )


def _best_model(found: Json) -> Json:
    """The model of the lowest AIC among those that the tows determine and a hull can have; None without any."""
    usable = [model for model in found["models"] if model["drag_nowhere_negative"] and model["determined"]]
    return min(usable, key=lambda model: model["aic"], default=None)


def _label(model: Json) -> str:
    return ", ".join(model["unknowns"])


def _verdict(found: Json, best: Json) -> str:
    if best is None:
        return "These tows determine no model with a drag that a hull can have: more tows, or others, are needed."
    mass, half = best["estimates"]["M"], best["half_widths_95"]["M"]
    text = f"The body moves as {mass:.0f} ± {half:.0f} kg (95 %), of which {mass - found['mass_kg']:.0f} kg is water"
    return f"{text}. These tows determine {_label(best)}, and no more."


def _figures(found: Json, best: Json) -> list[KeyFigure]:
    figures = []
    if best is not None:
        mass, half = best["estimates"]["M"], best["half_widths_95"]["M"]
        note = f"± {half:.0f} kg at 95 %; output error of {_label(best)}"
        figures.append(KeyFigure(label="Total mass M", value=round(mass), unit="kg", note=note))
        label = "Added mass λ₁₁ = M − m"
        added = round(mass - found["mass_kg"])
        figures.append(KeyFigure(label=label, value=added, unit="kg", note="of the same model"))
    if span := found["mass_range_kg"]:
        value = f"{span[0] / 1000:.2f} to {span[1] / 1000:.2f}"
        label = "Range of M that these tows leave"
        figures.append(KeyFigure(label=label, value=value, unit="t", note="over all usable models"))
    worst = max(found["methods"].values(), key=lambda fit: fit["condition_scaled"] or 0.0)
    if worst["condition_scaled"] is not None:
        condition = float(f"{worst['condition_scaled']:.2g}")
        verdict = Verdict.PASSED if condition <= _LARGEST_CONDITION else Verdict.CAUTION
        note = f"scaled; at most {_LARGEST_CONDITION:g} distinguishes them"
        label = f"Condition number of {', '.join(worst['estimated'])}"
        figures.append(KeyFigure(label=label, value=condition, note=note, verdict=verdict, limit=_LARGEST_CONDITION))
    return figures


_METHODS = {"paper": "as published", "qr": "least squares", "output_error": "output error"}

_ESTIMATES = (
    "M dv/dt + B1 v⁴ + B2 v³ + B3 v² = T. The published method and least squares put a polynomial through the mean "
    "speeds and solve this equation for it; output error integrates the equation and fits all "
    "readings. ± is one standard error. A force that is wrong by one per cent makes all of them wrong by one per "
    "cent: a constant force next to T cannot be found."
)
_FIT_ROWS = (
    ("root of the integrated square error, N √s", "J"),
    ("condition number, scaled", "condition_scaled"),
    ("largest speed error, m/s", "largest_speed_error_mps"),
)


def _estimates(found: Json) -> Section:
    methods = found["methods"]
    columns = [Column(title="")]
    for name in methods:
        columns += [Column(title=_METHODS.get(name, name), digits=5), Column(title="±", digits=2)]
    names = {key: name for name, key in TOW_PARAMETERS.items()} | {"added_mass_kg": "added mass"}
    rows: list[list[Cell]] = []
    keys = dict.fromkeys(key for fit in methods.values() for key in fit["estimates"] if key != "added_mass_kg")
    for key in (*keys, "added_mass_kg"):
        cells = [cell for fit in methods.values() for cell in _cells(fit, key)]
        rows.append([f"{names[key]}, {_UNITS.get(names[key], 'kg')}", *cells])
    for title, key in _FIT_ROWS:
        rows.append([title, *(cell for fit in methods.values() for cell in (_text(fit[key], 5), None))])
    tables = [Table(caption="Estimates by method", columns=columns, rows=rows), _polynomials(found)]
    return Section(heading="Estimates by method", text=_ESTIMATES, tables=tables, folded=True)


def _cells(fit: Json, key: str) -> tuple[Cell, Cell]:
    """An estimate and its standard error as text: each row has its own unit, so no decimals in common."""
    error = fit["standard_errors"].get(key)
    return _text(fit["estimates"].get(key), 5), _text(float(f"{error:.2g}"), 5) if error else None


def _text(value: float | None, digits: int) -> Cell:
    return None if value is None else format_number(float(f"{value:.{digits}g}"), digits)


def _half_width(value: float | None) -> str:
    return "unknown" if value is None else format_number(value, 2)


def _polynomials(found: Json) -> Table:
    heads = ("degree", "α₀", "α₁", "α₂", "α₃", "rms", "rms by n − 1")
    columns = [Column(title=head, unit="m/s" if head.startswith("rms") else "", digits=4) for head in heads]
    rows: list[list[Cell]] = []
    printed = found["tows_of_the_paper"]
    for polynomial in found["speed_polynomials"]:
        degree = polynomial["degree"]
        absent = [None] * (3 - degree)
        errors = polynomial["rms_mps"], polynomial["rms_less_one_mps"]
        rows.append([f"{degree}", *polynomial["coefficients"], *absent, *errors])
        if printed:
            values, error = tow_paper.TABLE_2[degree]
            rows.append([f"{degree}, printed", *values, *absent, error, None])
    source = ", next to the printed ones, which no single change of the printed readings gives" if printed else ""
    caption = f"Polynomials v = α₀ + α₁ t + ... through the mean speeds, m/s over s{source}"
    return Table(caption=caption, columns=columns, rows=rows)


def _speeds(found: Json) -> Section:
    """Readings, simulated speeds and their differences, and what the reader of the result must not miss."""
    heading, speeds = "Measured and computed speeds", found["speeds"]
    notes = [without_exponents(note) for note in found["warnings"]]
    if not speeds["simulated_mps"]:
        return Section(heading=heading, notes=notes)
    chart = tow_speed_chart(speeds, title="Speeds of the tows and of the models")
    caption = f"Below, everything less {next(iter(speeds['simulated_mps']))}."
    return Section(heading=heading, charts=[Illustration(chart=chart, caption=caption)], notes=notes)


def _models(found: Json) -> Section:
    columns = [
        Column(title="model"),
        Column(title="estimates with 95 % half-widths"),
        Column(title="scatter", unit="m/s", digits=3),
        Column(title="AIC"),
        Column(title="condition, scaled", digits=2),
        Column(title="drag nowhere negative"),
    ]
    rows: list[list[Cell]] = []
    for model in found["models"]:
        halves = model["half_widths_95"]
        estimates = [
            f"{name} {format_number(value)} ± {_half_width(halves[name])}" for name, value in model["estimates"].items()
        ]
        condition = model["condition_scaled"]
        numbers = [model["scatter_mps"], round(model["aic"], 1), condition and float(f"{condition:.2g}")]
        rows.append([_label(model), "; ".join(estimates), *numbers, model["drag_nowhere_negative"]])
    charts = [Illustration(chart=model_chart(found["models"]), caption=_MODELS)] if found["models"] else []
    if found["confidence_ellipses"]:
        chart = ellipse_chart(found["confidence_ellipses"], found["tow_by_tow"])
        charts.append(Illustration(chart=chart, caption=_ELLIPSES))
    return Section(
        heading="What these tows determine",
        text="The same readings by output error with fewer and with more unknowns (SI units; delay: the body starts so "
        "much later than t = 0).",
        tables=[Table(caption="Models by output error", columns=columns, rows=rows, folded=True)],
        charts=charts,
    )


_MODELS = (
    "A lower AIC is a better fit for the number of unknowns; it counts readings as independent, and differences below "
    "4 say little. A model whose unknowns cannot be distinguished, or whose drag pushes, is only a curve."
)
_ELLIPSES = (
    "Regions are linearised and take the readings as independent; the points are the same models fitted to each tow by "
    "itself. A region long and slanting means that mass and drag are known together only. Where the two regions part, "
    "the start decides."
)


def _by_tow(by_tow: Mapping[str, Json]) -> Section:
    tables = []
    for label, subset in by_tow.items():
        columns = [Column(title=""), *(Column(title=name, unit=_UNITS[name]) for name in subset["unknowns"])]
        rows: list[list[Cell]] = [
            ["all tows", *subset["together"]],
            *([f"tow {number} alone", *row] for number, row in enumerate(subset["alone"], 1)),
            *([f"all but tow {number}", *row] for number, row in enumerate(subset["left_out"], 1)),
            ["standard error, one left out in turn", *subset["jackknife_standard_errors"]],
            ["the same, 95 % half-width", *subset["jackknife_half_widths_95"]],
            ["standard error, spread of the tows", *subset["spread_standard_errors"]],
        ]
        tables.append(Table(caption=label[0].upper() + label[1:], columns=columns, rows=rows))
    return Section(
        heading="Tow by tow",
        text="Each tow by itself, and one left out in turn. These errors hold "
        "also where the readings of one tow err together.",
        tables=tables,
        folded=True,
    )


_ORDERS = (("A1", "s²/m²"), ("A2", "s/m"), ("A3", ""))


def _drag(found: Json, best: Json) -> Section:
    body = TowedBody(**found["body"])
    drags = {
        _METHODS.get(name, name): DragPolynomial(**drag["by_length_squared"])
        for name, drag in found["drag_coefficients"].items()
        if name != "paper" or "qr" not in found["drag_coefficients"]
    }
    if best is not None:
        values = {TOW_PARAMETERS[name]: value for name, value in best["estimates"].items() if name != DELAY}
        drag_of_best = drag_polynomial(SurgeCoefficients(**values), body)
        if drag_of_best not in drags.values():
            drags[f"best usable: {_label(best)}"] = drag_of_best
    if found["tows_of_the_paper"]:
        drags["as printed"] = drag_polynomial(tow_paper.SOLUTION, body)
    columns = [Column(title="")]
    for area in ("L²", "V^(2/3)"):
        columns += [Column(title=f"{name} by {area}", unit=unit) for name, unit in _ORDERS]
    rows: list[list[Cell]] = [
        [name, *drag.as_json().values(), *drag.times(body.area_ratio).as_json().values()]
        for name, drag in drags.items()
    ]
    table = Table(caption="C = A1 v² + A2 v + A3", columns=columns, rows=rows, folded=True)
    chart = drag_chart(drags, body, found["top_speed_mps"])
    viscosity = format_number(body.viscosity_m2ps)
    caption = (
        f"L = {body.length_m:g} m, V = {body.volume_m3:.4g} m³, ν = {viscosity} m²/s. The frame is that of "
        "the curves that stay above zero; no hull has a coefficient below zero."
    )
    return Section(heading="Drag coefficient", tables=[table], charts=[Illustration(chart=chart, caption=caption)])


def _theory(found: Json, best: Json) -> Section:
    columns = [
        Column(title="k₁₁ of"),
        Column(title="k₁₁", digits=4),
        Column(title="(1 + k₁₁) ρ V", unit="kg"),
        Column(title="near the surface, M_s", unit="kg"),
    ]
    rows: list[list[Cell]] = [
        [mass["basis"], mass["k11"], round(mass["deep_kg"]), round(mass["near_surface_kg"])]
        for mass in found["mass_by_theory"]
    ]
    estimate = ""
    if best is not None:
        mass, half = best["estimates"]["M"], best["half_widths_95"]["M"]
        estimate = f" The tows give {mass:.0f} ± {half:.0f} kg by the best usable model."
    return Section(
        heading="Mass by theory",
        text="M_s = k* (1 + k₁₁) ρ V, with Lamb's k₁₁ of ellipsoids and the published k* = 0.96 for the free surface. "
        "The published k₁₁ of 0.156 belongs to a spheroid 2.5 times as long as thick." + estimate,
        tables=[Table(caption="Mass in surge by theory", columns=columns, rows=rows)],
    )
