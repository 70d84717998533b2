"""The page of tows: estimates, speeds and residuals, what the tows can tell, drag coefficients, theory."""

from __future__ import annotations

from tank2sim.dynamics.surge_theory import DragPolynomial, TowedBody, drag_polynomial
from tank2sim.files import plain_json
from tank2sim.identification.tow import paper as tow_paper
from tank2sim.identification.tow.fit import TOW_PARAMETERS, TowFit
from tank2sim.identification.tow.force import force_words
from tank2sim.identification.tow.study import TowStudy
from tank2sim.report.kit.json_values import Json
from tank2sim.report.kit.numbers import format_number
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable
from tank2sim.report.tow.charts import drag_chart, ellipse_chart, model_chart, tow_speed_chart

_UNITS = {"M": "kg", "B1": "kg s²/m³", "B2": "kg s/m²", "B3": "kg/m", "delay": "s"}


def tow_page(study: TowStudy) -> Page:
    """The page of a study."""
    result = study.result
    sections = [_estimates(study), _speeds(study), _models(study)]
    if study.by_tow:
        sections.append(_by_tow(study))
    if study.body is not None:
        sections.append(_drag(study))
        sections.append(_theory(study))
    tows = f"{len(result.tows.names)} tows" if len(result.tows.names) > 1 else "one tow"
    return Page(
        title="Surge mass and drag from accelerating tows",
        subtitle=f"{result.tows.path.name}: {tows}, {force_words(result.force)}, m = {result.mass_kg:g} kg",
        figures=_figures(study),
        sections=sections,
    )


def _figures(study: TowStudy) -> list[KeyFigure]:
    result, best, span = study.result, study.best, study.mass_range_kg
    figures = []
    if best is not None:
        mass, half = float(best.fit.estimates[0]), best.fit.half_widths[0]
        note = f"± {half:.0f} kg at 95 %; output error of {best.model.label}"
        figures.append(KeyFigure(label="Total mass M", value=round(mass), unit="kg", note=note))
        label = "Added mass λ₁₁ = M − m"
        figures.append(KeyFigure(label=label, value=round(mass - result.mass_kg), unit="kg", note="of the same model"))
    if span is not None:
        value = f"{span[0] / 1000:.2f} to {span[1] / 1000:.2f}"
        figures.append(
            KeyFigure(label="What these tows fix of M", value=value, unit="t", note="over all usable models")
        )
    worst = max(result.fits.values(), key=lambda fit: fit.condition_scaled)
    note = f"scaled, of {', '.join(worst.free)}; 900 can be borne"
    figures.append(KeyFigure(label="Largest condition number", value=float(f"{worst.condition_scaled:.2g}"), note=note))
    return figures


def _estimates(study: TowStudy) -> PageSection:
    result = study.result
    columns = [Column(title="")]
    for name in result.fits:
        columns += [Column(title=name.replace("_", " "), digits=5), Column(title="±", digits=2)]
    unknowns = dict.fromkeys(name for fit in result.fits.values() for name in fit.unknowns)
    rows: list[list[Cell]] = []
    for name in (*unknowns, "added mass"):
        unit = _UNITS.get(name, "kg")
        key = TOW_PARAMETERS.get(name, "added_mass_kg")
        cells = [cell for fit in result.fits.values() for cell in _cells(fit, key)]
        rows.append([f"{name}, {unit}", *cells])
    more = (
        ("J of (1.6), N √s", "J"),
        ("condition number, scaled", "condition_scaled"),
        ("largest speed error, m/s", "largest_speed_error_mps"),
    )
    for words, attribute in more:
        rows.append([words, *(c for fit in result.fits.values() for c in (_short(getattr(fit, attribute)), None))])
    text = (
        "M dv/dt + B1 v⁴ + B2 v³ + B3 v² = T (1.5). The method of the paper and QR put a polynomial through the mean "
        "speeds and solve the least squares of the equation; output error integrates the equation and fits all "
        "readings. ± is one standard error. A force that is wrong by one per cent makes all of them wrong by one per "
        "cent: a constant force next to T cannot be found."
    )
    tables = [PageTable(caption="Estimates by method", columns=columns, rows=[[_text(c) for c in row] for row in rows])]
    return PageSection(heading="Estimates", text=text, tables=[*tables, _polynomials(study)], notes=study.notes)


