"""Results of ``design``: the next captive campaign, and the next sea trial."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeVar

import numpy as np

from tank2sim.analysis.influence.figures import figure_label
from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import runs_of
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, channel, layer, layered, tooltips
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, Table, data_frame, records_table, table
from tank2sim.answer.result import Result
from tank2sim.apps.design.captive_design import CaptiveDesign
from tank2sim.apps.design.plan_files import campaign_template, plan_csv
from tank2sim.apps.design.planning import counted
from tank2sim.apps.design.study import CampaignStudy, Certainty, TrialStudy
from tank2sim.apps.design.trial_design import TrialDesign
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

_WIDTH = 320
_HEIGHT = 240
DESIGN, USUAL = "design", "usual"


_S = TypeVar("_S", CampaignStudy, TrialStudy)

_ON_SCREEN = 12
"""Coefficients in the printed table. Project choice: the page and JSON have all."""


class _Programme(NamedTuple):
    """A plan, and the time of a plan that is as good as the usual programme in the `whole` time (None if none is)."""

    word: str
    tests: int
    used: float
    needed: float | None
    whole: float
    unit: str
    usual: str


class DesignResult(Result[_S]):
    """A plan that makes figures most certain, and the usual programme in the same time."""

    command: ClassVar[str] = "design"

    @property
    def figures(self) -> pd.DataFrame:
        """Figures by name: value of the card's ship, standard errors by the design and by the usual programme."""
        rows = [{"figure": name, **asdict(one)} for name, one in self.study.figures.items()]
        return data_frame(rows, index="figure").dropna(axis=1, how="all")

    def _certainty(self, text: str, seconds: float, unit: str) -> Section:
        charts = _certainty_charts(self.study.certainty, seconds, unit)
        rows: list[list[Cell]] = []
        for name, one in self.study.figures.items():
            sizes: list[Cell] = [one.before, one.design, one.usual, one.design / one.usual]
            rows.append([figure_label(name), one.value, *sizes, one.variance_ratio])
        heads = ["figure", "value", "before", "design", "usual", "ratio", "ratio of variances"]
        known = [place for place in range(len(heads)) if any(row[place] is not None for row in rows)]
        figures = table(
            "Figures and their standard errors",
            [heads[place] for place in known],
            [[row[place] for place in known] for row in rows],
        )
        return Section(
            "Certainty of the figures",
            text=text,
            charts=[Illustration(chart, half=True) for chart in charts],
            tables=[figures],
        )

    @property
    def _programme(self) -> _Programme:
        raise NotImplementedError

    @property
    def headline(self) -> tuple[str, ...]:
        """Number of tests and their time, and the time in which a plan is as good as the usual programme."""
        word, count, used, needed, whole, unit, usual = self._programme
        first = f"{self.study.ship}: {counted(count, word)} in {used:.3g} {unit}."
        if needed is None:
            return first, f"No plan was found that has every figure as certain as the {usual} in {whole:.3g} {unit}."
        return first, (
            f"{needed:.3g} {unit} of this plan are as accurate as {whole:.3g} {unit} of the {usual} "
            f"({100 * needed / whole:.0f} %)."
        )

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Number of tests, their time, and each figure."""
        word, count, used, needed, whole, unit, usual = self._programme
        time = KeyFigure(f"Time for the certainty of the {usual}", "none found")
        if needed is not None:
            note = f"{needed:.3g} {unit} in place of {whole:.3g} {unit}"
            time = KeyFigure(time.label, 100 * needed / whole, "%", note=note)
        cards = [KeyFigure(f"{word.capitalize()}s", count, note=f"in {used:.3g} {unit}"), time]
        for name, one in self.study.figures.items():
            label = figure_label(name)
            note = f"± {one.design:.2g}; usual programme ± {one.usual:.2g}"
            figure_unit = in_words(name.partition("@")[0])[1]
            cards.append(KeyFigure(label[:1].upper() + label[1:], one.value, figure_unit, note=note))
        return cards


@dataclass(frozen=True, eq=False, repr=False)
class CampaignDesignResult(DesignResult[CampaignStudy]):
    """A captive campaign that makes figures most certain, and the usual matrix in the same hours.

    Parameters
    ----------
    study : CampaignStudy
    design : CaptiveDesign, optional
        None if the result was read from its JSON.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> plan = t2s.design_campaign("mariner", figures="K_prime", members=0)
    >>> bool((plan.figures["design"] < plan.figures["usual"]).all())
    True
    """

    study: CampaignStudy
    design: CaptiveDesign | None = None

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: the next captive campaign"

    @property
    def subtitle(self) -> str:
        """Model and range of the tests."""
        model = self.study.model
        return (
            f"model {model.length_m:.3g} m at {model.speed_mps:.3g} m/s; drift to {model.drift_deg:.3g} deg, rudder to "
            f"{model.rudder_deg:.3g} deg, r' to {model.yaw_rate_prime:.2g}"
        )

    @property
    def runs(self) -> pd.DataFrame:
        """The runs in their order: type, speed, angles, frequency, amplitudes, length of the record, time in the
        tank."""
        return data_frame(map(asdict, self.study.runs), index="run")

    @property
    def plan(self) -> str:
        """The runs as CSV."""
        return plan_csv(self.study.runs)

    @property
    def template(self) -> str:
        """``campaign.toml`` for :func:`.reduce`, which lacks the files of the runs."""
        assert self.design is not None, "the JSON of a design does not hold it"
        return campaign_template(self.design, self.study.runs)

    @property
    def _programme(self) -> _Programme:
        study, usual = self.study, self.study.usual_matrix
        needed, compared = study.hours_for_usual_certainty, usual.hours * usual.repeats
        return _Programme("run", len(study.runs), study.hours_used, needed, compared, "h", "usual matrix")

    @property
    def sections(self) -> Sequence[Section]:
        """Certainty of the figures, places of the runs, coefficients that matter, and the plan."""
        study = self.study
        planes = run_planes(study)
        kinds = records_table(
            "Kinds of runs (amplitude: v/U or r L/U)", study.kinds, fields=_KINDS, digits=3, folded=False
        )
        plan = records_table("Runs in their order", study.runs, fields=_RUNS, digits=3, on_screen=False)
        return [
            self._certainty(_CAMPAIGN, 3600, "h"),
            Section(
                "Where the runs are",
                text=_PLACES,
                charts=[Illustration(chart, half=True) for chart in planes],
                tables=[kinds],
            ),
            Section("Coefficients that matter", text=_COEFFICIENTS, tables=list(self._coefficients())),
            Section("The plan", tables=[plan]),
        ]

    def _coefficients(self) -> Sequence[Table]:
        ordered = sorted(self.study.coefficients.items(), key=lambda item: -item[1].largest_share)
        names = list(self.study.figures)
        rows: list[list[Cell]] = []
        for name, one in ordered:
            shares = (one.share_of_variance.get(figure) for figure in names)
            percents = [None if share is None else 100 * share for share in shares]
            rows.append([name, one.value, one.design, one.usual, *percents])
        heads = ["coefficient", "value", "design", "usual"]
        largest: list[list[Cell]] = [
            [name, one.value, one.design, one.usual, 100 * one.largest_share] for name, one in ordered[:_ON_SCREEN]
        ]
        words = [f"{figure_label(figure)} (%)" for figure in names]
        return (
            table("Coefficients that matter (prime)", [*heads, "largest share of a variance (%)"], largest, digits=3),
            table("Coefficients and their shares of the variances", [*heads, *words], rows, digits=3, on_screen=False),
        )


@dataclass(frozen=True, eq=False, repr=False)
class TrialDesignResult(DesignResult[TrialStudy]):
    """A sea trial that makes figures most certain, and the usual set of manoeuvres in the same time.

    Parameters
    ----------
    study : TrialStudy
    design : TrialDesign, optional
        None if the result was read from its JSON.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> trial = t2s.design_trial("mariner", figures="advance_m@35")
    >>> bool((trial.figures["design"] < trial.figures["before"]).all())
    True
    """

    study: TrialStudy
    design: TrialDesign | None = None

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: the next sea trial"

    @property
    def subtitle(self) -> str:
        """The usual set."""
        usual = self.study.usual_set
        return f"usual set: {', '.join(usual.manoeuvres)}, {usual.minutes:.3g} min"

    @property
    def manoeuvres(self) -> pd.DataFrame:
        """The manoeuvres in their order: repeats, length (s), time with approach (min), file of the orders."""
        return data_frame(map(asdict, self.study.manoeuvres), index="manoeuvre")

    @property
    def plan(self) -> str:
        """The manoeuvres as CSV."""
        return plan_csv(self.study.manoeuvres)

    @property
    def orders(self) -> dict[str, str]:
        """Name of a file to the orders of a manoeuvre, for ``simulate --manoeuvre file:``; zigzags are switched at the
        headings of the card's ship."""
        assert self.design is not None, "the JSON of a design does not hold the orders"
        pairs = zip(self.study.manoeuvres, self.design.manoeuvres, strict=True)
        return {row.orders: manoeuvre.orders for row, (manoeuvre, _) in pairs}

    @property
    def _programme(self) -> _Programme:
        study, count = self.study, sum(one.repeats for one in self.study.manoeuvres)
        needed = study.minutes_for_usual_certainty
        return _Programme("manoeuvre", count, study.minutes_used, needed, study.minutes, "min", "usual set")

    @property
    def sections(self) -> Sequence[Section]:
        """Certainty of the figures, the plan, and the coefficients that become known."""
        words = {"manoeuvre": "", "repeats": "", "duration_s": "length", "total_min": "with approach", "orders": ""}
        plan = records_table("Manoeuvres", self.study.manoeuvres, fields=words, digits=3, folded=False)
        ordered = dict(sorted(self.study.coefficients.items(), key=lambda item: item[1].design))
        fields = {"before": "before (prime)", "design": "", "usual": ""}
        known = records_table("Coefficients", ordered, first="coefficient", fields=fields, digits=3)
        text = "Standard errors before the trial (prime), and after it over those before."
        return [
            self._certainty(_TRIAL, 60, "min"),
            Section("The plan", tables=[plan]),
            Section("Coefficients", text=text, tables=[known]),
        ]


