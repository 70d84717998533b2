"""Runs of the yaw rig and their records: body, motor and encoder under a sampled controller and a programme.

The controllers are (4), tuned from run to run, and (6), adaptive, as a digital controller carries them out. Both are
functions of one sample, ``step(memory, angle, angle_ref, rate_ref, gains) -> (memory after, command)``, with rectangles
for integrals and a held value for the filter, at the interval `h` of the sampling.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np

from tank2sim.apps.rigs.yaw.card import YawRig, YawRigCard
from tank2sim.apps.rigs.yaw.model import yaw_rig_model
from tank2sim.apps.rigs.yaw.programme import (
    Similarity,
    YawProgramme,
    dissipation_from_work,
    inertia_from_work,
    programme_of,
)
from tank2sim.apps.rigs.yaw.records import Medium, YawRecord
from tank2sim.arguments import numbers_in
from tank2sim.arrays import Array
from tank2sim.cards import Card
from tank2sim.dynamics.vessel import Vessel, as_vessel
from tank2sim.errors import ArgumentError, InputError
from tank2sim.simulation.scheme import runge_kutta_step


class Law(NamedTuple):
    """A controller: the start of its memory, its gains of the first run, and its step of one sample."""

    start: tuple[float, ...]
    gains: Mapping[str, float]
    step: Callable[[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX], tuple[ca.SX, ca.SX]]


@dataclass(frozen=True, kw_only=True)
class TunedController:
    """(4): u = (K_P + K_I/p) e + K_D (w_ref - p/(T_o p + 1) phi), e = phi_ref - phi.

    `inertia_kgm2` is a10 = J* + lambda66, from which the first gains are taken, with a20 = 0.1 a10 (N m s) for the
    friction; `divisor` is n1, `integral_gain` K_I, `filter_s` T_o. `tune` takes new gains after every pair of
    intervals. (The print exchanges a10 and a20 in the first gains, and has t4, t5 as limits of braking where t5, t6
    are meant.)
    """

    inertia_kgm2: float
    divisor: float = 1.0
    integral_gain: float = 1.0
    filter_s: float = 0.1
    tune: bool = True

    def first_gains(self, lag_s: float, torque_constant_NmpA: float) -> tuple[float, float]:
        """K_P and K_D of the first run: a20 and a10 over n1 T_c k_t."""
        scale = self.divisor * lag_s * torque_constant_NmpA
        return 0.1 * self.inertia_kgm2 / scale, self.inertia_kgm2 / scale

    def tuned_gains(
        self, programme: YawProgramme, time_s: Array, current: Array, lag_s: float
    ) -> tuple[float, float] | None:
        """K_P and K_D from the `current` of the last completed pair of intervals: the first fractions of (1) and (2).

        With the programme's rates, the braking limits t5, t6, and `lag_s` T_c; None without a pair.
        """
        pairs = [pair for pair in programme.pairs() if max(pair.accelerating_s[1], pair.braking_s[1]) <= time_s[-1]]
        if not pairs:
            return None
        speeding, braking = pairs[-1]
        works: list[float] = []  # int w I dt, A rad
        for ends in (braking, speeding):
            times = np.linspace(*ends, 401)
            rate = programme.at(times).rate_radps
            works.insert(0, float(np.trapezoid(rate * np.interp(times, time_s, current), times)))
        square, scale = float(np.trapezoid(rate**2, times)), self.divisor * lag_s
        derivative = inertia_from_work(works[0], works[1], float(rate[0]), float(rate[-1])) / scale
        return dissipation_from_work(works[0], works[1]) / (scale * square), derivative

    def law(self, h: float, lag_s: float, torque_constant_NmpA: float) -> Law:
        """The controller at the sampling interval `h`, s, for a motor with T_c and k_t."""

        def step(memory: ca.SX, angle: ca.SX, angle_ref: ca.SX, rate_ref: ca.SX, gains: ca.SX) -> tuple[ca.SX, ca.SX]:
            integral, filtered = memory[0], memory[1]
            error = angle_ref - angle
            rate = (angle - filtered) / self.filter_s
            command = gains[0] * error + self.integral_gain * integral + gains[1] * (rate_ref - rate)
            return ca.vertcat(integral + h * error, filtered + h * rate), command

        gains = self.first_gains(lag_s, torque_constant_NmpA)
        return Law((0.0, 0.0), dict(zip(("K_P", "K_D"), gains, strict=True)), step)


@dataclass(frozen=True, kw_only=True)
class AdaptiveController:
    """(5) and (6): u = d(kt xi)/dt + kt xi + gamma1 kt sgn w_ref + gamma2 kt w_ref |w_ref|.

    xi' = sigma0 kt^2 (e - xi), and kt' = lambda0 while |W_f e| > delta0, W_f = 1/(T_f p + 1). With both gammas 0 it is
    (5). The paper does not state the first kt; 20 is a project choice, with which the loop is stable.
    """

    sigma0: float = 0.008
    lambda0: float = 1.0
    delta0_rad: float = 0.006
    gamma1: float = 2e-4
    gamma2: float = 1e-4
    filter_s: float = 0.2
    first_gain: float = 20.0

    def law(self, h: float, lag_s: float, torque_constant_NmpA: float) -> Law:
        """The controller at the sampling interval `h`, s; it knows nothing of the motor."""

        def step(memory: ca.SX, angle: ca.SX, angle_ref: ca.SX, rate_ref: ca.SX, gains: ca.SX) -> tuple[ca.SX, ca.SX]:
            xi, gain, smooth = memory[0], memory[1], memory[2]
            error = angle_ref - angle
            gain_rate = ca.if_else(ca.fabs(smooth) > self.delta0_rad, self.lambda0, 0)
            xi_rate = self.sigma0 * gain**2 * (error - xi)
            feed = self.gamma1 * ca.sign(rate_ref) + self.gamma2 * rate_ref * ca.fabs(rate_ref)
            command = gain_rate * xi + gain * xi_rate + gain * xi + gain * feed
            smooth_rate = (error - smooth) / self.filter_s
            return ca.vertcat(xi + h * xi_rate, gain + h * gain_rate, smooth + h * smooth_rate), command

        return Law((0.0, self.first_gain, 0.0), {}, step)


Controller = TunedController | AdaptiveController


@dataclass(frozen=True, kw_only=True)
class Measuring:
    """Measurement settings of a rig.

    With the encoder, controller and record use whole pulses, else the exact angle. The noise of the recorded current is
    a standard deviation. The controller samples every millisecond, a project choice, the paper states none;
    `record_every` of its samples make a row of the record.
    """

    encoder: bool = True
    current_noise_A: float = 0.0
    control_s: float = 0.001
    record_every: int = 2
    seed: int = 1


class Saturation(NamedTuple):
    """First time of an ordered current above the motor's largest, and its total duration, s."""

    first_s: float
    total_s: float


