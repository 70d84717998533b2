"""The ships and manoeuvres of other libraries, each called as its documentation shows, for ``peers.py``."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import odeint
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from tank2sim.arrays import Array
from tank2sim.cards import parse_card, read_card

DURATION_S = 600.0
RUDDER, HEADING = math.radians(35.0), math.radians(20.0)
TOLERANCES = tuple(10.0**-k for k in range(3, 12))  # from the default of solve_ivp on
SAMPLE_S = 0.1  # of shipmmg's lists of time: that of its examples
FINEST_SAMPLE_S = SAMPLE_S / 2**3  # finer, a zigzag of shipmmg takes minutes


ABKOWITZ, MARINER = "KVLCC2 Abkowitz", "Mariner Abkowitz"
MMG, YAWED = "KVLCC2 MMG", "container, yaw moment"
"""Ships with their equations; figures of one and the same agree, those of others need not."""


@dataclass(frozen=True)
class Case:
    """One library at one manoeuvre.

    Parameters
    ----------
    library, ship, manoeuvre, setting : str
        Who, of which ship with which equations, what, and what `levels` are.
    levels : tuple of float
        From coarse to fine: a step in s, or a relative tolerance.
    delivered : float
        The level that the library or its documentation chooses.
    run : callable
        Simulates at a level, as its documentation shows: this is timed.
    figure : callable
        Tactical diameter (m) or second overshoot (deg) of what `run` gives.
    reference : callable, optional
        The figure without error of the method, where the finest level cannot give it.
    evaluations : callable, optional
        Number of right-hand sides in what `run` gives, where it is known.
    as_delivered : str
        What the library chooses at `delivered`, where that is none of `levels`.
    """

    library: str
    ship: str
    manoeuvre: str
    setting: str
    levels: tuple[float, ...]
    delivered: float
    run: Callable[[float], Any]
    figure: Callable[[Any], float]
    reference: Callable[[], float] | None = None
    evaluations: Callable[[Any], int] | None = None
    as_delivered: str = ""


def tactical_diameter(t: Array, y: Array, psi: Array) -> float:
    """Transfer (m) at 180 deg change of heading, by cubics through `y` (m) and `psi` (rad) at the times `t` (s)."""
    first = int(np.argmax(psi >= math.pi))
    near = slice(max(0, first - 4), first + 4)
    heading = CubicSpline(t[near], psi[near])
    at = brentq(lambda time: float(heading(time)) - math.pi, t[first - 1], t[first])
    return float(CubicSpline(t[near], y[near])(at))


def second_overshoot(psi: Array) -> float:
    """Second overshoot (deg) of a zigzag to starboard: the greatest heading to port, less that of the execute."""
    return float(-math.degrees(np.min(psi)) - math.degrees(HEADING))


@cache
def kvlcc2() -> tuple[Any, Any, float, float, float]:
    """shipmmg's KVLCC2 at full scale: its two parameter sets, speed (m/s), revolutions (1/s), rate of rudder (rad/s).

    The numbers of Yasukawa and Yoshimura (2015) for the model of 7 m as in shipmmg's documentation, her wake and
    resistance with them, scaled to 320 m; the revolutions are those at which thrust equals resistance. Speed and gear
    are those of tank2sim's card.
    """
    from shipmmg.mmg_3dof import Mmg3DofBasicParams, Mmg3DofManeuveringParams

    card: Any = read_card("kvlcc2-captive")
    L, u, rho = card.ship.length_m, card.model.speed_mps, 1025.0
    scale = L / 7.0
    d, mass = 0.46 * scale, 3.27 * rho * scale**3
    area = 0.5 * rho * L**2 * d
    sizes = {"L_pp": L, "B": 1.27 * scale, "d": d, "x_G": 0.25 * scale, "D_p": 0.216 * scale, "m": mass}
    inertia = {"I_zG": mass * (0.25 * L) ** 2, "m_x": 0.022 * area, "m_y": 0.223 * area, "J_z": 0.011 * area * L**2}
    rudder = {"A_R": 0.0539 * scale**2, "η": 0.216 / 0.345, "f_α": 2.747, "ε": 1.09, "t_R": 0.387, "x_R": -0.5 * L}
    rudder |= {"a_H": 0.312, "x_H": -0.464 * L, "γ_R_minus": 0.395, "γ_R_plus": 0.640, "l_R": -0.710, "κ": 0.50}
    propeller = {"t_P": 0.220, "w_P0": 0.40, "x_P": -0.650}
    names = "k_0 k_1 k_2 R_0 X_vv X_vr X_rr X_vvvv Y_v Y_r Y_vvv Y_vvr Y_vrr Y_rrr N_v N_r N_vvv N_vvr N_vrr N_rrr"
    values = [0.2931, -0.2753, -0.1385, 0.022, -0.040, 0.002, 0.011, 0.771, -0.315, 0.083, -1.607, 0.379, -0.391, 0.008]
    values += [-0.137, -0.049, -0.030, -0.294, 0.055, -0.013]
    hull = {name if name[0] == "k" else f"{name}_dash": x for name, x in zip(names.split(), values, strict=True)}

    def surplus(n: float) -> float:
        J = (1 - propeller["w_P0"]) * u / (n * sizes["D_p"])
        K_T = hull["k_0"] + hull["k_1"] * J + hull["k_2"] * J**2
        return float((1 - propeller["t_P"]) * rho * K_T * n**2 * sizes["D_p"] ** 4 - hull["R_0_dash"] * area / L * u**2)

    basic = Mmg3DofBasicParams(**sizes, **inertia, **rudder, **propeller)
    rate = card.steering_gear.max_rate_radps
    return basic, Mmg3DofManeuveringParams(**hull), u, float(brentq(surplus, 0.5, 5.0)), rate


def of_shipmmg() -> list[Case]:
    """shipmmg's KVLCC2: the rudder's angles as a list, and its own zigzag, whose tolerance cannot be set."""
    from shipmmg.mmg_3dof import simulate_mmg_3dof, zigzag_test_mmg_3dof

    basic, hull, u, n, rate = kvlcc2()

    def times(step: float) -> Array:
        return np.linspace(0.0, DURATION_S, round(DURATION_S / step) + 1)

    def turn(tolerance: float) -> tuple[Array, Array, int]:
        t = times(SAMPLE_S)
        angles, revolutions = np.minimum(rate * t, RUDDER), np.full(len(t), n)
        choice = {} if tolerance == TOLERANCES[0] else {"rtol": tolerance, "atol": 1e-3 * tolerance}
        solution = simulate_mmg_3dof(basic, hull, t, angles, revolutions, u0=u, **choice)
        return t, solution.sol(t), solution.nfev

    def zigzag(step: float) -> Any:
        t = times(step)
        return zigzag_test_mmg_3dof(basic, hull, HEADING, HEADING, t, np.full(len(t), n), δ_rad_rate=rate, u0=u)

    samples = tuple(8 * SAMPLE_S / 2**k for k in range(round(math.log2(8 * SAMPLE_S / FINEST_SAMPLE_S)) + 1))
    return [
        Case(
            "shipmmg",
            MMG,
            "turn",
            "tolerance",
            TOLERANCES,
            TOLERANCES[0],
            turn,
            _diameter_of_states,
            None,
            _evaluations,
        ),
        Case(
            "shipmmg",
            MMG,
            "zigzag",
            "sample, s",
            samples,
            SAMPLE_S,
            zigzag,
            lambda run: second_overshoot(np.array(run[6])),
            exact_overshoot,
        ),
    ]


def exact_overshoot() -> float:
    """Second overshoot (deg) of shipmmg's ship, its simulation called once a leg, ended by an event, tightly."""
    from shipmmg.mmg_3dof import simulate_mmg_3dof

    basic, hull, u, n, rate = kvlcc2()
    begin, state, side, headings = 0.0, np.array([u, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 1.0, []
    while begin < DURATION_S - SAMPLE_S:
        t = np.arange(begin, DURATION_S + FINEST_SAMPLE_S / 2, FINEST_SAMPLE_S)
        angles = np.clip(state[6] + side * rate * (t - begin), -HEADING, HEADING)
        start = dict(zip(("u0", "v0", "r0", "x0", "y0", "ψ0"), state[:6], strict=True))

        def reached(_: float, x: Array, side: float = side) -> float:
            return float(x[5] - side * HEADING)

        reached.terminal, reached.direction = True, side  # type: ignore[attr-defined]
        tight = {"rtol": 1e-9, "atol": 1e-11, "events": reached}
        leg = simulate_mmg_3dof(basic, hull, t, angles, np.full(len(t), n), **start, **tight)
        headings.append(leg.sol(np.linspace(begin, leg.t[-1], 5000))[5])
        begin, state, side = leg.t[-1], leg.y[:7, -1], -side
    return second_overshoot(np.concatenate(headings))


def _evaluations(run: tuple[Array, Array, int]) -> int:
    return run[2]


def _diameter_of_states(run: tuple[Array, Array, int]) -> float:
    t, states, _ = run
    return tactical_diameter(t, states[4], states[5])


def of_commonocean() -> list[Case]:
    """CommonOcean's container ship (vessel 1) under her greatest yaw moment, with the thrust for half her speed."""
    from vesselmodels.parameters_vessel_1 import parameters_vessel_1
    from vesselmodels.vessel_dynamics_3F import vessel_dynamics_3f

    ship = parameters_vessel_1()
    speed = ship.v_max / 2
    forces = [-ship.X_u * speed, 0.0, ship.yaw_moment_max]
    t = np.arange(0.0, DURATION_S, SAMPLE_S)
    usual = 1.5e-8  # odeint's own choice

    def turn(tolerance: float) -> tuple[Array, Array, int]:
        choice = {} if tolerance == usual else {"rtol": tolerance, "atol": 1e-3 * tolerance}
        start = [0.0, 0.0, 0.0, speed, 0.0, 0.0]
        states, told = odeint(
            lambda x, _, u, p: vessel_dynamics_3f(x, u, p), start, t, (forces, ship), full_output=True, **choice
        )
        return t, states.T, int(told["nfe"][-1])

    def figure(run: tuple[Array, Array, int]) -> float:
        return tactical_diameter(run[0], run[1][1], run[1][2])

    return [Case("CommonOcean", YAWED, "turn", "tolerance", TOLERANCES, usual, turn, figure, None, _evaluations)]


def of_vmm() -> list[Case]:
    """The Mariner of vessel-manoeuvring-models, with the numbers that lie in it, under the rudder of our card's rate.

    Its Simulator is given the equations of its own module ``vmm_mariner``, as sympy has them, with the surge velocity
    counted from the speed of approach, as the numbers are: the ready ``SimulatorPerturbed`` counts it from the speed
    of the moment when it takes prime numbers, so that no resistance acts, and ends in an error of numpy 2 when it
    takes others. The inertia that is in the printed yaw-rate terms is taken out, for the equations have it themselves.
    Its zigzag calls ``DataFrame.append``, which pandas has no more.
    """
    import pandas
    import sympy
    from vessel_manoeuvring_models.models import vmm_mariner
    from vessel_manoeuvring_models.models.vmm import Simulator
    from vessel_manoeuvring_models.symbols import U, u

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what pandas 3 thinks of the way in which the numbers are filled in
        from vessel_manoeuvring_models.models.vessels import mariner

    card: Any = mariner_card()
    L, speed, rho = card.ship.length_m, card.model.speed_mps, card.environment.water_density_kgpm3
    mass, x_G = mariner.m_prime_, mariner.xG_prime_
    own = {"Xvr": -mass, "Xrr": -mass * x_G, "Yr": mass, "Yur": mass, "Nr": mass * x_G, "Nur": mass * x_G}
    table = mariner.df_parameters
    prime = table["prime"].fillna(0.0).to_dict()
    at = {"L": L, "rho": rho, "U": speed}
    derivatives = {
        name: (value + own.get(name, 0.0)) * float(sympy.sympify(table.loc[name, "denominator"]).subs(at))
        if value or name in own
        else 0.0
        for name, value in prime.items()
    }
    weight = 0.5 * rho * L**3
    ship = {"x_G": x_G * L, "m": mass * weight, "I_z": mariner.Iz_prime_ * weight * L**2, "L": L, "rho": rho}
    simulator = Simulator(vmm_mariner.X_eq_general, vmm_mariner.Y_eq_general, vmm_mariner.N_eq_general)
    forces = vmm_mariner.X_qs_eq, vmm_mariner.Y_qs_eq, vmm_mariner.N_qs_eq
    simulator.define_quasi_static_forces(*(force.subs(u, u - U) for force in forces))
    rate, usual = card.steering_gear.max_rate_radps, 0.0

    def turn(tolerance: float) -> Any:
        t = np.linspace(0.0, DURATION_S, round(DURATION_S / SAMPLE_S) + 1)
        start = {"x0": 0.0, "y0": 0.0, "psi": 0.0, "u": speed, "v": 0.0, "r": 0.0}
        orders = pandas.DataFrame(start | {"delta": -np.minimum(rate * t, RUDDER)}, index=t)  # positive to port
        choice = {"method": "RK45", "rtol": tolerance, "atol": 1e-3 * tolerance} if tolerance != usual else {}
        return simulator.simulate(orders, derivatives, ship, control_keys=["delta"], **choice).solution

    def figure(run: Any) -> float:
        return tactical_diameter(run.t, run.y[4], run.y[5])

    levels = TOLERANCES[:4]  # finer, a turn takes seconds
    told = "Radau, tol. 0.001"
    nfev: Callable[[Any], int] = lambda run: int(run.nfev)  # noqa: E731
    return [Case("VMM", MARINER, "turn", "RK45, tol.", levels, usual, turn, figure, None, nfev, told)]


def mariner_card() -> Any:
    """Our Mariner with her forces by the speed of approach and a rudder that moves at its rate, as VMM has her."""
    text = read_card("mariner").text
    changes = {'speed_scale = "instantaneous"': 'speed_scale = "nominal"', "time_constant_s = 1.0\n": ""}
    for old, new in changes.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    return parse_card(text, "mariner")


PEERS: dict[str, Callable[[], list[Case]]] = {"shipmmg": of_shipmmg, "VMM": of_vmm, "CommonOcean": of_commonocean}
