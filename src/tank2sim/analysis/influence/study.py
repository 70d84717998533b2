"""Figures of a ship: their values and exact slopes at any values of its parameters."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from tank2sim.analysis.equilibrium import EquilibriumFigures, straight_courses
from tank2sim.analysis.influence.figures import STEADY, STRAIGHT, FigureManoeuvre, InfluenceFigure
from tank2sim.analysis.influence.motion import HALF_TURN, MotionSlopes, overshoots_in
from tank2sim.analysis.linearisation import slow_slopes
from tank2sim.analysis.stability.straight_line import settled_states, steering_constants
from tank2sim.analysis.turning.diagram import hull_states
from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.dynamics.card_parameters import CardParameter, card_parameters, study_model
from tank2sim.dynamics.model import Model
from tank2sim.errors import ArgumentError
from tank2sim.notices import Notice
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import Run, simulate

NO_TURN = 1e-4
"""Share of u0/L below which a steady yaw rate counts as a straight course.

Project choice: a circle of 10 000 lengths.
"""

PLACE_FELT = 1e-20
"""Squared slopes of the scaled accelerations by position and heading of an unsteady turn: rounding is below."""

SPARE = 1.5
"""Duration of a manoeuvre over the duration of the card's ship for its figures; the full one if that is too short."""


