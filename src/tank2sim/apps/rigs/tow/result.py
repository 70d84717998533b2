"""Result of ``tow``: surge mass and drag of a towed body, models that the tows determine, and theory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import PurePath
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_layers, look_of
from tank2sim.answer.charts.motion import History, Signal, history_chart
from tank2sim.answer.charts.parts import plain, series_look, vector
from tank2sim.answer.charts.rows import RowPlot, row_layers
from tank2sim.answer.charts.vega import STACKS, ChartRecord, ChartSpec, PlotAxis, Rule, layered
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import (
    Cell,
    Column,
    Illustration,
    KeyFigure,
    Section,
    Table,
    Verdict,
    data_frame,
    records_table,
    table,
)
from tank2sim.answer.result import Result
from tank2sim.apps.rigs.tow import paper as tow_paper
from tank2sim.apps.rigs.tow.findings import TowFit
from tank2sim.apps.rigs.tow.identify import tow_card_text
from tank2sim.apps.rigs.tow.records import force_words
from tank2sim.apps.rigs.tow.study import Ellipse, FittedModel, TowByTow, TowSpeeds, TowStudy
from tank2sim.apps.rigs.tow.surge import TOW_PARAMETERS
from tank2sim.apps.rigs.tow.theory import DragPolynomial, TowedBody, drag_polynomial
from tank2sim.cards import Card, parse_card
from tank2sim.errors import ArgumentError
from tank2sim.identification.conditioning import COLLINEAR
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd


_LARGEST_CONDITION = COLLINEAR**2
"""Scaled condition number up to which the unknowns can be distinguished."""

_UNITS = {name: in_words(key)[1] for name, key in TOW_PARAMETERS.items()}
_METHODS = {"paper": "as published", "qr": "least squares", "output_error": "output error"}
_ESTIMATES = (
    "M dv/dt + B1 v⁴ + B2 v³ + B3 v² = T. The published method and least squares put a polynomial through the mean "
    "speeds and solve this equation for it; output error integrates the equation and fits all readings. ± is one "
    "standard error. A force that is wrong by one per cent makes all estimates wrong by one per cent, and the tows "
    "cannot show it."
)
_MODELS = (
    "A lower AIC is a better fit for the number of unknowns; it counts readings as independent, and differences below "
    "4 say little. A model whose unknowns cannot be distinguished, or whose drag pushes, is only a curve."
)
_ELLIPSES = (
    "The regions are linearised and take the readings as independent; the points are the same models fitted to single "
    "tows. A long slanting region means that only a combination of mass and drag is known. Where the two regions part, "
    "the start decides."
)
_BY_TOW = (
    "Each tow by itself, and one left out in turn. These errors hold also where the readings of one tow err together."
)
_THEORY = (
    "M_s = k* (1 + k₁₁) ρ V, with Lamb's k₁₁ of ellipsoids and the published k* = 0.96 for the free surface. "
    "The published k₁₁ of 0.156 belongs to a spheroid 2.5 times as long as thick."
)


@dataclass(frozen=True, eq=False, repr=False)
class TowResult(Result[TowStudy]):
    """Surge mass and drag of a towed body, SI.

    Parameters
    ----------
    study : TowStudy
    wanted : str
        Method whose numbers the card gets.
    name : str
        Name of the body on the card.
    """

    study: TowStudy
    wanted: str = "output_error"
    name: str = "body"
    command: ClassVar[str] = "tow"

    @property
    def fit(self) -> TowFit:
        """Estimates of :attr:`method`."""
        return self.study.methods[self.method]

    @property
    def method(self) -> str:
        """Method whose numbers the card gets; ``qr`` where the one asked for did not converge."""
        return self.wanted if self.wanted in self.study.methods else "qr"

    @property
    def estimates(self) -> pd.DataFrame:
        """Estimates, a row each: method, name with unit (``total_mass_kg``), value, standard error."""
        rows = [
            (method, name, value, fit.standard_errors.get(name))
            for method, fit in self.study.methods.items()
            for name, value in fit.estimates.items()
        ]
        return data_frame(rows, ["method", "name", "value", "standard_error"])

    @property
    def total_mass_kg(self) -> float:
        """M of :attr:`method`: mass with the water inside and added mass, kg."""
        return self.fit.estimates["total_mass_kg"]

    @property
    def added_mass_kg(self) -> float:
        """M - m of :attr:`method`, kg."""
        return self.fit.added_mass_kg

    @property
    def mass_range_kg(self) -> tuple[float, float] | None:
        """Range of M that these tows determine over all usable models, kg; None if no model is usable."""
        return self.study.mass_range_kg

    @cached_property
    def card(self) -> Card:
        """The card of the body that surges; ``card.save("body.toml")`` writes it.

        Raises
        ------
        InputError
            No body has these estimates: the total mass is not positive. Or B3, which a card needs, was not estimated.
        """
        if "B3_kgpm" not in self.fit.estimates:
            raise ArgumentError("terms", "", "leaves out B3, the drag that a surge card needs", 'add it (terms="B3")')
        body = self.study.body
        source = f"tank2sim tow {PurePath(self.study.tows).name}, method {self.method}"
        length = body.length_m if body else None
        text = tow_card_text(self.study, self.fit, name=self.name, source=source, length_m=length)
        return parse_card(text, "the card found")

    @property
    def title(self) -> str:
        """What was done."""
        return "Surge mass and drag from accelerating tows"

    @property
    def subtitle(self) -> str:
        """The tows, the force and the mass."""
        count = len(self.study.speeds.measured_mps)
        tows = f"{count} tows" if count > 1 else "one tow"
        file, force = PurePath(self.study.tows).name, force_words(self.study.force)
        return f"{file}: {tows}, {force}, m = {self.study.mass_kg:g} kg"

    @property
    def headline(self) -> tuple[str, ...]:
        """Total and added mass of the best usable model; the drag, if the mass was given."""
        best, given = self.study.best, self.study.given_total_mass_kg
        if given is not None:
            return self._with_given_mass(given)
        if best is None:
            return ("These tows determine no model with a drag that a hull can have. Take more tows, or longer ones.",)
        water = best.estimates["M"] - self.study.mass_kg
        return (
            f"The body moves as {best.mass_words} kg (95 %), and {water:.0f} kg of it is water. These tows determine "
            f"{best.label}, and no more.",
        )

    def _with_given_mass(self, given_kg: float) -> tuple[str, ...]:
        """The drag found with a given mass, and the mass that the tows have by themselves."""
        drag = ", ".join(f"{name} = {_with_error(self.fit, TOW_PARAMETERS[name])} {_UNITS[name]}" for name in
                         self.fit.drag_terms)  # fmt: skip
        added = f"{given_kg - self.study.mass_kg:.0f} kg of it is water"
        found = f"M is held at {given_kg:g} kg, as given, and {added}; {drag} by {_METHODS[self.method]}."
        best = self.study.best
        alone = "no usable model" if best is None else f"{best.mass_words} kg (95 %), with {best.label}"
        return found, f"By themselves the tows determine {alone}."

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Total and added mass, the range of M, the worst condition number."""
        study, best, figures = self.study, self.study.best, []
        if (given := study.given_total_mass_kg) is not None:
            figures.append(KeyFigure("Total mass M", round(given), "kg", note="held, as given"))
            figures.append(KeyFigure("Added mass λ₁₁ = M − m", round(given - study.mass_kg), "kg"))
        elif best is not None:
            mass, half = best.estimates["M"], best.half_widths_95["M"]
            note = f"± {half:.0f} kg at 95 %; output error of {best.label}"
            figures.append(KeyFigure("Total mass M", round(mass), "kg", note=note))
            label, added = "Added mass λ₁₁ = M − m", round(mass - study.mass_kg)
            figures.append(KeyFigure(label, added, "kg", note="of the same model"))
        if study.mass_range_kg:
            low, high = study.mass_range_kg
            label, value = "Range of M that these tows leave", f"{low / 1000:.2f} to {high / 1000:.2f}"
            figures.append(KeyFigure(label, value, "t", note="over all usable models"))
        worst = max(study.methods.values(), key=lambda fit: fit.condition_scaled)
        condition = float(f"{worst.condition_scaled:.2g}")
        figures.append(
            KeyFigure(
                f"Condition number of {', '.join(worst.estimated)}",
                condition,
                note=f"scaled; at most {_LARGEST_CONDITION:g} distinguishes them",
                verdict=Verdict.PASSED if condition <= _LARGEST_CONDITION else Verdict.CAUTION,
                limit=_LARGEST_CONDITION,
            )
        )
        return figures

    @property
    def sections(self) -> Sequence[Section]:
        """Speeds, estimates, models of other size, drag, theory, single tows."""
        study, sections = self.study, []
        if study.speeds.simulated_mps:
            chart = Illustration(
                tow_speed_chart(study.speeds),
                caption=f"The lower panel shows the differences from {next(iter(study.speeds.simulated_mps))}.",
                name="measured_and_computed_speeds",
            )
            sections.append(Section("Measured and computed speeds", charts=[chart]))
        sections += [self._estimates(), self._models()]
        if study.body:
            sections += [self._drag(study.body), self._theory()]
        if study.tow_by_tow:
            by_tow = [_subset_table(label, subset) for label, subset in study.tow_by_tow.items()]
            sections.append(Section("Tow by tow", text=_BY_TOW, tables=by_tow, folded=True))
        return sections

    def _estimates(self) -> Section:
        fits = self.study.methods.values()
        names = {key: f"{name} ({_UNITS[name]})" for name, key in TOW_PARAMETERS.items()}
        names["added_mass_kg"] = "added mass (kg)"
        rows: list[list[Cell]] = [
            [words, *(_with_error(fit, key) for fit in fits)]
            for key, words in names.items()
            if any(key in fit.estimates for fit in fits)
        ]
        for words, field in (
            ("J of (1.6) (N √s)", "J"),
            ("condition number, scaled", "condition_scaled"),
            ("largest speed error (m/s)", "largest_speed_error_mps"),
        ):
            rows.append([words, *(f"{getattr(fit, field):.4g}" for fit in fits)])
        heads = ("", *(_METHODS[method] for method in self.study.methods))
        tables = [table("Estimates by method, ± one standard error", heads, rows), self._polynomials()]
        return Section("Estimates by method", text=_ESTIMATES, tables=tables)

    def _polynomials(self) -> Table:
        rows: list[list[Cell]] = []
        for one in self.study.speed_polynomials:
            absent = [None] * (3 - one.degree)
            rows.append([f"{one.degree}", *one.coefficients, *absent, one.rms_mps, one.rms_less_one_mps])
            if self.study.tows_of_the_paper:
                values, error = tow_paper.TABLE_2[one.degree]
                rows.append([f"{one.degree}, printed", *values, *absent, error, None])
        heads = ("degree", "α₀", "α₁", "α₂", "α₃", "rms (m/s)", "rms by n − 1 (m/s)")
        notes = ["No single change of the printed readings gives the printed polynomials."]
        return table(
            "Polynomials v = α₀ + α₁ t + ... through the mean speeds (m/s over s)",
            heads,
            rows,
            *(notes if self.study.tows_of_the_paper else []),
            folded=True,
            on_screen=False,
        )

    def _models(self) -> Section:
        study, name = self.study, "what_these_tows_determine"
        charts = []
        if study.models:
            charts.append(Illustration(model_chart(study.models), caption=_MODELS, name=name))
        if study.confidence_ellipses:
            chart = ellipse_chart(study.confidence_ellipses, study.tow_by_tow)
            charts.append(Illustration(chart, caption=_ELLIPSES, name=name))
        by_tow = [
            f"M by single tows, {label}: {', '.join(f'{row[0]:.0f}' for row in subset.alone)} kg. With one tow left "
            f"out in turn: ± {subset.jackknife_half_widths_95[0]:.0f} kg (95 %)."
            for label, subset in study.tow_by_tow.items()
        ]
        text = (
            "The same readings by output error with fewer and with more unknowns (delay: time from t = 0 to the start "
            "of the body)."
        )
        tables = [_model_table(study.models, by_tow), _model_estimates(study.models)]
        return Section("What these tows determine", text=text, tables=tables, charts=charts)

    def _drag(self, body: TowedBody) -> Section:
        study = self.study
        found = study.drag_coefficients
        drags = {
            _METHODS[name]: drag.by_length_squared
            for name, drag in found.items()
            if name != "paper" or "qr" not in found
        }
        if best := study.best:
            drag = drag_polynomial(best.coefficients, body)
            if drag not in drags.values():
                drags[f"best usable: {best.label}"] = drag
        if study.tows_of_the_paper:
            drags["as printed"] = drag_polynomial(tow_paper.SOLUTION, body)
        rows: list[list[Cell]] = []
        for name, drag in drags.items():
            rows.append([name, "L²", *asdict(drag).values()])
            rows.append([name, "V^(2/3)", *asdict(drag.times(body.area_ratio)).values()])
        chart = Illustration(
            drag_chart(drags, body, study.top_speed_mps),
            caption=f"L = {body.length_m:g} m, V = {body.volume_m3:.4g} m³, ν = {format_number(body.viscosity_m2ps)} "
            "m²/s. The axes fit the curves that stay above zero; no hull has a coefficient below zero.",
        )
        heads = ("method", "referred to", "A1 (s²/m²)", "A2 (s/m)", "A3")
        drag_table = table("Drag coefficient C = A1 v² + A2 v + A3", heads, rows, folded=True)
        return Section("Drag coefficient", tables=[drag_table], charts=[chart])

    def _theory(self) -> Section:
        estimate = ""
        if best := self.study.best:
            estimate = f" The tows give {best.mass_words} kg by the best usable model."
        fields = {"basis": "body", "k11": "k₁₁", "deep_kg": "(1 + k₁₁) ρ V", "near_surface_kg": "near the surface, M_s"}
        masses = records_table("Mass in surge by theory (2.5)", self.study.mass_by_theory, fields=fields)
        return Section("Mass by theory", text=_THEORY + estimate, tables=[masses])


