"""Surge of a towed body: equation (1.5) of paper 1 (Wilinski & Zellman 1984).

    M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T,   M = m + lambda11

The paper has v >= 0 only. Written with v |v|^(n-1) for v^n, the drag is the same there and opposes motion astern as
well, where the even powers of the print would push the body on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca

from tank2sim.dynamics.model import Input, Model, Parameter, Quantity, State

DRAG_POWERS: dict[str, int] = {"B1": 4, "B2": 3, "B3": 2}
"""Drag terms of (1.5), in its order, and the power of the speed that each multiplies."""

DELAY = "delay"
"""Unknown that (1.5) does not have: time from t = 0 to the start of the body, s."""

TOW_PARAMETERS = {
    "M": "total_mass_kg",
    "B1": "B1_kgs2pm3",
    "B2": "B2_kgspm2",
    "B3": "B3_kgpm",
    DELAY: "start_delay_s",
}
"""Unknown of (1.5) to its name with unit, as in :class:`SurgeCoefficients`, the card and the JSON."""

# The step of the paper's own integration. The time constant M / (dR/dv) of a towed body is 1 s for a 1 m model at
# 1 m/s and 10 s or more for the vehicle of the paper; a Runge-Kutta step of a tenth of it errs by less than 1e-7 of
# the speed.
_STEP_S = 0.1


@dataclass(frozen=True, kw_only=True)
class SurgeCoefficients:
    """Coefficients of (1.5), SI; the drag is positive against the motion.

    M is the mass of the body with the water in it plus its added mass lambda11; B1, B2, B3 multiply the fourth, third
    and second power of the speed.
    """

    total_mass_kg: float
    B1_kgs2pm3: float = 0.0
    B2_kgspm2: float = 0.0
    B3_kgpm: float = 0.0

    @classmethod
    def of(cls, estimates: Mapping[str, float]) -> SurgeCoefficients:
        """Coefficients from `estimates`, unknowns (``M``, ``B3``) with their values, SI; a delay is left out."""
        return cls(**{TOW_PARAMETERS[name]: value for name, value in estimates.items() if name != DELAY})

    def drag_N(self, speed_mps: Any) -> Any:
        """Drag in N at speeds in m/s."""
        return drag(speed_mps, self.B1_kgs2pm3, self.B2_kgspm2, self.B3_kgpm)


def drag(speed: Any, b1: Any, b2: Any, b3: Any) -> Any:
    """Drag of (1.5) in N at a speed in m/s, positive at positive speed; numbers, arrays or CasADi expressions."""
    magnitude = abs(speed)
    return speed * magnitude * (b3 + magnitude * (b2 + magnitude * b1))


def surge_model(
    name: str, coefficients: SurgeCoefficients, force_N: float, *, valid_speed_mps: tuple[float, float] | None = None
) -> Model:
    """Surge of a body under a force along its axis, equation (1.5).

    Parameters
    ----------
    name : str
        The body.
    coefficients : SurgeCoefficients
        Start values of the tunable parameters ``surge.*``.
    force_N : float
        Start value of the input ``tow.force``, positive forward.
    valid_speed_mps : pair of float, optional
        Speeds that the coefficients were identified in; with it the model has the output ``validity``.
    """
    parameters = _parameters(coefficients)
    mass, b1, b2, b3, initial_x, initial_u = (parameter.symbol for parameter in parameters)
    scale = abs(force_N) or 1.0
    force = Input("tow.force", "N", "Towing force, + forward", start=force_N, nominal=scale)
    x, u = _states(initial_x, initial_u, valid_speed_mps[1] if valid_speed_mps else 1.0)
    speed = Quantity("motion.xdot", "m/s", "Rate of the position", value=u.symbol)
    resistance = Quantity(
        "force.drag", "N", "Drag, + when it acts aft", nominal=scale, value=drag(u.symbol, b1, b2, b3)
    )
    acceleration = Quantity(
        "motion.udot",
        "m/s2",
        "Surge acceleration, + forward",
        nominal=scale / coefficients.total_mass_kg,
        value=(force.symbol - resistance.symbol) / mass,
    )
    model = Model(
        name=name,
        description="Straight-line motion of a towed body, equation (1.5) of Wilinski & Zellman (1984)",
        states=(x, u),
        inputs=(force,),
        parameters=parameters,
        quantities=(speed, acceleration, resistance),
        outputs=(x.name, u.name, acceleration.name, resistance.name),
        step_s=_STEP_S,
    )
    return model if valid_speed_mps is None else _with_validity(model, valid_speed_mps)


def _states(initial_x: ca.SX, initial_u: ca.SX, top_speed: float) -> tuple[State, State]:
    x = State("motion.x", "m", "Position along the track, + forward", derivative="motion.xdot", start=initial_x)
    u = State(
        "motion.u",
        "m/s",
        "Surge speed through the water, + forward",
        nominal=top_speed,
        derivative="motion.udot",
        start=initial_u,
    )
    return x, u


def _parameters(coefficients: SurgeCoefficients) -> tuple[Parameter, ...]:
    mass = coefficients.total_mass_kg
    term = "Drag coefficient of the {} power of the speed"
    return (
        Parameter(
            "surge.total_mass",
            "kg",
            "Mass of the body with the water in it, plus its added mass in surge",
            start=mass,
            nominal=mass,
            minimum=0.0,
        ),
        *(
            Parameter(f"surge.{key}", unit, description, start=start, nominal=abs(start) or 1.0)
            for key, unit, start, description in (
                ("B1", "kg.s2/m3", coefficients.B1_kgs2pm3, term.format("fourth")),
                ("B2", "kg.s/m2", coefficients.B2_kgspm2, term.format("third")),
                ("B3", "kg/m", coefficients.B3_kgpm, term.format("second")),
            )
        ),
        Parameter("initial.x", "m", "Position at the beginning", start=0.0, tunable=False),
        Parameter("initial.u", "m/s", "Surge speed at the beginning", start=0.0, tunable=False),
    )


def _with_validity(model: Model, speeds_mps: tuple[float, float]) -> Model:
    lowest, highest = speeds_mps
    outside = ca.fmax(lowest - model.symbol("motion.u"), model.symbol("motion.u") - highest)
    # A polynomial fitted over a range soon departs from the truth beyond it: nothing is left of its worth half a
    # range away.
    worth = 1 - 2 * outside / (highest - lowest)
    validity = Quantity(
        "validity",
        "1",
        f"1 from {lowest:g} to {highest:g} m/s, where the coefficients were identified, falling to 0 outside",
        minimum=0.0,
        maximum=1.0,
        value=ca.fmin(1, ca.fmax(0, worth)),
    )
    return model.extend(validity, outputs=["validity"])
