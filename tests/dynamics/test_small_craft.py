"""A small craft moves as an independent program has the Otter, by Fossen's matrices, and as thrusters push."""

from __future__ import annotations

import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import parse_card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.small_craft import craft_unit, revolutions_for, thrust_of
from tank2sim.errors import InputError
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running
from tests.dynamics.states import accelerations, motion, rates, replaced, values

OTTER = read_card("otter")
TEXT = OTTER.text
RPM = math.tau / 60


STERN = """[[thrusters]]
name = "stern"
x_m = -1.0
ahead_Ns2 = 0.02216
astern_Ns2 = 0.01
max_rpm = 990
max_azimuth_deg = 30
azimuth_time_constant_s = 0.4
"""
MOST = "max_radps = 103.930864"


def changed(*pairs: tuple[str, str]) -> Model:
    return build(parse_card(replaced(TEXT, *pairs), "changed.toml"))


def fitted(line: str) -> Model:
    """The Otter with one more key of both thrusters."""
    return build(parse_card(TEXT.replace(MOST, f"{MOST}\n{line}"), "fitted.toml"))


def outboard(line: str) -> Model:
    """The Otter with one thruster at the stern that turns."""
    return build(parse_card(f"{TEXT[: TEXT.index('[[thrusters]]')]}{STERN}{line}\n", "outboard.toml"))


def orders(port: float, starboard: float) -> dict[str, float]:
    return {"thrusters.port.command": port, "thrusters.starboard.command": starboard}


@pytest.fixture(scope="module")
def otter() -> Integrator:
    return Integrator(build(OTTER))