@dataclass(frozen=True, eq=False, kw_only=True)
class YawRun:
    """Result of a run, arrays (rows,): the record, with the noise of the current, and the true values, which a rig does
    not measure.

    `gains` of each hump, by name; none for a controller without gains. `memory` has the states of the
    controller at the end.
    """

    programme: YawProgramme
    time_s: Array
    angle_rad: Array
    current_A: Array
    true_angle_rad: Array
    true_rate_radps: Array
    true_current_A: Array
    gains: tuple[dict[str, float], ...]
    memory: tuple[float, ...]
    saturation: Saturation | None

    @property
    def error_rad(self) -> Array:
        """Tracking error e = phi_ref - phi of the true angle."""
        return self.programme.at(self.time_s).angle_rad - self.true_angle_rad


def run_yaw_rig(
    rig: YawRig,
    programme: YawProgramme,
    controller: Controller,
    measuring: Measuring | None = None,
    *,
    allow_saturation: bool = False,
) -> YawRun:
    """Simulate a programme on the rig under a controller, from rest.

    InputError if the motor saturates without `allow_saturation`: the message states the time and the required current.
    """
    measuring = measuring or Measuring()
    h = measuring.control_s
    law = controller.law(h, rig.current_lag_s, rig.torque_constant_NmpA)
    time: Array = np.arange(round(programme.end_s / h) + 1, dtype=np.float64) * h
    reference = programme.at(time)
    gains = tuple(law.gains.values())
    start, sample = _closed_loop(rig, law, measuring)
    states, commands, used = [start[:, None]], [], []
    # Ends of the humps; the time before the start belongs to the first one.
    ends = [round((programme.start_s + hump * programme.period_s) / h) for hump in range(1, programme.humps)]
    for begin, end in zip([0, *ends], [*ends, len(time) - 1], strict=True):
        used.append(dict(zip(law.gains, gains, strict=True)))
        driven = np.vstack([reference.angle_rad[begin:end], reference.rate_radps[begin:end]])
        given = np.vstack([driven, *(np.full(end - begin, gain) for gain in gains)])
        after, ordered = sample.mapaccum(end - begin)(states[-1][:, -1], given)
        states.append(np.asarray(after))
        commands.append(np.asarray(ordered).ravel())
        if isinstance(controller, TunedController) and controller.tune:
            current = np.hstack(states)[2]
            gains = controller.tuned_gains(programme, time[: end + 1], current, rig.current_lag_s) or gains
    path = np.hstack(states)
    saturation = _saturation(rig, np.concatenate(commands), h, allowed=allow_saturation)
    every = slice(None, None, measuring.record_every)
    angle, rate, driven_A = path[:3, every]
    pulse = 2 * math.pi / rig.pulses_per_turn
    noise = measuring.current_noise_A * np.random.default_rng(measuring.seed).standard_normal(len(driven_A))
    return YawRun(
        programme=programme,
        time_s=time[every],
        angle_rad=np.floor(angle / pulse) * pulse if measuring.encoder else angle,
        current_A=driven_A + noise,
        true_angle_rad=angle,
        true_rate_radps=rate,
        true_current_A=driven_A,
        gains=tuple(used),
        memory=tuple(path[3:, -1].tolist()),
        saturation=saturation,
    )


