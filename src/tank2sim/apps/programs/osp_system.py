"""The system of dp-ship, a case of the Open Simulation Platform, with gains and limits for a ship of another size.

The controller, the allocation and the observer of the case belong to a vessel of 107 m and 2365 t. For another ship the
places of thrusters go with the length, gains and the largest rate of thrust with mass and inertia. The observer has no
parameters: what it hears of the thrust is scaled by the same ratios, so that it sees the accelerations of its vessel.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product

CASE_STEP_S = 0.04
CASE_LENGTH_M = 107.0
CASE_INERTIA = (3.31e6, 3.29e9)
"""Mass in sway (kg) and inertia in yaw (kg m2) of the case's vessel, with added masses."""

CASE_PLACES_M = ((-45.0, -7.0), (-45.0, 7.0), (53.0, 0.0))
"""Places of the port and the starboard azimuth thruster and of the bow tunnel in the case's vessel."""

_GAINS = {"Kpx": 2e4, "Kpy": 2e4, "Kdx": 5e5, "Kdy": 5e5, "Kix": 750.0, "Kiy": 750.0}
_YAW_GAINS = {"Kppsi": 1.5e8, "Kdpsi": 1e9, "Kipsi": 5e4}
_LIMITS = {"Fmax": 1e7, "uFmax": 2000.0}


@dataclass(frozen=True)
class CasePart:
    """A simulator of the case: its name, file, and initial values."""

    name: str
    file: str
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CaseJoint:
    """A connection of two variables, with a factor where the second hears the first scaled."""

    start: str
    start_variable: str
    end: str
    end_variable: str
    factor: float | None = None


def case_system(
    hull: str, length_m: float, mass_kg: float, inertia_kgm2: float
) -> tuple[list[CasePart], list[CaseJoint]]:
    """Simulators of the case with their values for a ship, and connections.

    `hull`: File of the ship's FMU; `length_m`, `mass_kg`, `inertia_kgm2`: Of the ship: mass in sway and inertia in yaw
    with added masses.
    """
    length, by_mass, by_inertia = length_m / CASE_LENGTH_M, mass_kg / CASE_INERTIA[0], inertia_kgm2 / CASE_INERTIA[1]
    gains = {name: value * by_mass for name, value in _GAINS.items()}
    gains |= {name: value * by_inertia for name, value in _YAW_GAINS.items()}
    (x1, y1), (x2, y2), (x3, _) = CASE_PLACES_M
    places = {"x1": x1, "y1": y1, "x2": x2, "y2": y2, "x3": x3}
    thrust = {name: value * max(by_mass, by_inertia / length) for name, value in _LIMITS.items()}
    allocation = {name: value * length for name, value in places.items()} | thrust
    parts = [
        CasePart("DP Controller", "DPController.fmu", _rounded(gains)),
        CasePart("Observer", "NLPobserver.fmu"),
        CasePart("Reference Generator", "ReferenceGenerator.fmu"),
        CasePart("Thrust Allocation", "ThMPC.fmu", _rounded(allocation)),
        CasePart("Ship", hull),
    ]
    axes = ("x", "y", "psi")
    joints = []
    for ends, names in (
        (("Thrust Allocation", "Ship"), [(f"F{place}c", f"Thrust_d[{place}]") for place in (1, 2, 3)]),
        (("Thrust Allocation", "Ship"), [(f"alpha{place}", f"input[{place}]") for place in (1, 2)]),
        (("Ship", "Observer"), [(f"q[{place}]", f"y[{place}]") for place in (1, 2, 3)]),
        (("Observer", "DP Controller"), [(f"y_hat[{place}]", axis) for place, axis in enumerate(axes, 1)]),
        (("Observer", "DP Controller"), [(f"v_hat[{place}]", f"d{axis}") for place, axis in enumerate(axes, 1)]),
        (("Reference Generator", "DP Controller"), [(f"{d}{axis}_ref",) * 2 for d, axis in product(("", "d"), axes)]),
        (("DP Controller", "Thrust Allocation"), [(f"Control{axis}", f"ref{axis}") for axis in ("x", "y", "Mz")]),
    ):
        joints += [CaseJoint(ends[0], start, ends[1], end) for start, end in names]
    ratios = _rounded({"Fxg": 1 / by_mass, "Fyg": 1 / by_mass, "Mzg": 1 / by_inertia})
    for place, (name, factor) in enumerate(ratios.items(), 1):
        joints.append(CaseJoint("Thrust Allocation", name, "Observer", f"tau[{place}]", factor))
    return parts, joints


def _rounded(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(f"{value:.6g}") for name, value in values.items()}
