"""The steady-turning diagram of a ship: yaw rate, speed, drift and heel over the rudder angle, with unstable turns.

Every steady turn of the nonlinear model solves

    du/dt = dv/dt = dr/dt = 0   (and the states of effects that act on the hull: roll, the memory of the flow)

at constant revolutions in calm water. From the straight course the curve of solutions is followed in both directions by
pseudo-arclength (:mod:`tank2sim.analysis.turning.continuation`) with the exact Jacobian, through the folds of a ship
that is unstable on a straight course. A turn is stable if all eigenvalues of that Jacobian with the rudder held have a
negative real part. Folds are solved exactly (Moore and Spence 1980): F = 0, F_z phi = 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.linearisation import straight_course
from tank2sim.analysis.turning import continuation
from tank2sim.analysis.turning.continuation import Bounds, Curve, corrector_step, follow_branch
from tank2sim.arrays import Array
from tank2sim.dynamics.effects import undisturbed_inputs
from tank2sim.dynamics.model import Model
from tank2sim.notices import Notice, caution
from tank2sim.simulation.card_range import exceeded_range
from tank2sim.simulation.thruster_manoeuvres import thruster_sides

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

_LARGEST_RUDDER = math.radians(35.0)
"""Largest rudder of the diagram: 35 deg (MSC.137(76)), or the gear's limit."""

_REPORTED_RUDDERS_DEG = (-35, -20, -10, -5, 0, 5, 10, 20, 35)
"""Rudder angles whose steady turns a report lists. Project choice."""

_MOTION = ("motion.u", "motion.v", "motion.r")
_PLACE = ("motion.x", "motion.y", "motion.psi")
_FASTEST, _MOST_YAW, _MOST_ELSE = 2.5, 12.0, 50.0
"""Bounds of u/u0 and v/u0, of r L/u0, and of other states over their nominal size. No ship turns in a circle of a sixth
of its length. Project choice."""


@dataclass(frozen=True)
class TurningFold:
    """Fold of the diagram: beyond this rudder (rad) the ship leaves the branch. `place` is its row."""

    place: int
    rudder_rad: float
    yaw_rate_radps: float


@dataclass(frozen=True)
class HysteresisLoop:
    """The hysteresis loop of a ship that is unstable on a straight course.

    `width_deg` is the rudder between the two folds around the straight course; `height_degps` the difference of the
    two stable yaw rates at the rudder of the straight course, None if the curve does not reach both.
    """

    width_deg: float
    height_degps: float | None


@dataclass(frozen=True)
class CurveEnds:
    """Why the curve ends to port and to starboard (:class:`tank2sim.analysis.turning.continuation.Curve`)."""

    port: str
    starboard: str


