"""Manoeuvres of a craft with thrusters: a straight run, a turn by difference of revolutions, a spin.

Each drives a :class:`~tank2sim.simulation.running.Running` simulation of a model with inputs
``thrusters.<name>.command``. Revolutions are in rad/s. Which thruster is on which side is read off the model: one at
port (``thrusters.<name>.y`` < 0) that pushes ahead turns the craft to starboard.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from tank2sim.dynamics.model import Input, Model, Parameter
from tank2sim.simulation.running import Running, SwitchedManoeuvre, SwitchingPlan
from tank2sim.units import from_si

SPIN_HEADING = 4 * math.pi
"""Heading change of a spin: two turns; the second is steady. Project choice."""

DIFFERENCE_HEADING = math.radians(540.0)
"""Heading change of a turn by difference: as in a turning circle (ITTC 7.5-04-02-01)."""

_LONGEST_LENGTHS = 150.0
_STRAIGHT_LENGTHS = 30.0
"""Longest turn or spin, and length of a straight run, without a given duration, L/u0: project choices. Small craft
reach their speed within ten lengths."""


def thruster_commands(model: Model) -> tuple[Input, ...]:
    """The inputs of the revolutions of a craft's thrusters; none of a model without."""
    return tuple(
        variable
        for variable in model.inputs
        if variable.name.startswith("thrusters.") and variable.name.endswith(".command")
    )


def thruster_sides(model: Model) -> dict[str, float]:
    """Command of each thruster that pushes ahead to the side of the yaw moment it gives, 1 to starboard, -1, or 0."""
    sides = {}
    for command in thruster_commands(model):
        place = model[command.name.replace(".command", ".y")]
        assert isinstance(place, Parameter)
        if command.start:
            sides[command.name] = 0.0 if place.start == 0 else -math.copysign(1.0, place.start)
    return sides


def _opposed(model: Model, words: str) -> dict[str, float]:
    """As :func:`thruster_sides`; a craft without a thruster at one of the sides is refused."""
    sides = thruster_sides(model)
    if not {1.0, -1.0} <= set(sides.values()):
        raise model.fault("thrusters", f"are not on both sides, and {words} needs them", "give orders with file:")
    return sides


def _within(model: Model, orders: dict[str, float], words: str) -> dict[str, float]:
    """The orders; one beyond the largest revolutions is refused."""
    for name, value in orders.items():
        low, high = model[name].minimum, model[name].maximum
        assert low is not None and high is not None
        if not low * (1 + 1e-9) <= value <= high * (1 + 1e-9):
            ordered, lowest, highest = (from_si("n_rpm", speed) for speed in (value, low, high))
            problem = f"orders {ordered:.4g} rpm of {name.split('.')[1]}"
            raise model.fault(words, problem, f"it turns at {lowest:.4g} to {highest:.4g} rpm")
    return orders


def _at_rest(model: Model) -> dict[str, float]:
    """Parameters of a start at rest with stopped propellers."""
    names = [name for name in model.parameter_names if name.startswith("initial.") and name.endswith("_speed")]
    return {"initial.u": 0.0, **dict.fromkeys(names, 0.0)}


@dataclass(frozen=True)
class StraightRun:
    """From rest, the thrusters that push ahead at `revolutions` (rad/s; negative: astern)."""

    revolutions: float

    @property
    def words(self) -> str:
        """The text form of a manoeuvre, in rpm."""
        return f"straight:{from_si('n_rpm', self.revolutions):.10g}"

    def start(self, model: Model) -> dict[str, float]:
        """Parameters of the start."""
        return _at_rest(model)

    def drive(self, running: Running, ship_time: float, duration: float | None) -> None:
        """Run for `duration` s, by default 30 L/u0."""
        orders = dict.fromkeys(thruster_sides(running.model), self.revolutions)
        running.order(_within(running.model, orders, self.words))
        running.run(_STRAIGHT_LENGTHS * ship_time if duration is None else duration)


@dataclass(frozen=True)
class DifferenceTurn(SwitchedManoeuvre):
    """Turn from the cruising speed by a difference of revolutions, rad/s, port less starboard.

    Half of it is added to the cruising revolutions at one side and taken off at the other; positive turns to starboard.
    """

    difference: float

    @property
    def words(self) -> str:
        """The text form of a manoeuvre, in rpm."""
        return f"difference:{from_si('n_rpm', self.difference):.10g}"

    def start(self, model: Model) -> dict[str, float]:
        """Parameters of the start: the model's, at the cruising speed."""
        return {}

    def plan(self, model: Model, duration_s: float | None = None) -> SwitchingPlan:
        """Without a duration until the heading has changed by :data:`DIFFERENCE_HEADING` (at most 150 L/u0)."""
        starts = {command.name: command.start for command in thruster_commands(model)}
        sides = _opposed(model, self.words)
        orders = {name: starts[name] + side * self.difference / 2 for name, side in sides.items()}
        return _turned(_within(model, orders, self.words), self.difference, DIFFERENCE_HEADING, duration_s)


@dataclass(frozen=True)
class Spin(SwitchedManoeuvre):
    """From rest, port thrusters at `revolutions` (rad/s) and those at starboard at as many astern; + to starboard."""

    revolutions: float

    @property
    def words(self) -> str:
        """The text form of a manoeuvre, in rpm."""
        return f"spin:{from_si('n_rpm', self.revolutions):.10g}"

    def start(self, model: Model) -> dict[str, float]:
        """Parameters of the start."""
        return _at_rest(model)

    def plan(self, model: Model, duration_s: float | None = None) -> SwitchingPlan:
        """Without a duration until the heading has changed by :data:`SPIN_HEADING` (at most 150 L/u0)."""
        orders = {name: side * self.revolutions for name, side in _opposed(model, self.words).items()}
        return _turned(_within(model, orders, self.words), self.revolutions, SPIN_HEADING, duration_s)


def _turned(orders: Mapping[str, float], order: float, heading: float, duration_s: float | None) -> SwitchingPlan:
    """Orders until the heading has changed to the side of one of them."""
    side = math.copysign(1.0, order)
    changes = 1 if duration_s is None else 0
    return SwitchingPlan((orders, orders), "motion.psi", 2 * (side * heading,), side, changes, _LONGEST_LENGTHS)


ThrusterManoeuvre = StraightRun | DifferenceTurn | Spin