def _closed_loop(rig: YawRig, law: Law, measuring: Measuring) -> tuple[Array, ca.Function]:
    """Start of rig and controller, and ``sample([state; memory], [angle_ref; rate_ref; gains]) -> (next, command)``."""
    model = yaw_rig_model("yaw rig", rig)
    states = len(model.states)
    whole, given = ca.SX.sym("z", states + len(law.start)), ca.SX.sym("given", 2 + len(law.gains))
    x, memory = whole[:states], whole[states:]
    parameters = model.parameter_values()
    outputs = model.output(x, ca.SX(0), parameters)
    measured = outputs[model.outputs.index("encoder.angle")] if measuring.encoder else x[0]
    following, command = law.step(memory, measured, given[0], given[1], given[2:])
    after = runge_kutta_step(model)(x, command, parameters, measuring.control_s)
    start: Array = np.concatenate([np.asarray(model.initial(parameters)).ravel(), law.start])
    return start, ca.Function("sample", [whole, given], [ca.vertcat(after, following), command], {"cse": True})


def _saturation(rig: YawRig, command_A: Array, h: float, *, allowed: bool) -> Saturation | None:
    """Where the ordered current, at intervals of `h` s, is beyond the motor's; refused unless `allowed`."""
    beyond = np.flatnonzero(np.abs(command_A) > rig.max_current_A)
    if not beyond.size:
        return None
    found = Saturation(float(beyond[0] * h), float(beyond.size * h))
    if allowed:
        return found
    problem = (
        f"saturates the motor, first at {found.first_s:.3f} s and for {found.total_s:.3g} s in all: "
        f"up to {np.abs(command_A).max():.3g} A is ordered, and {rig.max_current_A:g} A is available"
    )
    raise InputError("yaw rig", "", problem, "take a slower programme, lower gains or a stronger motor")


def yaw_record(
    run: YawRun, rig: YawRig, path: Path, constants: Mapping[str, float] | None = None, *, medium: Medium = "water"
) -> YawRecord:
    """The record of a run; it states `constants` in addition to the torque constant and the largest current."""
    return YawRecord(
        path=path,
        time_s=run.time_s,
        angle_rad=run.angle_rad,
        current_A=run.current_A,
        medium=medium,
        programme=run.programme,
        stated=True,
        constants={
            "torque_constant_NmpA": rig.torque_constant_NmpA,
            "max_current_A": rig.max_current_A,
            **(constants or {}),
        },
    )


@dataclass(frozen=True)
class RigRun:
    """A run to simulate on a card's rig; `controller` is ``tuned`` (4), with the true inertia, or ``adaptive`` (6).

    `similar_to` (``L,B,R,T``) is a ship's motion that the body follows at its size, in place of the card's programme;
    `noise_A` the standard deviation of the recorded current.
    """

    medium: Medium = "water"
    controller: str = "tuned"
    similar_to: str | None = None
    noise_A: float = 0.0