_KINDS = {
    "runs": "",
    "type": "",
    "drift": "drift (deg)",
    "rudder": "rudder (deg)",
    "frequency_radps": "",
    "amplitude_prime": "amplitude",
    "cycles": "",
    "record_s": "",
    "check": "",
}
_RUNS = {
    "run": "",
    "type": "",
    "drift_deg": "",
    "rudder_deg": "",
    "frequency_radps": "",
    "sway_amplitude_m": "",
    "yaw_rate_amplitude_degps": "yaw rate",
    "heading_amplitude_deg": "heading",
    "cycles": "",
    "record_s": "",
    "tank_min": "tank (min)",
    "purpose": "",
}
_CAMPAIGN = (
    "Standard errors of the figures of the ship that the reduction of the tests will give, from the errors of the "
    "gauges alone, by the plan and by the usual matrix in the same time, but at least once. The ratio of variances is "
    "a mean over the ships that the card may be.\n\nErrors common to the whole campaign (calibration, alignment, "
    "scale) are the same in both."
)
_PLACES = (
    "The area of a point is the number of runs. Runs marked as checks show whether a polynomial of third order holds "
    "between the extremes."
)
_COEFFICIENTS = (
    "Standard errors of the coefficients (prime), and the share of the variance of each figure that would go if one of "
    "them were known exactly."
)
_TRIAL = (
    "Standard errors of the figures before the trial, after the plan, and after the usual set in the same time, as far "
    "as the errors of the card and of the sensors go. Windows of the records have an unknown first state and unknown "
    "constant disturbances, as wind and waves make."
)


