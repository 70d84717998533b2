"""Margin of straight-line stability, and its sensitivity to derivatives, speed and trim.

    C' = Y'_v (N'_r - m' x'_G u') - N'_v (Y'_r - m' u')

of :mod:`tank2sim.analysis.stability.straight_line`. The same as a distance: the yaw damping lever (N_r - m x_G u)/(Y_r
- m u) lies ahead of the sway lever N_v/Y_v by the margin (in L) if C' > 0. Sensitivities are exact (CasADi): that by a
derivative is the total one, including the change of the straight course (drift and rudder of an asymmetric ship).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.analysis.equilibrium import EquilibriumFigures, straight_courses
from tank2sim.analysis.linearisation import slow_slopes, straight_course
from tank2sim.analysis.stability.straight_line import speed_acts
from tank2sim.analysis.turning.diagram import hull_states
from tank2sim.arrays import Array, Number
from tank2sim.dynamics.model import Model

SPEEDS = 25
"""Speeds at which C' is reported, evenly over the card's range."""

CHANGE = 0.1
"""Reported change of a derivative: 10 %, as for influence coefficients (Poznyakov and Yudin, paper 4)."""

_NOTHING = 0.1
"""Per cent of C' below which an influence counts as none: the effect of an asymmetric straight course."""

_BODY = ("ship.mass", "ship.x_G")

PAPER_CHANGE = 0.075
"""Change of Y_r or N_r by 1 % of trim (paper 2, section 5)."""

INOUE = {"Yv": 2 / 3, "Yr": 0.80, "Nv": -0.27, "Nr": 0.30}
"""Relative change by tau/d (Inoue et al. 1981); for N_v over its lever N_v/Y_v in ship lengths."""

TRIMS = np.linspace(-0.01, 0.01, 21)
"""Trim by the stern over ship length at which C' is reported."""


@dataclass(frozen=True)
class MarginInfluence:
    """Influence of a coefficient on C'.

    Parameters
    ----------
    name : str
        Parameter of the model: ``derivatives.Nr``.
    value : float
        In the model's unit (prime for derivatives, SI for ``ship.*``).
    slope : float
        dC'/d(value).
    percent : float
        Change of C' when the value is multiplied by 1.1 (its magnitude grows by 10 %), in per cent of |C'|.
    neutral_value : float or None
        The value at which C' = 0, all else unchanged; None without one within ten times its magnitude.
    neutral_percent : float or None
        Change to that value, in per cent of the value: negative if its magnitude is to fall.
    """

    name: str
    value: float
    slope: float
    percent: Number
    neutral_value: float | None
    neutral_percent: float | None

    @property
    def short_name(self) -> str:
        """``Nr``, ``mass``: the name without its group."""
        return self.name.rpartition(".")[2]


@dataclass(frozen=True, eq=False)
class CriterionBySpeed:
    """C' over speed (k,) and its slope dC'/du; nan without a straight course."""

    speed_mps: Array
    C_prime: Array
    slope_s_per_m: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class Margin:
    """The criterion of straight-line stability, its margin and their sensitivities.

    Parameters
    ----------
    damping_lever_lengths, sway_lever_lengths : float
        (N'_r - m' x'_G)/(Y'_r - m') and N'_v/Y'_v, in ship lengths forward of midships.
    lever_margin_lengths : float
        The former less the latter: positive on a stable ship (whose Y_v and Y_r - m are negative).
    margin_percent : float
        C' in per cent of |Y'_v (N'_r - m' x'_G)|, its stabilising part.
    slopes_prime : array (2, 2)
        Slopes of Y' and N' by v' and r', the inertia of (3.1) included.
    derivatives : tuple of MarginInfluence
        The strongest first.
    speed : CriterionBySpeed or None
        None where forces do not change with speed, as for a linear card.
    """

    C_prime: float
    damping_lever_lengths: Number
    sway_lever_lengths: Number
    lever_margin_lengths: Number
    margin_percent: Number
    slopes_prime: Array
    derivatives: tuple[MarginInfluence, ...]
    speed: CriterionBySpeed | None