def _cells(fit: TowFit, key: str) -> tuple[Cell, Cell]:
    if key not in fit.estimates:
        return None, None
    error = fit.standard_errors.get(key)
    return _short(fit.estimates[key]), float(f"{error:.2g}") if error else None


def _short(value: float) -> float:
    return float(f"{value:.5g}")


def _text(cell: Cell) -> Cell:
    # Rows have units of their own, so that the numbers of a column have no common decimals.
    return format_number(cell, 5) if isinstance(cell, float) else cell


def _polynomials(study: TowStudy) -> PageTable:
    heads = ("degree", "α₀", "α₁", "α₂", "α₃", "rms", "rms by n − 1")
    columns = [Column(title=head, unit="m/s" if head.startswith("rms") else "", digits=4) for head in heads]
    rows: list[list[Cell]] = []
    printed = tow_paper.are_of_the_paper(study.result.tows)
    for polynomial in study.polynomials:
        coefficients: list[Cell] = [*polynomial.coefficients, *[None] * (3 - polynomial.degree)]
        rows.append([f"{polynomial.degree}", *coefficients, polynomial.rms_mps, polynomial.rms_less_one_mps])
        if printed:
            values, error = tow_paper.TABLE_2[polynomial.degree]
            rows.append([f"{polynomial.degree}, printed", *values, *[None] * (3 - polynomial.degree), error, None])
    caption = "Polynomials v = α₀ + α₁ t + ... through the mean speeds, m/s over s"
    beside = ", next to Table 2 of the paper, which no single change of its Table 1 gives" if printed else ""
    return PageTable(caption=caption + beside, columns=columns, rows=rows)


def _speeds(study: TowStudy) -> PageSection:
    return PageSection(
        heading="Speeds and residuals", charts=speed_illustrations(plain_json(study.as_json()["speeds"]))
    )


def speed_illustrations(speeds: Json) -> list[Illustration]:
    """Readings, simulated speeds and what is between them, from ``speeds`` of the JSON."""
    if not speeds["simulated_mps"]:
        return []
    chart = tow_speed_chart(speeds, title="Speeds of the tows and of the models")
    return [Illustration(chart=chart, caption=f"Below, everything less {next(iter(speeds['simulated_mps']))}.")]


def model_illustrations(found: Json) -> list[Illustration]:
    """Models of different size and joint regions of M and B3, from the JSON of a study."""
    charts = [Illustration(chart=model_chart(found["models"]), caption=_MODELS)] if found["models"] else []
    if found["confidence_ellipses"]:
        chart = ellipse_chart(found["confidence_ellipses"], found["tow_by_tow"])
        charts.append(Illustration(chart=chart, caption=_ELLIPSES))
    return charts


def tows_drawn(found: Json) -> list[PageSection]:
    """The charts of a study, from its JSON."""
    charts = [*speed_illustrations(found["speeds"]), *model_illustrations(found)]
    if body := found.get("body"):
        drags = {
            name.replace("_", " "): DragPolynomial(**one["by_length_squared"])
            for name, one in found["drag_coefficients"].items()
            if name != "paper" or "qr" not in found["drag_coefficients"]
        }
        charts.append(Illustration(chart=drag_chart(drags, TowedBody(**body), found["top_speed_mps"])))
    return [PageSection(heading="Speeds, models and drag", charts=charts)]


def _models(study: TowStudy) -> PageSection:
    columns = [
        Column(title="model"),
        Column(title="estimates with 95 % half-widths"),
        Column(title="scatter", unit="m/s", digits=3),
        Column(title="AIC"),
        Column(title="condition, scaled", digits=2),
        Column(title="drag nowhere negative"),
    ]
    rows: list[list[Cell]] = []
    for model in study.models:
        fit = model.fit
        messages = [
            f"{name} {format_number(float(value))} ± {format_number(float(half), 2)}"
            for name, value, half in zip(model.model.unknowns, fit.estimates, fit.half_widths, strict=True)
        ]
        aic, condition = round(fit.aic, 1), float(f"{fit.condition_scaled:.2g}")
        rows.append([model.model.label, "; ".join(messages), fit.scatter_mps, aic, condition, model.plausible])
    charts = model_illustrations(plain_json(study.as_json()))
    return PageSection(
        heading="What these tows can tell",
        text="The same readings by output error with fewer and with more unknowns (SI units; delay: the body starts so "
        "much later than t = 0).",
        tables=[PageTable(caption="Models by output error", columns=columns, rows=rows)],
        charts=charts,
    )


