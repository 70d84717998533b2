"""The page of a steering card: its models compared by turns, tracks and influence, and what is missing."""

from __future__ import annotations

from collections.abc import Mapping

import altair as alt

from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.charts.parts import NUMBER, Chart, ChartRecord, data, pan_zoom, plain, series_look
from tank2sim.answer.charts.theme import SHAPES
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.report.json_values import Json


def steering_catalogue_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim influence`` for a steering card."""
    return Page(
        title=found["ship"],
        subtitle="Steering models compared by their turns and their influence coefficients",
        verdict=_verdict(found),
        figures=_figures(found),
        sections=[
            _turning(found),
            _manoeuvres(found),
            _influence(found),
            *([_joint_variation(found)] if found["combined_predictions"] else []),
            *([_tuning(found["two_point_tuning"])] if found["two_point_tuning"] else []),
            _missing(found),
        ],
    )


def _verdict(found: Json) -> str:
    """How far apart the models are."""
    radii = {found["titles"][model]: table["radius_m"] for model, table in found["influence"].items()}
    if len(radii) < 2:
        return ""
    least, most = min(radii, key=lambda name: radii[name]), max(radii, key=lambda name: radii[name])
    return (
        f"At {found['rudder_deg']:g} deg of rudder the models turn with radii from {radii[least]:.3g} m ({least}) to "
        f"{radii[most]:.3g} m ({most})."
    )


def _figures(found: Json) -> list[KeyFigure]:
    figures = [
        KeyFigure(
            label=f"Radius, {found['titles'][model]}",
            value=table["radius_m"],
            unit="m",
            note=f"steady turn, {found['rudder_deg']:g} deg of rudder",
        )
        for model, table in found["influence"].items()
    ]
    incomplete = len(found["titles"]) - len(found["steady_turns"])
    note = f"of {len(found['titles'])}: their coefficients are not printed"
    verdict = Verdict.CAUTION if incomplete else Verdict.NONE
    return [*figures, KeyFigure(label="Models that cannot be computed", value=incomplete, note=note, verdict=verdict)]


def _turning(found: Json) -> Section:
    keys = ("rudder_deg", "radius_m", "yaw_rate_degpmin", "drift_deg")
    rows: list[list[Cell]] = [
        [found["titles"][model], *(turn[key] for key in keys)]
        for model, turns in found["steady_turns"].items()
        if model in found["manoeuvres"]
        for turn in turns
    ]
    columns = [
        Column(title="model"),
        Column(title="rudder", unit="deg"),
        Column(title="radius", unit="m"),
        Column(title="yaw rate", unit="deg/min", digits=3),
        Column(title="drift", unit="deg", digits=3),
    ]
    points = found["diagrams"]["points"]
    return Section(
        heading="Steady turning",
        text="Each model has a speed that does not fall in the turn. Its steady turns are followed from the straight "
        "course, so that they are those that the ship comes to.",
        charts=[_diagrams(found["diagrams"])],
        tables=[Table(caption="Steady turns", columns=columns, rows=rows)],
        notes=[f"{point['label']}: {point['source']}" for point in points if point["radius_measured"]],
    )


def _diagrams(diagrams: Json) -> Illustration:
    return Illustration(chart=steering_diagram_chart(diagrams), caption="Lines: models. Points: known turns.")


def steering_diagram_chart(diagrams: Json) -> alt.LayerChart:
    """Yaw rate (deg/min) against rudder (deg): the models as lines, the card's points on top, the tuned model too;
    from ``diagrams`` of the JSON."""
    lines: list[ChartRecord] = []
    for label, series in diagrams["models"].items():
        for place, (rudder, rate) in enumerate(zip(series["rudder_deg"], series["yaw_rate_degpmin"], strict=True)):
            lines.append({"run": label, "i": place, "d": plain(rudder), "r": plain(rate)})
    points: list[ChartRecord] = []
    for place, series in enumerate(diagrams["points"]):
        place_shown = {
            "d": plain(series["rudder_deg"]),
            "r": plain(series["yaw_rate_degpmin"]),
            "source": series["source"],
        }
        points.append({"run": series["label"], "i": place, **place_shown})
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
    line = Chart(data(lines), name="plot").mark_line(clip=True)
    unseen = Chart(data(lines)).mark_point(opacity=0, filled=True, size=110, clip=True)
    below = alt.Legend(title=None, orient="bottom")  # next to the lines they would be too wide for the page
    shape = alt.Shape("run:N", scale=alt.Scale(domain=marked, range=list(SHAPES[: len(marked)])), legend=below)
    point = Chart(data(points)).mark_point(style="start", filled=False, strokeWidth=1.8, clip=True)
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


def _influence(found: Json) -> Section:
    tables, printed = found["influence"], found["printed_influence"]
    names = list(dict.fromkeys(name for table in tables.values() for name in table["K_percent"]))
    columns = [Column(title=""), *(Column(title=found["titles"][model], digits=3) for model in tables)]
    rows: list[list[Cell]] = [[name, *(table["K_percent"].get(name) for table in tables.values())] for name in names]
    if printed:
        columns.append(Column(title=f"printed, {printed['draught_m']:g} m", digits=3))
        rows = [[*row, printed["K_percent"].get(str(row[0]))] for row in rows]
    models = {found["titles"][model]: table["K_percent"] for model, table in tables.items()}
    text = (
        f"K: change of the radius in % at {found['rudder_deg']:g} deg of rudder when one coefficient grows by 10 %. "
        "C_y are coefficients of the lateral force, C_m of the yaw moment, by powers of drift angle b, yaw rate w and "
        "rudder angle d: C_m_wwb is that of b w²."
    )
    return Section(
        heading="Influence on the steady radius",
        text=text,
        charts=[Illustration(chart=influence_bars(models))],
        tables=[Table(caption="K, %", columns=columns, rows=rows)],
    )


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
    bars = Chart(data(rows)).mark_bar(opacity=0.85).encode(x=x, y=y, yOffset=offset, color=colour, tooltip=tooltip)
    zero = Chart(data([{"K": 0.0}])).mark_rule(style="reference").encode(x="K:Q")
    return alt.layer(bars, zero).properties(
        title="Influence of each coefficient",
        width=620,
        height=alt.Step(11),
        description=f"Influence of {len(order)} coefficients on the steady radius in {', '.join(labels)}.",
    )


def _joint_variation(found: Json) -> Section:
    predictions = found["combined_predictions"]
    rows: list[list[Cell]] = []
    for model, prediction in predictions.items():
        direct, misread = (
            100 * (prediction[key] / prediction["radius_m"] - 1) for key in ("direct_m", "direct_misread_m")
        )
        rows += [
            [found["titles"][model], source, percent, radius]
            for source, percent, radius in (
                ("printed K, right pairs", prediction["percent"], prediction["predicted_m"]),
                ("printed K, as the source pairs them", prediction["misread_percent"], prediction["misread_m"]),
                ("K computed here", prediction["own_percent"], prediction["own_m"]),
                ("the model itself", direct, prediction["direct_m"]),
                ("the model with the source's slip", misread, prediction["direct_misread_m"]),
            )
        ]
    columns = [
        Column(title="to"),
        Column(title="by"),
        Column(title="change", unit="%", digits=3),
        Column(title="radius", unit="m"),
    ]
    names = next(iter(predictions.values()))["agreed_percent"]
    variations: list[list[Cell]] = [
        [name, *(prediction["agreed_percent"].get(name) for prediction in predictions.values())] for name in names
    ]
    heads = [Column(title=""), *(Column(title=found["titles"][model]) for model in predictions)]
    pairs = (found["printed_influence"] or {}).get("misread_as") or {}
    slip = ", ".join(f"{name} with the K of {misread}" for name, misread in pairs.items())
    return Section(
        heading="Agreed variation",
        text="Kc: change of each coefficient in % with 1 % of draught. The sum of Kc K / 10 predicts the radius.",
        tables=[
            Table(caption="Kc, %", columns=heads, rows=variations),
            Table(caption="Predicted and computed radius", columns=columns, rows=rows),
        ],
        notes=[f"The source multiplies {slip}: that slip, not the method, is the difference."] if slip else [],
        folded=True,
    )


def _manoeuvres(found: Json) -> Section:
    keys = ("advance_m", "transfer_m", "tactical_diameter_m", "steady_diameter_m")
    rows: list[list[Cell]] = []
    for model, figures in found["manoeuvres"].items():
        overshoots = [*(figures["zigzag"]["overshoots_deg"] or ()), None, None][:2]
        rows.append([found["titles"][model], *(figures["turn"][key] for key in keys), *overshoots])
    heads = [Column(title=key.removesuffix("_m").replace("_", " "), unit="m") for key in keys]
    overshoot_heads = [Column(title=f"{n} overshoot 10/10", unit="deg", digits=3) for n in ("first", "second")]
    tracks = [
        TrackData(label=label, x_m=history["x_m"], y_m=history["y_m"], time_s=history["t_s"])
        for label, history in found["histories"].items()
    ]
    chart = track_chart(tracks, title=f"Turning circles, {found['rudder_deg']:g} deg of rudder")
    columns = [Column(title="model"), *heads, *overshoot_heads]
    return Section(
        heading="Manoeuvres",
        text="The steady models in time, by drift angle and yaw rate, from a straight course.",
        charts=[Illustration(chart=chart)],
        tables=[Table(caption="Figures", columns=columns, rows=rows)],
    )


def _tuning(tuning: Json) -> Section:
    heading = "Two characteristics, two points"
    text = (
        "A steadier hull (static moment divided, damping multiplied by one factor) and a better rudder are found so "
        "that two measured points of the steering diagram are met."
    )
    if isinstance(tuning, str):
        return Section(heading=heading, text=text, notes=[tuning])
    rows: list[list[Cell]] = [
        [after["rudder_deg"], before["yaw_rate_degpmin"], after["yaw_rate_degpmin"]]
        for before, after in zip(tuning["before"], tuning["after"], strict=True)
    ]
    columns = [Column(title=title, unit="deg/min", digits=3) for title in ("rate before", "rate after")]
    factors: list[list[Cell]] = [["hull", tuning["hull_factor"]], ["rudder", tuning["rudder_factor"]]]
    notes = []
    if tuning["course_stable_before"] and not tuning["course_stable_after"]:
        notes.append("With these factors the ship, stable before, is unstable on a straight course.")
    return Section(
        heading=heading,
        text=text,
        tables=[
            Table(caption="Factors", columns=[Column(title=""), Column(title="factor")], rows=factors),
            Table(caption="Yaw rate", columns=[Column(title="rudder", unit="deg"), *columns], rows=rows),
        ],
        notes=notes,
    )


def _missing(found: Json) -> Section:
    rows: list[list[Cell]] = [
        [found["titles"][model], text] for model, texts in found["missing"].items() for text in texts
    ]
    polynomials: list[list[Cell]] = [[name, *values] for name, values in found["influence_over_draught"].items()]
    degrees = max((len(row) for row in polynomials), default=1) - 1
    heads = [Column(title=""), *(Column(title=f"T^{n}") for n in range(degrees))]
    tables = [Table(caption="Not known", columns=[Column(title="model"), Column(title="what")], rows=rows)]
    if polynomials:
        tables.append(
            Table(caption="K over the draught T in m, through its printed values", columns=heads, rows=polynomials)
        )
    return Section(heading="What is missing", text="As far as it is published.", tables=tables, folded=True)
