"""Results of ``poster`` and ``pilotcard``: the wheelhouse poster and the pilot card of a ship (IMO A.601(15))."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

from markupsafe import Markup

from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.charts.parts import with_unit
from tank2sim.answer.page import filled_template, resource_text
from tank2sim.answer.parts import Cell, Column, Illustration, Section, Table, records_frame, records_table, table
from tank2sim.answer.result import Result
from tank2sim.apps.bridge import boxes
from tank2sim.apps.bridge.boxes import Box, Row
from tank2sim.apps.bridge.drawings import Drawing, circles_drawing, stops_drawing
from tank2sim.apps.bridge.ship_track import ShipTrack, TrackStudy
from tank2sim.apps.bridge.study import SHALLOW, Bridge, BridgeStudy, Telegraph, ZigzagStudy
from tank2sim.dynamics.effects.loading import mean_draught
from tank2sim.notices import Notice
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

PANEL_MM = (88.0, 62.0)
STOPS_MM = (113.0, 48.0)
CARD_MM = (88.0, 50.0)
WIDE_MM = (100.0, 96.0)
"""Width and height of the drawings; the wide one is of a poster on which no other circles are known."""

WARNING = "Performance may differ from this record due to environmental, hull and loading conditions"

_NAME, _SOURCE, _NOTICE, _NOTICES = 60, 260, 140, 4
"""Characters of the ship's name, of its source and of a notice, and notices, that one sheet has room for."""

_TRACKS = {
    "turning_circles_deep": "Turning circles, deep water",
    "turning_circles_shallow": "Turning circles, shallow water",
    "stops": "Stops",
}


@dataclass(frozen=True, eq=False, repr=False)
class BridgeResult(Result[BridgeStudy]):
    """Circles, stops, speeds by revolutions and zigzags of a ship on a sheet of paper; unknown values are blank.

    Parameters
    ----------
    study : BridgeStudy
    bridge : Bridge, optional
        Data of the ship, or of its loaded condition; None if the result was read from its JSON.
    ballast : Bridge, optional
        Data of its ballast condition.
    """

    study: BridgeStudy
    bridge: Bridge | None = None
    ballast: Bridge | None = None

    @property
    def blanks(self) -> int:
        """Blanks that are to be filled in by hand."""
        return self._html.count('title="not known') + self.beyond_card

    @property
    def beyond_card(self) -> int:
        """Blanks whose figures are outside the range of the card; they are hatched."""
        return self._html.count('title="outside')

    @property
    def telegraph(self) -> pd.DataFrame:
        """Orders of the engine telegraph ahead: revolutions (rpm) and steady speed (m/s), nan where it is not known."""
        return records_frame(self.study.telegraph, Telegraph)

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: {self.command}"

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship and number of blanks."""
        if self.bridge is None:
            again = f"tank2sim {self.command} CARD --page FILE.html"
            return f"Manoeuvring data of {self.study.ship}.", f"The sheet itself is not in the JSON: {again} draws it."
        hatched = self.beyond_card
        outside = f", {hatched} of them hatched: outside the range of the card" if hatched else ""
        return (f"{self.study.ship}: {self.blanks} blanks are to be filled in by hand{outside}",)

    @property
    def sections(self) -> Sequence[Section]:
        """Turning circles and stops (the way ahead is up), speeds by revolutions."""
        charts = []
        for field, title in _TRACKS.items():
            tracks = [
                TrackData(track.name, x_m=track.ahead_m, y_m=track.starboard_m) for track in getattr(self.study, field)
            ]
            if tracks:
                chart = track_chart(tracks, title=title)
                charts.append(Illustration(chart, caption="The ship heads up the page."))
        tables = [
            _figures_table(title, {track.name: track for track in getattr(self.study, field)})
            for field, title in _TRACKS.items()
        ]
        tables.append(_figures_table("Zigzags", self.study.zigzags))
        tables = [one for one in tables if one.rows]
        if self.study.telegraph:
            tables.append(records_table("Engine telegraph", self.study.telegraph, on_screen=False))
        if self.study.full_astern_from:
            tables.append(records_table("Full astern", self.study.full_astern_from, on_screen=False))
        return [Section("Manoeuvres", charts=charts, tables=tables)]

    def page(self) -> str:
        """The sheet: self-contained HTML that prints on one page."""
        return self._html if self.bridge is not None else super().page()

    @cached_property
    def _html(self) -> str:
        assert self.bridge is not None, "the JSON of a sheet does not hold its card"
        return self._sheet(self.bridge)

    def _sheet(self, bridge: Bridge) -> str:
        raise NotImplementedError


def _figures_table(caption: str, runs: Mapping[str, TrackStudy | ZigzagStudy]) -> Table:
    """One row a figure, one column a run; the sheets leave out figures outside the card's range, too."""
    names = dict.fromkeys(name for run in runs.values() for name in run.figures)
    rows: list[list[Cell]] = [
        [
            with_unit(*in_words(name)),
            *("beyond the card" if name in run.outside_card_range else run.figures.get(name) for run in runs.values()),
        ]
        for name in names
    ]
    return table(caption, [Column("figure"), *map(Column, runs)], rows, on_screen=False)