def _prime_slopes(model: Model, by_speed: bool) -> ca.SX:
    """Slopes (2, 2) of Y' and N' by v' and r' with V = U, or u0 of a linear card; states of effects follow at once."""
    motion = ("motion.v", "motion.r")
    settled = [name for name in hull_states(model) if name not in ("motion.u", *motion)]
    slopes = slow_slopes(model, ["force.Y", "force.N"], motion, settled)
    length, density = model.symbol("ship.length"), model.symbol("ship.water_density")
    speed = model.symbol("ship.speed")
    if by_speed:
        speed = ca.sqrt(model.symbol("motion.u") ** 2 + model.symbol("motion.v") ** 2)
    unit = 0.5 * density * length**2 * speed
    return slopes / ca.vertcat(ca.horzcat(unit, unit * length), ca.horzcat(unit * length, unit * length**2))


@dataclass(frozen=True, eq=False)
class _Course:
    """C' and the slopes (2, 2) on a straight course with unknowns z (2,) and parameters p (np,)."""

    courses: EquilibriumFigures
    z: Array
    p: Array
    C_prime: float
    slopes: Array

    @staticmethod
    def near(courses: EquilibriumFigures, z: Array, p: Array) -> _Course | None:
        """The course near z; None if there is none with less than 45 deg of rudder."""
        found = courses.at(z, {}, p)
        if found is None or not abs(found[0][1]) < np.pi / 4:
            return None
        C, *slopes = found[1]
        return _Course(courses, found[0], p, float(C), np.reshape(slopes, (2, 2)))

    def by_parameters(self) -> Array:
        """Total derivatives (np,) of C'; that by ``initial.u`` is by the speed."""
        return np.asarray(self.courses.slopes(self.z, {}, self.p)[0])

    def moved(self, place: int, value: float) -> _Course | None:
        """The course with another value of the parameter at a place; None if there is none."""
        p = self.p.copy()
        p[place] = value
        return _Course.near(self.courses, self.z, p)


def stability_margin(model: Model, speed_mps: float | None = None) -> Margin:
    """Margin of straight-line stability and its sensitivities, by default at the speed of expansion.

    Raises
    ------
    InputError
        The model is not a ship, or has no straight course.
    """
    by_speed = speed_acts(model, straight_course(model))
    slopes = _prime_slopes(model, by_speed)
    shown = dict(
        zip(("C", "Yv", "Yr", "Nv", "Nr"), ca.vertsplit(ca.vertcat(ca.det(slopes), ca.vec(slopes.T))), strict=True)
    )
    courses, z = straight_courses(model, shown, speed_mps)
    course = _Course.near(courses, z, model.parameter_values({} if speed_mps is None else {"initial.u": speed_mps}))
    if course is None:
        raise model.fault("", "the slopes of its forces are not finite numbers", "check the derivatives of the card")
    names, total, slope = model.parameter_names, course.by_parameters(), course.slopes
    influences = [
        _influence(course, name, place, float(total[place]))
        for place, name in enumerate(names)
        if (name.startswith("derivatives.") or name in _BODY) and course.p[place] != 0
    ]
    moving = [influence for influence in influences if abs(influence.percent) > _NOTHING]
    damping, sway = _ratio(slope[1, 1], slope[0, 1]), _ratio(slope[1, 0], slope[0, 0])
    return Margin(
        C_prime=course.C_prime,
        damping_lever_lengths=damping,
        sway_lever_lengths=sway,
        lever_margin_lengths=damping - sway,
        margin_percent=100 * _ratio(course.C_prime, abs(slope[0, 0] * slope[1, 1])),
        slopes_prime=slope,
        derivatives=tuple(sorted(moving, key=lambda item: -abs(item.percent))),
        speed=_over_speed(model, course) if by_speed else None,
    )


def _ratio(upper: float, lower: float) -> float:
    return float(upper / lower) if lower else float("nan")


def _influence(course: _Course, name: str, place: int, slope: float) -> MarginInfluence:
    value, present = float(course.p[place]), course.C_prime
    percent = 100 * CHANGE * slope * value / abs(present) if present else float("nan")
    neutral = _neutral(course, place) if abs(percent) > _NOTHING else None
    return MarginInfluence(name, value, slope, percent, neutral, neutral and 100 * (neutral / value - 1))


def _neutral(course: _Course, place: int) -> float | None:
    """The value of a parameter at which C' = 0, by Newton's method along the straight course."""
    value = float(course.p[place])
    for _ in range(30):
        slope = float(course.by_parameters()[place])
        if not slope:
            return None
        change = -course.C_prime / slope
        changed = float(course.p[place]) + change
        following = course.moved(place, changed) if abs(changed - value) < 10 * abs(value) else None
        if following is None:
            return None
        course = following
        if abs(change) < 1e-12 * abs(value):
            return changed
    return None


