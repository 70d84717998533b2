"""Simulation of a manoeuvre in a single call: trajectory, figures and notices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError
from tank2sim.notices import Notice
from tank2sim.quantities import LONGEST_RUN_S
from tank2sim.simulation.card_range import CardRangeReading, reading
from tank2sim.simulation.figures import Figures, figures_of
from tank2sim.simulation.integrator import NO_COMPILER, Integrator
from tank2sim.simulation.manoeuvres import MANOEUVRE_FORMS, THRUSTER_FORMS, Manoeuvre, Orders, Stop
from tank2sim.simulation.running import Running
from tank2sim.simulation.thruster_manoeuvres import ThrusterManoeuvre, thruster_commands
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.units import in_words


@dataclass(frozen=True)
class Run:
    """A simulated manoeuvre.

    Parameters
    ----------
    trajectory : Trajectory
        The motion.
    figures : dict
        Manoeuvring figures, units in their names; None for a figure that the run does not show.
    notices : tuple of Notice
        Messages for the user.
    reading : CardRangeReading
        The figures outside the card's range.
    missing : tuple of Notice
        Of `notices` those on figures that the run does not show.
    """

    trajectory: Trajectory
    figures: Figures
    notices: tuple[Notice, ...]
    reading: CardRangeReading
    missing: tuple[Notice, ...] = ()


def simulate(
    model: Model,
    manoeuvre: Manoeuvre,
    *,
    duration_s: float | None = None,
    inputs: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    integrator: Integrator | None = None,
) -> Run:
    """Simulate a manoeuvre, executed at t = 0 from the initial state of the model.

    Parameters
    ----------
    model : Model
        A ship.
    manoeuvre : Manoeuvre
        See :mod:`tank2sim.simulation.manoeuvres`.
    duration_s : float, optional
        By default the manoeuvre's.
    inputs, parameters : mapping, optional
        Values in place of the model's, by name.
    integrator : Integrator, optional
        An existing integrator of this model, to save its preparation.

    Raises
    ------
    InputError
        The model is not a ship, the duration is not positive, or the motion leaves all bounds.
    """
    _refuse_other_steering(model, manoeuvre)
    if duration_s is not None and not 0 < duration_s < LONGEST_RUN_S:
        remedy = f"give more than 0 and less than {LONGEST_RUN_S:g} s"
        raise ArgumentError("duration_s", "", f"is {duration_s:g} s", remedy)
    integrator = integrator or Integrator(model)
    values = model.parameters_by_name(model.parameter_values(parameters))
    start = manoeuvre.start(model) if isinstance(manoeuvre, ThrusterManoeuvre) else {}
    running = Running(integrator, inputs, {**start, **(parameters or {})})
    manoeuvre.drive(running, values["ship.length"] / values["ship.speed"], duration_s)
    trajectory = running.trajectory()
    figures = figures_of(manoeuvre, trajectory, values["ship.length"])
    read = reading(figures, trajectory, values)
    missing = () if isinstance(manoeuvre, Orders) else _not_shown(trajectory, figures)
    notices = (
        *read.notices,
        *model.notices,
        *_beyond_the_gear(trajectory, values.get("steering.max_angle")),
        *(() if integrator.compiled else (NO_COMPILER,)),
        *missing,
    )
    return Run(trajectory, figures, notices, read, missing)


def _refuse_other_steering(model: Model, manoeuvre: Manoeuvre) -> None:
    """Raise InputError if the model cannot do the manoeuvre: without rudder or thrusters, or with the other of them."""
    if isinstance(manoeuvre, ThrusterManoeuvre):
        if not thruster_commands(model):
            remedy = f"it takes {MANOEUVRE_FORMS}" if "rudder.command" in model else "give the card of a small craft"
            raise model.fault(manoeuvre.words, "needs thrusters, and it has none", remedy)
        return
    if "rudder.command" in model:
        return
    if not thruster_commands(model):
        raise model.fault("", "has no rudder", "manoeuvres need the card of a ship (kind linear, abkowitz or mmg)")
    if not isinstance(manoeuvre, Stop | Orders):
        remedy = f"it is steered by thrusters: {THRUSTER_FORMS}"
        raise model.fault(manoeuvre.words, "needs a rudder, and it has none", remedy)


def _not_shown(trajectory: Trajectory, figures: Figures) -> tuple[Notice, ...]:
    missing = dict.fromkeys(in_words(name)[0] for name, value in figures.items() if value is None)
    return (Notice(f"the run of {trajectory.t[-1]:.0f} s does not show: {', '.join(missing)}"),) if missing else ()


def _beyond_the_gear(trajectory: Trajectory, largest: float | None) -> list[Notice]:
    if largest is None:
        return []
    ordered = float(np.max(np.abs(trajectory["rudder.command"])))
    if ordered <= largest * (1 + 1e-9):
        return []
    angles = np.degrees([ordered, largest])
    return [Notice("the rudder was ordered to {:.4g} deg, but its gear stops at {:.4g} deg".format(*angles))]
