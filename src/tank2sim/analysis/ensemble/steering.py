"""Bands of the curves of a ship's stability page: steady turns over the rudder, and the linear response to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.ensemble.questions import ShipText, each_ship
from tank2sim.analysis.linearisation import state_space, straight_course
from tank2sim.analysis.stability.response import HULL, SteeringResponse, system_response
from tank2sim.analysis.stability.straight_line import steering_states
from tank2sim.analysis.turning.diagram import SteadyTurning, largest_rudder, steady_turning
from tank2sim.arrays import Array
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.notices import Notice
from tank2sim.simulation.bands import QUANTILES, STILL_RUNNING, Band, BandOverTime, figure_bands
from tank2sim.simulation.ensemble import Ask, Draws, Ensemble, MemberResult, ensemble

CURVES = 200
"""Number of members, the first, for the bands of curves. Each takes half a second, and the share below a quantile is
known to 1.5 % (project choice)."""

_POINTS = 121
"""Points of every curve (project choice)."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Grid of the curves, (n,) each: rudder (rad), frequency (rad/s) and time after a step (s).

    `phase_deg` is the phase of the card's ship at the highest frequency: the members' phases are within half a turn of
    it.
    """

    rudder_rad: Array
    omega_radps: Array
    time_s: Array
    phase_deg: float

    @staticmethod
    def of(model: Model, response: SteeringResponse) -> Grid:
        """The grid over the rudder range of the gear, and over frequency and time of the card's own response."""
        largest = largest_rudder(model) * (1 - 1e-9)
        omega = np.geomspace(response.omega_radps[0], response.omega_radps[-1], _POINTS)
        phase = float(np.degrees(np.unwrap(np.angle(response.response)))[-1])
        return Grid(
            np.linspace(-largest, largest, _POINTS), omega, np.linspace(0.0, response.time_s[-1], _POINTS), phase
        )


@dataclass(frozen=True, eq=False)
class OfSteering:
    """Curves of a member over the grid, (5, n), and its hysteresis loop."""

    ship: ShipText
    speed_mps: float | None
    grid: Grid

    def prepared(self) -> Ask:
        """See :class:`tank2sim.simulation.ensemble.Question`."""
        model = build(self.ship.card())

        def curves(values: Mapping[str, float]) -> MemberResult:
            # What is an input (a current) is calm in these curves.
            drawn = model.with_values({name: value for name, value in values.items() if name in model.parameter_names})
            turning = steady_turning(drawn)
            rows = [*branches(turning, self.grid.rudder_rad), *_responses(drawn, self.speed_mps, self.grid)]
            width = turning.loop.width_deg if turning.loop else 0.0
            return MemberResult({"loop_width_deg": width}, np.array(rows, dtype=np.float32))

        return each_ship(model, curves)


@dataclass(frozen=True, eq=False)
class CurveBand(BandOverTime):
    """A band of a curve (n,), and the curve of the card's ship itself (`own`)."""

    own: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class TurningBands:
    """Yaw rates of the stable turns that a spiral reaches from starboard and from port, over the rudder (n,).

    `loop_width_deg` is the band of the width of the hysteresis loop, 0 for members without one; `with_loop` members
    have one.
    """

    rudder_deg: Array
    yaw_rate_from_starboard_degps: CurveBand
    yaw_rate_from_port_degps: CurveBand
    loop_width_deg: Band | None
    with_loop: int


@dataclass(frozen=True, eq=False, kw_only=True)
class BodeBands:
    """Magnitude and phase of yaw rate by rudder angle, over the angular frequency (n,)."""

    omega_radps: Array
    magnitude_dB: CurveBand
    phase_deg: CurveBand


@dataclass(frozen=True, eq=False, kw_only=True)
class StepBands:
    """Yaw rate after a unit step of the rudder, 1/s, over the time (n,)."""

    time_s: Array
    step_per_s: CurveBand


@dataclass(frozen=True, eq=False, kw_only=True)
class SteeringBands:
    """Bands of the curves of ``stability``, over the usable ones of the first :data:`CURVES` members."""

    members: int
    steady_turning: TurningBands
    bode: BodeBands
    step: StepBands


