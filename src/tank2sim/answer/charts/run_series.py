"""From a simulated trajectory to what the charts of tracks and time histories take."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from tank2sim.answer.charts.picture import History, Signal, TrackData
from tank2sim.dynamics.model import Model
from tank2sim.simulation.thruster_manoeuvres import thruster_commands
from tank2sim.simulation.trajectory import Trajectory

SHIP_SIGNALS = {
    "rudder.angle": "rudder, + to starboard",
    "motion.psi": "heading",
    "motion.r": "yaw rate",
    "motion.u": "surge velocity",
    "motion.v": "sway velocity, + to starboard",
}
"""What the time histories of a ship show, from top to bottom, and the words on each axis."""


def shown_signals(model: Model) -> dict[str, str]:
    """What the time histories of a model of a ship show: :data:`SHIP_SIGNALS`, and heel if it has it.

    Revolutions of each thruster take the place of the rudder of a craft without one.
    """
    heel = {"motion.phi": "heel, + to starboard"} if "motion.phi" in model else {}
    if "rudder.angle" in model:
        return SHIP_SIGNALS | heel
    propellers = [command.name.replace("command", "speed") for command in thruster_commands(model)]
    revolutions = {name: f"{name.split('.')[1]} revolutions" for name in propellers}
    return revolutions | {name: words for name, words in SHIP_SIGNALS.items() if name != "rudder.angle"}


def track_data(label: str, run: Trajectory) -> TrackData:
    """The track of a run."""
    return TrackData(label=label, x_m=run["motion.x"], y_m=run["motion.y"], time_s=run.t)


def history_of(label: str, run: Trajectory, names: Iterable[str]) -> History:
    """Named signals of a run over time."""
    return History(label=label, time_s=run.t, values={name: run[name] for name in names})


def signals_of(model: Model, titles: Mapping[str, str]) -> list[Signal]:
    """Panels for named variables of a model, with their titles and the units that it declares."""
    return [Signal(name=name, title=title, unit=model[name].unit) for name, title in titles.items()]