def _over_speed(model: Model, course: _Course) -> CriterionBySpeed:
    speeds = np.linspace(model.defaults["ship.slowest"], model.defaults["ship.fastest"], SPEEDS)
    place = model.parameter_names.index("initial.u")
    found = [course.moved(place, float(speed)) for speed in speeds]
    C_prime = np.array([np.nan if one is None else one.C_prime for one in found])
    slopes = np.array([np.nan if one is None else one.by_parameters()[place] for one in found])
    return CriterionBySpeed(speeds, C_prime, slopes)


@dataclass(frozen=True)
class TrimReading:
    """C' with a derivative 7.5 % smaller and larger in magnitude: trim changed by 1 %."""

    less: float
    more: float


@dataclass(frozen=True, eq=False)
class InoueTrim:
    """C' over trim after Inoue et al. (1981).

    Parameters
    ----------
    trim_by_stern_over_length, C_prime : arrays (k,)
    draught_m : float
        Mean draught with which tau/d was formed.
    change_percent_by_1_percent : dict
        Per cent by which 1 % of L of trim by the stern changes each derivative.
    """

    trim_by_stern_over_length: Array
    C_prime: Array
    draught_m: float
    change_percent_by_1_percent: dict[str, float]


@dataclass(frozen=True, eq=False)
class TrimEffect:
    """C' by trim, by two estimates: the readings of paper 2 by derivative (``Yr``, ``Nr``), and Inoue et al.

    It is an estimate, because a card holds for a single trim.
    """

    paper_7_5_percent: dict[str, TrimReading]
    inoue_1981: InoueTrim
    estimate: bool = True


def trim_effect(model: Model, margin: Margin) -> TrimEffect:
    """C' by trim, from the slopes of the margin: an estimate, because a card holds for a single trim.

    Two sources, side by side. Both give the hydrodynamic derivatives, without the inertia of (3.1).

    Paper 2 (Krezelewski and Misiag, section 5): a change of trim of 1 % changes one of the two most significant
    coefficients by 7.5 %; the print is damaged and leaves open whether it is Y_r or N_r. Both readings are reported.

    Inoue, Hirano and Kijima (1981), Hydrodynamic derivatives on ship manoeuvring, Int. Shipbuilding Progress 28(321),
    from tests of models on even keel and trimmed, with tau the trim by the stern and d the mean draught (factors as
    quoted in later literature):

        Y_v (1 + 0.67 tau/d)   Y_r (1 + 0.80 tau/d)   N_v (1 - 0.27 (Y_v/N_v) tau/d)   N_r (1 + 0.30 tau/d)

    The mass, its centre and the rudder do not change.
    """
    values = model.defaults
    length = values["ship.length"]
    mass = values["ship.mass"] / (0.5 * values["ship.water_density"] * length**3)
    inertia = {"Yr": mass, "Nr": mass * values["ship.x_G"] / length}
    (Yv, Yr), (Nv, Nr) = margin.slopes_prime.tolist()
    bare = {"Yv": Yv, "Yr": Yr + inertia["Yr"], "Nv": Nv, "Nr": Nr + inertia["Nr"]}

    def criterion(factors: Mapping[str, float]) -> float:
        trimmed = {name: value * factors.get(name, 1.0) for name, value in bare.items()}
        return float(trimmed["Yv"] * (trimmed["Nr"] - inertia["Nr"]) - trimmed["Nv"] * (trimmed["Yr"] - inertia["Yr"]))

    draught = values["ship.draught"]
    lever = Nv / Yv if Yv and Nv else np.inf
    rates = {name: rate / (lever if name == "Nv" else 1.0) for name, rate in INOUE.items()}
    per_length = length / draught
    curve = [criterion({name: 1 + rate * trim * per_length for name, rate in rates.items()}) for trim in TRIMS]
    return TrimEffect(
        {
            name: TrimReading(criterion({name: 1 - PAPER_CHANGE}), criterion({name: 1 + PAPER_CHANGE}))
            for name in ("Yr", "Nr")
        },
        InoueTrim(TRIMS, np.array(curve), draught, {name: rate * per_length for name, rate in rates.items()}),
    )
