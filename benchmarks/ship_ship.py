"""Forces by another ship: the effect ``other_ship`` against two bodies in ideal fluid.

The bodies are double ones, of the length, beam, draught and fullness of the KVLCC2, with sections between ellipse and
rectangle. Their added masses, in one another's presence, are from Capytaine (panels of constant strength, unbounded
fluid, which is the rigid free surface of the double body); forces follow from them by the equations of Kirchhoff and
Lagrange,

    F = -d/dt dT/dV - Omega x dT/dV + dT/dq,   T = 1/2 nu^T M(q) nu,

with dM/dq by differences of poses. Those of a body alone (the moment of Munk) are taken off: a card has them. Nothing
of slender-body theory is in it, and the reflection of the own flow by the other hull is. In shallow water the bodies
have three images below the bottom and three above the surface, the effect all.

    python benchmarks/ship_ship.py            (needs the library Capytaine; 10 min of a processor)
    python benchmarks/ship_ship.py --all      (with the forces at each place)
"""

from __future__ import annotations

import logging
import sys
from dataclasses import dataclass

import casadi as ca
import numpy as np

import tank2sim as t2s
from tank2sim.dynamics.effects import ships_near

L, B, T, BLOCK = 320.0, 58.0, 20.8, 0.81
DENSITY, SPEED = 1025.0, 5.0
STAGGERS = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 1.5])
CLEARANCES = (0.5, 1.0, 2.0)
FORCES = "XYN"
ENCOUNTERS = {
    "moored, another passes": (0.0, SPEED),
    "side by side, equal speed": (SPEED, SPEED),
    "overtaken by one at 1.5 times the speed": (SPEED, 1.5 * SPEED),
    "overtakes one at 0.6 of the speed": (SPEED, 0.6 * SPEED),
    "meets, equal speeds": (SPEED, -SPEED),
    "passes a moored one": (SPEED, 0.0),
}
"""Own speed and that of the other ship, which heads alike: negative, it comes the other way (its ends are alike)."""


@dataclass(frozen=True)
class Hulls:
    """Two equal double bodies and the images of both: faces of one (n, 4), its points (m, 3), heights of the images."""

    points: np.ndarray
    faces: np.ndarray
    heights: tuple[float, ...] = (0.0,)


def hulls(along: int, around: int, heights: tuple[float, ...] = (0.0,)) -> Hulls:
    """A body with the sectional areas of the effect: half-breadths and depths go with the root of 1 - abs(2 x/L)^p."""
    x = -np.cos(np.linspace(0, np.pi, along + 1))
    prismatic = BLOCK / ships_near.MIDSHIP_COEFFICIENT
    size = np.sqrt(np.clip(1 - np.abs(x) ** (prismatic / (1 - prismatic)), 0, None))
    # sections abs(y/b)^6 + abs(z/t)^6 = 1, whose area is 0.98 of the rectangle's
    angles = np.linspace(0, 2 * np.pi, around + 1) + np.pi / around
    round_ = 1 / 3
    section = np.column_stack(
        [B / 2 * np.sign(np.cos(angles)) * np.abs(np.cos(angles)) ** round_,
         T * np.sign(np.sin(angles)) * np.abs(np.sin(angles)) ** round_]
    )  # fmt: skip
    ahead = np.broadcast_to(L / 2 * x[:, None, None], (along + 1, around + 1, 1))
    points = np.concatenate([ahead, size[:, None, None] * section], axis=-1)
    index = np.arange(points[..., 0].size).reshape(points.shape[:2])
    faces = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1)
    return Hulls(points.reshape(-1, 3), faces.reshape(-1, 4), heights)


def added_masses(hull: Hulls, pose: np.ndarray) -> np.ndarray:
    """M (6, 6) of u, v, r of both bodies in own axes, per density; `pose` is x, y (m), psi (rad) of the second."""
    import capytaine

    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    turned = hull.points @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + [pose[0], pose[1], 0]
    points, faces = [], []
    for body in (hull.points, turned):
        for height in hull.heights:
            faces.append(hull.faces + sum(map(len, points)))
            points.append(body + np.array([0, 0, height]))
    mesh = capytaine.Mesh(vertices=np.vstack(points), faces=np.vstack(faces))
    centres, count = mesh.faces_centers, len(hull.faces)
    images = len(hull.heights)
    moving, own = {}, {}
    for body, (origin, ahead, aside) in enumerate(
        (((0, 0, 0), (1, 0, 0), (0, 1, 0)), ((pose[0], pose[1], 0), (cos, sin, 0), (-sin, cos, 0)))
    ):
        everywhere = slice(body * images * count, (body + 1) * images * count)
        alone = slice(body * images * count, (body * images + 1) * count)  # the first height is that of the body itself
        arm = centres - np.array(origin)
        turning = np.column_stack([-arm[:, 1], arm[:, 0], np.zeros(len(arm))])
        for name, motion in (("u", ahead), ("v", aside), ("r", turning)):
            for where, dofs in ((everywhere, moving), (alone, own)):
                values = np.zeros_like(centres)
                values[where] = np.broadcast_to(motion, centres.shape)[where]
                dofs[f"{name}{body}"] = values
    dofs = moving | {f"own {name}": values for name, values in own.items()}
    whole = capytaine.FloatingBody(mesh=mesh, dofs=dofs)
    free = {"free_surface": np.inf, "water_depth": np.inf, "rho": 1.0, "omega": 1.0}
    problems = [capytaine.RadiationProblem(body=whole, radiating_dof=name, **free) for name in moving]
    found = capytaine.BEMSolver(method="direct").solve_all(problems, progress_bar=False)
    M = np.array([[one.added_masses[f"own {name}"] for name in moving] for one in found])
    return (M + M.T) / 2