@dataclass(frozen=True)
class SteadyTurning:
    """Steady turns in the order of the curve, from port to starboard turn; rudder, yaw and drift + to starboard.

    Parameters
    ----------
    rudder_rad, yaw_rate_radps, speed_mps, drift_rad : arrays (k,)
    heel_rad : array (k,) or None
        None if the ship has no roll.
    growth_per_s : array (k,)
        Largest real part of the eigenvalues with the rudder held, 1/s: a stable turn has it negative.
    slope : array (k, 2)
        Slopes of rudder and yaw rate by arc length.
    arc : array (k,)
    straight : int
        Row of the straight course.
    loop : HysteresisLoop or None
    notices : tuple of Notice
        Messages for the user.
    """

    rudder_rad: Array
    yaw_rate_radps: Array
    speed_mps: Array
    drift_rad: Array
    heel_rad: Array | None
    growth_per_s: Array
    slope: Array
    arc: Array
    straight: int
    folds: tuple[TurningFold, ...]
    loop: HysteresisLoop | None
    ended: CurveEnds
    notices: tuple[Notice, ...]

    @cached_property
    def stable(self) -> NDArray[np.bool_]:
        """True (k,) where the turn is stable with the rudder held; on a fold it is not."""
        return np.asarray(self.growth_per_s < -1e-9 * np.max(np.abs(self.growth_per_s)))

    @cached_property
    def _along(self) -> CubicHermiteSpline:
        return self._spline(np.column_stack([self.rudder_rad, self.yaw_rate_radps]), self.slope)

    @cached_property
    def _rudder_along(self) -> CubicHermiteSpline:
        return self._spline(self.rudder_rad, self.slope[:, 0])

    def _spline(self, values: Array, slopes: Array) -> CubicHermiteSpline:
        from scipy.interpolate import CubicHermiteSpline  # slow to import

        return CubicHermiteSpline(self.arc, values, slopes)

    def turns_at(self, rudder_rad: float) -> list[tuple[float, bool]]:
        """Yaw rate (rad/s) and stability of every steady turn of the curve at a rudder angle, along the curve."""
        places = np.unique(np.round(self._rudder_along.solve(rudder_rad, extrapolate=False), 12))
        before = np.clip(np.searchsorted(self.arc, places, side="right") - 1, 0, len(self.arc) - 2)
        stable = self.stable
        # Between a fold and its neighbour the neighbour's word holds.
        return [
            (float(self._along(place)[1]), bool(stable[row] or stable[row + 1]))
            for place, row in zip(places, before, strict=True)
        ]

    def reported(self) -> TurningDiagram:
        """Return the part that results report, in degrees."""
        reported = [
            ReportedTurn(float(rudder), math.degrees(rate), stable)
            for rudder in _REPORTED_RUDDERS_DEG
            for rate, stable in self.turns_at(math.copysign(max(0.0, abs(math.radians(rudder)) - 1e-9), rudder))
        ]
        return TurningDiagram(
            points=DiagramPoints(
                rudder_deg=np.degrees(self.rudder_rad),
                yaw_rate_degps=np.degrees(self.yaw_rate_radps),
                speed_mps=self.speed_mps,
                drift_deg=np.degrees(self.drift_rad),
                growth_per_s=self.growth_per_s,
                stable=tuple(self.stable.tolist()),
                heel_deg=None if self.heel_rad is None else np.degrees(self.heel_rad),
            ),
            turns=tuple(reported),
            folds=tuple(
                ReportedFold(math.degrees(fold.rudder_rad), math.degrees(fold.yaw_rate_radps)) for fold in self.folds
            ),
            loop=self.loop,
            ended=self.ended,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class DiagramPoints:
    """Steady turns (k,) in the order of the curve, from port to starboard turn, positive to starboard; as of
    :class:`SteadyTurning`."""

    rudder_deg: Array
    yaw_rate_degps: Array
    speed_mps: Array
    drift_deg: Array
    growth_per_s: Array
    stable: tuple[bool, ...]
    heel_deg: Array | None


@dataclass(frozen=True)
class ReportedTurn:
    """A steady turn at one of the rudder angles of a report."""

    rudder_deg: float
    yaw_rate_degps: float
    stable: bool


@dataclass(frozen=True)
class ReportedFold:
    """A fold of the diagram."""

    rudder_deg: float
    yaw_rate_degps: float


@dataclass(frozen=True, eq=False, kw_only=True)
class TurningDiagram:
    """The steady-turning diagram of a ship as results report it: all points, turns at round rudder angles, folds."""

    points: DiagramPoints
    turns: tuple[ReportedTurn, ...]
    folds: tuple[ReportedFold, ...]
    loop: HysteresisLoop | None
    ended: CurveEnds


def hull_states(model: Model, motion: Sequence[str] = _MOTION) -> tuple[str, ...]:
    """States that move with the hull at held rudder or thrusters: u, v, r, and states of effects that act on them.

    With fewer names in `motion`, the remaining ones of u, v, r are constant.
    """
    found = list(motion)
    steering = [name for name in model.state_names if name == "rudder.angle" or name.startswith("thrusters.")]
    for name in found:  # grows on the way
        rate = model.expand(model.symbols(model.derivatives_of([name])))
        held = (*_PLACE, *_MOTION, *steering, *found)
        found += [name for name in model.state_names if name not in held and ca.depends_on(rate, model.symbol(name))]
    return tuple(found)


def calm_inputs(model: Model) -> Array:
    """Inputs (nu,) in calm water: no current, no wind, revolutions as they start."""
    return model.input_values(undisturbed_inputs(model))


class TurningEquations:
    """The equations of steady motion in calm water, in scaled unknowns y = (states of the hull, controls).

    The control of a ship is its rudder. A craft that is steered by thrusters has two: mean revolutions of the thrusters
    that push ahead, and port less starboard, half of which each side has more or less (rad/s).

    Parameters
    ----------
    model : Model
        A ship or craft, or a steering model with the state ``motion.beta``.
    free : bool
        Whether the parameters are arguments of the functions; else they are numbers, and the functions are short.
    """

    def __init__(self, model: Model, *, free: bool = False):
        self.model = model
        self.names = ("motion.beta", "motion.r") if "motion.beta" in model.state_names else hull_states(model)
        self.sides = thruster_sides(model)
        self.controls = ("mean", "difference") if self.sides else ("rudder.angle",)
        nominal = {state.name: state.nominal for state in model.states}
        speed = model.defaults["ship.speed"]
        self.ship_time = model.defaults["ship.length"] / speed
        sizes = {"motion.u": speed, "motion.v": speed, "motion.r": 1 / self.ship_time}
        self.scale: Array = np.array(
            [*(sizes.get(name, nominal[name]) for name in self.names), *(1.0,) * len(self.controls)]
        )
        self.yaw: Array = np.eye(len(self.scale))[self.names.index("motion.r")]
        self.symbol, self.p = ca.SX.sym("y", len(self.scale)), model.p if free else ca.SX(model.parameter_values())
        rates = model.expand(model.symbols(model.derivatives_of(self.names)))
        self.rates = self.along(rates) * self.ship_time / self.scale[: len(self.names)]
        slopes = ca.densify(ca.jacobian(self.rates, self.symbol))
        arguments = [self.symbol, model.p] if free else [self.symbol]
        self.function = ca.Function("steady", arguments, [self.rates, slopes], {"cse": True})

    def along(self, expression: ca.SX) -> ca.SX:
        """An expression of states, inputs and parameters in the unknowns, in calm water."""
        model = self.model
        states = ca.substitute(ca.vcat([ca.SX(state.start) for state in model.states]), model.p, self.p)
        inputs = ca.SX(calm_inputs(model))
        for name, value in self._values().items():
            if name in model.state_names:
                states[model.state_names.index(name)] = value
            else:
                inputs[model.input_names.index(name)] = value
        (found,) = ca.substitute([expression], [model.x, model.u, model.p], [states, inputs, self.p])
        return found

    def _values(self) -> dict[str, ca.SX]:
        """States and inputs by the unknowns."""
        scaled = ca.vertsplit(self.symbol * self.scale)
        given = dict(zip((*self.names, *self.controls), scaled, strict=True))
        if not self.sides:
            return given
        mean, difference = given.pop("mean"), given.pop("difference")
        return given | {name: mean + side * difference / 2 for name, side in self.sides.items()}

    def __call__(self, y: Array) -> tuple[Array, Array]:
        """Residual (n,) and Jacobian (n, n + 1)."""
        residual, jacobian = self.function(y)
        return np.array(residual).ravel(), np.array(jacobian)

    def growth(self, y: Array) -> float:
        """Largest real part of the eigenvalues with the rudder held, 1/s."""
        return float(np.linalg.eigvals(self(y)[1][:, :-1]).real.max()) / self.ship_time

    def fold(self, near: Array, direction: Array) -> Array | None:
        """The fold near a point with its tangent: F = 0, F_z phi = 0, c phi = 1; None if Newton finds none."""
        n = len(self.names)
        null = direction[:n] / np.linalg.norm(direction[:n])
        phi = ca.SX.sym("phi", n)
        slopes = ca.jacobian(self.rates, self.symbol)[:, :n]
        unknown = ca.vertcat(self.symbol, phi)
        system = ca.vertcat(self.rates, slopes @ phi, ca.dot(ca.SX(null), phi) - 1)
        newton = ca.Function("fold", [unknown], [system, ca.densify(ca.jacobian(system, unknown))], {"cse": True})
        value = np.concatenate([near, null])
        for _ in range(12):
            residual, jacobian = (np.array(part) for part in newton(value))
            if not np.isfinite(jacobian).all() or np.linalg.cond(jacobian) > 1e14:
                return None
            change = np.linalg.solve(jacobian, -residual.ravel())
            value = value + change
            if np.max(np.abs(change)) < 1e-11:
                return value[: n + 1]
        return None


def steady_turning(model: Model) -> SteadyTurning:
    """The steady-turning diagram of a ship, by continuation from its straight course at constant revolutions.

    Raises
    ------
    InputError
        The model is not a ship, has no straight course, or no steady speed on it.
    """
    point = straight_course(model)
    equations = TurningEquations(model)
    at = dict(zip(model.state_names, point.x.tolist(), strict=True))
    guess = np.array([at[name] for name in (*equations.names, "rudder.angle")]) / equations.scale
    straight = corrector_step(equations, guess, equations.yaw)
    if straight is None or not straight[0][0] > 0:
        remedy = "check X0, Xu, Xuu and Xuuu of the card: resistance and thrust balance at no speed near u0"
        raise model.fault("", "keeps no steady speed on a straight course", remedy)
    largest = largest_rudder(model)
    if not abs(straight[0][-1]) < largest:
        problem = f"needs {math.degrees(straight[0][-1]):.3g} deg of rudder to go straight: more than the gear has"
        raise model.fault("", problem, "check Y0 and N0 of the card")
    most = np.full(len(guess), _MOST_ELSE)
    most[:3] = _FASTEST, _FASTEST, _MOST_YAW
    most[-1] = largest
    bounds = Bounds(-most, most)
    curves = [follow_branch(equations, straight[0], side * equations.yaw, bounds) for side in (-1.0, 1.0)]
    return _diagram(equations, curves[0], curves[1])


def largest_rudder(model: Model) -> float:
    """:data:`_LARGEST_RUDDER`, or the largest angle of the gear, rad."""
    return min(_LARGEST_RUDDER, model.defaults.get("steering.max_angle", _LARGEST_RUDDER))


def _diagram(equations: TurningEquations, port: Curve, starboard: Curve) -> SteadyTurning:
    y = np.concatenate([port.points[:0:-1], starboard.points])
    tangents = np.concatenate([-port.tangents[:0:-1], starboard.tangents])
    straight = len(port.points) - 1
    y, tangents, straight, places = _with_folds(equations, y, tangents, straight)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(y, axis=0), axis=1))])
    states = dict(zip((*equations.names, "rudder.angle"), (y * equations.scale).T, strict=True))
    slopes = dict(zip((*equations.names, "rudder.angle"), (tangents * equations.scale).T, strict=True))
    speed = np.hypot(states["motion.u"], states["motion.v"])
    growth = np.array([equations.growth(point) for point in y])
    growth[places] = 0.0
    rudder, rate = states["rudder.angle"], states["motion.r"]
    heel = next((values for name, values in states.items() if name.endswith(".phi")), None)
    folds = tuple(TurningFold(place, float(rudder[place]), float(rate[place])) for place in places)
    found = SteadyTurning(
        rudder_rad=rudder,
        yaw_rate_radps=rate,
        speed_mps=speed,
        drift_rad=-np.arcsin(states["motion.v"] / speed),
        heel_rad=heel,
        growth_per_s=growth,
        slope=np.column_stack([slopes["rudder.angle"], slopes["motion.r"]]),
        arc=arc,
        straight=straight,
        folds=folds,
        loop=None,
        ended=CurveEnds(port.ended, starboard.ended),
        notices=(),
    )
    return _judged(equations.model, found)