def _with_error(fit: TowFit, key: str) -> Cell:
    """An estimate and its standard error; each row has a unit of its own, so no decimals in common."""
    if key not in fit.estimates:
        return None
    error = fit.standard_errors.get(key)
    value = format_number(float(f"{fit.estimates[key]:.5g}"), 5)
    return f"{value} ± {format_number(float(f'{error:.2g}'), 5)}" if error else value


def _subset_table(label: str, subset: TowByTow) -> Table:
    rows: list[list[Cell]] = [
        ["all tows", *subset.together],
        *([f"tow {number} alone", *row] for number, row in enumerate(subset.alone, 1)),
        *([f"all but tow {number}", *row] for number, row in enumerate(subset.left_out, 1)),
        ["standard error, one left out in turn", *subset.jackknife_standard_errors],
        ["95 % half-width, one left out in turn", *subset.jackknife_half_widths_95],
        ["standard error, spread of the tows", *subset.spread_standard_errors],
    ]
    heads = ("tows", *(f"{name} ({_UNITS[name]})" for name in subset.unknowns))
    return table(label[0].upper() + label[1:], heads, rows, on_screen=False)


def _model_table(models: Sequence[FittedModel], notes: Sequence[str]) -> Table:
    rows: list[list[Cell]] = [
        [
            model.label,
            model.mass_words,
            model.scatter_mps,
            round(model.aic, 1),
            float(f"{model.condition_scaled:.2g}"),
            model.drag_nowhere_negative,
        ]
        for model in models
    ]
    columns = [
        *(Column("model"), Column("M ± 95 %", "kg"), Column("scatter", "m/s", digits=3)),
        *(Column("AIC"), Column("condition", digits=2), Column("drag nowhere negative")),
    ]
    return table("Output error, models of different size", columns, rows, *notes, folded=True)


