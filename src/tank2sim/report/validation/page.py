"""The validation report of a simulation model, with what ITTC 7.5-02-06-03 wants to be stated of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import altair as alt
import numpy as np

from tank2sim.analysis.stability.imo import ImoCriterion
from tank2sim.analysis.validation.coefficients import CardCoefficient
from tank2sim.analysis.validation.study import ComparisonOutcome, Validation, Verified
from tank2sim.cards.card import DEFAULT_RELATIVE_ERROR, ManoeuvringCard
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.dynamics.model import Model
from tank2sim.gap.result import Passed
from tank2sim.report.kit.motion_charts import History, Signal, TrackData, history_chart, track_chart
from tank2sim.report.kit.numbers import format_number
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable, Verdict
from tank2sim.report.stability.page import imo_verdict
from tank2sim.report.validation.charts import COMPARISON_ERRORS, comparison_error_chart
from tank2sim.report.validation.model_documentation import documentation
from tank2sim.units import in_words

_METHOD = (
    "E = S − D is the simulated less the measured figure. U_val = 2 √(u_num² + u_input² + u_D²) is what numerics, "
    "coefficients and data leave open, with 95 % probability (ASME V&V 20; ITTC 7.5-03-01-01). Where |E| ≤ U_val the "
    "error of the model is hidden in U_val, and the figure is validated at that level; where |E| > U_val the model "
    "errs by about E. A level above the required one tells little: such a figure counts as too uncertain. A trial that "
    "the card was identified from can refute it, and not validate it: its figures are only fitted."
)
_SOURCES_OF_U = (
    "u_num comes from repeating the simulation with half the step (three times the change, Roache's factor for two "
    "grids, at the first order); u_input from ships drawn within the standard errors of the card, with "
    "their covariance where one is next to it; u_D from reading the trial off again with its noise, and from "
    "repeats of one manoeuvre "
    "where there are any."
)
_CLOSED_LOOP = (
    "Turns and zigzags are steered as the manoeuvre asks, from the measured state at the execute, with the rudder rate "
    "and the delay of the record."
)
_REPLAY = (
    "Each trial is simulated freely over its whole length with the recorded rudder and revolutions, from the initial "
    "state that suits it best. Errors add up in position; no verdict is taken from these."
)
_NUMERICAL = (
    "Classical Runge-Kutta of the fourth order with a fixed step. The change of each figure when the step is halved, "
    "the numerical uncertainty from it, and the deviation by the errors of the coefficients."
)
_SIGNALS = (
    Signal(name="motion.u", title="u", unit="m/s"),
    Signal(name="motion.v", title="v", unit="m/s"),
    Signal(name="motion.r", title="r", unit="rad/s"),
    Signal(name="motion.psi", title="ψ", unit="rad"),
)


@dataclass(frozen=True, eq=False)
class ValidationEvidence:
    """What a validation report is made of.

    Parameters
    ----------
    card : ManoeuvringCard
    model : Model
    validation : Validation
    verified : tuple of Verified
    criteria : tuple of ImoCriterion
    replays : tuple of Passed
    notices : tuple of str
    """

    card: ManoeuvringCard
    model: Model
    validation: Validation
    verified: tuple[Verified, ...]
    criteria: tuple[ImoCriterion, ...]
    replays: tuple[Passed, ...]
    notices: tuple[str, ...] = ()


def validation_page(evidence: ValidationEvidence) -> Page:
    """The report."""
    sections = [
        documentation(evidence.card, evidence.model),
        _coefficients(evidence.card),
        _numerical(evidence.verified),
    ]
    sections.append(_comparison(evidence.validation))
    if evidence.replays:
        sections.append(_replays(evidence.replays))
    sections += [_standards(evidence.criteria), _limits(evidence)]
    if evidence.notices:
        rows: list[list[Cell]] = [[notice] for notice in evidence.notices]
        table = PageTable(caption="What the reader should know.", columns=[Column(title="")], rows=rows)
        sections.append(PageSection(heading="Notices", tables=[table]))
    subtitle = "Validation of the manoeuvring simulation model, in the manner of ITTC 7.5-02-06-03"
    return Page(title=evidence.card.ship.name, subtitle=subtitle, figures=_figures(evidence), sections=sections)


def _figures(evidence: ValidationEvidence) -> list[KeyFigure]:
    found = evidence.validation
    total = len(found.figures)
    if not total:
        shown = [KeyFigure(label="Validation", value="none", verdict=Verdict.CAUTION, note="no trial to compare with")]
    else:
        worst = Verdict.FAILED if found.count(ComparisonOutcome.REFUTED) else Verdict.CAUTION
        verdict = Verdict.PASSED if found.count(ComparisonOutcome.VALIDATED) == total else worst
        value = f"{found.count(ComparisonOutcome.VALIDATED)} of {total}"
        shown = [KeyFigure(label="Figures validated", value=value, verdict=verdict, note=found.verdict)]
        errors = [
            abs(figure.error / figure.measured)
            for figure in found.figures
            if figure.error is not None and figure.measured
        ]
        levels = [figure.level_percent for figure in found.figures if figure.level_percent is not None]
        if errors:
            shown.append(KeyFigure(label="Median error |E|", value=100 * float(np.median(errors)), unit="% of D"))
        if levels:
            shown.append(KeyFigure(label="Median level U_val", value=float(np.median(levels)), unit="% of D"))
    numerical = [abs(one.numerical / one.value) for one in evidence.verified if one.numerical is not None and one.value]
    if numerical:
        shown.append(KeyFigure(label="Largest numerical uncertainty", value=100 * max(numerical), unit="%"))
    return shown


def _coefficients(card: ManoeuvringCard) -> PageSection:
    found = {
        name: CardCoefficient(card.derivatives[name], card.standard_error(name), name in card.uncertainty)
        for name in ALL_TERMS
        if card.derivatives.get(name)
    }
    rows: list[list[Cell]] = []
    for name, one in found.items():
        assert one.value is not None and one.standard_error is not None
        percent = 100 * one.standard_error / abs(one.value)
        rows.append([name, 1000 * one.value, 1000 * one.standard_error, percent, "stated" if one.stated else "assumed"])
    columns = [
        Column(title="coefficient"),
        Column(title="value"),
        Column(title="standard error", digits=3),
        Column(title="of the value", unit="%", digits=3),
        Column(title="error"),
    ]
    text = f"Where the card states no standard error, {DEFAULT_RELATIVE_ERROR:.0%} of the value is assumed."
    caption = "Prime system, rudder positive to starboard, times 1000."
    return PageSection(
        heading="Coefficients", text=text, tables=[PageTable(caption=caption, columns=columns, rows=rows)]
    )


def _numerical(verified: Sequence[Verified]) -> PageSection:
    rows: list[list[Cell]] = []
    for one in verified:
        deviation = None if one.deviation is None or not one.value else 100 * one.deviation / abs(one.value)
        values = _text(one.value), _text(one.halving, 2), _text(one.numerical, 2), _text(one.deviation, 3)
        rows.append([one.trial, _named(one.name), *values, deviation])
    columns = [
        Column(title="trial"),
        Column(title="figure"),
        Column(title="value"),
        Column(title="by half the step", digits=2),
        Column(title="U_num", digits=2),
        Column(title="u_input", digits=3),
        Column(title="u_input", unit="%", digits=3),
    ]
    table = PageTable(caption="Standard trials at the speed of expansion in calm water.", columns=columns, rows=rows)
    return PageSection(heading="Verification and uncertainty of the simulation", text=_NUMERICAL, tables=[table])


def _comparison(found: Validation) -> PageSection:
    if not found.figures:
        text = "No turning circle or zigzag was given: the model is documented and verified here, and not validated."
        return PageSection(heading="Validation", text=text, notes=[found.verdict])
    rows: list[list[Cell]] = []
    manoeuvres: dict[str, str] = {}
    for figure in found.figures:
        manoeuvres[figure.trial] = figure.manoeuvre
        parts = (figure.measured, figure.simulated, figure.error), (figure.inputs, figure.data, figure.uncertainty)
        values = [_text(value) for value in parts[0]] + [_text(value, 3) for value in parts[1]]
        number = list(manoeuvres).index(figure.trial) + 1
        rows.append([f"{number}: {_named(figure.name)}", *values, figure.level_percent, str(figure.outcome)])
    trials: list[list[Cell]] = [[place, *pair] for place, pair in enumerate(manoeuvres.items(), start=1)]
    heads = [Column(title="no."), Column(title="trial"), Column(title="manoeuvre, as recognised")]
    benchmark = PageTable(caption="Benchmark data.", columns=heads, rows=trials)
    columns = [
        *(Column(title=title) for title in ("no.: figure", "D", "S", "E")),
        *(Column(title=title, digits=2) for title in ("u_input", "u_D")),
        Column(title="U_val", digits=3),
        Column(title="level", unit="%", digits=3),
        Column(title="verdict"),
    ]
    required = found.figures[0].required_percent
    largest = max(
        (100 * figure.numerical / abs(figure.measured) for figure in found.figures if figure.measured), default=0.0
    )
    numerical = f"u_num is {format_number(largest, 2)} % of D at most."
    level = f"The level is U_val in per cent of D; required here: {required:g} %."
    text = f"{_METHOD} {level}\n\n{_SOURCES_OF_U} {numerical}\n\n{_CLOSED_LOOP}"
    table = PageTable(caption=f"{found.verdict[:1].upper()}{found.verdict[1:]}.", columns=columns, rows=rows)
    chart = Illustration(
        chart=comparison_error_chart([figure.as_json() for figure in found.figures]), caption=COMPARISON_ERRORS
    )
    return PageSection(heading="Validation", text=text, tables=[benchmark, table], charts=[chart])


def _text(value: float | None, digits: int = 4) -> str | None:
    """A number for a column of many units, whose numbers share no decimals."""
    return None if value is None else format_number(value, digits)


def _named(name: str) -> str:
    words, unit = in_words(name)
    return f"{words} ({unit})" if unit else words


def _replays(replays: Sequence[Passed]) -> PageSection:
    rows: list[list[Cell]] = []
    charts = []
    for replay in replays:
        rows += [[replay.name, *_replay_error(replay, name)] for name in replay.noise]
        if {"motion.x", "motion.y"} <= set(replay.noise):
            charts.append(Illustration(chart=_replay_track(replay)))
        charts.append(Illustration(chart=_replay_history(replay)))
    columns = [
        Column(title="trial"),
        Column(title="signal"),
        Column(title="unit"),
        Column(title="rms error", digits=3),
        Column(title="of its range", unit="%", digits=3),
        Column(title="noise", digits=2),
    ]
    table = PageTable(caption="Free-running replays with the recorded inputs.", columns=columns, rows=rows)
    return PageSection(heading="Replays", text=_REPLAY, tables=[table], charts=charts)


def _replay_error(one: Passed, name: str) -> list[Cell]:
    angle = name in ("motion.r", "motion.psi", "motion.cog", "motion.phi")
    factor = 180 / math.pi if angle else 1.0
    known = np.isfinite(one.measured[name])
    measured, simulated = one.measured[name][known], one.before[name][known]
    error = float(np.sqrt(np.mean((simulated - measured) ** 2)))
    spread = float(np.ptp(measured))
    unit = {"motion.r": "deg/s", "motion.x": "m", "motion.y": "m"}.get(name, "deg" if angle else "m/s")
    share = 100 * error / spread if spread > 0 and math.isfinite(error) else None
    shown = factor * error if math.isfinite(error) else None
    return [name.removeprefix("motion."), unit, shown, share, factor * one.noise[name]]


def _replay_track(one: Passed) -> alt.LayerChart:
    tracks = [
        TrackData(label="measured", x_m=one.measured["motion.x"], y_m=one.measured["motion.y"], measured=True),
        TrackData(label="simulated", x_m=one.before["motion.x"], y_m=one.before["motion.y"], time_s=one.time_s),
    ]
    return track_chart(tracks, title=f"Track: {one.name}", height_px=360)


def _replay_history(one: Passed) -> alt.VConcatChart:
    signals = [signal for signal in _SIGNALS if signal.name in one.measured]
    runs = [
        History(label="measured", time_s=one.time_s, values=one.measured, measured=True),
        History(label="simulated", time_s=one.time_s, values=one.before),
    ]
    return history_chart(runs, signals, title=f"Histories: {one.name}", height_px=90)


def _standards(criteria: Sequence[ImoCriterion]) -> PageSection:
    rows: list[list[Cell]] = [
        [criterion.name, criterion.found, criterion.allowed, criterion.unit, imo_verdict(plain_json(criterion.as_json())), criterion.remark]
        for criterion in criteria
    ]
    columns = [Column(title=title) for title in ("criterion", "found", "allowed", "unit", "verdict", "remark")]
    table = PageTable(caption="IMO MSC.137(76), the worse of starboard and port.", columns=columns, rows=rows)
    text = "What the model says of the standards; it holds as far as the figures above are validated."
    return PageSection(heading="Standard manoeuvres", text=text, tables=[table])


def _limits(evidence: ValidationEvidence) -> PageSection:
    card = evidence.card
    causes = [
        "Forces that the structure has not: higher orders, heel, flow memory, interaction of rudder and propeller.",
        "Coefficients that no test of the source excites, or that are estimated (see the source and the comments).",
        "Scale effects between model and ship, in resistance, wake and rudder flow.",
        "Weather, current, depth and loading of the trials, as far as no effect of the card holds them.",
        "Errors of the coefficients that go together, where no covariance is next to the card.",
    ]
    if card.propulsion is None:
        causes.append(
            "Engine and propeller: the card has none, so loss of revolutions in a turn is in the coefficients."
        )
    rows: list[list[Cell]] = [[cause] for cause in causes]
    text = (
        "What can be behind an error E (7.5-02-06-03, potential causes of prediction error). The command influence "
        "tells how each figure depends on each coefficient (sensitivity), the command gap looks for the missing effect."
    )
    table = PageTable(caption="Potential causes of prediction error.", columns=[Column(title="cause")], rows=rows)
    return PageSection(heading="Causes of error and sensitivity", text=text, tables=[table])
