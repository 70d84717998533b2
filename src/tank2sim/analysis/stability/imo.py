"""The manoeuvring criteria of IMO resolution MSC.137(76), from simulated trials, with their margins."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import entry_name, single_figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import FULL_ASTERN, Manoeuvre, Stop, Turn, Zigzag
from tank2sim.simulation.run import Run, simulate

TRIAL_RUDDER = math.radians(35.0)
"""Rudder of the turning circle trials: 35 deg, or the largest of the gear."""

STOPPING, STOPPING_OF_LARGE_SHIPS = 15.0, 20.0
"""Track reach of full astern stopping, L: 15, and up to 20 where the Administration finds that impracticable for a ship
of large displacement (5.3.4)."""

SHORTEST_SHIP_M = 100.0
"""Least length of ships to which the standards apply: 100 m (and chemical tankers and gas carriers of any length)."""

_SCALE = (
    "MSC.137(76) is for ships of 100 m and more: its limits of the 10/10 overshoots go with L/V in seconds, which a "
    "model does not keep, and the card states no scale: judge the overshoots at full scale"
)

_TURNED = math.radians(90.0)
"""Turn against the rudder from which a ship responds the wrong way, not late. Project choice."""


ADVANCE, TACTICAL = "advance", "tactical diameter"
INITIAL = "initial turning, 10 deg rudder to 10 deg heading"
FIRST_OF_TEN, SECOND_OF_TEN = "10/10 zigzag, first overshoot", "10/10 zigzag, second overshoot"
FIRST_OF_TWENTY, TRACK_REACH = "20/20 zigzag, first overshoot", "stopping, full astern, track reach"


@dataclass(frozen=True)
class ManoeuvringTrial:
    """A trial, to both sides where it has sides, and the figure of each criterion: the larger of the two sides."""

    manoeuvres: tuple[Turn | Zigzag | Stop, ...]
    criteria: Mapping[str, str]


def largest_trial_rudder(parameters: Mapping[str, float]) -> float:
    """Rudder of the turning circles of a ship with parameters by name, rad."""
    return min(TRIAL_RUDDER, parameters.get("steering.max_angle", TRIAL_RUDDER))


def manoeuvring_trials(rudder: float) -> tuple[ManoeuvringTrial, ...]:
    """Turning circles at `rudder`, 10/10 and 20/20 zigzags, and at last the stop with full astern: their criteria."""
    ten, twenty = math.radians(10.0), math.radians(20.0)
    of_turn = {ADVANCE: "advance_lengths", TACTICAL: "tactical_diameter_lengths"}
    of_ten = {
        INITIAL: "initial_turning_lengths",
        FIRST_OF_TEN: entry_name("overshoots_deg", 0),
        SECOND_OF_TEN: entry_name("overshoots_deg", 1),
    }
    return (
        ManoeuvringTrial((Turn(rudder), Turn(-rudder)), of_turn),
        ManoeuvringTrial((Zigzag(ten, ten), Zigzag(-ten, ten)), of_ten),
        ManoeuvringTrial(
            (Zigzag(twenty, twenty), Zigzag(-twenty, twenty)), {FIRST_OF_TWENTY: entry_name("overshoots_deg", 0)}
        ),
        ManoeuvringTrial((Stop(),), {TRACK_REACH: "track_reach_lengths"}),
    )


@dataclass(frozen=True)
class ImoCriterion:
    """A criterion: value and limit in `unit`; `found` is None where the trial did not show it.

    `remark` states why it has no value, or a reservation on the verdict; `beyond_card` is True if a trial left the
    card's range, so that the verdict is an extrapolation. `passed` is None if the trial did not show it, or only
    outside the card's range; the margin to the limit is negative if the criterion is not met.
    """

    name: str
    found: float | None
    allowed: float
    unit: str
    remark: str
    beyond_card: bool
    passed: bool | None
    margin: float | None
    margin_percent: float | None

    @classmethod
    def judged(
        cls, name: str, found: float | None, allowed: float, unit: str, remark: str = "", beyond_card: bool = False
    ) -> ImoCriterion:
        """The criterion with its verdict and margin.

        Parameters
        ----------
        name, found, allowed, unit, remark, beyond_card
            Fields of the same names.
        """
        passed = None if found is None or beyond_card else found <= allowed
        margin = None if found is None else allowed - found
        percent = None if margin is None else 100 * margin / allowed
        return cls(name, found, allowed, unit, remark, beyond_card, passed, margin, percent)


def calm_trial(
    model: Model,
    manoeuvre: Manoeuvre,
    integrator: Integrator,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, float] | None = None,
) -> Run | str:
    """A trial in calm water, or the reason that it cannot be run.

    MSC.137(76) requires calm water: a current on the card belongs to a location, not to the ship.

    Parameters
    ----------
    manoeuvre : Manoeuvre
        One of :mod:`tank2sim.simulation.manoeuvres`.
    integrator : Integrator
        Integrator with the functions of the model.
    parameters, inputs : mapping, optional
        Values in place of the model's, and further inputs, by name, SI.
    """
    calm = {**undisturbed_inputs(model), **(inputs or {})}
    try:
        return simulate(model, manoeuvre, inputs=calm, parameters=parameters, integrator=integrator)
    except InputError as error:
        return error.reason


class _Worse(NamedTuple):
    """The worse figure of trials (or None), its remark, and whether a trial left the card's range before it."""

    value: float | None
    remark: str
    beyond: bool


