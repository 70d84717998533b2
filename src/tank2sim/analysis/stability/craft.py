"""Straight-line stability, surge and turning of a craft that is steered by the difference of fixed thrusters.

Linearised about a straight run at a speed, with revolutions held. Lag and dead band of the thrusters, which lie before
the revolutions, are left out, and currents and winds are absent. With d the revolutions at port less those at starboard

    r/d = K (1 + T3 s) / ((1 + T1 s)(1 + T2 s)),    T = T1 + T2 - T3    (Nomoto, Taguchi, Honda and Hirano 1957)

so that a K above 0 turns to starboard where the thrusters at port run faster.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import root

from tank2sim.analysis.ensemble.questions import ShipText, each_ship
from tank2sim.analysis.ensemble.results import StabilityBands
from tank2sim.analysis.stability.straight_line import nomoto, sorted_modes
from tank2sim.analysis.turning.diagram import TurningEquations
from tank2sim.arrays import Array, ComplexNumber, Unbounded
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.form import ThrusterSection
from tank2sim.dynamics.build import build
from tank2sim.errors import ArgumentError
from tank2sim.notices import Notice
from tank2sim.simulation.ensemble import Ask, MemberResult
from tank2sim.units import from_si, to_si

SPEED_SHARES = (0.25, 0.5, 0.75, 0.95)
"""Speeds of the table, over the highest that the thrusters hold (project choice)."""

DIFFERENCE_SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Differences of the table, over the largest about the revolutions of the straight run (project choice)."""

_CURVATURES, _DRIFT = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6), 0.1
"""Yaw rates in r L/U and sway over surge from which a steady turn is looked for: those of craft in wide to tight turns
(project choice)."""

STRAIGHT_FROM_LENGTHS = 100.0
"""Diameter over length of a loop from which it is called nearly straight. Project choice: it turns the craft by a
degree for each length, which wind, waves and errors of a few per cent in its coefficients do as well."""

NO_RUDDER = "the criteria of IMO MSC.137(76) and the spirals are of a rudder, and are not judged"

_SMALL = 1e-6
"""Largest rate of a steady motion over the rate's scale: rounding of the search."""


@dataclass(frozen=True)
class CraftAtSpeed:
    """A craft at a speed.

    Parameters
    ----------
    speed_mps, revolutions_rpm : float
        Surge velocity through the water, and the mean revolutions of the two sides that hold it.
    eigenvalues : tuple of complex
        Eigenvalues of surge, sway and yaw, 1/s, least damped first.
    steering_modes : tuple of complex
        Steering modes of sway and yaw at a held speed, 1/s.
    surge_time_constant_s : float
        -1 over the slope of du/dt by u; None where nothing brakes the craft.
    K, T_s, T1_s, T2_s, T3_s : float
        Constants of r/d; K in rad/s by rad/s; T1 and T2 are None for an oscillating pair.
    stable : bool
        True if the straight run is stable with revolutions held: every mode decays.
    """

    speed_mps: float
    revolutions_rpm: float
    eigenvalues: tuple[ComplexNumber, ...]
    steering_modes: tuple[ComplexNumber, ...]
    surge_time_constant_s: float | None
    K: Unbounded
    T_s: Unbounded
    T1_s: float | None
    T2_s: float | None
    T3_s: Unbounded
    stable: bool


@dataclass(frozen=True)
class SteadyCraftTurn:
    """A steady turn: revolutions at port less at starboard, speed, yaw rate and drift (positive to starboard)."""

    difference_rpm: float
    speed_mps: float
    yaw_rate_degps: float
    drift_deg: float
    diameter_m: float


@dataclass(frozen=True, kw_only=True)
class CraftStabilityStudy:
    """Stability and turning of a craft.

    Parameters
    ----------
    straight_run : CraftAtSpeed
        At the requested speed.
    nearly_straight : bool
        Of :func:`keeps_nearly_straight`.
    speeds : tuple of CraftAtSpeed
        At :data:`SPEED_SHARES` of the highest speed.
    highest_speed_mps : float
        Held by the thrusters at their largest revolutions.
    difference_turns : tuple of SteadyCraftTurn
        To starboard, about the revolutions of the straight run.
    """

    ship: str
    length_m: float
    straight_run: CraftAtSpeed
    nearly_straight: bool
    speeds: tuple[CraftAtSpeed, ...]
    highest_speed_mps: float
    difference_turns: tuple[SteadyCraftTurn, ...]
    notices: tuple[Notice, ...]
    ensemble: StabilityBands | None = None


