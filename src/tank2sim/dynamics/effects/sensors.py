"""Faults of sensors: the ship moves as before, and its record shows something else."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from tank2sim.dynamics.effects.effect import MEASURED_BEFOREHAND, Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.froude_scale import lengths, rates, time_scale_passages

_Columns = Mapping[str, NDArray[np.float64]]

_SIGNALS = dict(zip(MEASURED_BEFOREHAND, ("u_mps", "v_mps", "r_radps", "psi_rad", "x_m", "y_m"), strict=True))
"""Variable of the model to the signal of a trial that measures it."""

RUDDER_SIGNALS = {"delta_order_rad": True, "delta_rad": False}
"""Signals that drive the rudder, and whether each is held until its next sample (an order) or runs straight to it (an
angle)."""


def _biased_gyro(motion: EffectSymbols, given: EffectSymbols) -> dict[str, ca.SX]:
    """r + b."""
    return {"motion.r": motion["motion.r"] + given["rate"]}


GYRO_BIAS = Effect(
    name="gyro_bias",
    acts_on="sensor",
    description="The rate gyro shows a turn while the ship goes straight.",
    source="Fossen (2011), Handbook of Marine Craft Hydrodynamics and Motion Control: bias of a rate gyro",
    parameters=(
        EffectParameter(
            "rate_radps",
            "what the gyro shows too much, positive to starboard",
            -0.2,
            0.2,
            absent=0.0,
            typical=rates(0.02),  # 0.06 deg/s where L/u0 is 20 s, a twentieth of the rate in a turn (project choice)
        ),
    ),
    readings=_biased_gyro,
)


def _scaled_gyro(motion: EffectSymbols, given: EffectSymbols) -> dict[str, ca.SX]:
    """(1 + s) r."""
    return {"motion.r": (1 + given["factor"]) * motion["motion.r"]}


GYRO_SCALE = Effect(
    name="gyro_scale",
    acts_on="sensor",
    description="The rate gyro shows every turn faster (or slower) than it is.",
    source="Titterton and Weston (2004), Strapdown Inertial Navigation Technology: scale factor error",
    parameters=(
        # 5 %: what turns up when a range or a unit is set wrongly is larger, what calibration leaves smaller (project
        # choice).
        EffectParameter("factor", "relative excess of the rate shown", -0.9, 2.0, absent=0.0, typical=(0.05,)),
    ),
    readings=_scaled_gyro,
)


def _turned_compass(motion: EffectSymbols, given: EffectSymbols) -> dict[str, ca.SX]:
    """psi + b."""
    return {"motion.psi": motion["motion.psi"] + given["angle"]}


HEADING_OFFSET = Effect(
    name="heading_offset",
    acts_on="sensor",
    description="The compass shows a heading to one side of the true one.",
    source="Bowditch, The American Practical Navigator: compass error",
    parameters=(
        EffectParameter(
            "angle_rad",
            "heading shown less true heading, positive clockwise",
            -math.pi / 2,
            math.pi / 2,
            absent=0.0,
            typical=(math.radians(2.0),),  # as compasses are mounted, and what their drift leaves (project choice)
        ),
    ),
    readings=_turned_compass,
)


def _off_centre_antenna(motion: EffectSymbols, given: EffectSymbols) -> dict[str, ca.SX]:
    """(x, y) + R(psi) a, a = (forward, starboard)."""
    cosine, sine = ca.cos(motion["motion.psi"]), ca.sin(motion["motion.psi"])
    forward, starboard = given["forward"], given["starboard"]
    return {
        "motion.x": motion["motion.x"] + forward * cosine - starboard * sine,
        "motion.y": motion["motion.y"] + forward * sine + starboard * cosine,
    }


ANTENNA_LEVER_ARM = Effect(
    name="antenna_lever_arm",
    acts_on="sensor",
    description="The position is measured at an antenna away from midships, which swings round as the ship turns.",
    source="ITTC 7.5-04-02-01, full scale manoeuvring trials: positions are of the antenna; rigid body",
    parameters=(
        EffectParameter(
            "forward_m",
            "antenna forward of midships",
            -300.0,
            300.0,
            absent=0.0,
            typical=lengths(-0.3),  # over a bridge aft (project choice)
        ),
        EffectParameter(
            "starboard_m", "antenna to starboard of the centreline", -50.0, 50.0, absent=0.0, typical=lengths(0.02)
        ),
    ),
    readings=_off_centre_antenna,
)


def _scaled_log(motion: EffectSymbols, given: EffectSymbols) -> dict[str, ca.SX]:
    """(1 + s) (u, v)."""
    return {name: (1 + given["factor"]) * motion[name] for name in ("motion.u", "motion.v")}


LOG_SCALE = Effect(
    name="log_scale",
    acts_on="sensor",
    description="The log shows every speed through the water higher (or lower) than it is.",
    source="Joyce (1989), J. Atmos. Oceanic Technol. 6, 169-172: scale factor of acoustic Doppler logs",
    parameters=(
        EffectParameter(
            "factor",
            "relative excess of the speeds shown through the water",
            -0.9,
            2.0,
            absent=0.0,
            typical=(0.05,),  # project choice
        ),
    ),
    readings=_scaled_log,
)


def _turned_log(motion: EffectSymbols, given: EffectSymbols) -> dict[str, ca.SX]:
    """(u cos a + v sin a, v cos a - u sin a)."""
    cosine, sine = ca.cos(given["angle"]), ca.sin(given["angle"])
    u, v = motion["motion.u"], motion["motion.v"]
    return {"motion.u": u * cosine + v * sine, "motion.v": v * cosine - u * sine}


LOG_MISALIGNMENT = Effect(
    name="log_misalignment",
    acts_on="sensor",
    description="The log is turned about the vertical, and takes headway for leeway.",
    source="Joyce (1989), J. Atmos. Oceanic Technol. 6, 169-172: misalignment of acoustic Doppler logs",
    parameters=(
        EffectParameter(
            "angle_rad",
            "angle by which the log points to starboard of the bow",
            -math.pi / 4,
            math.pi / 4,
            absent=0.0,
            typical=(math.radians(2.0),),  # project choice
        ),
    ),
    readings=_turned_log,
)


def _log_forward(motion: EffectSymbols, given: EffectSymbols) -> dict[str, ca.SX]:
    """v + x r."""
    return {"motion.v": motion["motion.v"] + given["forward"] * motion["motion.r"]}


LOG_LEVER_ARM = Effect(
    name="log_lever_arm",
    acts_on="sensor",
    description="The leeway is measured by a log away from midships, which the turn carries sideways.",
    source="kinematics of a rigid body",
    parameters=(
        EffectParameter(
            "forward_m",
            "log forward of midships",
            -300.0,
            300.0,
            absent=0.0,
            typical=lengths(
                0.3
            ),  # logs are in the forebody, out of the boundary layer and the bubbles (project choice)
        ),
    ),
    readings=_log_forward,
)

RUDDER_TIME_OFFSET = Effect(
    name="rudder_time_offset",
    acts_on="sensor",
    description="The record of the rudder is early: the ship answers to it only later.",
    source="pure delay between two recorders",
    parameters=(
        EffectParameter(
            "delay_s",
            "delay of the ship behind the recorded rudder: at t it acts on what the record shows at t less this",
            -60.0,
            60.0,
            absent=0.0,
            typical=time_scale_passages(0.05),  # 1 s where L/u0 is 20 s (project choice)
        ),
    ),
    delays={"rudder.command": "delay_s"},
)


def correct_reading(
    time_s: NDArray[np.float64], signals: _Columns, effect: Effect, values: Mapping[str, float]
) -> dict[str, NDArray[np.float64]]:
    """The signals of a trial as they would be without a fault of its sensors.

    Parameters
    ----------
    time_s : array, (rows,)
        Rising.
    signals : mapping
        Arrays (rows,), SI: :data:`_SIGNALS`, ``delta_rad``, ``delta_order_rad``, and any others.
    effect : Effect
        A sensor's.
    values : mapping
        Its parameters, SI, all of them.

    Returns
    -------
    dict
        All signals; those that the sensor shows are replaced by what it measured. The rudder of a late answer is that
        of the time less the delay: an order the one held then, an angle on the straight line between samples, and
        before the first (after the last) sample that one.

    Raises
    ------
    ValueError
        A signal is lacking with which another must be corrected.
    """
    found = {name: np.array(column, dtype=float) for name, column in signals.items()}
    if effect.readings is not None:
        found |= _measured(found, effect, values)
    if "rudder.command" in effect.delays:
        asked = time_s - values[effect.delays["rudder.command"]]
        for name, held in RUDDER_SIGNALS.items():
            if name in found:
                found[name] = _held(time_s, found[name], asked) if held else np.interp(asked, time_s, found[name])
    return found


def _measured(signals: _Columns, effect: Effect, values: Mapping[str, float]) -> dict[str, NDArray[np.float64]]:
    """True values behind `signals`: the readings s = A x + b, solved for x."""
    assert effect.readings is not None
    motion = {name: ca.SX.sym(name) for name in MEASURED_BEFOREHAND}
    given = {parameter.stem: ca.SX(values[parameter.name]) for parameter in effect.parameters}
    readings = effect.readings(motion, given)
    names = [name for name in readings if _SIGNALS[name] in signals]
    if not names:
        return {}
    others, solve = _solved(readings, names, motion)
    if lacking := [_SIGNALS[name] for name in others if _SIGNALS[name] not in signals]:
        raise ValueError(f"{effect.name} cannot be corrected without {lacking[0]}")
    rows: list[Any] = [np.vstack([signals[_SIGNALS[name]] for name in names])]
    rows += [signals[_SIGNALS[name]].reshape(1, -1) for name in others]
    return {_SIGNALS[name]: row for name, row in zip(names, np.array(solve(*rows)), strict=True)}


def _solved(
    readings: Mapping[str, ca.SX], names: Sequence[str], motion: Mapping[str, ca.SX]
) -> tuple[list[str], ca.Function]:
    """The function of what is shown that gives `names`, and the other motions that it takes."""
    x, shown = ca.vcat([motion[name] for name in names]), ca.SX.sym("shown", len(names))
    expression = ca.vcat([readings[name] for name in names])
    constant_part = ca.substitute(expression, x, ca.SX.zeros(len(names)))
    solution = ca.solve(ca.jacobian(expression, x), shown - constant_part)
    others = [name for name in MEASURED_BEFOREHAND if name not in names and ca.depends_on(solution, motion[name])]
    return others, ca.Function("measured", [shown, *(motion[name] for name in others)], [solution])


def _held(time_s: NDArray[np.float64], column: NDArray[np.float64], asked: NDArray[np.float64]) -> NDArray[np.float64]:
    """The last sample at or before each time asked for."""
    # Times are sums of rounded steps: a sample that is a millionth of a step late still counts as at the time.
    slack = 1e-6 * float(np.min(np.diff(time_s))) if len(time_s) > 1 else 0.0
    places = np.searchsorted(time_s, asked + slack, side="right") - 1
    return column[np.clip(places, 0, len(column) - 1)]
