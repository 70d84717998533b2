"""The page one steers on: the ship itself in it, rudder and engine, its track, and a measured trial as a ghost."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from tank2sim.answer.page import filled_template, resource_text
from tank2sim.apps.steering.ghost import Ghost
from tank2sim.apps.steering.members import NO_COVARIANCE
from tank2sim.apps.steering.scenario import Scenario
from tank2sim.apps.steering.ship import (
    Control,
    controls,
    levers_of,
    ship_equations,
    ship_tables,
    shown_in,
    telegraph_of,
    thrusters_of,
)
from tank2sim.dynamics.model import Input, Model, Parameter
from tank2sim.escaping import json_in_html
from tank2sim.notices import Notice

LONGEST_ZIGZAG = 150.0
"""A zigzag that has not ended after so many ship lengths is given up, as in the simulation."""

HISTORY = 25.0
"""Ship lengths that the chart over time shows at first, rounded to :data:`_WINDOWS`. Project choice."""

_WINDOWS = (10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200)
"""Stretches of time, s, that the chart over time may show: round ones, project choice."""

FASTEST_APPROACH = 2.0
"""Fastest approach that the page takes, in highest speeds of the card: beyond it nothing is known (project choice)."""


@dataclass(frozen=True, kw_only=True)
class _Scale:
    """How quickly a vessel answers, and in which units the page shows it.

    `pace`: times real time of the page at first; `predicted_s`, `predicted_first_s`: times ahead that the page
    predicts, and the one at first; `outlines_s`: time between outlines on the predicted curve; `units`: units of the
    vessel in place of a ship's.
    """

    pace: int
    predicted_s: tuple[int, ...]
    predicted_first_s: int
    outlines_s: int
    speed_digits: int
    units: Mapping[str, str]

    def unit(self, of_a_ship: str) -> str:
        """The unit of this vessel for a unit of a ship."""
        return self.units.get(of_a_ship, of_a_ship)


_SHIP = _Scale(
    pace=5,
    predicted_s=(60, 120, 180, 240, 300, 360),
    predicted_first_s=180,
    outlines_s=60,
    speed_digits=1,
    units={},
)
"""A ship takes minutes to answer. Project choice."""

_CRAFT = _Scale(
    pace=1,
    predicted_s=(5, 10, 20, 30, 60, 120),
    predicted_first_s=10,
    outlines_s=5,
    speed_digits=2,
    units={"knots": "m/s", "deg/min": "deg/s"},
)
"""A craft with thrusters comes through several of its lengths in seconds. Project choice."""

CRAFT_ZIGZAG = 0.25
"""Difference of revolutions of the zigzag that the page of a craft offers, over the largest. Project choice."""

_TURNING = (10.0, 20.0, 30.0, 60.0, 90.0, 120.0, 180.0, 300.0, 600.0, 1200.0, 1800.0)
"""Ends of the dial of the rate of turn, deg/min, of a craft deg/s: round ones, project choice."""

_USUAL_TURNING = 0.5
"""Yaw rate in ship lengths, r L/u0, that the dial shows at first: a hard turn of most ships. Project choice."""

_DIALS = ("motion.psi", "motion.r", "rudder.angle")
"""Signals with an instrument of their own."""

_SCRIPTS = tuple(
    f"{name}.js"
    for name in (
        *("ship", "levers", "voyage", "trial", "attempt", "score", "helm", "words"),
        *("pen", "view", "waters", "track", "history", "instruments", "telegraph", "gamepad", "page"),
    )
)
_VIEW_3D = ("three.min.js", "view3d.js")
"""three.js (MIT licence, ``three.LICENSE``), and what is seen from the bridge with it. Its release 149 is the last with
a single file that a plain script element takes without a warning."""

_BEAM = 1 / 7
"""Beam over length of the drawn ship where the card states none: an ordinary merchant ship's."""