def _worst(runs: Mapping[Turn | Zigzag | Stop, Run | str], *names: str) -> list[_Worse]:
    """The larger of each figure over trials, with a remark on its absence or validity."""
    done = [run for run in runs.values() if not isinstance(run, str)]
    troubles = [run if isinstance(run, str) else _wrong_way(manoeuvre, run) for manoeuvre, run in runs.items()]
    trouble = next(filter(None, troubles), "")
    found: list[_Worse] = []
    for name in names:
        shown = [figures[name] for figures in (single_figures(run.figures) for run in done) if name in figures]
        left = [str(each) for run in done for each in run.reading.notices if run.reading.outside(name)]
        outside = next(iter(left), "")
        if len(shown) == len(runs):
            found.append(_Worse(max(shown), outside, bool(outside)))
        else:
            remark = trouble or "; ".join(filter(None, ("the run does not show it", outside)))
            found.append(_Worse(None, remark, bool(outside)))
    return found


def _wrong_way(manoeuvre: Manoeuvre, run: Run) -> str:
    """Cause of missing figures: a ship that turns against its rudder."""
    if not isinstance(manoeuvre, Turn | Zigzag):
        return ""
    turned = float(run.trajectory["motion.psi"][-1] - run.trajectory["motion.psi"][0])
    # A complete zigzag reaches both sides, but only small headings.
    against = turned * manoeuvre.rudder < 0 and abs(turned) > _TURNED
    return "the ship turns against its rudder: see the signs of Yd and Nd and the card's rudder_sign" if against else ""


def imo_criteria(
    model: Model, changed: Mapping[str, float] | None = None, integrator: Integrator | None = None
) -> tuple[ImoCriterion, ...]:
    """Turning, initial turning, yaw checking and stopping of a ship at its speed of expansion (5.3.1 to 5.3.4).

    The worse of starboard and port counts. A trial that cannot be run leaves its criteria open, with the reason.

    Parameters
    ----------
    model : Model
        The ship.
    changed : mapping, optional
        Parameters in place of the model's, by name.
    integrator : Integrator, optional
        An existing integrator of this model, to save its preparation.
    """
    engine = integrator or Integrator(model)
    parameters = {**model.defaults, **(changed or {})}
    time = parameters["ship.length"] / parameters["ship.speed"]
    scale = _SCALE if parameters["ship.length"] < SHORTEST_SHIP_M else ""
    worst: dict[str, _Worse] = {}
    can_stop = "propeller.speed" in model.input_names
    for trial in manoeuvring_trials(largest_trial_rudder(parameters))[: None if can_stop else -1]:
        runs = {manoeuvre: calm_trial(model, manoeuvre, engine, changed) for manoeuvre in trial.manoeuvres}
        worst |= dict(zip(trial.criteria, _worst(runs, *trial.criteria.values()), strict=True))

    limits = largest_allowed(time)

    def criterion(name: str, unit: str, remark: str = "") -> ImoCriterion:
        value, left, beyond = worst[name]
        return ImoCriterion.judged(name, value, limits[name], unit, "; ".join(filter(None, (left, remark))), beyond)

    return (
        criterion(ADVANCE, "L"),
        criterion(TACTICAL, "L"),
        criterion(INITIAL, "L"),
        criterion(FIRST_OF_TEN, "deg", scale),
        criterion(SECOND_OF_TEN, "deg", scale),
        criterion(FIRST_OF_TWENTY, "deg"),
        _stopping(worst.get(TRACK_REACH)),
    )


def largest_allowed(time: float) -> dict[str, float]:
    """Return the limit of each criterion (5.3.1 to 5.3.4), in L or deg, by its name.

    Parameters
    ----------
    time : float
        L/V at the speed of the trials, s.
    """
    return {
        ADVANCE: 4.5,
        TACTICAL: 5.0,
        INITIAL: 2.5,
        FIRST_OF_TEN: min(max(5 + 0.5 * time, 10.0), 20.0),
        SECOND_OF_TEN: min(max(17.5 + 0.75 * time, 25.0), 40.0),
        FIRST_OF_TWENTY: 25.0,
        TRACK_REACH: STOPPING,
    }


def limits_of(manoeuvre: Manoeuvre, model: Model) -> dict[str, float]:
    """Return the limits of MSC.137(76) for the figures of a manoeuvre, by name; empty if it is not one of its trials.

    Those that go with L/V in seconds are left out of a model's, which does not keep it.

    Parameters
    ----------
    manoeuvre : Manoeuvre
        A turning circle at the largest rudder up to 35 deg, a 10/10 or 20/20 zigzag, or a stop with full astern.
    model : Model
        The ship, at the speed of its card.
    """
    values = model.defaults
    allowed = largest_allowed(values["ship.length"] / values["ship.speed"])
    trials = manoeuvring_trials(largest_trial_rudder(values))
    criteria = next((trial.criteria for trial in trials if manoeuvre in trial.manoeuvres), {})
    left_out = (FIRST_OF_TEN, SECOND_OF_TEN) if values["ship.length"] < SHORTEST_SHIP_M else ()
    return {figure: allowed[name] for name, figure in criteria.items() if name not in left_out}


def _stopping(worst: _Worse | None) -> ImoCriterion:
    """Track reach of full astern stopping; None: the card has no propulsion."""
    if worst is None:
        remark = "the card has no [propulsion]: its engine cannot be reversed"
        return ImoCriterion.judged(TRACK_REACH, None, STOPPING, "L", remark)
    found, left, beyond = worst
    remark = f"at {FULL_ASTERN:.0%} of the nominal revolutions astern, reached at once: an assumption of the simulation"
    if found is not None and STOPPING < found <= STOPPING_OF_LARGE_SHIPS:
        remark += "; up to 20 L may be allowed to a ship of large displacement"
    remark = "; ".join(filter(None, (left, remark if found is not None else "")))
    return ImoCriterion.judged(TRACK_REACH, found, STOPPING, "L", remark, beyond)
