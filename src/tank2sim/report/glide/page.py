"""The page of a glider: steady glides, polar, range, the path of a programme, and what the steady glides leave out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tank2sim.analysis.glide.steady import SteadyGlide
from tank2sim.analysis.glide.study import GlideStudy
from tank2sim.files import plain_json
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
from tank2sim.report.kit.json_values import Json
from tank2sim.report.kit.page import Cell, Column, Illustration, KeyFigure, Page, PageSection, PageTable


def glide_page(found: GlideStudy) -> Page:
    """The page of a study with views."""
    sections = [_design(found)]
    if found.glides:
        sections.append(_glides(found))
    if found.path:
        sections.append(_path(found))
    if found.errors:
        sections.append(_quasi_steady(plain_json(found.as_json()["quasi_steady_error"])))
    sections.append(PageSection(heading="What to know of this card", notes=found.notices))
    return Page(
        title=found.card.ship.name,
        subtitle=f"Underwater glider. {found.card.ship.source}",
        figures=_figures(found),
        sections=sections,
    )


def _figures(found: GlideStudy) -> list[KeyFigure]:
    least, fast = found.smallest_angle_rad, found.fastest
    figures = [
        KeyFigure(label="Smallest path angle", value=math.degrees(least), unit="deg", note="the best glide"),
        KeyFigure(label="Way for each metre of depth", value=1 / math.tan(least), unit="m", note="at this angle"),
        KeyFigure(label="Fastest over the ground", value=math.degrees(-fast.path_angle_rad), unit="deg",
               note=f"{fast.horizontal_speed_mps:.4g} m/s"),
    ]  # fmt: skip
    if found.compared:
        figures.append(
            KeyFigure(
                label="Programme flown by the transient model",
                value=float(found.compared.distance_m.max()),
                unit="m",
                note="farthest from the path of steady glides",
            )
        )
    return figures


_HEADS = (
    Column(title="path angle", unit="deg"),
    Column(title="roll", unit="deg"),
    Column(title="net buoyancy", unit="kg"),
    Column(title="incidence", unit="deg", digits=5),
    Column(title="pitch", unit="deg", digits=5),
    Column(title="speed", unit="m/s"),
    Column(title="C_L"),
    Column(title="C_D"),
    Column(title="turning radius", unit="m"),
)


def _row(glide: SteadyGlide) -> list[Cell]:
    angles = [math.degrees(angle) for angle in (glide.incidence_rad, glide.pitch_rad)]
    return [
        math.degrees(glide.path_angle_rad),
        math.degrees(glide.roll_rad),
        glide.buoyancy_kg,
        *angles,
        glide.speed_mps,
        glide.lift_coefficient,
        glide.drag_coefficient,
        glide.turning_radius_m if math.isfinite(glide.turning_radius_m) else None,
    ]


def _design(found: GlideStudy) -> PageSection:
    marked = [("best glide", found.best), ("fastest over the ground", found.fastest)]
    tables = [
        PageTable(
            caption="Design glides",
            columns=[Column(title=""), *_HEADS],
            rows=[[name, *_row(one)] for name, one in marked],
        )
    ]
    if found.ranges:
        tables.append(_ranges(found))
    text = (
        "The path angle, not the buoyancy, settles incidence and ratio of lift to drag; speeds go with the root of the "
        f"net buoyancy, here {found.card.glider.buoyancy_kg:g} kg. Below the smallest angle the drag is too large for "
        "the lift at any incidence."
    )
    return PageSection(heading="What is best", text=text, tables=tables, charts=_polar(plain_json(found.as_json())))


def glides_drawn(found: Json) -> list[PageSection]:
    """The charts of a study, from its JSON: polar, path, and the errors of the steady glides."""
    sections = [PageSection(heading="What is best", charts=_polar(found))]
    if "path_histories" in found:
        sections.append(PageSection(heading="Path of the programme", charts=_paths(found)))
    if errors := found.get("quasi_steady_error"):
        sections.append(_quasi_steady(errors))
    return [section for section in sections if section.charts]


def _polar(found: Json) -> list[Illustration]:
    design = found["design"]
    marked = {"best glide": design["best_glide"], "fastest over the ground": design["fastest_glide"]}
    caption = "From the best glide to almost straight down. A line from the origin has the angle of the path."
    return [Illustration(chart=polar_chart(found["polar"], marked, title="Glide polar"), caption=caption)]


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


def _ranges(found: GlideStudy) -> PageTable:
    first = found.ranges[0]
    columns = [
        Column(title="path angle", unit="deg"),
        Column(title="net buoyancy", unit="kg"),
        Column(title="cycles"),
        Column(title="range", unit="km"),
        Column(title="time", unit="days"),
        Column(title="work against the pressure", unit="kJ"),
    ]
    rows: list[list[Cell]] = []
    for one in found.ranges:
        start: list[Cell] = [math.degrees(one.path_angle_rad), one.buoyancy_kg, one.cycles]
        rows.append([*start, one.range_m / 1000, one.duration_s / 86400, one.energy_J / 1000])
    caption = f"Range on {first.budget_kg:g} kg of ballast pushed out at {first.depth_m:g} m"
    return PageTable(caption=caption, columns=columns, rows=rows)


def _glides(found: GlideStudy) -> PageSection:
    columns = [*_HEADS, Column(title="with added mass", unit="m")]
    rows: list[Sequence[Cell]] = [
        [*_row(glide), radius if math.isfinite(radius) else None]
        for glide, radius in zip(found.glides, found.radii_m, strict=True)
    ]
    tables = [PageTable(caption="Steady glides at the angles asked for", columns=columns, rows=rows)]
    if found.printed:
        heads = [*_HEADS, Column(title="speed by the right one", digits=3)]
        rows = [
            [*_row(printed), printed.speed_mps / glide.speed_mps]
            for printed, glide in zip(found.printed, found.glides, strict=True)
        ]
        tables.append(PageTable(caption="The same by the equations as the paper prints them", columns=heads, rows=rows))
    return PageSection(
        heading="Steady glides",
        text="Angles + up, incidence + when the flow comes from below, roll + starboard side down: it turns a dive to "
        "starboard and a climb to port. The turning radius neglects the added mass, as the paper does; the last column "
        "is that of the transient model, which has it.",
        tables=tables,
    )


def _path(found: GlideStudy) -> PageSection:
    assert found.path is not None
    heads = ("t|s", "x north|m", "y east|m", "height|m", "heading|deg")
    columns = [Column(title=head.split("|")[0], unit=head.split("|")[1]) for head in heads]
    rows: list[list[Cell]] = [
        [place.time_s, place.north_m, place.east_m, place.height_m, math.degrees(place.heading_rad)]
        for place in found.path.places
    ]
    table = PageTable(caption="Start and end of each step, steady glides", columns=columns, rows=rows)
    return PageSection(heading="Path of the programme", tables=[table], charts=_paths(plain_json(found.as_json())))


def _quasi_steady(errors: Json) -> PageSection:
    swings = swing_chart(errors["swings"], title="Error of the quasi-steady motion, swings")
    steps = quasi_steady_chart(errors["steps"], title="Error of the quasi-steady path, steps")
    return PageSection(
        heading="What slow means",
        text="The paper takes each moment for a steady glide because controls change slowly, and gives no number. Here "
        "the transient model, with mass and added mass, flies swings and steps of the controls.",
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