def run_planes(study: CampaignStudy) -> list[ChartSpec]:
    """Runs in the plane of drift and rudder, and oscillations in the plane of frequency and amplitude; areas are
    numbers of runs."""
    steady, swinging = Counter[tuple[float, ...]](), Counter[tuple[object, ...]]()
    for run in study.runs:
        if run.frequency_radps is None:
            steady[run.drift_deg, run.rudder_deg] += 1
            continue
        kind, ratio = "pure sway (v')", (run.sway_amplitude_m or 0.0) * run.frequency_radps / run.speed_mps
        if run.type != "pure_sway":
            kind = f"{run.type.replace('_', ' ')} (r')"
            ratio = math.radians(run.yaw_rate_amplitude_degps or 0.0) * study.model.length_m / run.speed_mps
        swinging[kind, plain(run.frequency_radps), plain(ratio)] += 1
    planes: list[ChartSpec] = []
    if swinging:
        rows = [{"run": kind, "x": x, "y": y, "runs": count} for (kind, x, y), count in swinging.items()]
        title = "Oscillations: amplitude and frequency"
        planes.append(_plane(rows, title, "frequency (rad/s)", "amplitude of v/U or r L/U"))
    if steady:
        rows = [{"run": "steady", "x": x, "y": y, "runs": count} for (x, y), count in steady.items()]
        planes.append(_plane(rows, "Steady runs: drift and rudder", "drift (deg)", "rudder (deg)"))
    return planes


