"""The manoeuvring criteria of IMO resolution MSC.137(76), from simulated trials, with the margin that is left."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import FULL_ASTERN, Manoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.run import simulate

TRIAL_RUDDER = math.radians(35.0)
"""Rudder of the turning circle trials: 35 deg, or the largest the gear allows."""

STOPPING, STOPPING_OF_LARGE_SHIPS = 15.0, 20.0
"""Track reach of full astern stopping, L: 15, and up to 20 where the Administration finds that impracticable for a ship
of large displacement (5.3.4)."""

SHORTEST_SHIP_M = 100.0
"""Ships to which the standards apply are 100 m long or longer (and chemical tankers and gas carriers of any length)."""

_SCALE = (
    "MSC.137(76) is for ships of 100 m and more: its limits of the 10/10 overshoots go with L/V in seconds, which a "
    "model does not keep, so scale the ship up for them"
)


@dataclass(frozen=True)
class Criterion:
    """One criterion: what was found, what is allowed, in `unit`; `found` is None where the trial did not show it.

    `remark` says why nothing was found, or what the reader of the verdict should know.
    """

    name: str
    found: float | None
    allowed: float
    unit: str
    remark: str = ""

    @property
    def passed(self) -> bool | None:
        """True if met; None if the trial did not show it."""
        return None if self.found is None else self.found <= self.allowed

    @property
    def margin(self) -> float | None:
        """What is left to the limit, in `unit`; negative if the criterion is not met."""
        return None if self.found is None else self.allowed - self.found

    @property
    def margin_percent(self) -> float | None:
        """The margin in per cent of what is allowed."""
        return None if self.margin is None else 100 * self.margin / self.allowed

    def as_json(self) -> dict[str, object]:
        """The criterion with its verdict and margin."""
        return {**vars(self), "passed": self.passed, "margin": self.margin, "margin_percent": self.margin_percent}


@dataclass(frozen=True)
class _Trials:
    """What runs the trials of one ship in calm water."""

    model: Model
    integrator: Integrator

    def run(self, manoeuvre: Manoeuvre) -> tuple[Figures, str]:
        """Figures of a trial, and why there are none."""
        # MSC.137(76) asks for calm water: a current on the card is part of one place, not of the ship.
        calm = {name: 0.0 for name in self.model.input_names if name in ("current.speed", "wind.speed")}
        try:
            return simulate(self.model, manoeuvre, inputs=calm, integrator=self.integrator).figures, ""
        except InputError as error:
            return {}, f"{error.place}: {error.problem}" if error.place else error.problem

    def worst(self, manoeuvres: Sequence[Manoeuvre], *places: tuple[str, int | None]) -> list[tuple[float | None, str]]:
        """The larger of each figure over the trials, and why there is none."""
        runs = [self.run(one) for one in manoeuvres]
        trouble = next((reason for _, reason in runs if reason), "")
        found: list[tuple[float | None, str]] = []
        for name, number in places:
            values = [_number(figures.get(name), number) for figures, _ in runs]
            shown = [value for value in values if value is not None]
            whole = len(shown) == len(values)
            found.append((max(shown), "") if whole else (None, trouble or "the run does not show it"))
        return found


def imo_criteria(model: Model) -> tuple[Criterion, ...]:
    """Turning, initial turning, yaw checking and stopping of a ship at her speed of expansion (5.3.1 to 5.3.4).

    The worse of starboard and port is taken. A trial that cannot be run leaves its criteria open, with the reason.
    """
    trials = _Trials(model, Integrator(model))
    parameters = dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))
    time = parameters["ship.length"] / parameters["ship.speed"]
    scale = _SCALE if parameters["ship.length"] < SHORTEST_SHIP_M else ""
    rudder = min(TRIAL_RUDDER, parameters.get("steering.max_angle", TRIAL_RUDDER))
    advance, tactical = trials.worst(
        [Turn(rudder), Turn(-rudder)], ("advance_lengths", None), ("tactical_diameter_lengths", None)
    )
    ten, twenty = math.radians(10.0), math.radians(20.0)
    initial, first, second = trials.worst(
        [Zigzag(ten, ten), Zigzag(-ten, ten)],
        ("initial_turning_lengths", None),
        ("overshoots_deg", 0),
        ("overshoots_deg", 1),
    )
    (of_twenty,) = trials.worst([Zigzag(twenty, twenty), Zigzag(-twenty, twenty)], ("overshoots_deg", 0))

    def criterion(name: str, found: tuple[float | None, str], allowed: float, unit: str, remark: str = "") -> Criterion:
        return Criterion(name, found[0], allowed, unit, found[1] or remark)

    return (
        criterion("advance", advance, 4.5, "L"),
        criterion("tactical diameter", tactical, 5.0, "L"),
        criterion("initial turning, 10 deg rudder to 10 deg heading", initial, 2.5, "L"),
        criterion("10/10 zigzag, first overshoot", first, min(max(5 + 0.5 * time, 10.0), 20.0), "deg", scale),
        criterion("10/10 zigzag, second overshoot", second, min(max(17.5 + 0.75 * time, 25.0), 40.0), "deg", scale),
        criterion("20/20 zigzag, first overshoot", of_twenty, 25.0, "deg"),
        _stopping(trials),
    )


def _stopping(trials: _Trials) -> Criterion:
    """Track reach of full astern stopping, as far as the card has propulsion."""
    name = "stopping, full astern, track reach"
    if "propeller.speed" not in trials.model.input_names:
        remark = "the card has no [propulsion]: its engine cannot be reversed"
        return Criterion(name, None, STOPPING, "L", remark)
    ((found, reason),) = trials.worst([Stop()], ("track_reach_lengths", None))
    remark = f"at {FULL_ASTERN:.0%} of the nominal revolutions astern, reached at once: an assumption of the simulation"
    if found is not None and STOPPING < found <= STOPPING_OF_LARGE_SHIPS:
        remark += "; up to 20 L may be allowed to a ship of large displacement"
    return Criterion(name, found, STOPPING, "L", reason or remark)


def _number(figure: object, place: int | None) -> float | None:
    """A figure, or the one at a place of a list of them; None if the trial did not show it."""
    if isinstance(figure, list):
        figure = figure[place] if place is not None and place < len(figure) else None
    return figure if isinstance(figure, float) else None