def craft_stability(card: SteeredCard, speed_mps: float | None = None) -> CraftStabilityStudy:
    """Stability and turning of a craft, by default at its cruising speed.

    Parameters
    ----------
    speed_mps : float, optional
        Surge velocity through the water, positive.

    Raises
    ------
    InputError
        The craft is not steered by fixed thrusters at both sides, or they do not hold the speed.
    """
    craft = CraftMotions(card)
    speed = card.model.speed_mps if speed_mps is None else speed_mps
    highest = craft.highest_speed(card.model.speed_mps)
    if not 0 < speed <= highest * (1 + 1e-9):
        problem = f"{speed:g} m/s is not a speed ahead that the thrusters hold"
        raise ArgumentError("speed_mps", "", problem, f"give one up to {highest:.4g} m/s")
    run = craft.straight(speed)
    turns = tuple(craft.turns(run))
    return CraftStabilityStudy(
        ship=card.ship.name,
        length_m=card.ship.length_m,
        straight_run=run,
        nearly_straight=keeps_nearly_straight(run, turns, card.ship.length_m),
        speeds=tuple(craft.straight(share * highest) for share in SPEED_SHARES),
        highest_speed_mps=highest,
        difference_turns=turns,
        notices=(*build(card).notices, Notice(NO_RUDDER)),
    )


@dataclass(frozen=True)
class OfCraft:
    """Straight run of the members of an ensemble at a speed, and their fastest turn."""

    ship: ShipText
    speed_mps: float

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        card = self.ship.card()
        craft = CraftMotions(card)

        def figures(values: Mapping[str, float]) -> MemberResult:
            member = craft.drawn(values)
            run, highest = member.straight(self.speed_mps), member.highest_speed(card.model.speed_mps)
            turn = member.turn(run, 1.0)
            return MemberResult(
                {
                    "growth_per_s": max(mode.real for mode in (*run.eigenvalues, *run.steering_modes)),
                    "surge_time_constant_s": run.surge_time_constant_s or math.nan,
                    "highest_speed_mps": highest,
                    "steady_rate_degps": turn.yaw_rate_degps if turn else math.nan,
                    "steady_diameter_m": turn.diameter_m if turn else math.nan,
                }
            )

        return each_ship(craft.model, figures)


def keeps_nearly_straight(run: CraftAtSpeed, turns: Sequence[SteadyCraftTurn], length_m: float) -> bool:
    """Whether a craft, with no difference of revolutions, keeps a straight course or a loop wider than
    :data:`STRAIGHT_FROM_LENGTHS`.

    Parameters
    ----------
    turns : sequence of SteadyCraftTurn
        About its revolutions; the one without a difference first.
    length_m : float
        Of the craft.
    """
    alone = turns[0] if turns and not turns[0].difference_rpm else None
    return run.stable or (alone is not None and alone.diameter_m > STRAIGHT_FROM_LENGTHS * length_m)