def _model_estimates(models: Sequence[FittedModel]) -> Table:
    unknowns = [name for name in _UNITS if any(name in model.estimates for model in models)]
    heads = [head for name in unknowns for head in (f"{name} ({_UNITS[name]})", f"± ({_UNITS[name]})")]
    rows: list[list[Cell]] = [
        [
            model.label,
            *(cell for name in unknowns for cell in (model.estimates.get(name), model.half_widths_95.get(name))),
        ]
        for model in models
    ]
    caption = "Estimates of these models with 95 % half-widths"
    return table(caption, ("model", *heads), rows, folded=True, on_screen=False)


_SPEEDS = (Signal("speed", "speed", "m/s"), Signal("left", "less the model", "m/s"))


def tow_speed_chart(speeds: TowSpeeds) -> ChartSpec:
    """Readings as points and simulated speeds as lines; below, all of them less the first simulation.

    Parameters
    ----------
    speeds : TowSpeeds
        With at least one simulation.
    """
    time, simulated = speeds.t_s, speeds.simulated_mps
    reference = next(iter(simulated.values()))
    at_readings = np.interp(time, speeds.simulated_t_s, reference)
    runs = []
    for label, speed in speeds.measured_mps.items():
        signals = {"speed": speed, "left": speed - at_readings}
        runs.append(History(label, time_s=time, values=signals, measured=True))
    for name, speed in simulated.items():
        runs.append(History(name, time_s=speeds.simulated_t_s, values={"speed": speed, "left": speed - reference}))
    return history_chart(runs, _SPEEDS, title="Speeds of the tows and of the models", height_px=230)