def steering_bands(
    ship: ShipText, draws: Draws, members: int, about: tuple[float | None, Grid], executor: Executor | None = None
) -> tuple[SteeringBands | None, list[Notice]]:
    """Bands of the first :data:`CURVES` members, with notices; `about` is the speed (None: the card's) and the grid.

    None if no member has such curves.
    """
    speed, grid = about
    question = OfSteering(ship, speed, grid)
    reference = question.prepared()(1, {}, 1)
    found = ensemble(question, draws, min(members, CURVES), executor)
    if found.histories is None or reference.histories is None:
        return None, []
    messages = [notice.of("no steady turns") for notice in found.of_unusable]
    if members > CURVES:
        messages.append(Notice(f"bands of steady turns, Bode diagram and step are of the first {CURVES} members"))
    bands = [_band(found, row, own.astype(float)) for row, own in enumerate(reference.histories[0])]
    from_starboard, from_port, magnitude, phase, step = bands
    if not all(np.isfinite(side.p5).all() for side in (from_starboard, from_port)):
        share = f"{100 * (1 - STILL_RUNNING):.2g} % of the members"
        messages.append(
            Notice(f"bands of steady turns leave out rudders at which more than {share} have no stable turn")
        )
    turning = TurningBands(
        rudder_deg=np.degrees(grid.rudder_rad),
        yaw_rate_from_starboard_degps=from_starboard,
        yaw_rate_from_port_degps=from_port,
        loop_width_deg=figure_bands(found).get("loop_width_deg"),
        with_loop=int(np.sum(found.figures["loop_width_deg"] > 0)),
    )
    bode = BodeBands(omega_radps=grid.omega_radps, magnitude_dB=magnitude, phase_deg=phase)
    drawn = SteeringBands(
        members=found.usable, steady_turning=turning, bode=bode, step=StepBands(time_s=grid.time_s, step_per_s=step)
    )
    return drawn, messages


def branches(turning: SteadyTurning, rudder_rad: Sequence[float] | Array) -> tuple[Array, Array]:
    """Yaw rates (n,), deg/s, of the stable turns that a spiral reaches from starboard and from port: the farthest to
    that side; equal outside a hysteresis loop, nan without a stable turn."""
    found = [[rate for rate, stable in turning.turns_at(float(angle)) if stable] for angle in rudder_rad]
    return (
        np.degrees([max(rates, default=math.nan) for rates in found]),
        np.degrees([min(rates, default=math.nan) for rates in found]),
    )


def _responses(model: Model, speed_mps: float | None, grid: Grid) -> list[Array]:
    """Magnitude (dB) and phase (deg) of yaw rate by rudder angle, and the step, 1/s."""
    point = straight_course(model, speed_mps)
    hull = state_space(model, point, states=steering_states(model), inputs=["rudder.angle"], outputs=["motion.r"])
    found = system_response(HULL, hull, grid.omega_radps, grid.time_s)
    with np.errstate(divide="ignore"):
        magnitude = 20 * np.log10(np.abs(found.response))
    phase = np.degrees(np.unwrap(np.angle(found.response)))
    phase -= 360.0 * round((phase[-1] - grid.phase_deg) / 360.0)
    return [magnitude, phase, found.step_per_s]


def _band(found: Ensemble, row: int, own: Array) -> CurveBand:
    """Quantiles where nearly all usable members have the curve, nan elsewhere."""
    assert found.histories is not None
    values = found.histories[:, row].astype(float)
    shown = np.isfinite(values).sum(axis=0) >= STILL_RUNNING * max(found.usable, 1)
    quantiles = np.full((len(QUANTILES), values.shape[1]), np.nan)
    if shown.any():
        quantiles[:, shown] = np.nanquantile(np.where(np.isfinite(values), values, np.nan)[:, shown], QUANTILES, axis=0)
    p5, p50, p95 = quantiles
    return CurveBand(p5, p50, p95, own)
