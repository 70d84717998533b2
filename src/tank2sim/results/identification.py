"""Result of ``identify`` for a ship: coefficients from trials, and how well held-out trials are predicted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np

from tank2sim.answer.charts.matrix import Matrix
from tank2sim.answer.charts.parts import plain, series_look
from tank2sim.answer.charts.rows import RowPlot, row_layers
from tank2sim.answer.charts.vega import (
    STACKS,
    ChartRecord,
    ChartSpec,
    PlotAxis,
    Rule,
    bare_layer,
    heading,
    layer,
    layered,
    tooltips,
)
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, Table, Verdict, data_frame, table
from tank2sim.answer.result import Result
from tank2sim.arrays import Array
from tank2sim.cards import Card
from tank2sim.errors import ArgumentError
from tank2sim.identification.trials.assessment.evaluation import TURN_FIGURE_NAMES
from tank2sim.identification.trials.assessment.identifiability import CLOSE_CORRELATION, IdentifiabilityStudy
from tank2sim.identification.trials.identify import Identification
from tank2sim.identification.trials.study import (
    SET_KEYS,
    BootstrapStudy,
    IdentificationStudy,
    ParameterEstimate,
    PosteriorStudy,
    PredictedFigure,
    TrialErrors,
    WindowError,
    pooled_error,
)
from tank2sim.results.trial_charts import MOST_TRIALS, figure_chart, trial_pictures, window_chart, worst_trials
from tank2sim.units import from_si

if TYPE_CHECKING:
    import pandas as pd

_NORMAL = 1.959964


_SAID = ("own", "known", "share_text")


_T = TypeVar("_T")

FITTED, HELD_OUT = "fitted", "held out"

NO_YAW = 3.0
"""A run whose yaw rate stays below this many times its noise is straight."""

_FOLLOWED = (
    "The model is given the recorded rudder over windows of five ship lengths, each begun from the state that suits "
    "the record best. The error is a root mean square, as a share of the signal's."
)
_FIGURES = (
    "Turns and zigzags are simulated in closed loop from the measured state at the execute: the rudder of a zigzag is "
    "reversed by the simulated heading, with the rudder rate and the lag of the trial."
)
_FIGURE_CHART = (
    "Grey: as measured. Bars: interval in which the figure is expected with 95 % probability. Figures that a "
    "simulation did not reach are not drawn."
)
_TRACKS = (
    "Turns and zigzags in closed loop, others with the recorded rudder. The scale fits the record and the card found: "
    "the card before may leave the panel."
)
_HISTORIES = (
    "Turns and zigzags in closed loop, others with the recorded rudder. Drift angle positive when the water comes from "
    "port."
)
_PARAMETERS = (
    "Estimates are in the units of the card (prime system for derivatives). Their intervals hold for the residuals as "
    "they are, coloured and with the effects that the model lacks."
)
_SINGULAR = (
    "Sensitivities of all measurements, in units of the prior. Below the red line the prior determines more than the "
    "trials."
)
_POSTERIOR = (
    "{draws} draws in {chains} chains by the sampler {sampler}, {simulations} simulations of all trials. R-hat "
    "compares the chains: converged ones have less than 1.01. The effective size is the number of independent draws "
    "that are worth as much."
)
_CHAINS_APART = " THESE CHAINS HAVE NOT CONVERGED: their intervals are not to be relied upon."
_POSTERIOR_CHART = (
    "Lines: intervals that hold 95 % (thin) and half (thick) of the draws, point: their median. Grey: 95 % of a "
    "normal distribution."
)


@dataclass(frozen=True, eq=False, repr=False)
class IdentificationResult(Result[IdentificationStudy]):
    """Coefficients identified from trials, and how well the new card follows trials.

    Parameters
    ----------
    study : IdentificationStudy
    card : Card, optional
        The card found, with the covariance of its estimates; ``card.save("better.toml")`` writes it, and ``ship`` is
        its ship. None if the result was read from its JSON.
    identification : Identification, optional
        SI and radians; None if the result was read from its JSON.
    """

    study: IdentificationStudy
    card: Card | None = None
    identification: Identification | None = None
    command: ClassVar[str] = "identify"
    subject: ClassVar[str] = "coefficients from trials"

    @property
    def estimates(self) -> pd.DataFrame:
        """Estimates by name: value and standard error, prime or SI, rudder positive to starboard."""
        terms = self.study.derivatives
        rows = [
            (f"derivatives.{name}" if name in terms else name, entry.value, entry.standard_error)
            for name, entry in self.study.parameters.items()
        ]
        return data_frame(rows, columns=["name", "value", "standard_error"], index="name")

    @property
    def figures(self) -> pd.DataFrame:
        """Figures of each trial, units in their names: measured, by the card before and now, and the 95 % interval.

        A figure of a held-out trial was expected in the interval (``low_95``, ``high_95``).
        """
        rows = [
            (one.trial, word, one.figure, one.measured, one.before, one.predicted, *(one.interval_95 or (None, None)))
            for word, key in SET_KEYS.items()
            for one in self.study.figures[key]
        ]
        return data_frame(rows, columns=["trial", "set", "figure", "measured", "before", "now", "low_95", "high_95"])

    @property
    def members(self) -> pd.DataFrame:
        """The ships behind the intervals of held-out trials, one row each: the numbers drawn, by the dotted keys of the
        card and as its file has them, and figures named ``trial: figure``.

        With an average over structures, the ships of each structure follow each other; a number that a structure does
        not have is missing.

        Raises
        ------
        InputError
            There are no members or no held-out trials, or the result was read from its JSON.
        """
        if self.identification is None:
            remedy = "compute the result again with the same members"
            raise ArgumentError("members", "", "the JSON of a result has the intervals, not the members", remedy)
        compared = self.identification.holdout
        if compared is None or compared.members is None:
            problem = "has no ship: figures of held-out trials are predicted with members"
            raise ArgumentError("members", "", problem, "hold out a turn or a zigzag, with members=100")
        return data_frame({**compared.members.coefficients, **compared.members.figures}).rename_axis("member")

    @property
    def samples(self) -> pd.DataFrame | None:
        """Draws of the posterior, a column for each parameter in the units of `estimates`; None without sampling."""
        samples = self.identification.posterior if self.identification else None
        return None if samples is None else data_frame(samples.flat, columns=list(samples.free))

    @property
    def subtitle(self) -> str:
        """The method."""
        return f"Coefficients from free-running trials by {self.study.method.replace('_', ' ')}"

    @property
    def headline(self) -> tuple[str, ...]:
        """How well the card found follows trials."""
        word, trials = self._judged
        before, after = (100 * pooled_error(trials, key) for key in ("before", "found"))
        untested = "" if word == HELD_OUT else " None was held out, so this card is untested."
        if not np.isfinite(after):
            count = len(self.study.parameters)
            return (f"{count} coefficients were fitted. The trials {word} have no yaw rate to compare.{untested}",)
        better = "better than" if after < before else "no better than"
        given = f"before ({before:.3g} %)" if np.isfinite(before) else "before"
        followed = f"The card found follows the yaw rate of the trials {word} within {after:.3g} % (rms)"
        return (f"{followed}, {better} the card {given}.{untested}",)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Errors of yaw rate, overshoots and advance, and how many trials and numbers there are."""
        study = self.study
        word, trials = self._judged
        errors = [100 * pooled_error(trials, key) for key in ("before", "found")]
        figures = [_compared("Yaw-rate error", word, "%", *errors)]
        for label, unit, names in (
            ("Overshoot error", "deg", ("overshoot_1_deg", "overshoot_2_deg")),
            ("Advance error", "%", TURN_FIGURE_NAMES[:1]),
        ):
            named = [figure for figure in study.figures[SET_KEYS[word]] if figure.figure in names]
            old, new = (_rms(named, key, 100 if unit == "%" else 1) for key in ("before", "predicted"))
            if not np.isnan(new):
                figures.append(_compared(label, word, unit, old, new))
        held_out, fitted = (len(study.errors_over_windows[SET_KEYS[word]]) for word in (HELD_OUT, FITTED))
        effects = f"{len(study.effects_of_card)} effects"
        return [
            *figures,
            KeyFigure(
                "Trials held out",
                held_out,
                verdict=Verdict.NONE if held_out else Verdict.CAUTION,
                note=f"{fitted} were fitted",
            ),
            KeyFigure("Numbers fitted", len(study.parameters), note=effects),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Trials, parameters, posterior, errors of signals, structures and figures."""
        study = self.study
        trials = [section for word in (HELD_OUT, FITTED) if (section := self._trials(word)).charts]
        return [
            *(replace(section, folded=place > 0) for place, section in enumerate(trials)),
            self._parameters(),
            *([self._posterior(study.posterior)] if study.posterior else []),
            self._signals(),
            *([self._structures()] if study.structures else []),
            *self._figures(),
        ]

    @property
    def _judged(self) -> tuple[str, tuple[TrialErrors, ...]]:
        """The trials that judge the card: those held out, where there are any."""
        windows = self.study.errors_over_windows
        word = HELD_OUT if windows[SET_KEYS[HELD_OUT]] else FITTED
        return word, windows[SET_KEYS[word]]

    def _trials(self, word: str) -> Section:
        windows = self.study.errors_over_windows[SET_KEYS[word]]
        trials = [trial for trial in self.study.replays if trial.held_out == (word == HELD_OUT)]
        errors = {trial.trial: trial.found["r_degps"].relative for trial in windows if "r_degps" in trial.found}
        shown = worst_trials(trials, [errors.get(trial.trial, 0.0) for trial in trials])
        charts = trial_pictures(shown, word, word.replace(" ", "_"), captions=(_TRACKS, _HISTORIES))
        many = f"The {MOST_TRIALS} of {len(windows)} trials with the largest error of yaw rate."
        text = many if len(windows) > MOST_TRIALS else ""
        return Section(f"Trials {word}", text=text, charts=charts)

    def _parameters(self) -> Section:
        study, known = self.study, self.study.identifiability
        count = len(study.errors_over_windows[SET_KEYS[FITTED]])
        rows: list[list[Cell]] = [
            [
                name,
                _value_with_error(entry.value, entry.standard_error),
                _value_with_error(entry.before, entry.before_standard_error),
                f"{100 * entry.share_from_trials:.0f} %",
            ]
            for name, entry in study.parameters.items()
        ]
        caption = f"{study.ship}: {len(rows)} coefficients from {count} trial{'s' * (count > 1)}, ± one standard error"
        tables = [table(caption, ("coefficient", "found", "before", "from trials"), rows)]
        if study.bootstrap:
            tables.append(self._bootstrap(study.bootstrap))
        title = "Parameters: estimate and prior with 95 % intervals"
        in_errors = "In standard errors of the prior, as the fit took it."
        correlation = _correlation_chart(known, title="Correlation of the parameters, by the trials alone")
        information = "Information of the trials: singular values"
        singular = _singular_value_chart(known.singular_values, title=information)
        return Section(
            "Parameters",
            text=_PARAMETERS + _widened(study.prior_scale),
            tables=tables,
            charts=[
                Illustration(parameter_chart(study.parameters, title=title), caption=in_errors, name="parameters"),
                Illustration(correlation, name="correlation"),
                Illustration(singular, caption=_SINGULAR, name="singular_values"),
            ],
        )

    def _bootstrap(self, found: BootstrapStudy) -> Table:
        errors = self.estimates["standard_error"].to_dict()
        rows: list[list[Cell]] = [
            [name, float(errors[name]), scatter] for name, scatter in found.standard_errors.items()
        ]
        caption = f"Standard errors, and scatter over {found.members} sets of trials simulated again"
        return table(caption, ("parameter", "standard error", "bootstrap"), rows)

    def _posterior(self, posterior: PosteriorStudy) -> Section:
        rows: list[list[Cell]] = [
            [
                name,
                f"{entry.quantiles[0]:.5g} to {entry.quantiles[-1]:.5g}",
                f"{entry.r_hat:.4f}",
                f"{entry.effective_sample_size:.0f}",
            ]
            for name, entry in posterior.parameters.items()
        ]
        title = "Samples of the posterior, next to a normal distribution"
        chart = _posterior_chart(self.study.parameters, posterior, title=title)
        text = _POSTERIOR.format(
            draws=posterior.draws, chains=posterior.chains, sampler=posterior.sampler, simulations=posterior.simulations
        )
        caption = f"Posterior, {posterior.draws} draws"
        return Section(
            "Posterior",
            text=text + ("" if posterior.converged else _CHAINS_APART),
            tables=[table(caption, ("parameter", "95 %", "R-hat", "effective size"), rows)],
            charts=[Illustration(chart, caption=_POSTERIOR_CHART, name="posterior")],
        )

    def _signals(self) -> Section:
        noise = from_si("r_degps", self.study.misfit.noise.get("motion.r") or 0.0)
        rows: list[list[Cell]] = [
            [trial.trial, word, _yaw_error(trial.before, noise), _yaw_error(trial.found, noise)]
            for word, key in SET_KEYS.items()
            for trial in self.study.errors_over_windows[key]
        ]
        caption = "Yaw rate: error over windows of 5 ship lengths, of its root mean square"
        title = "Error over windows of five ship lengths, of each signal"
        chart = window_chart(self._sets(self.study.errors_over_windows), title=title)
        return Section(
            "Error of each signal",
            text=_FOLLOWED,
            tables=[table(caption, ("trial", "set", "before", "now"), rows)],
            charts=[Illustration(chart, name="windows")],
        )

    def _structures(self) -> Section:
        rows: list[list[Cell]] = []
        for name, structure in self.study.structures.items():
            *single, largest = (100 * error for error in structure.errors)
            rows.append([name, float(np.mean(single)), largest])
        heads = ("structure", "one at a time, mean (%)", "largest amplitudes (%)")
        caption = "Yaw-rate error of trials left out of the fit"
        return Section("Structure, by cross-validation", tables=[table(caption, heads, rows)])

    def _figures(self) -> list[Section]:
        """Figures by unit: in one column the digits of distances would hide the errors of angles."""
        tables = []
        for ending, caption, unit in (("_deg", "Overshoots", "deg"), ("_m", "Distances", "m")):
            rows = [
                _figure_row(figure, word, ending)
                for word in (HELD_OUT, FITTED)
                for figure in self.study.figures[SET_KEYS[word]]
                if figure.figure.endswith(ending)
            ]
            if rows:
                heads = [f"{name} ({unit})" for name in ("measured", "before", "now")]
                every = ["trial", "set", "figure", *heads, "error", f"95 % ({unit})"]
                tables.append(replace(table(caption, every, rows), wide=True))
        chart = figure_chart(self._sets(self.study.figures), title="Figures of turns and zigzags, in closed loop")
        charts = [Illustration(chart, caption=_FIGURE_CHART, name="figures")] if chart else []
        return [Section("Figures of manoeuvres", text=_FIGURES, tables=tables, charts=charts)] if tables else []

    def _sets(self, entries: Mapping[str, tuple[_T, ...]]) -> dict[str, tuple[_T, ...]]:
        """Words for a set of trials to its entries, without a set that has no trial."""
        windows = self.study.errors_over_windows
        return {word: entries[key] for word, key in SET_KEYS.items() if windows[key]}


def _compared(label: str, word: str, unit: str, before: float, after: float) -> KeyFigure:
    worse = Verdict.CAUTION if after > before else Verdict.NONE
    note = f"rms; before {before:.3g} {unit}" if np.isfinite(before) else "rms; before: not reached"
    return KeyFigure(f"{label}, {word}", float(f"{after:.3g}"), unit, verdict=worse, note=note)


def _rms(figures: Sequence[PredictedFigure], key: str, factor: float) -> float:
    """Root mean square error of figures by a card (``before`` or ``predicted``); NaN without any that is reached."""
    errors = [factor * figure.share_or_error(getattr(figure, key)) for figure in figures]
    reached = [error for error in errors if not np.isnan(error)]
    return float(np.sqrt(np.mean(np.square(reached)))) if reached else np.nan


def _widened(scale: Mapping[str, float]) -> str:
    wide = {group: factor for group, factor in scale.items() if factor > 1}
    if not wide:
        return ""
    text = ", ".join(f"{group} {factor:.3g} times" for group, factor in sorted(wide.items()))
    return f" The card's standard errors were widened as the trials demanded: {text}."


def _yaw_error(windows: Mapping[str, WindowError], noise: float) -> str:
    """Error of the yaw rate over windows, %; a phrase where such a share has no meaning."""
    if "r_degps" not in windows:
        return "no yaw rate measured"
    if windows["r_degps"].rms_signal < NO_YAW * noise:
        return "no yaw"
    return f"{100 * windows['r_degps'].relative:.3g} %"


def _figure_row(figure: PredictedFigure, word: str, ending: str) -> list[Cell]:
    error, interval = figure.share_or_error(figure.predicted), figure.interval_95
    text = f"{100 * error:+.1f} %" if ending == "_m" else f"{error:+.2f} deg"
    name = figure.figure.removesuffix(ending).replace("_", " ")
    expected = f"{interval[0]:.4g} to {interval[1]:.4g}" if interval else None
    numbers = [figure.measured, figure.before, figure.predicted]
    return [figure.trial, word, name, *numbers, None if np.isnan(error) else text, expected]


def _value_with_error(value: float, error: float) -> str:
    """Value and standard error in words: ``-0.0035 ± 0.00012``."""
    return f"{value:.5g} ± {error:.2g}"


def parameter_chart(parameters: Mapping[str, ParameterEstimate], *, title: str = "") -> ChartSpec:
    """Estimates with their 95 % intervals next to the priors', in standard errors of the prior; shares next to."""
    found = [_parameter_row(name, parameter) for name, parameter in parameters.items()]
    farthest = max((abs(row[key] or 0.0) for row in found for key in ("low", "high")), default=1.0)
    # A few derivatives may move by dozens of standard errors, where the others move by one.
    wide = farthest > 12
    across = PlotAxis(
        "value less prior, in standard errors of the prior (-)",
        zero=not wide,
        scale={"type": "symlog", "constant": 2} if wide else None,
        ticks=_symmetric_ticks(farthest) if wide else None,
    )
    look = series_look(["estimate", "prior"], as_points=["estimate", "prior"])
    prior = [row | {"run": "prior", "v": 0.0, "low": -_NORMAL, "high": _NORMAL} for row in found]
    shown = {"name:N": "parameter", "own:N": "found", "known:N": "before", "share_text:N": "from trials"}
    intervals = [
        *row_layers(RowPlot(found, across=across, look=look, shown=shown, rules=[Rule([0.0])]), size=34, yOffset=-4),
        *row_layers(RowPlot(prior, across=across, look=look, shown=shown), size=34, yOffset=4),
    ]
    shares = PlotAxis("information from trials (%)", domain=(0, 100))
    bare = {"labels": False, "ticks": False, "grid": False}
    bars = [{"name": row["name"], "v": row["share"]} | {key: row[key] for key in _SAID} for row in found]
    height = 21 * len(found)
    return {
        "hconcat": [
            layered(intervals, size=(400, height)),
            layered(
                row_layers(RowPlot(bars, across=shares, shown=shown, side=bare), mark="bar", height=9, opacity=0.7),
                size=(150, height),
            ),
        ],
        "spacing": 18,
        "title": title,
        "description": "Estimates and priors with 95 % intervals, and the share of the trials in each.",
        "usermeta": STACKS,
    }


def _parameter_row(name: str, parameter: ParameterEstimate) -> ChartRecord:
    unit, share = parameter.prior_standard_error, 100 * parameter.share_from_trials
    value = (parameter.value - parameter.before) / unit
    error = _NORMAL * parameter.standard_error / unit
    return {
        "name": name,
        "run": "estimate",
        "v": plain(value),
        "low": plain(value - error),
        "high": plain(value + error),
        "share": plain(share),
        "own": _value_with_error(parameter.value, parameter.standard_error),
        "known": _value_with_error(parameter.before, unit),
        "share_text": f"{share:.0f} %",
    }


def _symmetric_ticks(farthest: float) -> list[float]:
    steps = [step * 10.0**power for power in range(5) for step in (2, 5, 10)]
    positive = [step for step in steps if step <= farthest][:8]
    return [-step for step in reversed(positive)] + [0.0, *positive]


def _posterior_chart(
    parameters: Mapping[str, ParameterEstimate], posterior: PosteriorStudy, *, title: str = ""
) -> ChartSpec:
    """Median and intervals of 50 and 95 % of each sampled parameter, in its standard deviations from its mean.

    The grey band is the 95 % interval of a normal distribution.
    """
    rows: list[ChartRecord] = []
    for name, entry in posterior.parameters.items():
        mean, deviation = parameters[name].value, parameters[name].standard_error
        low, quarter, middle, three, high = entry.quantiles
        scaled = {"low": low, "quarter": quarter, "v": middle, "three": three, "high": high}
        shown = {key: plain((value - mean) / deviation) for key, value in scaled.items()}
        rows.append(
            {"name": name, **shown, "interval": f"{low:.4g} to {high:.4g}", "found": f"{middle:.4g}", "run": "samples"}
        )
    across = PlotAxis("value less mean, in standard deviations (-)", zero=True)
    shown_as = {"name:N": "parameter", "found:N": "median", "interval:N": "95 %"}
    layers = row_layers(RowPlot(rows, across=across, shown=shown_as), size=40)
    half = {"x": across.channel("quarter"), "x2": "three", "y": layers[0]["encoding"]["y"]}
    half["color"] = layers[0]["encoding"]["color"]
    normal = layer(
        "rect",
        [{"low": -_NORMAL, "high": _NORMAL}],
        {"x": across.channel("low"), "x2": "high"},
        style="reference",
        opacity=0.15,
    )
    return layered(
        [normal, *layers, layer("rule", rows, half, strokeWidth=4)],
        size=(560, 19 * len(rows)),
        title=title,
        description="Medians and intervals of sampled parameters next to the 95 % interval of a normal distribution.",
    )


def _correlation_chart(known: IdentifiabilityStudy, *, title: str = "") -> ChartSpec:
    """Correlation of the estimates by the trials alone, as a heat map; frames mark :data:`CLOSE_CORRELATION`."""
    names = list(known.parameters)
    step = max(8, min(24, 560 // len(names)))
    rows: list[ChartRecord] = [
        {"one": name, "other": column_name, "c": plain(float(value))}
        for name, row in zip(names, known.correlation, strict=True)
        for column_name, value in zip(names, row, strict=True)
    ]
    axis = {"labelLimit": 200, "ticks": False}
    (cells,) = Matrix(
        colour="c",
        rows=names,
        columns=names,
        names=("one", "other"),
        scale={"domain": [-1, 1], "scheme": "blueorange"},
        side=axis,
        foot=axis,
        shown={"one:N": "one", "other:N": "other", "c:Q": ("correlation", ".3f")},
        written=False,
    ).layers
    close = f"datum.one !== datum.other && abs(datum.c) > {CLOSE_CORRELATION}"
    frames = bare_layer(
        "rect",
        {name: cells["encoding"][name] for name in ("x", "y", "tooltip")},
        filled=False,
        stroke="black",
        strokeWidth=2,
    )
    pairs = len(known.correlated_pairs)
    text = f"Framed: {pairs} pairs above {CLOSE_CORRELATION:g} either way, which are known only together."
    return layered(
        [cells, frames | {"transform": [{"filter": close}]}],
        size=(step * len(names), step * len(names)),
        data={"values": rows},
        title=heading(title, f"Colour: correlation (-). {text}"),
        description=f"Correlation of {len(names)} parameters. {text}",
    )


def _singular_value_chart(values: Array, *, title: str = "") -> ChartSpec:
    """Singular values of the sensitivities in units of the prior, falling; below 1 the prior determines more."""
    rows = [{"order": order, "v": plain(value)} for order, value in enumerate(values.tolist(), start=1) if value > 0]
    across = PlotAxis("direction, by the information of the trials (-)", nice=False, padding=10, form="d", zero=True)
    x, up = across.channel("order"), PlotAxis("singular value (-)", log=True, form="~g")
    x["axis"] |= {"tickMinStep": 1}
    place: ChartSpec = {"x": x, "y": up.channel("v")}
    place["tooltip"] = tooltips({"order:Q": ("direction", "d"), "v:Q": "singular value"})
    return layered(
        [Rule([1.0], style="limit", dash=(5, 3)).layer(place["y"]), layer("point", rows, place, filled=True, size=45)],
        size=(620, 220),
        title=title,
        description=f"{len(rows)} singular values; {sum(value < 1 for value in values)} are below 1.",
    )
