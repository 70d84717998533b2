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

from tank2sim.analysis.linearisation import OperatingPoint, straight_course
from tank2sim.analysis.stability.straight_line import speed_acts
from tank2sim.analysis.turning.diagram import hull_states
from tank2sim.arrays import Array, Number
from tank2sim.dynamics.model import Model, Parameter
from tank2sim.errors import InputError

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


class StabilityCriterion:
    """C' of a model as a function of speed and parameters, with its exact total derivatives."""

    def __init__(self, model: Model):
        self.model = model
        self._places = [model.state_names.index(name) for name in ("motion.v", "rudder.angle")]
        self._speed = model.state_names.index("motion.u")
        unknown, x, p = model.x[self._places], model.x, model.p
        self.by_speed = speed_acts(model, straight_course(model))
        slopes = _prime_slopes(model, self.by_speed)
        value = ca.det(slopes)
        residual = model.expand(ca.vcat([model.symbol(name) for name in ("motion.vdot", "motion.rdot")]))
        by = ca.vertcat(p, x[self._speed])
        # implicit function: on the straight course residual(unknown, by) = 0
        follow = -ca.solve(ca.densify(ca.jacobian(residual, unknown)), ca.densify(ca.jacobian(residual, by)))
        total = ca.jacobian(value, by) + ca.jacobian(value, unknown) @ follow
        arguments = [x, model.u, p]
        self._value = ca.Function("criterion", arguments, [value, ca.densify(total), ca.densify(slopes)], {"cse": True})
        newton = [residual, ca.densify(ca.jacobian(residual, unknown))]
        self._course = ca.Function("course", arguments, newton, {"cse": True})

    def at(self, point: OperatingPoint) -> tuple[float, Array, Array]:
        """C', its total derivative by the parameters and at last by the speed (np + 1,), and the slopes (2, 2)."""
        value, total, slopes = self._value(point.x, point.u, point.p)
        return float(value), np.array(total).ravel(), np.array(slopes)

    def moved(
        self, point: OperatingPoint, *, speed: float | None = None, p: Array | None = None
    ) -> OperatingPoint | None:
        """The straight course near a given one, at a new speed or with new parameters; None if there is none."""
        x, p = point.x.copy(), point.p if p is None else p
        if speed is not None:
            x[self._speed] = speed
        for _ in range(20):
            residual, jacobian = (np.array(value) for value in self._course(x, point.u, p))
            if not np.isfinite(jacobian).all() or np.linalg.matrix_rank(jacobian) < 2:
                return None
            change = np.linalg.solve(jacobian, -residual.ravel())
            x[self._places] += change
            if np.max(np.abs(change)) < 1e-12 * max(1.0, abs(x[self._speed])):
                return OperatingPoint(x, point.u, p) if abs(x[self._places[1]]) < np.pi / 4 else None
        return None


def _prime_slopes(model: Model, by_speed: bool) -> ca.SX:
    """Slopes (2, 2) of Y' and N' by v' and r' with V = U, or u0 of a linear card; states of effects follow at once."""
    forces = model.expand(ca.vcat([model.symbol("force.Y"), model.symbol("force.N")]))
    motion = ca.vcat([model.symbol("motion.v"), model.symbol("motion.r")])
    slopes = ca.jacobian(forces, motion)
    derivative = {state.name: state.derivative for state in model.states}
    settled = [name for name in hull_states(model) if name not in ("motion.u", "motion.v", "motion.r")]
    if settled:
        effect_states = ca.vcat([model.symbol(name) for name in settled])
        rates = model.expand(ca.vcat([model.symbol(derivative[name]) for name in settled]))
        follow = ca.solve(ca.densify(ca.jacobian(rates, effect_states)), ca.densify(ca.jacobian(rates, motion)))
        slopes -= ca.jacobian(forces, effect_states) @ follow
    length, density = model.symbol("ship.length"), model.symbol("ship.water_density")
    speed = model.symbol("ship.speed")
    if by_speed:
        speed = ca.sqrt(model.symbol("motion.u") ** 2 + model.symbol("motion.v") ** 2)
    unit = 0.5 * density * length**2 * speed
    scale = ca.vertcat(ca.horzcat(unit, unit * length), ca.horzcat(unit * length, unit * length**2))
    return ca.densify(slopes) / scale


