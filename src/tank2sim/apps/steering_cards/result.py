"""Result of ``influence`` for a steering card: its models compared by turns, tracks and influence coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.charts.parts import plain
from tank2sim.answer.charts.rows import RowPlot, names_of, row_chart, runs_of
from tank2sim.answer.charts.theme import SHAPES
from tank2sim.answer.charts.vega import ChartRecord, ChartSpec, PlotAxis, Rule, channel, layer, tooltips
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, Verdict, data_frame, records_table, table
from tank2sim.answer.result import Result
from tank2sim.apps.steering_cards.card import SteeringCard
from tank2sim.apps.steering_cards.comparison import SteeringComparison, SteeringDiagrams
from tank2sim.apps.steering_cards.tuning_result import TUNING_TEXT, stability_change, turn_table
from tank2sim.apps.steering_cards.two_point_tuning import TwoPointTuning
from tank2sim.notices import Notice

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, repr=False)
class SteeringModelsResult(Result[SteeringComparison]):
    """The models of a steering card: steady turns, influence coefficients, manoeuvres, and missing data.

    Parameters
    ----------
    study : SteeringComparison
    card : SteeringCard, optional
        None if the result was read from its JSON.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.steering_models("poznyakov-yudin")
    >>> float(found.coefficients.loc["C_m_w", "inoue-hirano"].round(1))
    7.1
    """

    study: SteeringComparison
    card: SteeringCard | None = None
    command: ClassVar[str] = "influence"

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The card."""
        return (Path(self.card.source),) if self.card else ()

    @property
    def title(self) -> str:
        """The ship."""
        return self.study.ship

    @property
    def subtitle(self) -> str:
        """Kind of the comparison."""
        return "Steering models compared by their turns and their influence coefficients"

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Missing data of each model."""
        titles, missing = self.study.titles, self.study.missing
        return tuple(Notice(f"{titles[name]}: {text}") for name, texts in missing.items() for text in texts)

    @property
    def turns(self) -> pd.DataFrame:
        """Steady turns of every complete model: rudder (deg), radius (m), yaw rate (deg/min), drift (deg), speed."""
        rows = self.study.steady_turns.items()
        return data_frame([{"model": model, **asdict(turn)} for model, turns in rows for turn in turns])

    @property
    def coefficients(self) -> pd.DataFrame:
        """K %, the change of the radius for 10 % more of a coefficient (rows), by model (columns)."""
        return data_frame({model: dict(each.K_percent) for model, each in self.study.influence.items()})

    @property
    def headline(self) -> tuple[str, ...]:
        """The radii of the models, and the effect of the tuning on the stability or why there is no tuning."""
        study, titles = self.study, self.study.titles
        lines = [f"{study.ship}: {len(titles)} steering models."]
        radii = {titles[model]: each.radius_m for model, each in study.influence.items()}
        if len(radii) > 1:
            least, most = min(radii, key=lambda name: radii[name]), max(radii, key=lambda name: radii[name])
            lines.append(
                f"At {study.rudder_deg:g} deg of rudder the models turn with radii from {radii[least]:.3g} m ({least}) "
                f"to {radii[most]:.3g} m ({most})."
            )
        tuning = study.two_point_tuning
        if isinstance(tuning, str):
            lines.append(f"No tuning to the measured points: {tuning}.")
        if isinstance(tuning, TwoPointTuning):
            lines += stability_change(tuning)
        return tuple(lines)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The radius by each model, and the number of models without all coefficients."""
        study, titles = self.study, self.study.titles
        note = f"steady turn, {study.rudder_deg:g} deg of rudder"
        figures = [
            KeyFigure(f"Radius, {titles[model]}", each.radius_m, "m", note=note)
            for model, each in study.influence.items()
        ]
        incomplete = len(titles) - len(study.steady_turns)
        verdict = Verdict.CAUTION if incomplete else Verdict.NONE
        note = f"of {len(titles)}: their coefficients are not printed"
        label = "Models that cannot be computed"
        return [*figures, KeyFigure(label, incomplete, note=note, verdict=verdict)]

    @property
    def sections(self) -> Sequence[Section]:
        """Steady turning, manoeuvres, influence, the agreed variation, the tuning, and influence over the draught."""
        study = self.study
        return [
            self._turning(),
            self._manoeuvres(),
            self._influence(),
            *([self._agreed_variation()] if study.combined_predictions else []),
            *([_tuning(study.two_point_tuning)] if study.two_point_tuning else []),
            *([self._over_draught()] if study.influence_over_draught else []),
        ]

    def _turning(self) -> Section:
        study = self.study
        points = study.diagrams.points
        fields = ("rudder_deg", "radius_m", "yaw_rate_degpmin", "drift_deg")
        tables = [
            records_table(f"Steady turns, {study.titles[model]}", turns, fields=fields)
            for model, turns in study.steady_turns.items()
            if model in study.manoeuvres
        ]
        chart = steering_diagram_chart(study.diagrams)
        return Section(
            "Steady turning",
            text="The speed of each model does not fall in the turn. Its steady turns are followed from the straight "
            "course, so they are those that the ship reaches.",
            charts=[Illustration(chart, caption="Lines: models. Points: known turns.")],
            tables=tables,
            notes=[f"{point.label}: {point.source}" for point in points if point.radius_measured],
        )

    def _manoeuvres(self) -> Section:
        study = self.study
        keys = ("advance_m", "transfer_m", "tactical_diameter_m", "steady_diameter_m")
        rows: list[list[Cell]] = []
        for model, figures in study.manoeuvres.items():
            shown = figures.zigzag["overshoots_deg"]
            overshoots = [*(shown if isinstance(shown, list) else ()), None, None][:2]
            rows.append([study.titles[model], *(figures.turn[key] for key in keys), *overshoots])
        heads = [f"{key.removesuffix('_m').replace('_', ' ')} (m)" for key in keys]
        overshoot_heads = ("overshoot 1 (deg)", "overshoot 2 (deg)")
        tracks = [
            TrackData(label, x_m=history["x_m"], y_m=history["y_m"], time_s=history["t_s"])
            for label, history in study.histories.items()
        ]
        chart = track_chart(tracks, title=f"Turning circles, {study.rudder_deg:g} deg of rudder")
        caption = f"Turning circle at {study.rudder_deg:g} deg of rudder, and 10/10 zigzag"
        return Section(
            "Manoeuvres",
            text="The steady models in time, by drift angle and yaw rate, from a straight course.",
            charts=[Illustration(chart)],
            tables=[table(caption, ("model", *heads, *overshoot_heads), rows)],
        )

    def _influence(self) -> Section:
        study, printed = self.study, self.study.printed_influence
        models = {study.titles[model]: each.K_percent for model, each in study.influence.items()}
        names = list(dict.fromkeys(name for K in models.values() for name in K))
        heads = ["coefficient", *models]
        rows: list[list[Cell]] = [[name, *(K.get(name) for K in models.values())] for name in names]
        if printed:
            heads.append(f"printed, {printed.draught_m:g} m")
            rows = [[*row, printed.K_percent.get(name)] for name, row in zip(names, rows, strict=True)]
        text = (
            f"K: change of the radius in % at {study.rudder_deg:g} deg of rudder when one coefficient grows by 10 %. "
            "C_y are coefficients of the lateral force, C_m of the yaw moment, by powers of drift angle b, yaw rate w "
            "and rudder angle d: C_m_wwb belongs to b w²."
        )
        return Section(
            "Influence on the steady radius",
            text=text,
            charts=[Illustration(influence_bars(models))],
            tables=[table("K (%): change of the radius for 10 % more", heads, rows, digits=3)],
        )

    def _agreed_variation(self) -> Section:
        study, predictions = self.study, self.study.combined_predictions
        rows: list[list[Cell]] = []
        for model, found in predictions.items():
            direct, misread = (
                100 * (radius / found.radius_m - 1) for radius in (found.direct_m, found.direct_misread_m)
            )
            ways = (
                ("printed K, right pairs", found.percent, found.predicted_m),
                ("printed K, as the source pairs them", found.misread_percent, found.misread_m),
                ("K computed here", found.own_percent, found.own_m),
                ("the model itself", direct, found.direct_m),
                ("the model with the source's slip", misread, found.direct_misread_m),
            )
            rows += [[study.titles[model], way, percent, radius] for way, percent, radius in ways]
        names = next(iter(predictions.values())).agreed_percent
        variations: list[list[Cell]] = [
            [name, *(found.agreed_percent.get(name) for found in predictions.values())] for name in names
        ]
        pairs = study.printed_influence.misread_as if study.printed_influence else {}
        slip = ", ".join(f"{name} with the K of {misread}" for name, misread in pairs.items())
        heads = ["coefficient", *(study.titles[model] for model in predictions)]
        return Section(
            "Agreed variation",
            text="Kc: change of each coefficient in % with 1 % of draught. The sum of Kc K / 10 predicts the radius.",
            tables=[
                table("Kc (%)", heads, variations, on_screen=False),
                table("Predicted and computed radius", ("model", "by", "change (%)", "radius (m)"), rows),
            ],
            notes=[f"The source multiplies {slip}: that slip, not the method, is the difference."] if slip else [],
            folded=True,
        )

    def _over_draught(self) -> Section:
        rows: list[list[Cell]] = [[name, *values] for name, values in self.study.influence_over_draught.items()]
        heads = ["coefficient", *(f"T^{power}" for power in range(max(map(len, rows)) - 1))]
        caption = "K over the draught T in m, through its printed values"
        tables = [table(caption, heads, rows, on_screen=False)]
        return Section("Influence over the draught", tables=tables, folded=True)


