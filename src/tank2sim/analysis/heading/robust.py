"""A robust heading controller: mixed sensitivity, H-infinity (extra ``robust``: slycot).

Least largest gain of [W1 S; W2 K S], S = 1/(1 + G K): W1 requires a fast loop with a low peak of S, W2 little rudder at
high frequency (waves, gear): Skogestad & Postlethwaite (2005), Multivariable Feedback Control, 9.3.

The design uses a frequency axis shifted by a: the controller of G(s - a) is shifted back. Then every mode of the loop
decays faster than a, and the controller cannot cancel the slow mode of the hull, which would make the ship slow to
recover from a gust: Chiang & Safonov (1992), J. Guidance, Control, and Dynamics 15. The integral precedes the ship as
(s + b)/s in the design and is part of the controller afterwards.
"""

from __future__ import annotations

import importlib.util
import warnings

import control
import numpy as np

from tank2sim.analysis.heading.control import INTEGRAL_BAND_RAD
from tank2sim.analysis.heading.designs import HeadingDesign, SteeringPlant
from tank2sim.dynamics.autopilot_linear import LinearLaw, linear_autopilot_model
from tank2sim.errors import InputError

# All in w = sqrt(K/T) of the ship: project choices, tested on stable and unstable ships (Ms 1.4 to 1.7).
POLE_SHIFT = 0.2
"""Every mode of the loop decays faster."""
INTEGRAL = 0.3
"""Zero b of the integral; above the shift, so that it can be moved."""
_BANDWIDTH = 0.8
"""Frequency below which W1 requires a sensitivity below 1."""
PEAK = 1.5
"""Largest peak of the sensitivity that W1 allows."""
RUDDER_FREQUENCY = 20.0
"""Frequency above which W2 allows less rudder than heading error; far below it 5 times as much."""
LEAST_ERROR = 0.01
"""Share of BANDWIDTH at which W1 becomes flat, because its pole must be stable."""


def robust_design(plant: SteeringPlant, name: str, origin: str) -> HeadingDesign:
    """The mixed-sensitivity controller.

    Parameters
    ----------
    plant : SteeringPlant
    name : str
        Name of the controller.
    origin : str
        :attr:`Model.origin` of the ship, for messages.

    Raises
    ------
    InputError
        slycot is not installed, or the controller does not exist.
    """
    if importlib.util.find_spec("slycot") is None:
        raise InputError("--design", "robust", "needs slycot", "pip install 'tank2sim[robust]'")
    w = plant.frequency_radps
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # of a name inside python-control
        core, gamma = _synthesis(plant, origin)
    core = _without_fast_modes(core, 1 / plant.step_s / w)
    A, B, C, D = core.A * w, core.B * w, core.C, core.D  # time back from 1/w to s
    n = len(A)
    rates = np.hstack([A, B, np.zeros((n, 2))])
    demand = np.concatenate([C.ravel(), D.ravel(), [0.0]])
    steady = float(np.real(core.dcgain()).item())
    law = LinearLaw(
        rates=rates,
        demand=demand,
        growth=INTEGRAL * w * demand,
        growth_limit_radps=INTEGRAL * w * abs(steady) * INTEGRAL_BAND_RAD,
        anti_windup_time_s=1 / w,
        largest_rudder_rad=plant.largest_rudder_rad,
    )
    source = (
        f"Mixed sensitivity on {plant.found.name} with its steering gear at {plant.found.speed_mps:.4g} m/s: "
        f"gamma {gamma:.3g}, order {n + 1}"
    )
    gains = {"gamma": gamma, "order": float(n + 1), "steady_gain": steady, "integral_radps": INTEGRAL * w}
    description = "Heading autopilot: mixed sensitivity (H-infinity) on the heading error, limits and anti-windup"
    model = linear_autopilot_model(name, description, law, plant.step_s)
    return HeadingDesign(kind="robust", found=plant.found, gains=gains, source=source, autopilot=model)


def _synthesis(plant: SteeringPlant, origin: str) -> tuple[control.StateSpace, float]:
    """Controller without its integral (time in 1/w), and the gain reached."""
    w = plant.frequency_radps
    if not (np.isfinite(plant.A).all() and np.isfinite(plant.B).all()):  # LAPACK may search for ever
        raise InputError(origin, "", "no robust controller was found (the linear ship is not finite)", "check the card")
    ship = control.ss(plant.A / w, plant.B / w, [[0, 0, 1, 0]], [[0]])
    integral = control.ss([[0]], [[1]], [[INTEGRAL]], [[1]])
    together = control.series(integral, ship)
    shifted = control.ss(together.A + POLE_SHIFT * np.eye(together.nstates), together.B, together.C, together.D)
    W1 = control.tf([1 / PEAK, _BANDWIDTH], [1, LEAST_ERROR * _BANDWIDTH])
    W2 = control.tf([1, 0.2 * RUDDER_FREQUENCY], [0.01, RUDDER_FREQUENCY])
    try:
        found, _, reached = control.mixsyn(shifted, control.ss(W1), control.ss(W2), None)
    except (control.ControlArgument, ArithmeticError, ValueError) as error:
        remedy = "choose another design"
        raise InputError(origin, "", f"no robust controller was found ({error})", remedy) from None
    back = control.ss(found.A - POLE_SHIFT * np.eye(found.nstates), found.B, found.C, found.D)
    return back, float(reached[0])


def _without_fast_modes(system: control.StateSpace, fastest: float) -> control.StateSpace:
    """Modes that decay faster than the integration resolves, replaced by their steady values."""
    modal, _ = control.modal_form(system)
    fast = [place for place in range(modal.nstates) if -modal.A[place, place] > fastest]
    return control.model_reduction(modal, elim_states=fast, method="matchdc") if fast else modal