# signal, what it is called, unit it is shown in, decimals
_READOUTS = (
    ("motion.u", "Speed ahead", "knots", 2),
    ("motion.sog", "Over ground", "knots", 2),
    ("motion.psi", "Heading", "deg", 1),
    ("motion.r", "Rate of turn", "deg/min", 1),
    ("motion.beta", "Drift angle", "deg", 2),
    ("rudder.angle", "Rudder", "deg", 1),
    ("propeller.speed_actual", "Engine", "rpm", 1),
    ("motion.phi", "Heel", "deg", 1),
    ("validity", "Validity", "", 2),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class PageShip:
    """The vessel of a page.

    Parameters
    ----------
    model : Model
        A ship; for a ghost with a measured rudder angle that of
        :func:`tank2sim.apps.steering.ship.ship_following_angle`.
    members : sequence of mapping
        Parameters by name of ships that are steered together with the card's (:mod:`.members`).
    autopilot : str
        How the autopilot in the model (:func:`tank2sim.dynamics.autopilot_loop.ship_steered_by_either`) was designed;
        empty if there is none.
    beam_m, draught_m : float, optional
        Of the drawn hull, and of what goes aground; without them the hull has the beam of an ordinary merchant ship,
        and no depth of a scenario holds it up.
    """

    model: Model
    members: Sequence[Mapping[str, float]] = ()
    autopilot: str = ""
    beam_m: float | None = None
    draught_m: float | None = None


def steering_page(
    ship: PageShip,
    ghost: Ghost | None = None,
    notices: Sequence[Notice] = (),
    scenario: Scenario | None = None,
    view_3d: bool = False,
) -> str:
    """The page as one HTML file.

    Parameters
    ----------
    ship : PageShip
    ghost : Ghost, optional
        A measured trial.
    notices : sequence of Notice
        What the user should know.
    scenario : Scenario, optional
        Waters to steer in.
    view_3d : bool
        Whether the page has the view from the bridge.

    Raises
    ------
    InputError
        The model has no rudder.
    """
    model = ship.model
    scale = _scale_of(model)
    equations = ship_equations(model)
    return filled_template(
        "apps/steering/page.html.j2",
        name=model.name,
        description=model.description,
        notices=notices,
        ghost=ghost,
        **_hand(model, ghost),
        pace=scale.pace,
        speed_unit=scale.unit("knots"),
        turning_unit=scale.unit("deg/min"),
        approach=_approach(model, ghost, scenario),
        windows=_windows(model),
        telegraph=telegraph_of(model),
        members=len(ship.members),
        no_members=NO_COVARIANCE,
        autopilot=ship.autopilot,
        scenario=scenario,
        ahead=([(one, _in_words(one, 60)) for one in scale.predicted_s], scale.predicted_first_s),
        dials=_DIALS,
        readouts=_readouts(model),
        fails="steering.failed" in model.input_names,
        view_3d=view_3d,
        style=Markup("".join(map(resource_text, _styles(view_3d)))),
        script=Markup("\n".join([equations, *(resource_text(f"apps/steering/{name}") for name in _scripts(view_3d))])),
        data=json_in_html(_data(ship, equations, ghost, scenario)),
    )


def _scale_of(model: Model) -> _Scale:
    """The scale of a vessel; InputError for one that cannot be steered."""
    if thrusters_of(model):
        return _CRAFT
    if "rudder.command" not in model.input_names:
        remedy = "a ship (kind linear, abkowitz or mmg) can be steered, and a craft with fixed thrusters at both sides"
        raise model.fault("", "has no rudder and no thrusters that steer", remedy)
    return _SHIP


def _hand(model: Model, ghost: Ghost | None) -> dict[str, Any]:
    """What the user sets: rudder and engine, or thrusters with their two levers; and all other inputs."""
    found, levers = _controls(model, ghost), levers_of(model)
    names = {thruster.name for thruster in thrusters_of(model)}
    by_name = {control.name: control for control in found}
    taken = {*names, "propeller.speed", "rudder.command"}
    return {
        "rudder": by_name.get("rudder.command"),
        "engine": by_name.get("propeller.speed"),
        "levers": levers,
        "thrusters": [control for control in found if control.name in names],
        "controls": [control for control in found if control.name not in taken],
        "zigzag": round(CRAFT_ZIGZAG * (levers[1].maximum or 0.0), -1) if levers else 20,
        "zigzag_most": levers[1].maximum if levers else 89,
    }


def _styles(view_3d: bool) -> list[str]:
    return ["answer/page.css", "apps/steering/page.css", *(["apps/steering/view3d.css"] if view_3d else [])]


def _scripts(view_3d: bool) -> list[str]:
    """The scripts in their order; the view from the bridge goes before the last, which makes the chart."""
    *parts, page = _SCRIPTS
    return [*parts, *(_VIEW_3D if view_3d else ()), page]


def _data(ship: PageShip, equations: str, ghost: Ghost | None, scenario: Scenario | None) -> dict[str, Any]:
    data = _ship_data(ship, ghost, scenario)
    # Names the ship, the trial, the scenario and all that moves them: a link with an attempt is of this page alone.
    return {**data, "id": hashlib.sha256((equations + json.dumps(data, sort_keys=True)).encode()).hexdigest()[:8]}


def _ship_data(ship: PageShip, ghost: Ghost | None, scenario: Scenario | None) -> dict[str, Any]:
    model, scale = ship.model, _scale_of(ship.model)
    length, speed = _start(model, "ship.length"), _start(model, "ship.speed")
    gear = [math.degrees(parameter.start) for parameter in model.parameters if parameter.name == "steering.max_angle"]
    return {
        "name": model.name,
        **ship_tables(model, {name for member in ship.members for name in member}),
        "members": [dict(member) for member in ship.members],
        "telegraph": [{"name": order.name, "value": order.value} for order in telegraph_of(model)],
        "turning": _turning(shown_in(model["motion.r"], scale.unit("deg/min"))[1] * _USUAL_TURNING * speed / length),
        "thrusters": [dataclasses.asdict(thruster) for thruster in thrusters_of(model)],
        "levers": [dataclasses.asdict(lever) for lever in levers_of(model)],
        "largestRudder": (levers_of(model)[-1:] or _controls(model, ghost))[0].maximum,
        "outlines": scale.outlines_s,
        "speed": speed,
        "step": model.step_s,
        "start": {"initial.u": _start(model, "initial.u")} | _begin(ghost, scenario),
        "scenario": None if scenario is None else scenario.as_data(),
        "length": length,
        "beam": ship.beam_m or length * _BEAM,
        "draught": ship.draught_m,
        "longest": LONGEST_ZIGZAG * length / speed,
        "stop": gear[0] if gear else None,
        "speeds": {
            "unit": scale.unit("knots"),
            "factor": shown_in(model["initial.u"], scale.unit("knots"))[1],
            "digits": scale.speed_digits,
        },
        "controls": [dataclasses.asdict(control) for control in _controls(model, ghost)],
        "readouts": _readouts(model),
        "ghost": None if ghost is None else {"label": ghost.label, "angle": ghost.by_angle, **_series(ghost)},
    }


def _begin(ghost: Ghost | None, scenario: Scenario | None) -> dict[str, float]:
    """Start of the ship by parameter, from a measured trial or a scenario."""
    if scenario is not None:
        speed = {} if scenario.speed is None else {"initial.u": scenario.speed}
        return {"initial.psi": scenario.heading, **speed}
    return dict(ghost.start) if ghost else {}


def _controls(model: Model, ghost: Ghost | None) -> list[Control]:
    """Settings of the user: at first as on the card, or as in the trial."""
    held = ghost.held if ghost else {}
    return [dataclasses.replace(control, start=held.get(control.name, control.start)) for control in controls(model)]


def _windows(model: Model) -> tuple[list[tuple[int, str]], int]:
    """Stretches that the chart over time may show (s, in words), and the one at first, s."""
    wanted = HISTORY * _start(model, "ship.length") / _start(model, "ship.speed")
    place = min(range(1, len(_WINDOWS) - 2), key=lambda index: abs(math.log(_WINDOWS[index] / wanted)))
    shown = _WINDOWS[place - 1 : place + 3]
    return [(window, _in_words(window, 120)) for window in shown], _WINDOWS[place]


def _in_words(time_s: int, from_s: int) -> str:
    """A time in words, in minutes from a time on."""
    return f"{time_s} s" if time_s < from_s else f"{time_s / 60:g} min"


def _turning(usual: float) -> list[float]:
    """Ends of the dial of the rate of turn from the one that holds a usual rate on, deg/min, of a craft deg/s."""
    return [end for end in _TURNING if end >= usual] or [_TURNING[-1]]


def _series(ghost: Ghost) -> dict[str, list[float | None]]:
    columns = {
        "t": ghost.time_s,
        "x": ghost.x_m,
        "y": ghost.y_m,
        "psi": ghost.psi_rad,
        "rudder": ghost.rudder_rad,
        "engine": ghost.rpm_radps,
    }
    return {
        name: [float(f"{value:.9g}") if math.isfinite(value) else None for value in values]
        for name, values in columns.items()
    }


def _readouts(model: Model) -> list[dict[str, Any]]:
    names = {*model.outputs, *model.state_names, *model.input_names}
    scale, wanted = _scale_of(model), [*_READOUTS]
    for thruster in thrusters_of(model):
        prefix = thruster.name.removesuffix(".command")
        wanted += [
            (f"{prefix}.speed", thruster.label, "rpm", 0),
            (f"{prefix}.thrust", f"{thruster.label} thrust", "N", 0),
        ]
    return [
        {"name": name, "label": label, "unit": shown, "digits": digits, "factor": shown_in(model[name], shown)[1]}
        for name, label, unit, digits in wanted
        for shown in [scale.unit(unit)]
        if name in names
    ]


def _approach(model: Model, ghost: Ghost | None, scenario: Scenario | None) -> dict[str, float]:
    """Approach speed of the trial or the scenario, else of the card, and its bounds, knots, of a craft m/s."""
    factor = shown_in(model["initial.u"], _scale_of(model).unit("knots"))[1]
    measured = _begin(ghost, scenario).get("initial.u")
    speed = _start(model, "initial.u") if measured is None else measured
    fastest = max(FASTEST_APPROACH * _start(model, "ship.fastest"), speed)
    return {"value": speed * factor, "minimum": min(0.0, speed * factor), "maximum": fastest * factor}


def _start(model: Model, name: str) -> float:
    variable = model[name]
    assert isinstance(variable, Parameter | Input)
    return float(variable.start)