def _plane(rows: Sequence[ChartRecord], title: str, across: str, up: str) -> ChartSpec:
    kinds = runs_of(rows)
    look = series_look(kinds, as_points=kinds)
    most = max(int(row["runs"]) for row in rows)
    counts = sorted({1, max(1, most // 2), most})
    scale = {"domain": [0, most], "range": [0, 500]}  # from no area for no runs: the legend has only numbers of runs
    place = {
        "x": PlotAxis(across, padding=20).channel("x"),
        "y": PlotAxis(up, padding=20, zero=True).channel("y"),
        "size": channel("runs:Q", scale=scale, legend={"title": "runs", "values": counts, "format": "d"}),
        "color": look.colour,
        "shape": look.shape,
        "tooltip": tooltips({"run:N": "type", "x:Q": across, "y:Q": up, "runs:Q": "runs"}),
    }
    return layered(
        [layer("point", rows, place, filled=True, opacity=0.7)],
        size=(2 * _WIDTH, _HEIGHT),
        title=title,
        description=f"{title}, by number of runs.",
    )


def _certainty_charts(curve: Certainty, seconds: float, unit: str) -> list[ChartSpec]:
    """Standard error of each figure over the time in a unit of so many `seconds`, by both programmes."""
    charts: list[ChartSpec] = []
    for figure in curve.design:
        plans = {DESIGN: (curve.time_s, curve.design), USUAL: (curve.usual_time_s, curve.usual)}
        series = []
        for kind, (times, errors) in plans.items():
            known = np.isfinite(errors[figure])
            time, error = np.asarray(times)[known] / seconds, np.asarray(errors[figure])[known]
            series.append(PlotSeries(kind, x=time, y=error))
        up = PlotAxis(f"standard error ({in_words(figure.partition('@')[0])[1]})", zero=True)
        across = PlotAxis(f"time ({unit})")
        dots = [row for each in series for row in each.rows]
        place = {"x": across.channel("x"), "y": up.channel("v")}
        place["color"] = series_look([DESIGN, USUAL]).colour
        charts.append(
            curve_chart(
                Plot(series, up=up, height_px=160, over=[layer("point", dots, place, filled=True, size=36)]),
                across,
                title=f"Certainty of the {figure_label(figure)}",
                width_px=2 * _WIDTH,
                window=[],
                described=f"Standard error of the {figure_label(figure)} over the time, by both programmes.",
                shown={"run:N": "plan", "x:Q": unit, "v:Q": "standard error"},
            )
        )
    return charts