def driven_by_reference(
    otter: Integrator, folder: Path, name: str
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The reference, and the model's motion under the same revolutions, at the same times."""
    path = folder.parent / "reference" / f"otter_{name}.csv"
    if not path.is_file():
        pytest.skip(f"no {path}")
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    columns = dict(zip(lines[0].split(","), np.genfromtxt(lines[1:], delimiter=",").T, strict=True))
    port, starboard = columns["n_port_rpm"] * RPM, columns["n_stbd_rpm"] * RPM
    current = {"current.speed": 0.3 if "current" in name else 0.0, "current.direction": math.radians(30)}
    start = {"initial.u": columns["u_mps"][0], "initial.v": columns["v_mps"][0]}
    running = Running(otter, {**orders(port[0], starboard[0]), **current}, start)
    time = columns["t_s"]
    for row in np.flatnonzero(np.diff(port)) + 1:
        running.run(time[row] - running.time)
        running.order(orders(port[row], starboard[row]))
    running.run(time[-1] - running.time)
    found = running.trajectory()
    names = {"u_mps": 1.0, "v_mps": 1.0, "r_degps": 180 / math.pi, "psi_deg": 180 / math.pi, "x_m": 1.0, "y_m": 1.0}
    return columns, {
        key: factor * np.interp(time, found.t, found[f"motion.{key.split('_')[0]}"]) for key, factor in names.items()
    }


@pytest.mark.parametrize("name", ["straight", "straight_current", "turn", "turn_current", "spin"])
def test_the_otter_moves_as_mss_has_it_in_six_degrees_of_freedom(otter: Integrator, data: Path, name: str) -> None:
    """Within what pitch and roll make of it: 0.5 % of the steady rate of the turn, 2.5 cm/s while pitch settles."""
    reference, found = driven_by_reference(otter, data / "gap_cases", name)
    for signal, bound in {"u_mps": 0.025, "v_mps": 0.003, "r_degps": 0.06, "x_m": 0.25, "y_m": 0.25}.items():
        assert np.abs(found[signal] - reference[signal]).max() < bound, signal
    assert abs(found["u_mps"][-1] - reference["u_mps"][-1]) < 5e-4
    assert abs(found["psi_deg"][-1] - reference["psi_deg"][-1]) < 0.005 * abs(reference["psi_deg"][-1]) + 0.02


def test_accelerations_are_those_of_fossens_matrices() -> None:
    """M nu' = tau - C_RB nu - C_A nu + D, with the matrices written out (Fossen 2021, 6.1 to 6.5)."""
    rng = np.random.default_rng(3)
    names = {
        "Xudot": -6.0, "Yvdot": -70.0, "Yrdot": -8.0, "Nvdot": -8.0, "Nrdot": -21.0,
        "Xu": -30.0, "Xuabsu": -22.0, "Yv": -80.0, "Yvabsv": -300.0, "Yvabsr": -40.0, "Yvabsu": -12.0, "Yr": -9.0,
        "Yrabsr": -7.0, "Yrabsv": -33.0, "Yrabsu": 21.0, "Nv": -14.0, "Nvabsv": -11.0, "Nvabsr": -5.0, "Nvabsu": 17.0,
        "Nr": -50.0, "Nrabsr": -90.0, "Nrabsv": -60.0, "Nrabsu": -35.0,
    }  # fmt: skip
    head, rest = TEXT.split("[derivatives]")
    tail = rest[rest.index("[[thrusters]]") : rest.index("[[effects]]")]
    body = "\n".join(f"{name} = {value}" for name, value in names.items())
    model = build(parse_card(f"{head}[derivatives]\n{body}\n\n{tail}", "made.toml"))
    m, inertia, g = 80.0, 16.0125, 0.153125
    d = names
    M = np.array(
        [
            [m - d["Xudot"], 0, 0],
            [0, m - d["Yvdot"], m * g - d["Yrdot"]],
            [0, m * g - d["Nvdot"], inertia - d["Nrdot"]],
        ]
    )
    for _ in range(10):
        u, v, r = nu = rng.uniform(-1, 1, 3) * [2.0, 0.7, 0.6]
        n = rng.uniform(-80, 80, 2)
        C_RB = np.array([[0, 0, -m * (g * r + v)], [0, 0, m * u], [m * (g * r + v), -m * u, 0]])
        a2 = d["Yvdot"] * v + d["Yrdot"] * r
        C_A = np.array([[0, 0, a2], [0, 0, -d["Xudot"] * u], [-a2, d["Xudot"] * u, 0]])
        D = [
            d["Xu"] * u + d["Xuabsu"] * u * abs(u),
            *(
                (d[f"{f}v"] + d[f"{f}vabsv"] * abs(v) + d[f"{f}vabsr"] * abs(r) + d[f"{f}vabsu"] * abs(u)) * v
                + (d[f"{f}r"] + d[f"{f}rabsr"] * abs(r) + d[f"{f}rabsv"] * abs(v) + d[f"{f}rabsu"] * abs(u)) * r
                for f in "YN"
            ),
        ]  # fmt: skip
        T = [0.01108 * n_i**2 if n_i > 0 else -0.006445 * n_i**2 for n_i in n]
        tau = np.array([T[0] + T[1], 0, 0.395 * (T[0] - T[1])])
        expected = np.linalg.solve(M, tau - C_RB @ nu - C_A @ nu + D)
        assert accelerations(model, motion(u, v, r) | orders(*n)) == pytest.approx(expected, rel=1e-10)


def test_a_dead_band_leaves_small_orders_without_thrust_and_large_ones_as_they_are() -> None:
    banded = fitted("dead_band_radps = 8.0")

    def surge(model: Model, n: float) -> float:
        return float(accelerations(model, {"motion.u": 0.0} | orders(n, n))[0])

    assert surge(banded, 7.9) == surge(banded, -7.9) == 0.0
    for n in (8.1, 50.0, -50.0):
        assert surge(banded, n) == surge(build(OTTER), n) != 0.0


def test_thrust_ahead_falls_with_speed_and_thrust_astern_does_not() -> None:
    losing = fitted("speed_loss_kg = 0.05")
    for n, loss in ((60.0, 2 * 0.05 * 60.0 * 1.2), (-60.0, 0.0)):
        at = {"motion.u": 1.2} | orders(n, n)
        less = accelerations(build(OTTER), at)[0] - accelerations(losing, at)[0]
        assert less == pytest.approx(loss / 85.281521, abs=1e-12)


@pytest.mark.parametrize("along", [-1.5, 0.0, 1.5])
@pytest.mark.parametrize("thrust", [-60.0, -1.0, 3.0, 100.0])
def test_revolutions_for_a_thrust_are_the_ones_that_a_thruster_gives_it_at(thrust: float, along: float) -> None:
    """Ahead the root of k n^2 - l u n = T that is positive, whichever way the craft moves; astern -sqrt(-T/k)."""
    ahead, astern, loss = 0.011, 0.0065, 0.05
    found = float(ca.evalf(revolutions_for(ca.SX(thrust), ca.SX(along), ca.SX(ahead), ca.SX(astern), ca.SX(loss))))
    root = max(np.roots([ahead, -loss * along, -thrust]).real) if thrust > 0 else -math.sqrt(-thrust / astern)
    assert found == pytest.approx(root, rel=1e-9)
    n, u = ca.SX(found), ca.SX(along)
    assert float(ca.evalf(thrust_of(n, u, ca.SX(ahead), ca.SX(astern), ca.SX(loss)))) == pytest.approx(thrust, rel=1e-9)


@pytest.mark.parametrize(("u", "expected"), [(0.0, 1.0), (1.0, 1.0), (3.0, 1.0), (3.15, 0.5), (3.3, 0.0), (-3.15, 0.5)])
def test_validity_falls_to_half_a_tenth_of_the_cruising_speed_beyond_the_range(u: float, expected: float) -> None:
    fastest = OTTER.model.speed_range_mps[1]
    at = {"motion.u": math.copysign(fastest + abs(u) - 3.0, u) if abs(u) >= 3 else u}
    assert values(build(OTTER), ["validity"], at) == pytest.approx(expected, abs=1e-3)


def test_orders_are_held_within_the_largest_revolutions_either_way() -> None:
    for order, reached in ((300.0, 103.930864), (-300.0, -101.736666), (50.0, 50.0), (-20.0, -20.0)):
        found = values(build(OTTER), ["thrusters.port.order"], {"thrusters.port.command": order})
        assert found == pytest.approx(reached, rel=1e-6)


@pytest.mark.parametrize(
    ("azimuth_deg", "order_deg", "rate_degps"),
    [(0.0, 10.0, 20.0), (0.0, 4.0, 10.0), (5.0, -60.0, -20.0), (30.0, 60.0, 0.0)],
)
def test_a_thruster_turns_by_its_lag_and_rate_to_orders_within_its_reach(
    azimuth_deg: float, order_deg: float, rate_degps: float
) -> None:
    """(order - azimuth)/0.4 s, at most 20 deg/s; orders beyond 30 deg are held there."""
    at = {"azimuth": math.radians(azimuth_deg), "azimuth_command": math.radians(order_deg)}
    found = rates(outboard("max_azimuth_rate_degps = 20"), {f"thrusters.stern.{key}": at[key] for key in at})
    assert math.degrees(found["thrusters.stern.azimuth"]) == pytest.approx(rate_degps, abs=1e-9)


@pytest.mark.parametrize("azimuth_deg", [-30.0, 0.0, 25.0])
def test_a_thruster_loses_thrust_by_the_speed_along_its_own_direction(azimuth_deg: float) -> None:
    model, a = outboard("speed_loss_kg = 0.05"), math.radians(azimuth_deg)
    moving = {"motion.u": 1.2, "motion.v": -0.4, "thrusters.stern.azimuth": a, "thrusters.stern.command": 50.0}
    expected = 0.02216 * 50.0**2 - 0.05 * 50.0 * (1.2 * math.cos(a) - 0.4 * math.sin(a))
    assert values(model, ["thrusters.stern.thrust"], moving) == pytest.approx(expected, rel=1e-9)


def test_the_step_is_a_fifth_of_the_shortest_lag_and_a_two_hundredth_of_a_length() -> None:
    assert build(OTTER).step_s == pytest.approx(0.005)  # 2 m / 1.5 m/s / 200 = 0.0067, to 1, 2, 5 of a power of ten
    assert fitted("time_constant_s = 0.02").step_s == pytest.approx(0.002)


def test_units_of_terms_follow_from_what_they_multiply() -> None:
    """Force over velocities: kg/s and kg/m, with a metre more for a moment and for each yaw rate."""
    expected = {
        "Xu": "kg/s", "Yr": "kg.m/s", "Nv": "kg.m/s", "Nr": "kg.m2/s", "Xuabsu": "kg/m", "Yvabsr": "kg",
        "Nrabsv": "kg.m", "Nrabsr": "kg.m2", "Nvdot": "kg.m",
    }  # fmt: skip
    found = {name: craft_unit(name) for name in expected}
    assert found == expected


def test_an_outboard_at_the_stern_that_pushes_to_port_turns_the_craft_to_starboard() -> None:
    model = outboard("max_azimuth_rate_degps = 20")
    at = {"motion.u": 0.0, "thrusters.stern.azimuth": math.radians(-30), "thrusters.stern.command": 50.0}
    _, vdot, rdot = accelerations(model, at)
    T = 0.02216 * 50.0**2
    Y, N = T * math.sin(math.radians(-30)), 1.0 * T * math.sin(math.radians(30))
    assert (vdot, rdot) == pytest.approx(np.linalg.solve([[162.5, 12.25], [12.25, 40.044924]], [Y, N]), rel=1e-9)
    assert rdot > 0 > vdot
    running = Running(Integrator(model, compiled=False), {"thrusters.stern.azimuth_command": math.radians(30)})
    running.run(1.0)
    assert math.degrees(running.state("thrusters.stern.azimuth")) == pytest.approx(20.0, abs=0.3)  # by its rate


def test_revolutions_follow_their_order_with_the_lag_of_the_card() -> None:
    lagging = fitted("time_constant_s = 0.3")
    assert lagging.step_s <= 0.06
    running = Running(Integrator(lagging, compiled=False), {"thrusters.port.command": 90.0})
    first = running.state("thrusters.port.speed")
    running.run(0.3)
    assert running.state("thrusters.port.speed") == pytest.approx(90 + (first - 90) * math.exp(-1), rel=1e-6)


def test_a_craft_on_a_prime_card_is_the_same_craft() -> None:
    """By the scales of the prime system by hand: 1/2 rho L^2 V^2, L/V."""
    rho, L, V = 1025.0, 2.0, 1.5
    scale = {
        "mass = 80.0": ("mass", 80.0, 0.5 * rho * L**3),
        "yaw_inertia = 16.0125": ("yaw_inertia", 16.0125, 0.5 * rho * L**5),
        "x_G = 0.153125": ("x_G", 0.153125, L),
        "Xudot = -5.281521": ("Xudot", -5.281521, 0.5 * rho * L**3),
        "Yvdot = -82.5": ("Yvdot", -82.5, 0.5 * rho * L**3),
        "Nrdot = -24.032424": ("Nrdot", -24.032424, 0.5 * rho * L**5),
        "Xu = -77.5544": ("Xu", -77.5544, 0.5 * rho * L**2 * V),
        "Yv = -162.5": ("Yv", -162.5, 0.5 * rho * L**2 * V),
        "Yvabsv = -10.04": ("Yvabsv", -10.04, 0.5 * rho * L**2),
        "Nr = -40.044922": ("Nr", -40.044922, 0.5 * rho * L**4 * V),
        "Nrabsr = -410.99": ("Nrabsr", -410.99, 0.5 * rho * L**5),
    }
    prime = changed(
        ("speed_mps = 1.5\n", 'speed_mps = 1.5\nscaling = "prime"\n'),
        *((old, f"{name} = {value / unit!r}") for old, (name, value, unit) in scale.items()),
    )
    at = motion(1.1, -0.2, 0.3) | orders(70.0, -20.0)
    assert accelerations(prime, at) == pytest.approx(accelerations(build(OTTER), at), rel=1e-12)


def test_the_cruising_revolutions_hold_the_cruising_speed() -> None:
    for model in (build(OTTER), fitted("speed_loss_kg = 0.1")):
        assert accelerations(model, {}) == pytest.approx([0, 0, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("Xu = -77.5544", "Xu = 77.5544", "derivatives.Xu"),
        ("Yv = -162.5", "Yvv = -162.5", "derivatives.Yvv"),
        ("Yvdot = -82.5", "Yvdot = 82.5", "rigid_body"),
        ("x_G = 0.153125", "x_G = 1.01", "rigid_body.x_G"),  # half of the 2 m
        ("x_G = 0.153125", "x_G = 0.99", "rigid_body.yaw_inertia"),
        ("mass = 80.0", "mass = 80000.0", "rigid_body.mass"),
        ('name = "starboard"', 'name = "port"', "thrusters.1.name"),
        ("speed_mps = 1.5", "speed_mps = 3.5", "model.speed_mps"),
        ("y_m = 0.395", "y_m = 2.01", "thrusters.1.x_m"),
        ('name = "cross_flow_drag"', 'name = "rudder_stall"', "effects.0.name"),
        ("y_m = 0.395", "y_m = 0.395\nmax_azimuth_deg = 30", "thrusters.1.azimuth_time_constant_s"),
        ("y_m = 0.395", "y_m = 0.395\ndead_band_rpm = 1000", "thrusters.1.dead_band_rpm"),
    ],
)
def test_a_card_at_fault_is_refused_at_its_place(old: str, new: str, place: str) -> None:
    with pytest.raises(InputError) as caught:
        changed((old, new))
    assert caught.value.place == place


def test_a_thruster_may_lie_within_a_length_of_the_origin() -> None:
    changed(("y_m = 0.395", "y_m = 1.99"))


def test_a_craft_without_thrust_only_loses_energy() -> None:
    model = build(OTTER)
    body = np.array([[85.281521, 0, 0], [0, 162.5, 12.25], [0, 12.25, 40.044924]])
    running = Running(
        Integrator(model, compiled=False),
        orders(0.0, 0.0),
        {"initial.u": 1.5, "initial.v": 0.4, "initial.r": -0.5},
    )
    running.run(10.0)
    run = running.trajectory()
    nu = np.column_stack([run[f"motion.{letter}"] for letter in "uvr"])
    energy = np.einsum("ni,ij,nj->n", nu, body, nu)
    assert np.all(np.diff(energy) < 0) and energy[-1] < 1e-3 * energy[0]


def test_the_derivatives_of_a_craft_are_a_table_in_si() -> None:
    otter = t2s.load("otter").replace({"uncertainty.Nr": 2.5})
    assert otter.derivatives.loc["Xu", "value"] == pytest.approx(-77.5544)
    assert otter.derivatives.loc["Nr", "standard_error"] == 2.5


def test_revolutions_follow_the_power_of_the_order_and_the_command_at_the_start_holds_the_cruising_speed() -> None:
    model = fitted("order_exponent = 0.6")
    command, order = "thrusters.port.command", ["thrusters.port.order"]

    def reached(n: float) -> float:
        return float(values(model, order, {command: n})[0])

    assert reached(0.0) == 0.0
    for share in (1.0, 0.5, 0.1):
        assert reached(share * 103.930864) == pytest.approx(share**0.6 * 103.930864, rel=5e-3)
    assert reached(-0.5 * 101.736666) == pytest.approx(-(0.5**0.6) * 101.736666, rel=5e-3)
    cruising = values(build(OTTER), order, {})
    assert values(model, order, {}) == pytest.approx(cruising, rel=1e-2)
