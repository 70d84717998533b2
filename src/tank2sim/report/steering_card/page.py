"""The page of a steering card: its models next to each other by turns, tracks and influence, and what is missing."""

from __future__ import annotations

import math
from collections.abc import Mapping

import altair as alt

from tank2sim.analysis.catalogue.comparison import SteeringComparison
from tank2sim.analysis.turning.two_point_tuning import TwoPointTuning
from tank2sim.cards.steering_card import SteeringCard
from tank2sim.files import plain_json
from tank2sim.report.kit.chart_parts import NUMBER, ChartRecord, data, pan_zoom, plain, series_look
from tank2sim.report.kit.json_values import Json
from tank2sim.report.kit.motion_charts import TrackData, track_chart
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable, Verdict
from tank2sim.report.kit.theme import SHAPES


def steering_catalogue_page(card: SteeringCard, found: SteeringComparison) -> Page:
    """The page of a comparison (:func:`tank2sim.analysis.catalogue.comparison.compare_steering_models`)."""
    told = plain_json(found.as_json())
    return Page(
        title=found.ship,
        subtitle="Steering models compared by their turns and their influence coefficients",
        figures=_figures(card, found),
        sections=[
            _turning(card, found, told),
            _influence(card, found, told),
            *([_agreed(card, found)] if found.predictions else []),
            _manoeuvres(card, found, told),
            *([_tuning(found)] if found.tuning else []),
            _missing(card, found),
        ],
    )


def _figures(card: SteeringCard, found: SteeringComparison) -> list[KeyFigure]:
    figures = [
        KeyFigure(
            label=f"Radius, {card.models[one.model].title}",
            value=one.radius_m,
            unit="m",
            note=f"steady turn, {found.rudder_deg:g} deg of rudder",
        )
        for one in found.influence
    ]
    incomplete = len(card.models) - len(found.turns)
    note = f"of {len(card.models)}: their coefficients are not printed"
    verdict = Verdict.CAUTION if incomplete else Verdict.NONE
    return [*figures, KeyFigure(label="Models that cannot be computed", value=incomplete, note=note, verdict=verdict)]


def _turning(card: SteeringCard, found: SteeringComparison, told: Json) -> PageSection:
    rows: list[list[Cell]] = []
    for one in found.turns:
        if one.model in found.runs:
            for turn in one.turns:
                row = turn.as_json()
                keys = ("rudder_deg", "radius_m", "yaw_rate_degpmin", "drift_deg")
                rows.append([one.title, *(row[key] for key in keys)])
    columns = [
        Column(title="model"),
        Column(title="rudder", unit="deg"),
        Column(title="radius", unit="m"),
        Column(title="yaw rate", unit="deg/min", digits=3),
        Column(title="drift", unit="deg", digits=3),
    ]
    notes = [f"{point.label}: {point.source}" for point in card.points if point.measured and point.radius_m]
    return PageSection(
        heading="Steady turning",
        text="Each model has a speed that does not fall in the turn. Its steady turns are followed from the straight "
        "course, so that they are those that the ship comes to.",
        charts=[_diagrams(told["diagrams"])],
        tables=[PageTable(caption="Steady turns", columns=columns, rows=rows)],
        notes=notes,
    )


def catalogue_drawn(found: Json) -> list[PageSection]:
    """The charts of a comparison, from its JSON: steering diagrams, influence, turning circles."""
    return [
        PageSection(heading="Steering diagrams", charts=[_diagrams(found["diagrams"])]),
        PageSection(heading="Influence on the steady radius", charts=[_bars(found)]),
        PageSection(heading="Turning circles", charts=[_circles(found)]),
    ]


def _diagrams(diagrams: Json) -> Illustration:
    return Illustration(chart=steering_diagram_chart(diagrams), caption="Lines: models. Points: known turns.")


def _bars(found: Json) -> Illustration:
    titles = found["titles"]
    return Illustration(
        chart=influence_bars({titles[name]: one["K_percent"] for name, one in found["influence"].items()})
    )


def _circles(found: Json) -> Illustration:
    runs = found["histories"].items()
    tracks = [TrackData(label=label, x_m=one["x_m"], y_m=one["y_m"], time_s=one["t_s"]) for label, one in runs]
    return Illustration(chart=track_chart(tracks, title=f"Turning circles, {found['rudder_deg']:g} deg of rudder"))


def steering_diagram_chart(diagrams: Json) -> alt.LayerChart:
    """Yaw rate (deg/min) against rudder (deg): the models as lines, the card's points on top, the tuned model too;
    from ``diagrams`` of the JSON."""
    lines: list[ChartRecord] = []
    for label, one in diagrams["models"].items():
        for place, (rudder, rate) in enumerate(zip(one["rudder_deg"], one["yaw_rate_degpmin"], strict=True)):
            lines.append({"run": label, "i": place, "d": plain(rudder), "r": plain(rate)})
    points: list[ChartRecord] = []
    for place, one in enumerate(diagrams["points"]):
        told = {"d": plain(one["rudder_deg"]), "r": plain(one["yaw_rate_degpmin"]), "source": one["source"]}
        points.append({"run": one["label"], "i": place, **told})
    return _diagram(lines, points)