_MODELS = (
    "A lower AIC is a better fit for the number of unknowns; it counts readings as independent, and differences below "
    "4 say little. A model whose unknowns cannot be distinguished, or whose drag pushes, is no more than a curve."
)
_ELLIPSES = (
    "Regions are linearised and take the readings as independent; the points are the same models fitted to each tow by "
    "itself. A region long and slanting means that mass and drag are known together only. Where the two regions part, "
    "the start decides."
)


def _by_tow(study: TowStudy) -> PageSection:
    tables = []
    for way in study.by_tow:
        columns = [Column(title="")]
        columns += [Column(title=name, unit=_UNITS[name]) for name in way.unknowns]
        rows: list[list[Cell]] = [["all tows", *way.together.tolist()]]
        numbers = range(1, len(way.alone) + 1)
        rows += [[f"tow {n} alone", *row.tolist()] for n, row in zip(numbers, way.alone, strict=True)]
        rows += [[f"all but tow {n}", *row.tolist()] for n, row in zip(numbers, way.held_out, strict=True)]
        rows.append(["standard error, one left out in turn", *way.jackknife_errors.tolist()])
        rows.append(["the same, 95 % half-width", *way.half_widths.tolist()])
        rows.append(["standard error, spread of the tows", *way.spread_errors.tolist()])
        tables.append(PageTable(caption=way.label[0].upper() + way.label[1:], columns=columns, rows=rows))
    return PageSection(
        heading="Tow by tow",
        text="Each tow by itself, as the authors wish for at their end, and one left out in turn. These errors hold "
        "also where the readings of one tow err together.",
        tables=tables,
    )


def _drag(study: TowStudy) -> PageSection:
    assert study.body is not None
    drags = {
        name.replace("_", " "): own for name, own in study.drags.items() if name != "paper" or "qr" not in study.drags
    }
    if study.best is not None:
        best = drag_polynomial(study.best.coefficients, study.body)
        if best not in drags.values():
            drags[f"best usable: {study.best.model.label}"] = best
    if tow_paper.are_of_the_paper(study.result.tows):
        drags["paper, printed (2.4)"] = drag_polynomial(tow_paper.SOLUTION, study.body)
    columns = [Column(title="")]
    for area in ("L²", "V^(2/3)"):
        columns += [Column(title=f"{name} by {area}", unit=unit) for name, unit in _ORDERS]
    rows: list[list[Cell]] = [
        [name, *own.as_json().values(), *own.times(study.body.area_ratio).as_json().values()]
        for name, own in drags.items()
    ]
    table = PageTable(caption="C = A1 v² + A2 v + A3 (1.3)", columns=columns, rows=rows)
    chart = drag_chart(drags, study.body, study.result.tows.top_speed_mps)
    viscosity = format_number(study.body.viscosity_m2ps)
    caption = (
        f"L = {study.body.length_m:g} m, V = {study.body.volume_m3:.4g} m³, ν = {viscosity} m²/s. The frame is that of "
        "the curves that stay above zero; a coefficient below zero is that of no hull."
    )
    return PageSection(heading="Drag coefficient", tables=[table], charts=[Illustration(chart=chart, caption=caption)])


_ORDERS = (("A1", "s²/m²"), ("A2", "s/m"), ("A3", ""))


def _theory(study: TowStudy) -> PageSection:
    columns = [
        Column(title="k₁₁ of"),
        Column(title="k₁₁", digits=4),
        Column(title="(1 + k₁₁) ρ V", unit="kg"),
        Column(title="near the surface, M_s", unit="kg"),
    ]
    rows: list[list[Cell]] = [
        [one.basis, one.k11, round(one.deep_kg), round(one.near_surface_kg)] for one in study.theory
    ]
    found = ""
    if study.best is not None:
        mass, half = study.best.fit.estimates[0], study.best.fit.half_widths[0]
        found = f" The tows give {mass:.0f} ± {half:.0f} kg by the best usable model."
    return PageSection(
        heading="Mass by theory",
        text="M_s = k* (1 + k₁₁) ρ V (2.5), with Lamb's k₁₁ of ellipsoids and k* = 0.96 for the free surface as in the "
        "paper. Its k₁₁ of 0.156 belongs to a spheroid 2.5 times as long as thick." + found,
        tables=[PageTable(caption="Mass in surge by (2.5)", columns=columns, rows=rows)],
    )