def _tuning(tuning: TwoPointTuning | str) -> Section:
    heading = "Two characteristics, two points"
    if isinstance(tuning, str):
        return Section(heading, text=TUNING_TEXT, notes=[tuning])
    factors = table("Factors", ("hull", "rudder"), [[tuning.hull_factor, tuning.rudder_factor]])
    tables = [factors, turn_table(tuning)]
    return Section(heading, text=TUNING_TEXT, tables=tables, notes=stability_change(tuning))


def steering_diagram_chart(diagrams: SteeringDiagrams) -> ChartSpec:
    """Yaw rate (deg/min) against rudder (deg): the models as lines, the tuned one too, the card's points on top."""
    series = [
        PlotSeries(label, x=line.rudder_deg, y=line.yaw_rate_degpmin, closed=True)
        for label, line in diagrams.models.items()
    ]
    points: list[ChartRecord] = [
        {"run": one.label, "x": plain(one.rudder_deg), "v": plain(one.yaw_rate_degpmin), "source": one.source}
        for one in diagrams.points
    ]
    marked = runs_of(points)
    across = PlotAxis("rudder, starboard positive (deg)", padding=12)
    up = PlotAxis("yaw rate, starboard positive (deg/min)", zero=True)
    shown = {"run:N": "of", "x:Q": "rudder (deg)", "v:Q": "yaw rate (deg/min)"}
    # Next to the lines these names would be too wide for the page.
    below = {"title": None, "orient": "bottom"}
    place = {"x": across.channel("x"), "y": up.channel("v"), "tooltip": tooltips(shown)}
    place["shape"] = channel("run:N", scale={"domain": marked, "range": list(SHAPES[: len(marked)])}, legend=below)
    turns = layer("point", points, place, style="start", filled=False, strokeWidth=1.8, clip=True)
    return curve_chart(
        Plot(series, up=up, height_px=420, over=[turns] if points else []),
        across,
        title="Steering diagrams",
        described=f"Yaw rate against rudder angle of {', '.join(diagrams.models)}, with points of {', '.join(marked)}.",
        shown=shown,
    )


def influence_bars(models: Mapping[str, Mapping[str, float]]) -> ChartSpec:
    """K % of every coefficient as bars, the models side by side.

    `models`: words of each model to its K by coefficient.
    """
    rows: list[ChartRecord] = [
        {"run": title, "name": name, "v": plain(value)} for title, K in models.items() for name, value in K.items()
    ]
    return row_chart(
        RowPlot(
            rows,
            across=PlotAxis("change of the radius for 10 % more (%)", zero=True),
            apart=True,
            rules=[Rule([0.0])],
            side={"labelLimit": 160},
            shown={"run:N": "model", "name:N": "coefficient", "v:Q": ("K (%)", "+.2f")},
        ),
        title="Influence of each coefficient",
        described=f"Influence of {len(names_of(rows))} coefficients on the steady radius, by model.",
        step_px=11,
        mark="bar",
        height={"band": 1},
        opacity=0.85,
    )