def _diagram(lines: list[ChartRecord], points: list[ChartRecord]) -> alt.LayerChart:
    labels = list(dict.fromkeys(row["run"] for row in lines))
    marked = list(dict.fromkeys(row["run"] for row in points))
    look = series_look(labels)
    x = alt.X("d:Q", title="rudder, starboard positive (deg)", scale=alt.Scale(padding=12))
    y = alt.Y("r:Q", title="yaw rate, starboard positive (deg/min)")
    tooltip = [
        alt.Tooltip("run:N", title="of"),
        alt.Tooltip("d:Q", title="rudder (deg)", format=NUMBER),
        alt.Tooltip("r:Q", title="yaw rate (deg/min)", format=NUMBER),
    ]
    line = alt.Chart(data(lines), name="plot").mark_line(clip=True)
    unseen = alt.Chart(data(lines)).mark_point(opacity=0, filled=True, size=110, clip=True)
    below = alt.Legend(title=None, orient="bottom")  # next to the lines they would be too wide for the page
    shape = alt.Shape("run:N", scale=alt.Scale(domain=marked, range=list(SHAPES[: len(marked)])), legend=below)
    point = alt.Chart(data(points)).mark_point(style="start", filled=False, strokeWidth=1.8, clip=True)
    layers = [
        line.encode(x=x, y=y, color=look.colour, strokeDash=look.dash, order="i:Q"),
        unseen.encode(x=x, y=y, tooltip=tooltip),
        *([point.encode(x=x, y=y, shape=shape, tooltip=tooltip)] if points else []),
    ]
    return alt.layer(*layers, params=[pan_zoom("x", "y", views=["plot"])]).properties(
        title="Steering diagrams",
        width=720,
        height=420,
        description=f"Yaw rate against rudder angle of {', '.join(labels)}, with points of {', '.join(marked)}.",
    )


def _influence(card: SteeringCard, found: SteeringComparison, told: Json) -> PageSection:
    names = list(dict.fromkeys(name for one in found.influence for name in one.K_percent))
    printed = card.influence
    columns = [Column(title=""), *(Column(title=card.models[one.model].title, digits=3) for one in found.influence)]
    rows: list[list[Cell]] = [[name, *(one.K_percent.get(name) for one in found.influence)] for name in names]
    if printed:
        columns += [Column(title=f"printed, {printed.draughts_m[-1]:g} m", digits=3)]
        rows = [[*row, _last(printed.K_percent.get(str(row[0])))] for row in rows]
    return PageSection(
        heading="Influence on the steady radius",
        text=f"K: change of the radius in % at {found.rudder_deg:g} deg of rudder when one coefficient grows by 10 %.",
        charts=[_bars(told)],
        tables=[PageTable(caption="K, %", columns=columns, rows=rows)],
    )


def _last(values: list[float] | None) -> float | None:
    return values[-1] if values else None


def influence_bars(models: Mapping[str, Mapping[str, float]]) -> alt.LayerChart:
    """K % of every coefficient as bars, the models (title to K by coefficient) side by side."""
    rows: list[ChartRecord] = [
        {"run": title, "name": name, "K": plain(value)} for title, K in models.items() for name, value in K.items()
    ]
    order = list(dict.fromkeys(row["name"] for row in rows))
    labels = list(dict.fromkeys(row["run"] for row in rows))
    y = alt.Y("name:N", sort=order, title=None, axis=alt.Axis(labelLimit=160))
    offset = alt.YOffset("run:N", sort=labels)
    x = alt.X("K:Q", title="change of the radius for 10 % more (%)")
    tooltip = [
        alt.Tooltip("run:N", title="model"),
        alt.Tooltip("name:N", title="coefficient"),
        alt.Tooltip("K:Q", title="K (%)", format="+.2f"),
    ]
    legend = None if len(labels) == 1 else alt.Legend(title=None, symbolType="square")
    colour = alt.Color("run:N", scale=alt.Scale(domain=labels), legend=legend)
    bars = alt.Chart(data(rows)).mark_bar(opacity=0.85).encode(x=x, y=y, yOffset=offset, color=colour, tooltip=tooltip)
    zero = alt.Chart(data([{"K": 0.0}])).mark_rule(style="reference").encode(x="K:Q")
    return alt.layer(bars, zero).properties(
        title="Influence of each coefficient",
        width=620,
        height=alt.Step(11),
        description=f"Influence of {len(order)} coefficients on the steady radius in {', '.join(labels)}.",
    )


