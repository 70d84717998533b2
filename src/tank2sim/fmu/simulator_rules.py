"""What rules for simulators ask of the model of a ship, row by row, and whether the passport of an FMU shows it.

Only requirements whose text was at hand are listed: paragraph 68 of section B-I/12 of the STCW Code (navigation and
watchkeeping simulation), and headings of ITTC 7.5-02-06-03 (2002), Validation of Manoeuvring Simulation Models. Text
of DNV-ST-0033, Maritime Simulator Systems, was not at hand. Its rows are what K. Czaplewski & P. Zwolan (2018),
Multicriteria analysis method for evaluation of vessel simulation models in open waters, Journal of Navigation, say of
section C2 of the edition of 2011, then Standard for Certification 2.14; the clauses of today may ask for more.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from tank2sim.dynamics.model import Model

STCW, ITTC = "STCW Code, section B-I/12", "ITTC 7.5-02-06-03 (2002)"
DNV = "DNV-ST-0033, as 2.14 (2011) is reported by Czaplewski & Zwolan (2018)"


class Shown(StrEnum):
    """Whether a requirement is shown to be met."""

    SHOWN = "shown"
    NOT_SHOWN = "not shown"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True, kw_only=True)
class RuleRow:
    """A requirement: rule and clause, what it asks for, whether it is shown, and where or why not."""

    rule: str
    clause: str
    subject: str
    shown: Shown
    remark: str


def simulator_rules(model: Model, *, manoeuvres: bool, errors: bool) -> tuple[RuleRow, ...]:
    """The rows for the model of a ship; empty for any other model.

    Parameters
    ----------
    model : Model
    manoeuvres : bool
        The passport has figures of a turning circle and a zigzag.
    errors : bool
        The card states standard errors of its coefficients.
    """
    if "rudder.command" not in model.input_names:
        return ()
    inputs = set(model.input_names)
    run = "turning circle and zigzag in this passport" if manoeuvres else "the motion leaves all bounds"
    wind, waves = "wind.speed" in inputs, "waves.height" in inputs
    motions = "surge, sway, yaw and roll" if "motion.phi" in model else "surge, sway and yaw"
    current = bool({"current.speed", "current.north"} & inputs)
    external = "a force from outside can be given: inputs external.*" if "external.X" in inputs else "no input for it"
    bridge = "of the simulator, not of the model of the ship"
    rows: tuple[tuple[str, str, str, bool | None, str], ...] = (
        (STCW, "68.1", "operating environment in real time: instruments and controls", None, bridge),
        (STCW, "68.2", "visual scenario as seen from the bridge", None, bridge),
        (STCW, "68.3", "own ship dynamics in open water", manoeuvres, run),
        (STCW, "68.3", "effects of weather: wind", wind, "input wind.speed" if wind else "no wind"),
        (STCW, "68.3", "effects of weather: waves", waves, "inputs waves.*" if waves else "no waves"),
        (STCW, "68.3", "tidal stream, currents", current, "inputs of the current" if current else "no current"),
        (STCW, "68.3", "interaction with other ships", False, external),
        (STCW, "68.4", "communication with vessel traffic services", None, bridge),
        (
            DNV,
            "C2",
            "motion in six degrees of freedom",
            False,
            f"{motions}, others only in waves",
        ),
        (
            DNV,
            "C2",
            "hydrodynamic forces allowed for",
            True,
            "coefficients below, equations in the manual",
        ),
        (ITTC, "3.2", "prediction of forces", True, "source of each coefficient below"),
        (ITTC, "3.3", "modelling of forces", True, "kind of the model above; equations in its manual"),
        (ITTC, "3.5", "integration method", True, f"Runge-Kutta of the fourth order, {model.step_s:.3g} s at most"),
        (ITTC, "3.6", "simulation software", True, "tank2sim, version above"),
        (ITTC, "3.7", "simulated manoeuvres", manoeuvres, run),
        (ITTC, "4.2", "benchmark data", False, "comparison with trials: tank2sim validate"),
        (ITTC, "4.3", "potential causes of prediction error", errors, _errors(errors)),
        (ITTC, "4.4", "sensitivity analysis", False, "tank2sim influence"),
    )
    return tuple(
        RuleRow(rule=rule, clause=clause, subject=subject, shown=_shown(shown), remark=remark)
        for rule, clause, subject, shown, remark in rows
    )


def _shown(shown: bool | None) -> Shown:
    if shown is None:
        return Shown.NOT_APPLICABLE
    return Shown.SHOWN if shown else Shown.NOT_SHOWN


def _errors(stated: bool) -> str:
    return "standard errors below" if stated else "the card states no standard error"