def drag_chart(drags: Mapping[str, DragPolynomial], body: TowedBody, top_speed_mps: float) -> ChartSpec:
    """C referred to L^2 against speed, and C referred to V^(2/3) against Reynolds number."""
    speeds = np.linspace(0.0, top_speed_mps, 121)
    panels = []
    shown: dict[str, str | tuple[str, str]] = {
        "run:N": "by",
        "speed:Q": "v (m/s)",
        "re:Q": ("Re", ",.3~s"),
        "c:Q": "C by L²",
        "cv:Q": "C by V^(2/3)",
    }
    for across, values, name, factor in (
        (PlotAxis("speed (m/s)", nice=False), speeds, "C referred to L²", 1.0),
        (
            PlotAxis("Reynolds number v L / ν", nice=False, form="~s"),
            body.reynolds(speeds),
            "C referred to V^(2/3)",
            body.area_ratio,
        ),
    ):
        series = []
        for label, drag in drags.items():
            both = {"c": drag.at(speeds), "cv": drag.times(body.area_ratio).at(speeds)}
            more = {"speed": speeds, "re": body.reynolds(speeds), **both}
            series.append(PlotSeries(label, x=values, y=drag.times(factor).at(speeds), more=more))
        # From a little below 0 to above the highest C of the curves that stay above zero; of all, if none does.
        curves = [vector(line.y) for line in series]
        kept = [curve for curve in curves if curve.min() >= 0] or curves
        low, high = min(0.0, *(float(curve.min()) for curve in kept)), max(float(curve.max()) for curve in kept)
        margin = 0.08 * (high - low)
        up = PlotAxis(name, domain=(low - margin, high + margin))
        plot = Plot(series, up=up, rules=[Rule([0.0])])
        layers = curve_layers(plot, across, look_of(series), shown=shown)
        panels.append(layered(layers, size=(330, 300)))
    return {
        "hconcat": panels,
        "spacing": 28,
        "title": "Drag coefficient",
        "description": "Drag coefficient referred to length squared over speed, and to volume over Reynolds number.",
        "usermeta": STACKS,
    }


