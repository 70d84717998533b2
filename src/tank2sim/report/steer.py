"""The page one steers on: the ship herself in it, rudder and engine, her track, and a measured trial as a ghost."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from tank2sim import __version__
from tank2sim.dynamics.model import Input, Model, Parameter, Vector
from tank2sim.errors import InputError
from tank2sim.fmu.interface import interface
from tank2sim.records.trials import Trial
from tank2sim.report.page import beside, json_in_html
from tank2sim.report.steer_ship import TOKEN, controls, references, shown_in

LONGEST_ZIGZAG = 150.0
"""A zigzag that has not ended after so many ship lengths is given up, as in the simulation."""

HISTORY = 25.0
"""Ship lengths that the chart over time shows at first; later it shows twice as many. A choice of ours."""

_SCRIPTS = ("steer_ship.js", "steer_chart.js", "steer.js")
_BEAM = 1 / 7
"""Beam over length of the drawn ship where the card states none: that of an ordinary merchant ship."""

# signal, what it is called, unit it is shown in, decimals
_READOUTS = (
    ("motion.speed", "Speed", "knots", 2),
    ("motion.sog", "Speed over ground", "knots", 2),
    ("motion.psi", "Heading", "deg", 1),
    ("motion.r", "Rate of turn", "deg/min", 1),
    ("motion.beta", "Drift angle", "deg", 2),
    ("rudder.angle", "Rudder", "deg", 1),
    ("propeller.speed", "Engine", "rpm", 1),
    ("motion.phi", "Heel", "deg", 1),
    ("validity", "Validity", "", 2),
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Ghost:
    """A measured trial beside the ship, SI, rad, arrays (n,); nan where nothing was measured.

    `start` holds the start of the ship on it (``initial.*``), by name.
    """

    label: str
    time_s: Vector
    x_m: Vector
    y_m: Vector
    psi_rad: Vector
    rudder_rad: Vector
    rpm_radps: Vector
    start: Mapping[str, float]


def ghost_of(trial: Trial) -> Ghost:
    """A trial as a ghost: its track from its first row on, and the rudder that steered it (the order, else the angle).

    Raises
    ------
    InputError
        The trial has no positions, or no heading at its start.
    """
    blank = np.full(len(trial.time_s), math.nan)
    signals = {name: np.asarray(values, dtype=float) for name, values in trial.signals.items()}
    if not np.isfinite(signals.get("x_m", blank)).any() or not np.isfinite(signals.get("y_m", blank)).any():
        raise InputError(trial.path, "columns x_m, y_m", "hold no track", "a ghost needs positions: leave out --ghost")
    start = {
        f"initial.{name}": _first(signals[f"{name}_{unit}"])
        for name, unit in (("x", "m"), ("y", "m"), ("u", "mps"), ("v", "mps"), ("r", "radps"))
        if np.isfinite(signals.get(f"{name}_{unit}", blank)).any()
    }
    psi = signals.get("psi_rad", blank)
    start["initial.psi"] = _first(psi) if np.isfinite(psi).any() else _course(signals["x_m"], signals["y_m"])
    if "delta_rad" in signals and np.isfinite(signals["delta_rad"]).any():
        start["initial.rudder_angle"] = _first(signals["delta_rad"])
    return Ghost(
        label=trial.name,
        time_s=trial.time_s - trial.time_s[0],
        x_m=signals["x_m"],
        y_m=signals["y_m"],
        psi_rad=psi,
        rudder_rad=signals.get("delta_order_rad", signals.get("delta_rad", blank)),
        rpm_radps=signals.get("n_radps", blank),
        start=start,
    )


def steering_page(model: Model, library: str | None, ghost: Ghost | None = None, notices: Sequence[str] = ()) -> str:
    """The page as one HTML file.

    Parameters
    ----------
    model : Model
        A ship.
    library : str or None
        Of :func:`tank2sim.report.steer_ship.ship_in_page`; None where it cannot be compiled, which the page tells.
    ghost : Ghost, optional
        A measured trial.
    notices : sequence of str
        What the user should be told.

    Raises
    ------
    InputError
        The model has no rudder.
    """
    if "rudder.command" not in model.input_names:
        raise InputError(model.name, "", "has no rudder", "only a ship (kind linear or abkowitz) can be steered")
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("tank2sim", "report"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    environment.trim_blocks = environment.lstrip_blocks = True
    return environment.get_template("steer.html.j2").render(
        name=model.name,
        description=model.description,
        version=__version__,
        notices=notices,
        ghost=ghost,
        library=library,
        controls=[one for one in controls(model) if one.name not in ("rudder.command", "propeller.speed")],
        rudder=controls(model)[0],
        engine=next((one for one in controls(model) if one.name == "propeller.speed"), None),
        approach=_approach(model, ghost),
        readouts=_readouts(model),
        fails="steering.failed" in model.input_names,
        style=Markup(beside("page.css") + beside("steer.css")),
        script=Markup("\n".join(beside(name) for name in _SCRIPTS)),
        data=json_in_html(_data(model, library, ghost)),
    )


def _data(model: Model, library: str | None, ghost: Ghost | None) -> dict[str, Any]:
    described = interface(model)
    length = _start(model, "ship.length")
    start = {name: value for name, value in (ghost.start if ghost else {}).items() if name in model}
    return {
        "name": model.name,
        "library": library,
        "token": TOKEN,
        "references": references(described),
        "step": model.step_s,
        "start": {"initial.u": _start(model, "initial.u")} | start,
        "length": length,
        "beam": _start(model, "ship.beam") if "ship.beam" in model else length * _BEAM,
        "longest": LONGEST_ZIGZAG * length / _start(model, "ship.speed"),
        "window": HISTORY * length / _start(model, "ship.speed"),
        "knots": shown_in(model["initial.u"], "knots")[1],
        "controls": [dataclasses.asdict(control) for control in controls(model)],
        "readouts": _readouts(model),
        "ghost": None if ghost is None else {"label": ghost.label, **_series(ghost)},
    }


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
    return [
        {"name": name, "label": label, "unit": unit, "digits": digits, "factor": shown_in(model[name], unit)[1]}
        for name, label, unit, digits in _READOUTS
        if name in names
    ]


def _approach(model: Model, ghost: Ghost | None) -> float:
    """Approach speed, knots: of the trial, else of the card."""
    measured = ghost.start.get("initial.u") if ghost else None
    return (_start(model, "initial.u") if measured is None else measured) * shown_in(model["initial.u"], "knots")[1]


def _start(model: Model, name: str) -> float:
    variable = model[name]
    assert isinstance(variable, Parameter | Input)
    return float(variable.start)


def _first(values: Vector) -> float:
    return float(values[np.isfinite(values)][0])


def _course(x: Vector, y: Vector) -> float:
    """Course (rad) of the first twentieth of a track: the approach."""
    known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    end = known[max(1, len(known) // 20)] if len(known) > 1 else known[0]
    return math.atan2(y[end] - y[known[0]], x[end] - x[known[0]])