@dataclass(frozen=True)
class Pair:
    """M (6, 6) and its derivatives by x, y, psi (3, 6, 6), per density; M of one alone (3, 3)."""

    masses: np.ndarray
    slopes: np.ndarray
    alone: np.ndarray
    pose: np.ndarray

    def forces(self, u: float, other: float, v: float = 0.0, r: float = 0.0) -> np.ndarray:
        """X, Y (N), N (N m) on half of the first double body, less those on it alone."""
        nu = np.array([u, v, r, other, 0.0, 0.0])
        x, y, psi = self.pose
        rates = np.array(
            [other * np.cos(psi) - u + r * y, other * np.sin(psi) - v - r * x, -r],
        )
        impulse = (self.masses @ nu)[:3] - self.alone @ nu[:3]
        change = (np.tensordot(rates, self.slopes, 1) @ nu)[:3]
        pull = 0.5 * np.einsum("i,kij,j", nu, self.slopes, nu)
        turning = np.array([-r * impulse[1], r * impulse[0], u * impulse[1] - v * impulse[0]])
        by_pose = np.array([-pull[0], -pull[1], y * pull[0] - x * pull[1] - pull[2]])
        return DENSITY / 2 * (by_pose - change - turning)


def lonely(hull: Hulls) -> np.ndarray:
    """M (3, 3) of a body whose like is far away."""
    return added_masses(hull, np.array([1e3 * L, 0.0, 0.0]))[:3, :3]


def pair(hull: Hulls, alone: np.ndarray, x: float, y: float, psi: float = 0.0) -> Pair:
    """Two bodies at a pose; `alone` as :func:`lonely` has it."""
    pose, steps = np.array([x, y, psi]), np.array([0.01 * L, 0.01 * L, 0.01])
    slopes = [
        (added_masses(hull, pose + step) - added_masses(hull, pose - step)) / (2 * np.max(step))
        for step in np.diag(steps)
    ]
    return Pair(added_masses(hull, pose), np.array(slopes), alone, pose)


def with_other_ship(depth: float | None = None) -> ca.Function:
    """``forces(x, y, psi, u, v, r, U2, masses)`` -> X, Y, N of the effect on the KVLCC2, its added masses given.

    These are (3,) in surge, sway (m3) and yaw (m5), over the density.
    """
    effects = [{"name": "other_ship", "parameters": dict.fromkeys(("forward_m", "starboard_m"), 1e4)
                | {"heading_deg": 0.0, "speed_mps": 0.0}}]  # fmt: skip
    if depth is not None:
        effects.insert(0, {"name": "finite_depth", "parameters": {"depth_m": depth}})
    card = t2s.load("kvlcc2").replace(
        {"ship.length_m": L, "ship.beam_m": B, "ship.draught_m": T, "ship.block_coefficient": BLOCK,
         "ship.name": f"{ships_near.POINTS} points",  # equal cards have the same model, built once
         "environment.water_density_kgpm3": DENSITY, "effects": effects}
    )  # fmt: skip
    model = card.model
    masses = ca.SX.sym("masses", 3)
    expression = ca.vcat([model[f"other_ship.{force}"].value for force in FORCES])
    for place, (moved, rigid) in enumerate((("surge", "mass"), ("sway", "mass"), ("yaw", "yaw_inertia"))):
        whole = model.symbol(f"ship.{rigid}") + DENSITY * masses[place]
        expression = ca.substitute(expression, model.symbol(f"inertia.{moved}"), whole)
    expression = model.expand(expression)
    names = [f"other_ship.{name}" for name in ("forward", "starboard", "heading")]
    names += ["motion.u", "motion.v", "motion.r", "other_ship.speed"]
    symbols = [model.symbol(name) for name in names]
    rest = [variable for variable in (*model.states, *model.inputs, *model.parameters) if variable.name not in names]
    fixed = dict(zip(model.parameter_names, model.parameter_values(), strict=True))
    fixed |= dict(zip(model.input_names, model.input_values(), strict=True))
    starts = ca.vcat([fixed.get(one.name, 0.0) for one in rest])
    numbers = ca.substitute(expression, ca.vcat([one.symbol for one in rest]), starts)
    return ca.Function("forces", [*symbols, masses], [numbers])