class CraftMotions:
    """Steady motions of a craft, by the revolutions of its sides, with :class:`.TurningEquations`.

    Raises
    ------
    InputError
        The craft is not steered by fixed thrusters at both sides.
    """

    def __init__(self, card: SteeredCard) -> None:
        self.model = build(replace(card, thrusters=tuple(map(_without_lag, card.thrusters))))
        self._equations = TurningEquations(self.model, free=True)
        sides = self._equations.sides
        if not {1.0, -1.0} <= set(sides.values()):
            problem = "is not steered by thrusters at both sides, and has no rudder"
            raise card.fault("thrusters", problem, "give one at port and one at starboard")
        steering = [one for one in card.thrusters if f"thrusters.{one.name}.command" in sides]
        self.low, self.high = max(one.lowest_radps for one in steering), min(one.max_radps for one in steering)
        self.p = self.model.parameter_values()

    def drawn(self, values: Mapping[str, float]) -> CraftMotions:
        """The craft with other parameters, by name; names that the model lacks (lags) do not matter here."""
        other, known = copy(self), set(self.model.parameter_names)
        other.p = self.model.parameter_values({name: value for name, value in values.items() if name in known})
        return other

    def highest_speed(self, about: float) -> float:
        """Speed (m/s) that the largest revolutions hold on a straight course, with the effects of the card.

        Parameters
        ----------
        about : float
            A speed from which it is sought, m/s.
        """
        return self._held({"motion.r": 0.0, "mean": self.high}, {"motion.u": about}).values["motion.u"]

    def straight(self, speed: float) -> CraftAtSpeed:
        """The straight run at a speed, m/s."""
        run = self._held({"motion.u": speed, "motion.r": 0.0}, {"mean": 0.5 * self.high})
        A, b = run.slopes[:, : len(run.slopes)], run.slopes[:, -1:]
        modes, eigenvalues = sorted_modes(A[1:, 1:]), sorted_modes(A)
        found = nomoto(A[1:3, 1:3], b[1:3], np.array([[0.0, 1.0]]))
        return CraftAtSpeed(
            speed_mps=speed,
            revolutions_rpm=from_si("n_rpm", run.values["mean"]),
            eigenvalues=eigenvalues,
            steering_modes=modes,
            surge_time_constant_s=float(-1 / A[0, 0]) if A[0, 0] < 0 else None,
            K=found.K_per_s,
            T_s=found.T_s,
            T1_s=found.T1_s,
            T2_s=found.T2_s,
            T3_s=found.T3_s,
            stable=all(mode.real < 0 for mode in (*eigenvalues, *modes)),
        )

    def turns(self, run: CraftAtSpeed) -> list[SteadyCraftTurn]:
        """Steady turns to starboard about the revolutions of a straight run that are stable.

        A craft that is unstable on a straight course turns without a difference, too: that turn is the first.
        """
        shares = DIFFERENCE_SHARES if run.stable else (0.0, *DIFFERENCE_SHARES)
        found = [self.turn(run, share) for share in shares]
        return [turn for turn in found if turn is not None]

    def turn(self, run: CraftAtSpeed, share: float) -> SteadyCraftTurn | None:
        """The steady turn to starboard by a share of the largest difference about the revolutions of a straight run."""
        mean = to_si("n_rpm", run.revolutions_rpm)[1]
        difference = share * 2 * min(self.high - mean, mean - self.low)
        for curvature in _CURVATURES:
            rate = curvature * run.speed_mps / self.p[self.model.parameter_names.index("ship.length")]
            near = {"motion.u": run.speed_mps, "motion.v": -_DRIFT * run.speed_mps, "motion.r": rate}
            turn = self._steady({"mean": mean, "difference": difference}, near)
            u, v, r = (turn.values[name] for name in ("motion.u", "motion.v", "motion.r"))
            if turn.converged and u > 0 and r > _SMALL * rate and turn.growth_per_s < 0:
                speed = math.hypot(u, v)
                return SteadyCraftTurn(
                    difference_rpm=from_si("n_rpm", difference),
                    speed_mps=speed,
                    yaw_rate_degps=math.degrees(r),
                    drift_deg=0.0 - math.degrees(math.asin(v / speed)),
                    diameter_m=2 * speed / r,
                )
        return None

    def _held(self, given: Mapping[str, float], near: Mapping[str, float]) -> _SteadyMotion:
        """As :meth:`_steady`; refused if there is none near the start."""
        found = self._steady(given, near)
        if not found.converged and found.residual > _SMALL:
            problem = "has no steady motion with these thrusters"
            raise self.model.fault("", problem, "check thrust and damping, or give another speed")
        return found

    def _steady(self, given: Mapping[str, float], near: Mapping[str, float]) -> _SteadyMotion:
        """The steady motion with the values `given` by name, from others that are `near` (else zero)."""
        equations = self._equations
        names = (*equations.names, *equations.controls)
        start = np.array([{**near, **given}.get(name, 0.0) for name in names]) / equations.scale
        unknown = [place for place, name in enumerate(names) if name not in given]

        def at(values: Array) -> Array:
            y = start.copy()
            y[unknown] = values
            return y

        found = root(lambda values: np.array(equations.function(at(values), self.p)[0]).ravel(), start[unknown])
        y = at(found.x)
        slopes = np.array(equations.function(y, self.p)[1]) / equations.ship_time / equations.scale
        return _SteadyMotion(
            values=dict(zip(names, (y * equations.scale).tolist(), strict=True)),
            slopes=slopes * equations.scale[: len(slopes), None],
            converged=bool(found.success),
            residual=float(np.abs(found.fun).max()),
        )


def _without_lag(thruster: ThrusterSection) -> ThrusterSection:
    """A thruster at once at its order, with twice the bounds: slopes at the largest revolutions follow its curve."""
    bounds = {"max_radps": 2 * thruster.max_radps, "max_astern_radps": -2 * thruster.lowest_radps}
    return thruster.model_copy(update={"time_constant_s": None, "dead_band_radps": 0.0, **bounds})


@dataclass(frozen=True, eq=False)
class _SteadyMotion:
    """Where a search ended: values by name, slopes (n, n + 2) of the rates by states and controls, scaled residual."""

    values: dict[str, float]
    slopes: Array
    converged: bool
    residual: float

    @property
    def growth_per_s(self) -> float:
        """Real part of the least damped mode with revolutions held."""
        return float(np.linalg.eigvals(self.slopes[:, : len(self.slopes)]).real.max())