class PosterResult(BridgeResult):
    """The wheelhouse poster of a ship (A3, landscape).

    Parameters as for :class:`BridgeResult`.
    """

    command: ClassVar[str] = "poster"

    def _sheet(self, bridge: Bridge) -> str:
        return poster_page(bridge, self.ballast)


class PilotCardResult(BridgeResult):
    """The pilot card of a ship (A4).

    Parameters as for :class:`BridgeResult`.
    """

    command: ClassVar[str] = "pilotcard"

    def _sheet(self, bridge: Bridge) -> str:
        return pilot_card_page(bridge, self.ballast)


@dataclass(frozen=True)
class Check:
    """Something to be ticked on the pilot card; with `field` something is to be written next to it."""

    label: str
    field: bool = False


@dataclass(frozen=True)
class Panel:
    """Turning circles of one condition and depth; without a drawing it is a frame to be filled in by hand."""

    title: str
    drawing: Drawing | None = None
    box: Box | None = None


def poster_page(bridge: Bridge, ballast: Bridge | None = None) -> str:
    """The wheelhouse poster; with `ballast` the first card is the loaded condition.

    Values that the cards do not state are left blank, and marked as blanks.
    """
    left_column = (
        boxes.draughts(bridge, ballast),
        boxes.steering(bridge),
        boxes.anchors("heaving, min/shackle"),
        boxes.telegraph(bridge, ballast),
        boxes.engine(poster=True),
        boxes.visibility(),
    )
    right = (
        boxes.stopping(bridge),
        boxes.zigzags(bridge),
        boxes.draught_increase(bridge),
        boxes.squat(bridge),
        boxes.thrusters(),
        boxes.overboard(),
    )
    stops = stops_drawing(bridge.stops, width=STOPS_MM[0], height=STOPS_MM[1]) if bridge.stops else None
    return _rendered(
        "apps/bridge/poster.html.j2",
        bridge,
        left=left_column,
        right=right,
        panels=_panels(bridge, ballast),
        particulars=boxes.particulars(bridge),
        circles_title=_circles_title(bridge),
        stops=stops,
        notices=_notices(bridge, ballast),
    )


def pilot_card_page(bridge: Bridge, ballast: Bridge | None = None) -> str:
    """The pilot card; with `ballast` the first card is the loaded condition."""
    thrusters = Box("Thrusters", tuple(Row(where, (None,)) for where in ("Bow, kW (HP)", "Stern, kW (HP)")))
    shown = (
        boxes.present_condition(),
        boxes.of_the_ship(bridge),
        boxes.anchors(),
        thrusters,
        boxes.engine(poster=False),
        boxes.steering(bridge, units=False),
        boxes.telegraph(bridge, ballast),
        boxes.stopping(bridge),
    )
    circles = None
    if bridge.deep:
        drawing = _circles(bridge, bridge.deep, CARD_MM)
        circles = Panel(
            _turning_title(bridge, f"Deep water,{_draught(bridge)}"), drawing, boxes.turning(bridge, bridge.deep)
        )
    return _rendered(
        "apps/bridge/pilotcard.html.j2",
        bridge,
        boxes=shown,
        circles=circles,
        zigzags=boxes.zigzags(bridge),
        ready=_READY,
        notices=_notices(bridge, ballast),
    )


