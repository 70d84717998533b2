"""Runs of the yaw rig: body, motor and encoder under a sampled controller, hump after hump of a programme."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.form import YawRig
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.yaw_programme import Reference, YawProgramme
from tank2sim.dynamics.yaw_rig import yaw_rig_model
from tank2sim.errors import InputError
from tank2sim.simulation.scheme import runge_kutta_step
from tank2sim.simulation.yaw_rig_control import Controller, TunedController


@dataclass(frozen=True, kw_only=True)
class Measuring:
    """How a rig measures.

    Parameters
    ----------
    encoder : bool
        The controller and the record get whole pulses; else the angle itself.
    current_noise_A : float
        Standard deviation of the recorded current.
    control_s : float
        Sampling interval of the controller; a millisecond is our choice, the paper tells none.
    record_every : int
        Samples of the controller per row of the record.
    seed : int
        Of the noise.
    """

    encoder: bool = True
    current_noise_A: float = 0.0
    control_s: float = 0.001
    record_every: int = 2
    seed: int = 1


class Saturation(NamedTuple):
    """When the controller first asked for more than the motor's largest current, and for how long in all, s."""

    first_s: float
    total_s: float


@dataclass(frozen=True, eq=False, kw_only=True)
class YawRun:
    """What a run gave; all arrays (rows,).

    Parameters
    ----------
    programme : YawProgramme
        What was to be run.
    time_s, angle_rad, current_A : array
        The record: angle as measured, current with noise.
    true_angle_rad, true_rate_radps, true_current_A : array
        What no rig knows.
    gains : tuple
        Of each hump, by name; empty where the controller has none.
    memory : tuple of float
        The controller's at the end.
    saturation : Saturation or None
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
    reference: Reference = field(repr=False)

    @property
    def error_rad(self) -> Array:
        """Tracking error e = phi_ref - phi of the true angle."""
        error: Array = self.reference.angle_rad - self.true_angle_rad
        return error


def run_yaw_rig(
    rig: YawRig,
    programme: YawProgramme,
    controller: Controller,
    measuring: Measuring | None = None,
    *,
    allow_saturation: bool = False,
) -> YawRun:
    """Let the rig carry out a programme from rest.

    Raises
    ------
    InputError
        The motor saturates, and that is not allowed: the message says when, and how strong a motor is needed.
    """
    measuring = measuring or Measuring()
    h = measuring.control_s
    model = yaw_rig_model("yaw rig", rig)
    law = controller.law(h, rig.current_lag_s, rig.torque_constant_NmpA)
    steps = round(programme.end_s / h)
    time: Array = np.arange(steps + 1, dtype=np.float64) * h
    reference = programme.at(time)
    gains = tuple(law.gains.values())
    sample = _closed_loop(model, law.step, len(law.start), len(law.gains), measuring)
    state = np.concatenate([np.asarray(model.initial(model.parameter_values())).ravel(), law.start])
    states, commands, used = [state[:, None]], [], []
    for begin, end in _humps(programme, steps, h):
        used.append(dict(zip(law.gains, gains, strict=True)))
        driven = np.vstack([reference.angle_rad[begin:end], reference.rate_radps[begin:end]])
        given = np.vstack([driven, *(np.full(end - begin, gain) for gain in gains)])
        after, asked = sample.mapaccum(end - begin)(states[-1][:, -1], given)
        states.append(np.asarray(after))
        commands.append(np.asarray(asked).ravel())
        if isinstance(controller, TunedController) and controller.tune:
            gains = _tuned(controller, rig, programme, time[: end + 1], np.hstack(states)[2]) or gains
    path, asked_A = np.hstack(states), np.concatenate(commands)
    saturation = _saturation(time, asked_A, rig.max_current_A)
    if saturation and not allow_saturation:
        _refuse(saturation, asked_A, rig)
    return _recorded(rig, programme, measuring, _Path(time, path, reference, tuple(used), saturation))


class _Path(NamedTuple):
    time_s: Array
    states: Array
    reference: Reference
    gains: tuple[dict[str, float], ...]
    saturation: Saturation | None


def _recorded(rig: YawRig, programme: YawProgramme, measuring: Measuring, path: _Path) -> YawRun:
    every = slice(None, None, measuring.record_every)
    time, states = path.time_s[every], path.states[:, every]
    pulse = 2 * math.pi / rig.pulses_per_turn
    noise = measuring.current_noise_A * np.random.default_rng(measuring.seed).standard_normal(len(time))
    return YawRun(
        programme=programme,
        time_s=time,
        angle_rad=np.floor(states[0] / pulse) * pulse if measuring.encoder else states[0],
        current_A=states[2] + noise,
        true_angle_rad=states[0],
        true_rate_radps=states[1],
        true_current_A=states[2],
        gains=path.gains,
        memory=tuple(float(value) for value in path.states[3:, -1]),
        saturation=path.saturation,
        reference=Reference(*(column[every] for column in path.reference)),
    )


def _closed_loop(model: Model, law: object, memories: int, gains: int, measuring: Measuring) -> ca.Function:
    """``sample([state; memory], [angle_ref; rate_ref; gains]) -> (next, command)``: one interval of the controller."""
    states = len(model.states)
    whole, given = ca.SX.sym("z", states + memories), ca.SX.sym("given", 2 + gains)
    x, memory = whole[:states], whole[states:]
    parameters = model.parameter_values()
    outputs = model.output(x, ca.SX(0), parameters)
    measured = outputs[model.outputs.index("encoder.angle")] if measuring.encoder else x[0]
    assert callable(law)
    following, command = law(memory, measured, given[0], given[1], given[2:])
    after = runge_kutta_step(model)(x, command, parameters, measuring.control_s)
    return ca.Function("sample", [whole, given], [ca.vertcat(after, following), command], {"cse": True})


def _humps(programme: YawProgramme, steps: int, h: float) -> list[tuple[int, int]]:
    """First sample and the one after the last of each hump; the wait before the start belongs to the first."""
    ends = [round((programme.start_s + (hump + 1) * programme.period_s) / h) for hump in range(programme.humps)]
    ends[-1] = steps
    return list(zip([0, *ends[:-1]], ends, strict=True))


def _tuned(
    controller: TunedController, rig: YawRig, programme: YawProgramme, time: Array, current: Array
) -> tuple[float, float] | None:
    """Gains from the last pair of intervals that has been run; None if there is none.

    As the paper allows where the tracking is close, the rates are those of the programme.
    """
    done = [pair for pair in programme.pairs() if max(pair.accelerating_s[1], pair.braking_s[1]) <= time[-1]]
    if not done:
        return None
    works, square, rates = [], [], []
    speeding, braking = done[-1]
    if controller.as_printed:  # t4 to t5, where the rate has hardly begun to fall
        t4 = braking[0] - programme.settle_s - programme.rise_s / 6
        braking = t4, t4 + programme.rise_s / 6
    for begin, end in (speeding, braking):
        own = np.linspace(begin, end, 401)
        rate = programme.at(own).rate_radps
        works.append(float(np.trapezoid(rate * np.interp(own, time, current), own)))
        square.append(float(np.trapezoid(rate**2, own)))
        rates.append((float(rate[0]), float(rate[-1])))
    return controller.tuned_gains((works[0], works[1]), (*rates[0], square[0]), rig.current_lag_s)


def _saturation(time: Array, asked_A: Array, limit_A: float) -> Saturation | None:
    beyond = np.flatnonzero(np.abs(asked_A) > limit_A)
    if not beyond.size:
        return None
    return Saturation(float(time[beyond[0]]), float(beyond.size * (time[1] - time[0])))


def _refuse(saturation: Saturation, asked_A: Array, rig: YawRig) -> None:
    problem = (
        f"saturates the motor, first at {saturation.first_s:.3f} s and for {saturation.total_s:.3g} s in all: "
        f"up to {np.abs(asked_A).max():.3g} A is asked for, and {rig.max_current_A:g} A can be had"
    )
    raise InputError("yaw rig", "", problem, "take a slower programme, lower gains or a stronger motor")