def _with_folds(
    equations: TurningEquations, y: Array, tangents: Array, straight: int
) -> tuple[Array, Array, int, list[int]]:
    """The curve with its folds inserted, the row of the straight course, and the rows of the folds."""
    turns, count = np.flatnonzero(np.diff(np.sign(tangents[:, -1])) != 0), len(y)
    places: list[int] = []
    for turn in turns.tolist():
        row = int(turn) + len(y) - count
        nearer = row if abs(tangents[row, -1]) < abs(tangents[row + 1, -1]) else row + 1
        fold = equations.fold(y[nearer], tangents[nearer])
        if fold is None or np.linalg.norm(fold - y[nearer]) > 2 * continuation.LARGEST_STEP:
            if straight in (row, row + 1):  # a corner on the straight course, stable to one side of it
                places.append(straight)
            continue
        direction = continuation.tangent(equations(fold)[1], tangents[nearer])
        if direction is None:
            continue
        y = np.insert(y, row + 1, fold, axis=0)
        tangents = np.insert(tangents, row + 1, direction, axis=0)
        straight += row + 1 <= straight
        places.append(row + 1)
    return y, tangents, straight, places


def _judged(model: Model, found: SteadyTurning) -> SteadyTurning:
    """The diagram with its loop and notices."""
    return replace(found, loop=_loop(found), notices=(*_end_notices(found), *_out_of_range(model, found)))


