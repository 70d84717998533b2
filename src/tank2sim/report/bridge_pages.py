"""The pilot card (A4) and the wheelhouse poster (A3, landscape) of IMO A.601(15), as HTML that prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jinja2
from markupsafe import Markup

from tank2sim import __version__
from tank2sim.analysis.practice.bridge import SHALLOW, Bridge, ShipTrack
from tank2sim.report import bridge_boxes as boxes
from tank2sim.report.bridge_boxes import Box, Row
from tank2sim.report.bridge_drawings import Drawing, circles_drawing, stops_drawing
from tank2sim.report.page import beside

PANEL_MM = (90.0, 66.0)
STOPS_MM = (113.0, 58.0)
CARD_MM = (88.0, 52.0)
"""Width and height of the drawings."""

WARNING = "Performance may differ from this record due to environmental, hull and loading conditions"

_ANCHORS = tuple(Row(where, (None, None)) for where in ("Port", "Starboard", "Stern"))
_READY = (
    *("Anchors", "Whistle", "Radar 3 cm", "Radar 10 cm", "ARPA", "Speed log: water / ground", "Engine telegraphs"),
    *("Steering gear", "Power units operating", "Rudder indicator", "Rpm / pitch indicator", "Rate of turn indicator"),
    *("Gyro error ± ___°", "VHF", "Electronic position fixing"),
)


@dataclass(frozen=True)
class Panel:
    """Turning circles of one condition and depth; without a drawing it is a frame to be filled in by hand."""

    title: str
    drawing: Drawing | None = None
    box: Box | None = None


def poster_page(bridge: Bridge, ballast: Bridge | None = None) -> str:
    """The wheelhouse poster; with `ballast` the first card is the loaded condition.

    What the cards do not tell is left blank, and marked as a blank.
    """
    thruster = Box(
        "Thruster effect",
        tuple(Row(where, (None,) * 4) for where in ("Bow", "Stern", "Combined")),
        ("kW (HP)", "delay, reversal", "turning rate at zero speed", "not effective above"),
    )
    overboard = ("Buoy, order to the helm", "Recovery: turn, reversal at heading change", "Remarks")
    visibility = ("Blind distance ahead, loaded", "Blind distance ahead, ballast", "Height of eye")
    left = (
        boxes.draughts(bridge, ballast),
        boxes.steering(bridge),
        Box("Anchor chain", _ANCHORS, ("shackles", "heaving, min/shackle")),
        boxes.telegraph(bridge, ballast),
        boxes.engine(bridge),
    )
    right = (
        boxes.stopping(bridge),
        boxes.zigzags(bridge),
        boxes.draught_increase(bridge),
        thruster,
        Box("Man overboard rescue", tuple(Row(label, (None,)) for label in overboard)),
        Box("Visibility", tuple(Row(label, (None,)) for label in visibility)),
    )
    stops = stops_drawing(bridge.stops, width=STOPS_MM[0], height=STOPS_MM[1]) if bridge.stops else None
    return _rendered(
        "poster.html.j2",
        bridge,
        left=left,
        right=right,
        panels=_panels(bridge, ballast),
        stops=stops,
        notices=[*bridge.notices, *(ballast.notices if ballast else ())],
    )


def pilot_card_page(bridge: Bridge, ballast: Bridge | None = None) -> str:
    """The pilot card; with `ballast` the first card is the loaded condition."""
    ship = Box(
        "Ship's particulars",
        (
            *boxes.particulars(bridge)[6:],
            Row("Length overall", (None,)),
            Row("Displacement", boxes.particulars(bridge)[4].values),
            Row("Bulbous bow", ("☐ yes  ☐ no",)),
            Row("Air draught", (None,)),
            Row("Bow to bridge / bridge to stern", (None,)),
            Row("Parallel waterline loaded / ballast", (None,)),
        ),
    )
    thrusters = Box("Thrusters", tuple(Row(where, (None,)) for where in ("Bow, kW (HP)", "Stern, kW (HP)")))
    left = (
        ship,
        boxes.draughts(bridge, ballast),
        Box("Anchor chain", _ANCHORS, ("shackles", "m per shackle")),
        boxes.steering(bridge),
        thrusters,
    )
    right = (boxes.telegraph(bridge, ballast), boxes.engine(bridge), boxes.stopping(bridge))
    circles = None
    if bridge.deep:
        drawing = _circles(bridge, bridge.deep, CARD_MM)
        circles = Panel(_turning_title(bridge, "Deep water,"), drawing, boxes.turning(bridge, bridge.deep))
    return _rendered(
        "pilotcard.html.j2",
        bridge,
        left=left,
        right=right,
        circles=circles,
        zigzags=boxes.zigzags(bridge),
        ready=_READY,
        notices=[*bridge.notices, *(ballast.notices if ballast else ())],
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
    panels = []
    for condition, own, circles, where in wanted:
        title = f"{condition}, {where}"
        if own is None or not circles:
            panels.append(Panel(title))
        else:
            drawing = _circles(own, circles, PANEL_MM)
            panels.append(Panel(f"{title}: {_turning_title(own, '')}", drawing, boxes.turning(own, circles)))
    return tuple(panels)


def _turning_title(bridge: Bridge, where: str) -> str:
    return f"{where} rudder {bridge.rudder_deg:.3g}°, from {boxes.approach(bridge)}".strip()


def _circles(bridge: Bridge, circles: Sequence[ShipTrack], size: tuple[float, float]) -> Drawing:
    ship = bridge.card.ship
    return circles_drawing(circles, ship.length_m, ship.beam_m, width=size[0], height=size[1])


def _rendered(template: str, bridge: Bridge, **content: object) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("tank2sim", "report"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.trim_blocks = environment.lstrip_blocks = True
    return environment.get_template(template).render(
        version=__version__,
        style=Markup(beside("bridge.css")),
        ship=bridge.card.ship,
        particulars=boxes.particulars(bridge),
        warning=WARNING,
        **content,
    )