def simulated_record(card: YawRigCard, path: Path, run: RigRun) -> YawRecord:
    """Simulate a run on the card's rig, including its encoder, as the record of the file `path`.

    In ``air`` the rig is given by :func:`rig_in_air`. InputError if the file exists or the motor saturates.
    """
    if path.exists():
        raise InputError(path, "", "exists, and may be a measurement", "give the simulated record a new name")
    air = run.medium == "air"
    rig = rig_in_air(card.yaw_rig) if air else card.yaw_rig
    programme = similar_programme(card, run.similar_to) if run.similar_to else programme_of(card)
    tuned = TunedController(inertia_kgm2=rig.inertia_kgm2 + rig.added_inertia_kgm2)
    controller = AdaptiveController() if run.controller == "adaptive" else tuned
    found = run_yaw_rig(rig, programme, controller, Measuring(current_noise_A=run.noise_A))
    water: dict[str, float | None] = {
        "inertia_kgm2": rig.inertia_kgm2,
        "water_density_kgpm3": card.environment.water_density_kgpm3,
        "inertia_error_kgm2": card.uncertainty.get("inertia_kgm2"),
    }
    known = ({} if air else water) | {"length_m": card.ship.length_m}
    return yaw_record(found, rig, path, {key: value for key, value in known.items() if value}, medium=run.medium)


def rig_in_air(rig: YawRig) -> YawRig:
    """The rig with its body in air: no added inertia, no f_662, no walls.

    Dry and viscous friction are the card's, because it does not state the water's part of them. The inertia, the
    purpose of a run in air, does not depend on it.
    """
    water = ("added_inertia_kgm2", "quadratic_Nms2", "inertia_accelerating_kgm2", "inertia_braking_kgm2")
    return rig.model_copy(update={**dict.fromkeys(water, 0.0), "braking_quadratic_Nms2": None, "walls": None})


def rig_card_of(given: Vessel | Card | str | Path) -> YawRigCard:
    """The card of a yaw rig; InputError for a card of another kind."""
    card = as_vessel(given).card
    if not isinstance(card, YawRigCard):
        raise card.fault("model.kind", f"is {card.model.kind}", "a card of kind yaw_rig is needed, such as alyshev")
    return card


def similar_programme(card: YawRigCard, text: str) -> YawProgramme:
    """The programme of a ship's motion (`text` ``L,B,R,T``) at the size of the card's body."""
    length, beam, rate_degpmin, time_s = _ship_motion(text)
    body = card.ship
    if body.length_m is None or body.beam_m is None:
        raise card.fault("ship", "has no length_m or no beam_m", "add them, on the waterline")
    ratio = Similarity(ship_length_m=length, ship_beam_m=beam, length_m=body.length_m, beam_m=body.beam_m)
    try:
        return ratio.programme(math.radians(rate_degpmin / 60), time_s, programme_of(card))
    except ValueError as error:
        raise ArgumentError("similar_to", "", str(error), "give another motion of the ship") from None


def _ship_motion(text: str) -> tuple[float, ...]:
    """Length and beam (m), yaw rate (deg/min) and time (s) of a text ``L,B,R,T``."""
    numbers = numbers_in(text, (4,))
    if not numbers or not numbers[2] or min(numbers[0], numbers[1], numbers[3]) <= 0:
        remedy = "write length and beam in m, yaw rate in deg/min and time in s: 38,8,100,120"
        raise ArgumentError("similar_to", "", f"{text!r} is not a motion of a ship", remedy)
    return tuple(numbers)


def similarity_words(record: YawRecord, text: str) -> str:
    """Sentence on the scale of rates between a ship's motion (`text` ``L,B,R,T``) and its record."""
    length, beam, rate_degpmin, time_s = _ship_motion(text)
    model_degps = math.degrees(record.programme.max_rate_radps)
    return (
        f"{length:g} m x {beam:g} m at model size: rates times {60 * model_degps / rate_degpmin:.4g}, so "
        f"{rate_degpmin:g} deg/min in {time_s:g} s is {model_degps:.4g} deg/s in {3 * record.programme.rise_s:.4g} s"
    )