def compare(hull: Hulls, depth: float | None, clearances: tuple[float, ...], staggers: np.ndarray) -> None:
    """Print largest forces and differences for each encounter and clearance."""
    calculated = with_other_ship(depth)
    alone, poses = lonely(hull), {}
    for clearance in clearances:
        for stagger in staggers:
            poses[clearance, stagger] = pair(hull, alone, stagger * L, (1 + clearance) * B)
    masses = np.diag(alone) / 2
    print(f"added mass in surge and sway over displaced mass: {np.round(masses[:2] / (BLOCK * L * B * T), 3)}")
    moored: dict[float, np.ndarray] = {}
    for encounter, (u, other) in ENCOUNTERS.items():
        for clearance in clearances:
            exact, theory = [], []
            for stagger in staggers:
                # ahead and, by the symmetry of the bodies, astern
                exact.append(poses[clearance, stagger].forces(u, other))
                place = stagger * L, (1 + clearance) * B, 0.0
                theory.append(np.array(calculated(*place, u, 0.0, 0.0, other, masses)).ravel())
            exact, theory = np.array(exact) / 1e3, np.array(theory) / 1e3
            if u == 0:
                moored[clearance] = np.abs(exact).max(axis=0)
            largest = np.abs(exact).max(axis=0)
            error = np.abs(theory - exact).max(axis=0) / (moored[clearance] if other == 0 else largest)
            print(
                f"{encounter}, clearance {clearance:g} B: largest X, Y, N {largest[0]:.0f} kN, {largest[1]:.0f} kN, "
                f"{largest[2] / 1e3:.1f} MN m; largest difference "
                + ", ".join(f"{100 * one:.0f} %" for one in error)
                + (" of the forces on the moored one" if other == 0 else "")
            )
            if "--all" in sys.argv:
                for row in zip(staggers, exact.round(1), theory.round(1), strict=True):
                    print("   ", *row)


def by_points(clearance: float) -> np.ndarray:
    """Largest difference (3,) of X, Y, N on a moored ship to those with 40 points on each hull, over the largest."""
    found, usual = [], (ships_near.POINTS, ships_near.OTHER_POINTS)
    masses = np.array([0.05, 0.75, 0.05 * L**2]) * BLOCK * L * B * T
    for points in (usual, (40, 40)):
        ships_near.POINTS, ships_near.OTHER_POINTS = points
        calculated = with_other_ship()
        places = np.linspace(-1.2, 1.2, 61) * L
        rows = [calculated(x, (1 + clearance) * B, 0.0, 0.0, 0.0, 0.0, SPEED, masses) for x in places]
        found.append(np.array(rows).reshape(-1, 3))
    ships_near.POINTS, ships_near.OTHER_POINTS = usual
    return np.max(np.abs(found[0] - found[1]), axis=0) / np.max(np.abs(found[1]), axis=0)


def oblique(hull: Hulls) -> None:
    """Print forces of a ship that drifts and turns, another one crossing."""
    calculated, alone = with_other_ship(), lonely(hull)
    for x, y, psi in ((0.4 * L, 0.8 * L, 2.0), (-0.1 * L, -0.8 * L, 1.0)):
        bodies = pair(hull, alone, x, y, psi)
        motion = 4.0, 0.6, 0.006
        exact = bodies.forces(motion[0], SPEED, *motion[1:]) / 1e3
        theory = np.array(calculated(x, y, psi, *motion, SPEED, np.diag(alone) / 2)).ravel() / 1e3
        print(
            f"crossing at {np.degrees(psi):.0f} deg, u 4 m/s, v 0.6 m/s, r 0.006 rad/s: X, Y, N {exact.round()} kN, "
            f"kN, kN m; effect {theory.round()}"
        )


def main() -> None:
    """Print all comparisons."""
    logging.disable(logging.WARNING)
    for clearance in (0.25, 0.5, 1.0):
        errors = ", ".join(f"{100 * one:.2f} %" for one in by_points(clearance))
        points = f"{ships_near.POINTS} and {ships_near.OTHER_POINTS} points in place of 40"
        print(f"{points}, clearance {clearance:g} B: X, Y, N differ by {errors}")
    print("deep water")
    compare(hulls(24, 16), None, CLEARANCES, STAGGERS)
    oblique(hulls(24, 16))
    depth = 2 * T
    print(f"water of {depth / T:g} draughts")
    heights = (0.0, *(side * 2 * n * depth for n in range(1, 4) for side in (1, -1)))
    compare(hulls(16, 12, heights), depth, (1.0,), np.array([0.0, 0.25, 0.5, 1.0]))


if __name__ == "__main__":
    main()
