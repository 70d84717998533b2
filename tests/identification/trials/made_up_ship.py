"""A made-up ship and her trials: equations written out in numpy and integrated by scipy, nothing of tank2sim's models.

Length 100 m, 5 m/s; m' = 0.010, x_G' = -0.02, J_z' = 0.0006; forces 1/2 rho L^2 U^2 with U the present speed,
hydrodynamic parts alone (m u r and the like are added), rudder positive to starboard.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.identification.trials.problem.estimation_problem import Problem, driven_by_angle
from tank2sim.identification.trials.problem.sampled_runs import prepare
from tank2sim.records.trials import Trial

LENGTH, SPEED, DENSITY = 100.0, 5.0, 1025.0
MASS, X_G, YAW_INERTIA = 0.010, -0.02, 0.0006
TRUTH = {
    **{"X0": 0.0, "Xu": -0.0024, "Xvv": -0.003, "Xvr": 0.004, "Xdd": -0.0012},
    **{"Y0": 0.0, "Yv": -0.014, "Yr": 0.003, "Yd": -0.0028, "Yvvv": -0.05},
    **{"N0": 0.0, "Nv": -0.0032, "Nr": -0.0022, "Nd": 0.0015, "Nvvr": -0.02},
    **{"Xudot": -0.0006, "Yvdot": -0.009, "Yrdot": -0.0002, "Nvdot": -0.0001, "Nrdot": -0.0005},
}
NOISE = {"u_mps": 0.01, "v_mps": 0.01, "r_radps": np.deg2rad(0.02), "psi_rad": np.deg2rad(0.05), "x_m": 0.3, "y_m": 0.3}
ESTIMATED = ("Xu", "Xvv", "Xvr", "Xdd", "Yv", "Yr", "Yd", "Yvvv", "Nv", "Nr", "Nd", "Nvvr")

CARD = f"""
format = "tank2sim-ship/1"
[ship]
name = "Made up"
length_m = {LENGTH}
beam_m = 16.0
draught_m = 6.0
source = "made up"
[environment]
water_density_kgpm3 = {DENSITY}
[model]
kind = "abkowitz"
speed_mps = {SPEED}
scaling = "prime"
speed_scale = "instantaneous"
yaw_rate_terms = "hydrodynamic"
rudder_sign = "starboard"
[rigid_body]
mass = {MASS}
yaw_inertia = {YAW_INERTIA}
x_G = {X_G}
[steering_gear]
time_constant_s = 0.5
[derivatives]
""" + "\n".join(f"{name} = {value}" for name, value in TRUTH.items())


def model(*, by_angle: bool = True) -> Model:
    """The ship as tank2sim builds her, with the true coefficients."""
    whole = build(parse_card(CARD, "made_up.toml"))
    return driven_by_angle(whole) if by_angle else whole


def accelerations(u, v, r, rudder, c, force=(0.0, 0.0, 0.0)):
    """du/dt, dv/dt, dr/dt; `force` is added to the prime X, Y, N at speed u0."""
    U = (u * u + v * v) ** 0.5
    vp, rp, du = v / U, r * LENGTH / U, (u - SPEED) / U
    X = c["X0"] + c["Xu"] * du + c["Xvv"] * vp**2 + c["Xvr"] * vp * rp + c["Xdd"] * rudder**2
    Y = c["Y0"] + c["Yv"] * vp + c["Yr"] * rp + c["Yd"] * rudder + c["Yvvv"] * vp**3
    N = c["N0"] + c["Nv"] * vp + c["Nr"] * rp + c["Nd"] * rudder + c["Nvvr"] * vp**2 * rp
    # over 1/2 rho L^2 (and L^3): what is left is U^2 X + m' L (v r + x_G r^2) and so on
    fx = U**2 * X + SPEED**2 * force[0] + MASS * LENGTH * (v * r + X_G * LENGTH * r * r)
    fy = U**2 * Y + SPEED**2 * force[1] - MASS * LENGTH * u * r
    fn = U**2 * N + SPEED**2 * force[2] - MASS * LENGTH * X_G * u * r
    udot = fx / (LENGTH * (MASS - c["Xudot"]))
    # mass matrix by vdot/L and rdot, lengths taken out; inverted by hand
    m11, m12 = MASS - c["Yvdot"], MASS * X_G - c["Yrdot"]
    m21, m22 = MASS * X_G - c["Nvdot"], YAW_INERTIA - c["Nrdot"]
    determinant = LENGTH * (m11 * m22 - m12 * m21)
    vdot, rdot_length = (m22 * fy - m12 * fn) / determinant, (m11 * fn - m21 * fy) / determinant
    return udot, vdot, rdot_length / LENGTH


def zigzag(amplitude_deg: float, half_period_s: float = 50.0, rate_degps: float = 3.0, begin_s: float = 10.0):
    """A rudder that goes to and fro by the clock, at a limited rate: ``rudder(t)`` in rad."""
    over = 2 * amplitude_deg / rate_degps

    def rudder(t: float) -> float:
        since = t - begin_s
        if since < 0:
            return 0.0
        if since < over / 2:
            return math.radians(rate_degps * since)
        number, inside = divmod(since, half_period_s)
        side = 1.0 if int(number) % 2 == 0 else -1.0
        if number == 0:
            return math.radians(amplitude_deg)
        return math.radians(side * min(amplitude_deg, -amplitude_deg + rate_degps * inside))

    return rudder


def turn(angle_deg: float, rate_degps: float = 3.0, begin_s: float = 10.0):
    """A rudder that is put over and held."""
    return lambda t: math.radians(math.copysign(min(max(rate_degps * (t - begin_s), 0.0), abs(angle_deg)), angle_deg))


def trial(
    rudder,
    *,
    name: str = "made_up",
    duration: float = 300.0,
    step: float = 0.2,
    noise: float = 1.0,
    seed: int = 1,
    truth=None,
    start=(SPEED, 0.0, 0.0),
    force=None,
) -> Trial:
    """The record of a run: `noise` times :data:`NOISE`; `force` (3, n) prime X, Y, N at each sample."""
    c = TRUTH if truth is None else truth
    t = np.arange(0, duration + step / 2, step)

    def rates(time, x):
        u, v, r, psi = x[:4].tolist()  # numbers of Python: those of numpy are slow one by one
        pushed = (0.0, 0.0, 0.0) if force is None else _between(force, time / step).tolist()
        cos, sin = math.cos(psi), math.sin(psi)
        return [*accelerations(u, v, r, float(rudder(float(time))), c, pushed), r, u * cos - v * sin, u * sin + v * cos]

    accuracy = {"rtol": 1e-5, "max_step": step} if force is not None else {"rtol": 1e-8, "atol": 1e-10, "max_step": 1.0}
    solution = solve_ivp(rates, (0, t[-1]), [*start, 0.3, 0.0, 0.0], t_eval=t, **accuracy)
    names = ("u_mps", "v_mps", "r_radps", "psi_rad", "x_m", "y_m")
    rng = np.random.default_rng(seed)
    signals = {
        name: values + noise * NOISE[name] * rng.standard_normal(len(t))
        for name, values in zip(names, solution.y, strict=True)
    }
    signals["delta_rad"] = np.array([rudder(time) for time in t])
    return Trial(Path(f"{name}.csv"), t, signals)


def _between(force, place: float):
    before = min(int(place), force.shape[1] - 2)
    share = place - before
    return (1 - share) * force[:, before] + share * force[:, before + 1]


def gusts(count: int, step: float, deviation, correlation_s: float, seed: int) -> np.ndarray:
    """First-order Gauss-Markov forces (3, count): an exact recursion."""
    rng = np.random.default_rng(seed)
    keep = np.exp(-step / correlation_s)
    shocks = np.asarray(deviation)[:, None] * np.sqrt(1 - keep**2) * rng.standard_normal((3, count))
    shocks[:, 0] /= np.sqrt(1 - keep**2)
    return lfilter([1.0], [1.0, -keep], shocks, axis=1)


def problem(trials, *, free=ESTIMATED, off: float = 0.2, seen=None, by_angle: bool = True, seed: int = 3) -> Problem:
    """To find the coefficients `free` from a start that is `off` either way, known to as much."""
    ship = model(by_angle=by_angle)
    truth = np.array([TRUTH[name] for name in free])
    side = np.random.default_rng(seed).choice([-1.0, 1.0], len(truth))
    mean = truth * (1 + off * side)
    error = np.where(truth == 0, 1e-4, off * np.abs(truth))
    seen = seen or ("motion.u", "motion.v", "motion.r", "motion.psi", "motion.x", "motion.y")
    names = tuple(f"derivatives.{name}" for name in free)
    return Problem(ship, names, mean, error, tuple(prepare(ship, one, seen) for one in trials))