def _panels(bridge: Bridge, ballast: Bridge | None) -> tuple[Panel, ...]:
    first, second = boxes.conditions(bridge, ballast)
    shallow = f"shallow water, depth {SHALLOW:g} draughts"
    wanted: Sequence[tuple[str, Bridge | None, Sequence[ShipTrack], str]] = (
        (first, bridge, bridge.deep, "deep water"),
        (second, ballast, ballast.deep if ballast else (), "deep water"),
        (first, bridge, bridge.shallow, shallow),
        (second, ballast, ballast.shallow if ballast else (), shallow),
    )
    size = WIDE_MM if sum(1 for _, _, circles, _ in wanted if circles) == 1 else PANEL_MM
    panels = []
    for condition, bridge_shown, circles, where in wanted:
        title = f"{condition}, {where}"
        if bridge_shown is None or not circles:
            panels.append(Panel(title))
        else:
            drawing = _circles(bridge_shown, circles, size)
            panels.append(
                Panel(f"{title}: {_turning_title(bridge_shown, '')}", drawing, boxes.turning(bridge_shown, circles))
            )
    return tuple(panels)


def _turning_title(bridge: Bridge, where: str) -> str:
    return f"{where} rudder {bridge.study.rudder_deg:.3g}°, from {boxes.approach(bridge)}".strip()


def _draught(bridge: Bridge) -> str:
    """The card's draught: the present one is another."""
    draught = mean_draught(bridge.card)
    return "" if draught is None else f" mean draught {draught:.4g} m,"


def _circles_title(bridge: Bridge) -> str:
    gear = bridge.card.steering_gear
    if gear and gear.max_angle_rad:
        return "Turning circles at maximum rudder angle"
    return f"Turning circles at {bridge.study.rudder_deg:.3g}° rudder: the card states no maximum angle"


def _notices(*bridges: Bridge | None) -> list[Notice]:
    """As many notices as a sheet has room for; the command prints all."""
    cut = (
        Notice(_cut(each.line, _NOTICE), each.level) for bridge in bridges if bridge for each in bridge.study.notices
    )
    texts = list(dict.fromkeys(cut))
    omitted = len(texts) - _NOTICES
    return texts if omitted <= 0 else [*texts[:_NOTICES], Notice(f"and {omitted} more, which the command prints")]


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 2].rstrip()} …"


def _circles(bridge: Bridge, circles: Sequence[ShipTrack], size: tuple[float, float]) -> Drawing:
    ship = bridge.card.ship
    return circles_drawing(circles, ship.length_m, ship.beam_m, width=size[0], height=size[1])


def _rendered(template: str, bridge: Bridge, **content: object) -> str:
    return filled_template(
        template,
        style=Markup(resource_text("apps/bridge/sheet.css")),
        name=_cut(bridge.card.ship.name, _NAME),
        source=_cut(bridge.card.ship.source, _SOURCE),
        warning=WARNING,
        **content,
    )


_READY = (
    *(Check(label) for label in ("Anchors", "Whistle", "Radar  ☐ 3 cm  ☐ 10 cm", "ARPA")),
    Check("Speed log  ☐ Doppler  ☐ water  ☐ ground"),
    Check("Axes of the log  ☐ single  ☐ dual"),
    *(Check(label) for label in ("Engine telegraphs", "Steering gear")),
    Check("Number of power units operating", field=True),
    *(Check(label) for label in ("Rudder indicator", "Rpm / pitch indicator", "Rate of turn indicator")),
    Check("Compass system", field=True),
    Check("Constant gyro error, ± °", field=True),
    Check("VHF"),
    Check("Electronic position fixing, type", field=True),
)