def _agreed(card: SteeringCard, found: SteeringComparison) -> PageSection:
    rows: list[list[Cell]] = []
    for name, prediction in found.predictions.items():
        title = card.models[name].title
        rows += [
            [title, "printed K, right pairs", prediction.percent, prediction.predicted_m],
            [title, "printed K, as the source pairs them", prediction.misread_percent, prediction.misread_m],
            [title, "K computed here", prediction.own_percent, prediction.own_m],
            [title, "the model itself", 100 * (prediction.direct_m / prediction.radius_m - 1), prediction.direct_m],
            [
                title,
                "the model with the source's slip",
                100 * (prediction.direct_misread_m / prediction.radius_m - 1),
                prediction.direct_misread_m,
            ],
        ]
    columns = [
        Column(title="to"),
        Column(title="by"),
        Column(title="change", unit="%", digits=3),
        Column(title="radius", unit="m"),
    ]
    names = list(next(iter(found.predictions.values())).agreed_percent)
    agreed: list[list[Cell]] = [
        [k, *(prediction.agreed_percent.get(k) for prediction in found.predictions.values())] for k in names
    ]
    heads = [Column(title=""), *(Column(title=card.models[name].title) for name in found.predictions)]
    slip = ", ".join(
        f"{one} with the K of {other}" for one, other in (card.influence.misread_as if card.influence else {}).items()
    )
    return PageSection(
        heading="Agreed variation",
        text="Kc: change of each coefficient in % with 1 % of draught. The sum of Kc K / 10 predicts the radius.",
        tables=[
            PageTable(caption="Kc, %", columns=heads, rows=agreed),
            PageTable(caption="Foretold and computed radius", columns=columns, rows=rows),
        ],
        notes=[f"The source multiplies {slip}: that slip, not the method, is the difference."] if slip else [],
    )


def _manoeuvres(card: SteeringCard, found: SteeringComparison, told: Json) -> PageSection:
    keys = ("advance_m", "transfer_m", "tactical_diameter_m", "steady_diameter_m")
    rows: list[list[Cell]] = []
    for name, run in found.runs.items():
        numbers = [run.turn_figures[key] for key in keys]
        overshoots = run.zigzag_figures["overshoots_deg"]
        first = [float(x) for x in overshoots[:2]] if isinstance(overshoots, list) else []
        cells: list[Cell] = [float(x) if isinstance(x, int | float) else None for x in (*numbers, *first)]
        rows.append([card.models[name].title, *cells, *[None] * (2 - len(first))])
    heads = [Column(title=key.removesuffix("_m").replace("_", " "), unit="m") for key in keys]
    over = [Column(title=f"{n} overshoot 10/10", unit="deg", digits=3) for n in ("first", "second")]
    return PageSection(
        heading="Manoeuvres",
        text="The steady models in time: (1) of the paper, drift angle and yaw rate, from a straight course.",
        charts=[_circles(told)],
        tables=[PageTable(caption="Figures", columns=[Column(title="model"), *heads, *over], rows=rows)],
    )


def _tuning(found: SteeringComparison) -> PageSection:
    heading = "Two characteristics, two points"
    text = (
        "A steadier hull (static moment divided, damping multiplied by one factor) and a better rudder are found so "
        "that two measured points of the steering diagram are met."
    )
    tuning = found.tuning
    if not isinstance(tuning, TwoPointTuning):
        return PageSection(heading=heading, text=text, notes=[str(tuning)])
    rows: list[list[Cell]] = [
        [math.degrees(after.rudder_rad), *(60 * math.degrees(turn.yaw_rate_radps) for turn in (before, after))]
        for before, after in zip(tuning.before, tuning.after, strict=True)
    ]
    columns = [Column(title=title, unit="deg/min", digits=3) for title in ("rate before", "rate after")]
    factors: list[list[Cell]] = [["hull", tuning.hull], ["rudder", tuning.rudder]]
    notes = []
    if tuning.stable_before and not tuning.stable_after:
        notes.append("With these factors the ship, stable before, is unstable on a straight course.")
    return PageSection(
        heading=heading,
        text=text,
        tables=[
            PageTable(caption="Factors", columns=[Column(title=""), Column(title="factor")], rows=factors),
            PageTable(caption="Yaw rate", columns=[Column(title="rudder", unit="deg"), *columns], rows=rows),
        ],
        notes=notes,
    )


def _missing(card: SteeringCard, found: SteeringComparison) -> PageSection:
    rows: list[list[Cell]] = [
        [card.models[name].title, words] for name, told in found.missing.items() for words in told
    ]
    polynomials: list[list[Cell]] = [[name, *values] for name, values in found.polynomials.items()]
    degrees = max((len(row) for row in polynomials), default=1) - 1
    heads = [Column(title=""), *(Column(title=f"T^{n}") for n in range(degrees))]
    tables = [PageTable(caption="Not known", columns=[Column(title="model"), Column(title="what")], rows=rows)]
    if polynomials:
        tables.append(
            PageTable(caption="K over the draught T in m, through its printed values", columns=heads, rows=polynomials)
        )
    return PageSection(heading="What is missing", text="As far as it is published.", tables=tables)