def stability_margin(model: Model, speed_mps: float | None = None) -> Margin:
    """Margin of straight-line stability and its sensitivities, by default at the speed of expansion.

    Raises
    ------
    InputError
        The model is not a ship, or has no straight course.
    """
    point = straight_course(model, speed_mps)
    criterion = StabilityCriterion(model)
    value, total, slopes = criterion.at(point)
    if not np.isfinite(value):
        raise InputError(
            model.origin, "", "the slopes of its forces are not finite numbers", "check the derivatives of the card"
        )
    names = model.parameter_names
    influences = [
        _influence(criterion, point, name, float(total[names.index(name)]))
        for name in names
        if (name.startswith("derivatives.") or name in _BODY) and point.p[names.index(name)] != 0
    ]
    moving = [influence for influence in influences if abs(influence.percent) > _NOTHING]
    damping, sway = _ratio(slopes[1, 1], slopes[0, 1]), _ratio(slopes[1, 0], slopes[0, 0])
    return Margin(
        C_prime=value,
        damping_lever_lengths=damping,
        sway_lever_lengths=sway,
        lever_margin_lengths=damping - sway,
        margin_percent=100 * _ratio(value, abs(slopes[0, 0] * slopes[1, 1])),
        slopes_prime=slopes,
        derivatives=tuple(sorted(moving, key=lambda item: -abs(item.percent))),
        speed=_over_speed(criterion, point),
    )


def _ratio(upper: float, lower: float) -> float:
    return float(upper / lower) if lower else float("nan")


def _influence(criterion: StabilityCriterion, point: OperatingPoint, name: str, slope: float) -> MarginInfluence:
    place = criterion.model.parameter_names.index(name)
    value, present = float(point.p[place]), criterion.at(point)[0]
    percent = 100 * CHANGE * slope * value / abs(present) if present else float("nan")
    neutral = _neutral(criterion, point, place) if abs(percent) > _NOTHING else None
    return MarginInfluence(name, value, slope, percent, neutral, neutral and 100 * (neutral / value - 1))


def _neutral(criterion: StabilityCriterion, point: OperatingPoint, place: int) -> float | None:
    """The value of a parameter at which C' = 0, by Newton's method along the straight course."""
    value = float(point.p[place])
    size, current = abs(value), point
    for _ in range(30):
        found, total, _ = criterion.at(current)
        if not total[place]:
            return None
        change = -found / total[place]
        p = current.p.copy()
        p[place] += change
        if not abs(p[place] - value) < 10 * size:
            return None
        following = criterion.moved(current, p=p)
        if following is None:
            return None
        current = following
        if abs(change) < 1e-12 * size:
            return float(p[place])
    return None


def _over_speed(criterion: StabilityCriterion, point: OperatingPoint) -> CriterionBySpeed | None:
    model = criterion.model
    if not criterion.by_speed:
        return None
    start = {parameter.name: parameter.start for parameter in model.parameters if isinstance(parameter, Parameter)}
    speeds = np.linspace(start["ship.slowest"], start["ship.fastest"], SPEEDS)
    rows = []
    for speed in speeds:
        shifted = criterion.moved(point, speed=float(speed))
        if shifted is None:
            rows.append((np.nan, np.nan))
            continue
        value, total, _ = criterion.at(shifted)
        rows.append((value, float(total[-1])))
    criteria, slopes = np.array(rows).T
    return CriterionBySpeed(speeds, criteria, slopes)


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
    values = dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))
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