class Study:
    """Figures of a ship: their values and exact slopes at any values of its parameters.

    Parameters
    ----------
    card : SteeredCard
        The ship, or craft.
    figures : sequence of InfluenceFigure
        Figures to compute.

    Raises
    ------
    InputError
        The card has an error, or its ship does not show one of the figures.
    """

    def __init__(self, card: SteeredCard, figures: Sequence[InfluenceFigure]):
        self.card, self.figures = card, tuple(figures)
        self.model = study_model(card)
        self.parameters: tuple[CardParameter, ...] = card_parameters(card, self.model)
        self.values: Array = np.array([parameter.value for parameter in self.parameters])
        self._integrator = Integrator(self.model)
        self._length, self._speed = (self.model.defaults[f"ship.{name}"] for name in ("length", "speed"))
        self._places = [self.model.parameter_names.index(parameter.name) for parameter in self.parameters]
        self._equilibria: dict[float, Array] = {}
        self._long_enough: dict[FigureManoeuvre, float] = {}
        self._notices: dict[Notice, None] = dict.fromkeys(self.model.notices)
        self._known = False  # whether the figures of the card itself have been found: others say nothing of it
        self.base: Array = self.figures_at(self.values)
        self._known = True
        for figure, value in zip(self.figures, self.base, strict=True):
            if not math.isfinite(value):
                remedy = "ask for another, or for another rudder"
                raise ArgumentError(
                    "figures", figure.text, f"{card.source} ({card.ship.name}) does not show this figure", remedy
                )

    @cached_property
    def _motion(self) -> MotionSlopes:
        return MotionSlopes(self._integrator, [parameter.name for parameter in self.parameters])

    @cached_property
    def _turning(self) -> EquilibriumFigures:
        return steady_turns(self.model)

    @cached_property
    def _straight(self) -> tuple[EquilibriumFigures, Array]:
        return straight_courses(self.model, straight_figures(self.model))

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Notices on the limits of the card's ship and its manoeuvres."""
        return tuple(self._notices)

    def figures_at(self, values: Array) -> Array:
        """Figures (nf,) of the ship with parameters `values` (k,); nan for figures that it does not show."""
        return self._evaluated(values, sloped=False)[0]

    def slopes_at(self, values: Array) -> tuple[Array, Array]:
        """Figures (nf,) and their slopes (nf, k) by the parameters."""
        return self._evaluated(values, sloped=True)

    def _evaluated(self, values: Array, *, sloped: bool) -> tuple[Array, Array]:
        found, slopes = np.full(len(self.figures), np.nan), np.full((len(self.figures), len(values)), np.nan)
        for family, angles in dict.fromkeys((figure.kind.family, figure.angles) for figure in self.figures):
            rows = [
                n for n, figure in enumerate(self.figures) if (figure.kind.family, figure.angles) == (family, angles)
            ]
            named = self._family(self.figures[rows[0]], values, sloped)
            for row in rows:
                if self.figures[row].kind.name in named:
                    found[row], slope = named[self.figures[row].kind.name]
                    slopes[row] = slope if slope is not None else np.nan
        return found, slopes

    def _family(self, figure: InfluenceFigure, values: Array, sloped: bool) -> dict[str, tuple[float, Array | None]]:
        """All figures of the same evaluation as this one, on request with their slopes."""
        p = self.model.parameter_values()
        p[self._places] = values
        if figure.kind.family in (STRAIGHT, STEADY) and "rudder.command" not in self.model:
            remedy = "give one of its thrusters, as steady_diameter_m@difference:200"
            raise ArgumentError("figures", figure.text, "is of a rudder, and the craft has none", remedy)
        if figure.kind.family == STRAIGHT:
            return self._linear(p, sloped)
        manoeuvre = figure.manoeuvre
        assert manoeuvre is not None
        if figure.kind.family == STEADY:
            assert isinstance(manoeuvre, Turn)
            return self._steady(manoeuvre, figure.text, p, sloped)
        return self._simulated(manoeuvre, p, sloped)

    def _linear(self, p: Array, sloped: bool) -> dict[str, tuple[float, Array | None]]:
        course, near = self._straight
        found = course.at(near, {}, p)
        if found is None:
            return {}
        z, shown = found
        slopes = course.slopes(z, {}, p)[:, self._places] if sloped else [None] * len(shown)
        return {name: (float(v), by) for name, v, by in zip(course.names, shown, slopes, strict=True)}

    def _steady(self, turn: Turn, text: str, p: Array, sloped: bool) -> dict[str, tuple[float, Array | None]]:
        if turn.rudder not in self._equilibria:
            self._equilibria[turn.rudder] = self._first_turn(turn, text, p)
        side = math.copysign(1.0, turn.rudder)
        order = {"rudder.command": turn.rudder}
        found = self._turning.at(self._equilibria[turn.rudder], order, p)
        if found is None:
            return {}
        z, (u, v, r, _) = found
        if not side * r > NO_TURN * self._speed / self._length:
            return {}
        named, by_motion = turn_figures(u, v, r, side, self._speed)
        if not sloped:
            return {name: (value, None) for name, value in named.items()}
        slopes = by_motion @ self._turning.slopes(z, order, p)[:3, self._places]
        return {name: (value, by) for (name, value), by in zip(named.items(), slopes, strict=True)}

    def _first_turn(self, turn: Turn, text: str, p: Array) -> Array:
        """The steady turn at the end of a turning circle, refined and then followed."""
        run = self._run(turn, p).trajectory
        names = turning_states(self.model)
        scale = np.array([self.model[name].nominal for name in names])
        near = run.x[-1][[self.model.state_names.index(name) for name in names]] / scale
        side = math.copysign(1.0, turn.rudder)
        found = self._turning.at(near, {"rudder.command": turn.rudder}, p)
        rate = 0.0 if found is None else side * float(found[1][2])
        if found is None or not rate > NO_TURN * self._speed / self._length:
            degrees = f"{math.degrees(turn.rudder):.4g} deg of rudder"
            problem = f"{self.card.ship.name} does not turn steadily to the side of {degrees}"
            raise ArgumentError("figures", text, problem, "ask at more rudder")
        if found[1][3] > PLACE_FELT:
            problem = f"{self.card.ship.name} feels where it is or heads (wind or waves): no turn is steady"
            raise ArgumentError("figures", text, problem, "take that effect off the card, or ask for advance_m@35")
        return found[0]

    def _simulated(self, manoeuvre: FigureManoeuvre, p: Array, sloped: bool) -> dict[str, tuple[float, Array | None]]:
        names = {
            figure.kind.name
            for figure in self.figures
            if figure.manoeuvre == manoeuvre and figure.kind.family != STEADY
        }
        run = self._run(manoeuvre, p, self._long_enough.get(manoeuvre))
        found = named_figures(run.figures)
        if manoeuvre in self._long_enough and not names <= set(found):
            run = self._run(manoeuvre, p)
            found = named_figures(run.figures)
        of_rudder = isinstance(manoeuvre, Turn | Zigzag)  # a manoeuvre by thrusters ends with its last figure
        if of_rudder and manoeuvre not in self._long_enough and names <= set(found):
            self._long_enough[manoeuvre] = SPARE * last_event(run.figures, names)
        if sloped:
            return dict(self._motion.figures(run.trajectory, manoeuvre, p, self._length, names))
        return {name: (value, None) for name, value in found.items()}

    def _run(self, manoeuvre: FigureManoeuvre, p: Array, duration_s: float | None = None) -> Run:
        values = self.model.parameters_by_name(p)
        model, integrator = self.model, self._integrator
        run = simulate(model, manoeuvre, parameters=values, integrator=integrator, duration_s=duration_s)
        if not self._known:
            beyond = [notice.of(manoeuvre.words) for notice in run.reading.notices]
            self._notices |= dict.fromkeys((*beyond, *run.notices[len(beyond) :]))
        return run


def named_figures(given: Figures) -> dict[str, float]:
    """Figures of a manoeuvre by the names of :mod:`tank2sim.analysis.influence.figures`, where the run shows them."""
    return {name: value for name, value in single_figures(given).items() if isinstance(value, float)}


