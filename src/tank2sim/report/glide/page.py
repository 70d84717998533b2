"""The page of a glider: steady glides, polar, range, the path of a programme, and what the steady glides leave out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tank2sim.answer.page import Page
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table
from tank2sim.report.glide.charts import (
    corners_of,
    elevation_chart,
    isometric_chart,
    plan_chart,
    polar_chart,
    programme_chart,
    quasi_steady_chart,
    space_path,
    swing_chart,
)
from tank2sim.report.json_values import Json


def glide_page(found: Json) -> Page:
    """Return the page of the JSON of ``tank2sim glide``."""
    sections = [_design(found)]
    glides = [state for state in found["states"] if "duration_s" not in state]  # the others are of the programme
    if glides:
        sections.append(_glides(glides, found.get("as_printed") or ()))
    if "path" in found:
        sections.append(_path(found))
    if errors := found.get("quasi_steady_error"):
        sections.append(_quasi_steady(errors))
    sections.append(
        Section(heading="What to know of this card", text=f"From {found['source']}.", notes=found["notices"])
    )
    return Page(
        title=found["glider"],
        subtitle="Underwater glider",
        verdict=_verdict(found),
        figures=_figures(found),
        sections=sections,
    )


def _verdict(found: Json) -> str:
    least, fastest = found["design"]["smallest_angle_deg"], found["design"]["fastest_glide"]
    return (
        f"At its best the glider moves {1 / math.tan(math.radians(least)):.3g} m over the ground for each metre of "
        f"depth, on a path of {least:.3g} deg; it is fastest, {fastest['horizontal_speed_mps']:.3g} m/s over the "
        f"ground, at {-fastest['path_angle_deg']:.3g} deg."
    )


def _figures(found: Json) -> list[KeyFigure]:
    least, fastest = found["design"]["smallest_angle_deg"], found["design"]["fastest_glide"]
    fast = f"{fastest['horizontal_speed_mps']:.4g} m/s"
    distance = 1 / math.tan(math.radians(least))
    figures = [
        KeyFigure(label="Smallest path angle", value=least, unit="deg", note="the best glide"),
        KeyFigure(label="Distance for each metre of depth", value=distance, unit="m", note="at this angle"),
        KeyFigure(label="Fastest over the ground", value=-fastest["path_angle_deg"], unit="deg", note=fast),
    ]
    if transient := found.get("transient"):
        figures.append(
            KeyFigure(
                label="Programme flown by the transient model",
                value=max(transient["distance_m"]),
                unit="m",
                note="farthest from the path of steady glides",
            )
        )
    return figures


_HEADS = (
    Column(title="path angle", unit="deg"),
    Column(title="roll", unit="deg"),
    Column(title="net buoyancy", unit="kg"),
    Column(title="incidence", unit="deg"),
    Column(title="pitch", unit="deg"),
    Column(title="speed", unit="m/s"),
    Column(title="C_L"),
    Column(title="C_D"),
    Column(title="turning radius", unit="m"),
)


_KEYS = (
    "path_angle_deg",
    "roll_deg",
    "buoyancy_kg",
    "incidence_deg",
    "pitch_deg",
    "speed_mps",
    "lift_coefficient",
    "drag_coefficient",
    "turning_radius_m",
)
"""Key of each of :data:`_HEADS`."""


def _row(glide: Json) -> list[Cell]:
    return [glide[key] for key in _KEYS]


def _design(found: Json) -> Section:
    design = found["design"]
    marked = {"best glide": design["best_glide"], "fastest over the ground": design["fastest_glide"]}
    # Straight glides have no turning radius.
    tables = [
        Table(
            caption="Design glides",
            columns=[Column(title=""), *_HEADS[:-1]],
            rows=[[name, *_row(glide)[:-1]] for name, glide in marked.items()],
        )
    ]
    if design["ranges"]:
        tables.append(_ranges(design["ranges"]))
    text = (
        "The path angle, not the buoyancy, settles incidence and ratio of lift to drag; speeds go with the root of the "
        f"net buoyancy, here {found['buoyancy_kg']:g} kg. Below the smallest angle the drag is too large for "
        "the lift at any incidence."
    )
    caption = "From the best glide to almost straight down. Grey: the path of the best glide; no path is less steep."
    polar = Illustration(chart=polar_chart(found["polar"], marked, title="Glide polar"), caption=caption)
    return Section(heading="What is best", text=text, tables=tables, charts=[polar])


def _paths(found: Json) -> list[Illustration]:
    paths = [space_path("steady glides", found["path_histories"])]
    transient = found.get("transient")
    if transient:
        paths.append(space_path("transient", transient["histories"]))
    if "path_as_printed_histories" in found:
        paths.append(space_path("as printed", found["path_as_printed_histories"]))
    charts = [
        Illustration(chart=plan_chart(paths, title="Path from above")),
        Illustration(chart=elevation_chart(paths, title="Path from the side, rolled out")),
        Illustration(
            chart=isometric_chart(paths[0], corners_of(found["path"]), title="Path in isometric projection"),
            caption="Plumb lines lead from the shadow, at the height of the start, to the ends of the steps.",
        ),
    ]
    if transient:
        charts.append(Illustration(chart=programme_chart(transient, title="Programme and motion")))
    return charts


def _ranges(ranges: Sequence[Json]) -> Table:
    columns = [
        Column(title="path angle", unit="deg"),
        Column(title="net buoyancy", unit="kg"),
        Column(title="cycles"),
        Column(title="range", unit="km"),
        Column(title="time", unit="days"),
        Column(title="work against the pressure", unit="kJ"),
    ]
    units = {"path_angle_deg": 1, "buoyancy_kg": 1, "cycles": 1, "range_m": 1000, "duration_s": 86400, "energy_J": 1000}
    rows: list[list[Cell]] = [[row[key] / unit for key, unit in units.items()] for row in ranges]
    caption = f"Range on {ranges[0]['budget_kg']:g} kg of ballast pushed out at {ranges[0]['depth_m']:g} m"
    return Table(caption=caption, columns=columns, rows=rows)


def _glides(glides: Sequence[Json], printed: Sequence[Json]) -> Section:
    turning = any(glide["turning_radius_m"] is not None for glide in glides)
    heads, last = (_HEADS, len(_HEADS)) if turning else (_HEADS[:-1], -1)
    columns, rows = [*heads], [_row(glide)[:last] for glide in glides]
    if turning:
        columns.append(Column(title="with added mass", unit="m"))
        rows = [[*row, glide["turning_radius_with_added_mass_m"]] for row, glide in zip(rows, glides, strict=True)]
    tables = [Table(caption="Steady glides at the angles asked for", columns=columns, rows=rows)]
    if printed:
        columns = [*heads, Column(title="speed over that above", digits=3)]
        pairs = zip(printed, glides, strict=True)
        rows = [[*_row(row)[:last], row["speed_mps"] / glide["speed_mps"]] for row, glide in pairs]
        caption = "The same by the equations as printed"
        tables.append(Table(caption=caption, columns=columns, rows=rows))
    text = "Angles + up, incidence + when the flow comes from below"
    if turning:
        text += (
            ", roll + starboard side down: it turns a dive to starboard and a climb to port. The turning radius "
            "neglects the added mass, as published; the last column is that of the transient model, which has it"
        )
    return Section(heading="Steady glides", text=f"{text}.", tables=tables)


def _path(found: Json) -> Section:
    heads = {"t_s": "t|s", "x_m": "x north|m", "y_m": "y east|m", "height_m": "height|m", "heading_deg": "heading|deg"}
    columns = [Column(title=head.split("|")[0], unit=head.split("|")[1]) for head in heads.values()]
    rows: list[list[Cell]] = [[place[key] for key in heads] for place in found["path"]]
    table = Table(caption="Start and end of each step, steady glides", columns=columns, rows=rows)
    return Section(heading="Path of the programme", tables=[table], charts=_paths(found))


def _quasi_steady(errors: Json) -> Section:
    swings = swing_chart(errors["swings"], title="Error of the quasi-steady motion, swings")
    steps = quasi_steady_chart(errors["steps"], title="Error of the quasi-steady path, steps")
    return Section(
        heading="How slowly the controls must change",
        text="A path of steady glides holds where the controls change slowly. How slowly, "
        "the transient model shows: with mass and added mass, it flies swings and steps of the controls.",
        folded=True,
        charts=[
            Illustration(
                chart=swings,
                caption="Root mean square over a period, against the steady glide of the controls as they are at each "
                "moment: of the velocity by the speed; where roll swings, of the rate of turn by its own. What inertia "
                "does falls with the period. Roll keeps the share by which the added mass widens every turn. Swings "
                "quicker than the controls follow are small.",
            ),
            Illustration(
                chart=steps,
                caption="Farthest distance of the path of steady glides in four steps, the delay of the controls "
                "included. On straight paths each change costs a fixed distance, so that the error falls with the "
                "length of a step. In turns the added mass adds to it for as long as they last.",
            ),
        ],
    )
