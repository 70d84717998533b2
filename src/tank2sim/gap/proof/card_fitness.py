"""Whether an improved card may replace the given one: standard manoeuvres, and trials held out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tank2sim.cards.card import SteeredBy, SteeredCard
from tank2sim.dynamics import build
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.errors import InputError
from tank2sim.gap.proof.cross_check import REMAINS, worse_trials
from tank2sim.gap.result import Passed
from tank2sim.identification.trials.assessment.model_selection import hard_rudder
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import Run, simulate

CLEARLY_WORSE = 0.25
"""Share of the misfit before by which that of a trial held out must grow for the improved card to be withheld (project
choice: five times what :func:`.worse_trials` reports)."""

_STOPPED = 0.05
"""Share of the approach speed below which a ship with its engine ahead has stopped (project choice: hard turns of full
ships leave 25 to 40 %)."""

_OVERSHOOTS = 2
"""Overshoots that make a zigzag: one to each side."""


def improvement_objections(given: SteeredCard, improved: SteeredCard, passed: Sequence[Passed]) -> tuple[str, ...]:
    """Reasons for which the improved card should not replace the given one; empty without any, or if they are equal.

    A standard manoeuvre that the given card does and the improved one does not, and trials held out that the improved
    card follows worse by :data:`CLEARLY_WORSE`, and not to the noise (:data:`.REMAINS`).

    Parameters
    ----------
    given, improved : SteeredCard
    passed : sequence of Passed
        Fitted trials and those held out, simulated with both.
    """
    if improved.text == given.text:
        return ()
    return (*_lost_manoeuvres(given, improved), *_worse_held_out(passed))


def _worse_held_out(passed: Sequence[Passed]) -> list[str]:
    """Trials held out that the improved card follows clearly worse."""
    held = {trial.name: trial for trial in passed if trial.held_out and not trial.misfit("after") <= REMAINS}
    lines = []
    for name in worse_trials([*held.values()], CLEARLY_WORSE):
        before, after = (held[name].misfit(version) for version in ("before", "after"))
        much = f"has a misfit of {after:.3g} in noise units" if math.isfinite(after) else "diverges"
        lines.append(f"{name}, held out, {much} with it; its misfit without it is {before:.3g}")
    return lines


def _lost_manoeuvres(given: SteeredCard, improved: SteeredCard) -> list[str]:
    """Turning circles and zigzags in calm water that the given card does and the improved one does not; none of a craft
    with thrusters."""
    if given.steered_by is SteeredBy.THRUSTERS:
        return []
    ten, twenty, hard = math.radians(10), math.radians(20), hard_rudder(given.manoeuvring())
    manoeuvres = (Turn(hard), Turn(-hard), Zigzag(ten, ten), Zigzag(twenty, twenty))
    improved_integrator, given_integrator = (Integrator(build(card)) for card in (improved, given))
    lines = []
    for manoeuvre in manoeuvres:
        fault = _fault(improved_integrator, manoeuvre)
        if fault and not _fault(given_integrator, manoeuvre):
            lines.append(f"{manoeuvre.words} {fault} with it, and not with the given card")
    return lines


def _fault(integrator: Integrator, manoeuvre: Turn | Zigzag) -> str:
    """How a ship fails at a manoeuvre; empty if it does it."""
    model = integrator.model
    try:
        run = simulate(model, manoeuvre, inputs=undisturbed_inputs(model), integrator=integrator)
    except InputError:
        return "leaves all bounds"
    speed = run.trajectory["motion.speed"]
    if np.min(speed) < _STOPPED * speed[0]:
        return f"stops the ship ({np.min(speed):.2g} m/s of {speed[0]:.3g} m/s)"
    if _is_done(run, manoeuvre):
        return ""
    what = "never reaches 180 deg" if isinstance(manoeuvre, Turn) else f"has not {_OVERSHOOTS} overshoots"
    return f"{what} (speed at the end {speed[-1]:.2g} m/s)"


def _is_done(run: Run, manoeuvre: Turn | Zigzag) -> bool:
    """Whether a turn reached half a circle, or a zigzag checked the ship on both sides."""
    if isinstance(manoeuvre, Turn):
        return run.figures["time_180_s"] is not None
    overshoots = run.figures["overshoots_deg"]
    return isinstance(overshoots, list | tuple) and len(overshoots) >= _OVERSHOOTS