def last_event(given: Figures, names: Collection[str]) -> float:
    """Time (s) at which the last of the named figures is known."""
    if "time_90_s" in given:
        half = any(name.startswith(HALF_TURN) for name in names)
        return float(str(given["time_180_s" if half else "time_90_s"]))
    executes, peaks = given["execute_times_s"], given["overshoot_times_s"]
    assert isinstance(executes, list) and isinstance(peaks, list)
    count = overshoots_in(names)
    return float(executes[count - 1] + peaks[count - 1] if count else executes[0])


def turning_states(model: Model) -> tuple[str, ...]:
    """States that are constant in a steady turn: hull and steering gear."""
    return tuple(dict.fromkeys((*hull_states(model), *(state.name for state in model.states if state.steady))))


def steady_turns(model: Model) -> EquilibriumFigures:
    """Steady turns of a ship: unknowns are its :func:`turning_states` over their nominal sizes.

    Shown are ``u``, ``v`` and ``r`` as functions of rudder order (the input) and parameters, and ``place``, the effect
    of position and heading on the turn: zero in calm and open water.
    """
    names = turning_states(model)
    scale = np.array([model[name].nominal for name in names])
    unknown = ca.SX.sym("z", len(names))
    fixed = {
        state.name: (ca.SX(state.trim) if state.trim is not None else ca.SX(state.start)) for state in model.states
    }
    fixed |= {name: unknown[row] * scale[row] for row, name in enumerate(names)}
    x = ca.vcat([fixed[name] for name in model.state_names])
    while ca.depends_on(x, model.x):  # a rudder follows a telemotor, which follows the order
        x = ca.substitute(x, model.x, x)
    rates = model.expand(model.symbols(model.derivatives_of(names)))
    time = model.symbol("ship.length") / model.symbol("ship.speed")
    scaled = rates * time / scale
    place = model.symbols(("motion.psi", "motion.x", "motion.y"))
    felt = ca.sumsqr(ca.jacobian(scaled, place))
    residual, felt = ca.substitute([scaled, felt], [model.x], [x])
    u, v, r = (fixed[name] for name in ("motion.u", "motion.v", "motion.r"))
    return EquilibriumFigures(model, unknown, residual, {"u": u, "v": v, "r": r, "place": felt})


def turn_figures(u: float, v: float, r: float, side: float, approach: float) -> tuple[dict[str, float], Array]:
    """Figures of a steady turn by name, and their slopes (n, 3) by u, v and r.

    `side` is 1 with the rudder to starboard and -1 to port; `approach` the speed at the execute, m/s.
    """
    U2 = u * u + v * v
    U = math.sqrt(U2)
    radius, drift = U / (side * r), -math.degrees(math.asin(v / U))
    by_radius = np.array([u / (U * side * r), v / (U * side * r), -radius / r])
    by_drift = -math.degrees(1.0) * np.array([-v / U2, u / U2, 0.0])
    by_speed = np.array([u / U, v / U, 0.0])
    figures = {
        "steady_radius_m": radius,
        "steady_diameter_m": 2 * radius,
        "steady_rate_degps": math.degrees(r),
        "steady_drift_deg": drift,
        "steady_speed_mps": U,
        "speed_loss_percent": 100 * (1 - U / approach),
    }
    by_rate = np.array([0.0, 0.0, math.degrees(1.0)])
    return figures, np.array([by_radius, 2 * by_radius, by_rate, by_drift, by_speed, -100 / approach * by_speed])


def straight_figures(model: Model) -> dict[str, ca.SX]:
    """Nomoto's coefficients and the criterion of the linearised ship, of x, u and p, by the names of
    :mod:`tank2sim.analysis.influence.figures`."""
    settled = settled_states(model)
    slopes = slow_slopes(model, ["motion.vdot", "motion.rdot"], ["motion.v", "motion.r", "rudder.angle"], settled)
    K, total, product, T3 = steering_constants(slopes[:, :2], slopes[:, 2], ca.DM([[0, 1]]))
    discriminant = total**2 - 4 * product
    T1 = 0.5 * (total + ca.sign(total) * ca.sqrt(discriminant))  # nan where the modes oscillate
    length, density = model.symbol("ship.length"), model.symbol("ship.water_density")
    speed2 = model.symbol("motion.u") ** 2 + model.symbol("motion.v") ** 2
    time = length / ca.sqrt(speed2)
    determinant = ca.det(slow_slopes(model, ["force.Y", "force.N"], ["motion.v", "motion.r"], settled))
    return {
        "K_per_s": K,
        "T_s": total - T3,
        "T1_s": T1,
        "T2_s": product / T1,
        "T3_s": T3,
        "K_prime": K * time,
        "T_prime": (total - T3) / time,
        "criterion_C": determinant / (0.25 * density**2 * length**6 * speed2),
    }
