"""Runs of the yaw rig and their records: body, motor and encoder under a sampled controller and a programme."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import casadi as ca
import numpy as np

from tank2sim.apps.rigs.yaw.card import YawRig, YawRigCard
from tank2sim.apps.rigs.yaw.control import Controller, TunedController
from tank2sim.apps.rigs.yaw.model import yaw_rig_model
from tank2sim.apps.rigs.yaw.programme import Reference, YawProgramme, programme_of
from tank2sim.apps.rigs.yaw.records import Medium, YawRecord
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.scheme import runge_kutta_step


@dataclass(frozen=True, kw_only=True)
class Measuring:
    """Measurement settings of a rig.

    Parameters
    ----------
    encoder : bool
        Controller and record use whole pulses; else the exact angle.
    current_noise_A : float
        Standard deviation of the recorded current.
    control_s : float
        Sampling interval of the controller; a millisecond is a project choice, the paper states none.
    record_every : int
        Samples of the controller per row of the record.
    seed : int
        Seed of the noise.
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
    """Result of a run; all arrays (rows,).

    Parameters
    ----------
    programme : YawProgramme
        The programme of the run.
    time_s, angle_rad, current_A : array
        The record: angle as measured, current with noise.
    true_angle_rad, true_rate_radps, true_current_A : array
        True values, which a rig does not measure.
    gains : tuple
        Gains of each hump, by name; empty for a controller without gains.
    memory : tuple of float
        States of the controller at the end.
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
        return self.reference.angle_rad - self.true_angle_rad


def run_yaw_rig(
    rig: YawRig,
    programme: YawProgramme,
    controller: Controller,
    measuring: Measuring | None = None,
    *,
    allow_saturation: bool = False,
) -> YawRun:
    """Simulate a programme on the rig under a controller, from rest.

    Raises
    ------
    InputError
        The motor saturates without `allow_saturation`: the message states the time and the required current.
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
        after, ordered = sample.mapaccum(end - begin)(states[-1][:, -1], given)
        states.append(np.asarray(after))
        commands.append(np.asarray(ordered).ravel())
        if isinstance(controller, TunedController) and controller.tune:
            gains = _tuned(controller, rig, programme, time[: end + 1], np.hstack(states)[2]) or gains
    path, command_A = np.hstack(states), np.concatenate(commands)
    saturation = _saturation(time, command_A, rig.max_current_A)
    if saturation and not allow_saturation:
        _refuse(saturation, command_A, rig)
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
    """First sample and the one after the last of each hump; the time before the start belongs to the first hump."""
    ends = [round((programme.start_s + (hump + 1) * programme.period_s) / h) for hump in range(programme.humps)]
    ends[-1] = steps
    return list(zip([0, *ends[:-1]], ends, strict=True))


def _tuned(
    controller: TunedController, rig: YawRig, programme: YawProgramme, time: Array, current: Array
) -> tuple[float, float] | None:
    """Gains from the last completed pair of intervals, with the programme's rates; None without a pair."""
    done = [pair for pair in programme.pairs() if max(pair.accelerating_s[1], pair.braking_s[1]) <= time[-1]]
    if not done:
        return None
    works, square, rates = [], [], []
    speeding, braking = done[-1]
    if controller.as_printed:  # t4 to t5, where the rate has hardly begun to fall
        t4 = braking[0] - programme.settle_s - programme.rise_s / 6
        braking = t4, t4 + programme.rise_s / 6
    for begin, end in (speeding, braking):
        times = np.linspace(begin, end, 401)
        rate = programme.at(times).rate_radps
        works.append(float(np.trapezoid(rate * np.interp(times, time, current), times)))
        square.append(float(np.trapezoid(rate**2, times)))
        rates.append((float(rate[0]), float(rate[-1])))
    return controller.tuned_gains((works[0], works[1]), (*rates[0], square[0]), rig.current_lag_s)


def _saturation(time: Array, command_A: Array, limit_A: float) -> Saturation | None:
    beyond = np.flatnonzero(np.abs(command_A) > limit_A)
    if not beyond.size:
        return None
    return Saturation(float(time[beyond[0]]), float(beyond.size * (time[1] - time[0])))


def _refuse(saturation: Saturation, command_A: Array, rig: YawRig) -> None:
    problem = (
        f"saturates the motor, first at {saturation.first_s:.3f} s and for {saturation.total_s:.3g} s in all: "
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


def simulated_record(
    card: YawRigCard,
    path: Path,
    current_noise_A: float = 0.0,
    *,
    medium: Medium = "water",
    controller: Controller | None = None,
    programme: YawProgramme | None = None,
) -> YawRecord:
    """Simulate the record of a programme on the card's rig, including its encoder.

    Parameters
    ----------
    card : YawRigCard
    path : Path
        The file of the record.
    current_noise_A : float
        Standard deviation of the recorded current.
    medium : str
        In ``air`` the rig is that of :func:`rig_in_air`.
    controller : optional
        By default (4), with the true inertia.
    programme : optional
        By default the card's.

    Raises
    ------
    InputError
        The motor saturates, or the card lacks a rig or a programme.
    """
    wet, programme = card.yaw_rig, programme or programme_of(card)
    rig = rig_in_air(wet) if medium == "air" else wet
    controller = controller or TunedController(inertia_kgm2=rig.inertia_kgm2 + rig.added_inertia_kgm2)
    run = run_yaw_rig(rig, programme, controller, Measuring(current_noise_A=current_noise_A))
    constants = {}
    if medium == "water":
        constants = {"inertia_kgm2": rig.inertia_kgm2, "water_density_kgpm3": card.environment.water_density_kgpm3}
        if error := card.uncertainty.get("inertia_kgm2"):
            constants["inertia_error_kgm2"] = error
    if card.ship.length_m is not None:
        constants["length_m"] = card.ship.length_m
    return yaw_record(run, rig, path, constants, medium=medium)


def rig_in_air(rig: YawRig) -> YawRig:
    """The rig with its body in air: no added inertia, no f_662, no walls.

    Dry and viscous friction are those of the card, because it does not state the water's part of them. The inertia, the
    purpose of a run in air, does not depend on it.
    """
    water = ("added_inertia_kgm2", "quadratic_Nms2", "inertia_accelerating_kgm2", "inertia_braking_kgm2")
    return rig.model_copy(update={**dict.fromkeys(water, 0.0), "braking_quadratic_Nms2": None, "walls": None})