def _loop(found: SteadyTurning) -> HysteresisLoop | None:
    """The hysteresis loop between the folds nearest to the straight course; a corner there is either of them."""
    places = np.array([fold.place for fold in found.folds])
    corner = found.straight in places
    # rudder to port for more yaw to starboard: unstable in yaw, not in surge alone
    backwards = corner or found.slope[found.straight, 0] < 0
    if found.stable[found.straight] or not backwards:
        return None
    before, after = np.flatnonzero(places < found.straight), np.flatnonzero(places > found.straight)
    itself = np.flatnonzero(places == found.straight)
    ends = [*before[-1:], *itself, *after[:1]]
    if len(ends) < 2 and not corner:
        return None
    rates = [rate for rate, stable in found.turns_at(float(found.rudder_rad[found.straight])) if stable]
    height = math.degrees(max(rates) - min(rates)) if len(rates) > 1 else None
    return HysteresisLoop(math.degrees(abs(found.folds[ends[0]].rudder_rad - found.folds[ends[-1]].rudder_rad)), height)


def _end_notices(found: SteadyTurning) -> list[Notice]:
    words = {
        continuation.OUTSIDE: "runs away: the polynomial holds no steady turn beyond",
        continuation.STALLED: "breaks off: no steady turn was found beyond",
        continuation.LONG: "goes on beyond the steps allowed, from",
    }
    messages = []
    for side, row, ended in (("port", 0, found.ended.port), ("starboard", -1, found.ended.starboard)):
        if ended in words:
            rudder, rate = np.degrees([found.rudder_rad[row], found.yaw_rate_radps[row]])
            place = f"{rudder:.3g} deg of rudder and {rate:.3g} deg/s (to {side})"
            messages.append(Notice(f"the steady-turning diagram {words[ended]} {place}"))
    return messages


def _out_of_range(model: Model, found: SteadyTurning) -> list[Notice]:
    values = model.defaults
    rate = found.yaw_rate_radps * values["ship.length"] / found.speed_mps
    outside = exceeded_range(values, found.speed_mps, rate, found.drift_rad, found.rudder_rad)
    return [caution(f"EXTRAPOLATED beyond the card's measurements: steady turns have {outside}")] if outside else []