def ellipse_chart(ellipses: Sequence[Ellipse], by_tow: Mapping[str, TowByTow]) -> ChartSpec:
    """Joint 95 % regions of M and B3 from all tows, and each tow by itself as a point."""
    series = [
        PlotSeries(f"95 %: {ellipse.label}", x=ellipse.mass_kg, y=ellipse.B3_kgpm, closed=True) for ellipse in ellipses
    ]
    for name, way in by_tow.items():
        if way.unknowns[:2] == ("M", "B3") and name.startswith("output error"):
            known = np.flatnonzero(np.isfinite(np.asarray(way.alone)[:, :2]).all(axis=1))
            if len(known):
                mass, drag = np.asarray(way.alone)[known, :2].T
                label, more = f"each tow: {', '.join(way.unknowns)}", {"tow": known + 1.0}
                series.append(PlotSeries(label, x=mass, y=drag, points=True, more=more))
    return curve_chart(
        Plot(series, up=PlotAxis("B3 (kg/m)"), height_px=360),
        PlotAxis("M (kg)"),
        title="M and B3 together",
        width_px=620,
        described="Joint 95 % regions of M and B3 with and without a start delay, and the estimates of each tow.",
        shown={"run:N": "of", "tow:O": "tow"},
        point_px=70,
    )


_VERDICTS = ("usable", "not determined", "drag negative somewhere")


def model_chart(models: Sequence[FittedModel]) -> ChartSpec:
    """M with its 95 % interval, and AIC above the lowest, of each model."""
    lowest = min(model.aic for model in models)
    rows: list[ChartRecord] = []
    for model in models:
        (low, high), mass = model.mass_interval_kg, plain(model.estimates["M"])
        verdict = 0 if model.usable else 1 if model.drag_nowhere_negative else 2
        span = {"low": plain(low), "high": plain(high), "least": plain(low), "most": plain(high)}
        shown = {"v": mass, "m": mass, "aic": plain(model.aic - lowest)}
        rows.append({"name": model.label, "run": _VERDICTS[verdict], **shown, **span})
    verdicts = [verdict for verdict in _VERDICTS if any(row["run"] == verdict for row in rows)]
    mass_rows = RowPlot(
        rows,
        across=PlotAxis("M with its 95 % interval (kg)"),
        shown={"name:N": "model", "run:N": "it is", "m:Q": "M (kg)", "least:Q": "from", "most:Q": "to"}
        | {"aic:Q": "AIC above the lowest"},
        look=series_look(verdicts, as_points=verdicts),
    )
    rank_rows = replace(
        mass_rows,
        rows=[row | {"v": row["aic"], "low": None} for row in rows],
        across=PlotAxis("AIC above the lowest", zero=True),
        side={"labels": False},
    )
    masses, ranks = (row_layers(each, span_px=2, size=70, strokeWidth=2) for each in (mass_rows, rank_rows))
    height = 30 * len(models)
    return {
        "hconcat": [layered(masses, size=(340, height)), layered(ranks, size=(280, height))],
        "title": "Models of different size",
        "description": "Mass and AIC of each model fitted by output error.",
        "usermeta": STACKS,
    }
