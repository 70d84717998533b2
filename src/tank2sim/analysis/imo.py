"""The manoeuvring criteria of IMO resolution MSC.137(76), from simulated trials."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tank2sim.dynamics.model import Model
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

TRIAL_RUDDER = math.radians(35.0)
"""Rudder of the turning circle trials: 35 deg, or the largest the gear allows."""


@dataclass(frozen=True)
class Criterion:
    """One criterion: what was found, what is allowed, in `unit`; `found` is None where the trial did not show it."""

    name: str
    found: float | None
    allowed: float
    unit: str

    @property
    def passed(self) -> bool | None:
        """True if met; None if the trial did not show it."""
        return None if self.found is None else self.found <= self.allowed

    def as_json(self) -> dict[str, object]:
        """The criterion with its verdict."""
        return {**vars(self), "passed": self.passed}


def imo_criteria(model: Model) -> tuple[Criterion, ...]:
    """Turning, initial turning, yaw checking of a ship at its speed of expansion (MSC.137(76), 5.3.1 to 5.3.3).

    The worse of starboard and port is taken. Stopping (5.3.4) needs a crash stop, which is outside the models' range.
    """
    integrator = Integrator(model)
    parameters = dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))
    time = parameters["ship.length"] / parameters["ship.speed"]
    # MSC.137(76) asks for calm water: a current on the card is part of one place, not of the ship.
    calm = {name: 0.0 for name in model.input_names if name in ("current.speed", "wind.speed")}
    rudder = min(TRIAL_RUDDER, parameters.get("steering.max_angle", TRIAL_RUDDER))

    def worst(manoeuvres: list[Turn] | list[Zigzag], *places: tuple[str, int | None]) -> list[float | None]:
        runs = [simulate(model, one, inputs=calm, integrator=integrator).figures for one in manoeuvres]
        found: list[float | None] = []
        for name, number in places:
            values = [_number(run[name], number) for run in runs]
            shown = [value for value in values if value is not None]
            found.append(max(shown) if len(shown) == len(values) else None)
        return found

    advance, tactical = worst(
        [Turn(rudder), Turn(-rudder)], ("advance_lengths", None), ("tactical_diameter_lengths", None)
    )
    ten, twenty = math.radians(10.0), math.radians(20.0)
    initial, first, second = worst(
        [Zigzag(ten, ten), Zigzag(-ten, ten)],
        ("initial_turning_lengths", None),
        ("overshoots_deg", 0),
        ("overshoots_deg", 1),
    )
    (first_of_twenty,) = worst([Zigzag(twenty, twenty), Zigzag(-twenty, twenty)], ("overshoots_deg", 0))
    return (
        Criterion("advance", advance, 4.5, "L"),
        Criterion("tactical diameter", tactical, 5.0, "L"),
        Criterion("initial turning, 10 deg rudder to 10 deg heading", initial, 2.5, "L"),
        Criterion("10/10 zigzag, first overshoot", first, min(max(5 + 0.5 * time, 10.0), 20.0), "deg"),
        Criterion("10/10 zigzag, second overshoot", second, min(max(17.5 + 0.75 * time, 25.0), 40.0), "deg"),
        Criterion("20/20 zigzag, first overshoot", first_of_twenty, 25.0, "deg"),
    )


def _number(figure: object, place: int | None) -> float | None:
    """A figure, or the one at a place of a list of them; None if the trial did not show it."""
    if isinstance(figure, list):
        figure = figure[place] if place is not None and place < len(figure) else None
    return figure if isinstance(figure, float) else None
