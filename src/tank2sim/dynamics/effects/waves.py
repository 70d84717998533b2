"""Irregular waves: mean drift forces, and first-order motions on top of the pose, from a table on the card."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards.card import SteeredCard
from tank2sim.cards.wave_table import MIRRORED, WAVE_MOTIONS, WAVE_ROTATIONS, WaveTable, wave_table
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, EffectSymbols
from tank2sim.dynamics.effects.forces import with_forces, with_validity
from tank2sim.dynamics.effects.froude_scale import lengths
from tank2sim.dynamics.effects.surroundings import bearing
from tank2sim.dynamics.hull import inside_range
from tank2sim.dynamics.kinematics import earth_velocity
from tank2sim.dynamics.model import Model, Quantity, State

COMPONENTS = 40
"""Regular waves that make up the sea, from the lowest to the highest frequency of the table at equal ratios, so that
the sea does not repeat itself. A table over a ratio of 8 in frequency has steps of 5 %, and the variance of the sum is
that of the spectrum between its ends within 1 % (peakedness 1 to 5; tests/dynamics/effects/test_waves.py). Project
choice."""

COVERED, COVERED_MARGIN = 0.9, 0.5
"""Share of the variance of the sea within the frequencies of the table from which the effect holds, and the distance
below over which ``validity`` falls to zero: project choice."""

LARGEST_TAU, TAU_MARGIN = 0.15, 0.35
"""w U/g at the peak up to which the effect of speed on the mean drift, of the first order in it, counts as valid, and
the distance beyond over which ``validity`` falls to zero: at 0.25 the waves that a ship makes no longer go ahead of it.
Project choice."""


@dataclass(frozen=True)
class Components:
    """Frequencies of the regular waves and the bandwidth of each, (COMPONENTS,), rad/s."""

    frequencies: Array
    widths: Array


def components(table: WaveTable) -> Components:
    """The regular waves between the ends of a table."""
    bounds = np.geomspace(table.frequencies[0], table.frequencies[-1], COMPONENTS + 1)
    return Components(np.sqrt(bounds[1:] * bounds[:-1]), np.diff(bounds))


def amplitudes(chosen: Components, height: ca.SX, period: ca.SX, peakedness: ca.SX) -> ca.SX:
    """Amplitudes (m) of the components, a = sqrt(2 S d_omega), by the JONSWAP spectrum.

    `height` is the significant height Hs (m), `period` the peak period 2 pi/wp (s), `peakedness` gamma.

        S = (1 - 0.287 ln gamma) 5/16 Hs^2 wp^4/w^5 exp(-5/4 (wp/w)^4) gamma^b,   b = exp(-(w/wp - 1)^2/(2 s^2))

    s = 0.07 below the peak wp and 0.09 above it: ITTC (2002), 23rd ITTC, Specialist Committee on Waves, vol. II,
    505-551, and DNV-RP-C205, 3.5.5. gamma = 1 gives Bretschneider (1959), as in ITTC 7.5-02-07-01.1.
    """
    peak = 2 * math.pi / period
    frequencies, widths = ca.DM(chosen.frequencies), ca.DM(chosen.widths)
    ratio = peak / frequencies
    beyond = frequencies / peak - 1
    below, above = 1 / (2 * 0.07**2), 1 / (2 * 0.09**2)
    # the exponent of b, either side of the peak without a comparison, which would be an event of the simulation
    square = (above + below) / 2 * beyond**2 + (above - below) / 2 * beyond * ca.fabs(beyond)
    scale = (1 - 0.287 * ca.log(peakedness)) * 5 / 8 * widths / frequencies
    # the root of the exponential itself: where that is nothing, the root of a product has no slope
    return height * ca.sqrt(scale) * ratio**2 * ca.exp(-5 / 8 * ratio**4) * peakedness ** (ca.exp(-square) / 2)


def phases(seed: ca.SX) -> ca.SX:
    """Phases (rad) of the components: 2 pi times the fraction of seed sqrt(p), p the prime numbers in their order.

    Fractions of the multiples of these roots are evenly and independently distributed: Weyl (1916), Ueber die
    Gleichverteilung von Zahlen mod. Eins, Mathematische Annalen 77, 313-352. They are the same on every machine.
    """
    turns = seed * ca.DM(np.sqrt(_primes(COMPONENTS)))
    return 2 * math.pi * (turns - ca.floor(turns))


def _primes(count: int) -> list[int]:
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in found):
            found.append(number)
        number += 1
    return found


def by_direction(values: Array, mirrored: bool) -> Array:
    """Coefficients of cos(m beta), or of sin(m beta) if `mirrored`, m = 0 to nd - 1, through values (.., nd)."""
    count = values.shape[-1]
    angles = np.outer(np.linspace(0, math.pi, count), np.arange(count))
    if not mirrored:
        return np.asarray(np.linalg.solve(np.cos(angles), values[..., None])[..., 0])
    inner = np.linalg.solve(np.sin(angles[1:-1, 1:-1]), values[..., 1:-1, None])[..., 0]
    return np.concatenate([np.zeros_like(values[..., :1]), inner, np.zeros_like(values[..., :1])], axis=-1)


def _harmonics(direction: ca.SX, count: int) -> tuple[ca.SX, ca.SX]:
    orders = ca.DM(np.arange(count))
    return ca.cos(orders * direction), ca.sin(orders * direction)


def _slopes(direction: ca.SX, count: int) -> tuple[ca.SX, ca.SX]:
    """Derivatives of :func:`_harmonics` by the direction."""
    orders = ca.DM(np.arange(count))
    return -orders * ca.sin(orders * direction), orders * ca.cos(orders * direction)


def _drift(table: WaveTable, force: str, encounter: ca.SX, squares: ca.SX, harmonics: ca.SX) -> ca.SX:
    """Sum of a^2 D: D linear between the frequencies of the table, 0 at 0, constant beyond the last."""
    nodes = np.concatenate([[0.0], table.frequencies])
    coefficients = by_direction(table.drift[force], force in MIRRORED)
    values = np.vstack([np.zeros_like(coefficients[:1]), coefficients])
    slopes = np.diff(values, axis=0) / np.diff(nodes)[:, None]
    edges = np.vstack([np.zeros_like(slopes[:1]), slopes, np.zeros_like(slopes[:1])])
    turns = np.diff(edges, axis=0) / 2
    # f(x) = (f_0 + f_n)/2 + sum of c_i abs(x - x_i): without comparisons, which would be events of the simulation
    distances = ca.vcat([ca.dot(squares, ca.fabs(ca.fabs(encounter) - node)) for node in nodes])
    by_harmonic = ca.mtimes(ca.DM(turns.T), distances) + ca.DM((values[0] + values[-1]) / 2) * ca.sum1(squares)
    return ca.dot(by_harmonic, harmonics)


def _motion(table: WaveTable, motion: str, chosen: Components, waves: tuple[ca.SX, ca.SX], direction: ca.SX) -> ca.SX:
    """Sum of the real part of RAO a exp(i phase), `waves` being a cos(phase) and a sin(phase)."""
    grid = table.motions[motion]
    at = np.array(
        [
            np.interp(chosen.frequencies, table.frequencies, column.real)
            + 1j * np.interp(chosen.frequencies, table.frequencies, column.imag)
            for column in grid.T
        ]
    ).T
    mirrored = motion in MIRRORED
    real, imaginary = (ca.DM(by_direction(part, mirrored)) for part in (at.real, at.imag))
    harmonics = _harmonics(direction, len(table.directions))[mirrored]
    return ca.dot(ca.mtimes(real, harmonics), waves[0]) - ca.dot(ca.mtimes(imaginary, harmonics), waves[1])


def _with_waves(model: Model, given: EffectSymbols, card: SteeredCard) -> Model:
    """Mean drift at the frequency of encounter, and the pose with the first-order motions on top.

        X, Y, N = sum of a_k^2 (1 + 4 w_k/g w) D(w_k + w_k^2/g w, beta + 2 w_k/g (v cos(beta) - u sin(beta)))
        w = u cos(beta) + v sin(beta)
        eta = eta_LF + sum of a_k abs(R_k) cos(theta_k + arg(R_k)),   R_k = RAO(w_k, beta)
        theta_k = w_k t + w_k^2/g (x cos(chi) + y sin(chi)) + eps_k

    beta = chi - psi is the direction chi from which the waves come, clockwise from the bow, and w the velocity
    against them: the formula of Aranha (1994), A formula for "wave damping" in the drift of a floating body, J. Fluid
    Mech. 275, 147-155, cited without the paper at hand, of the first order in w_k w/g, with D at rest; for N as for X
    and Y, its factor held above zero, and the small change of direction linearised. With `speed_effect` 0 only the
    frequency of encounter is left, as in FRyDoM's theory guide, "Mean wave drift force". The motions of Fossen
    (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 10.2.3, which do not act back on the manoeuvre.
    The waves are long-crested, of deep water.
    """
    own = card.manoeuvring().waves
    if own is None:
        raise card.fault("waves", "is missing", "the effect waves needs the table [waves] of the ship's own answer")
    table = wave_table(own.columns, own.rows)
    chosen = components(table)
    clock = State("waves.clock", "s", "Time since the start", derivative="waves.clock_rate", start=0.0)
    rate = Quantity("waves.clock_rate", "1", "Rate of the time since the start", ca.SX(1))
    motion, direction = model.symbol, given["direction"]
    relative = direction - motion("motion.psi")
    frequencies = ca.DM(chosen.frequencies)
    numbers = frequencies**2 / card.environment.gravity_mps2
    heights = amplitudes(chosen, given["height"], given["period"], given["peakedness"])
    approach = motion("motion.u") * ca.cos(relative) + motion("motion.v") * ca.sin(relative)
    encounter = frequencies + numbers * approach
    across = motion("motion.v") * ca.cos(relative) - motion("motion.u") * ca.sin(relative)
    share = given["speed_effect"] * frequencies / card.environment.gravity_mps2
    grown = 1 + 4 * share * approach
    squares = heights**2 * (grown + ca.fabs(grown)) / 2
    forces = {}
    for force in table.drift:
        harmonics, slopes = (
            of_direction(relative, len(table.directions))[force in MIRRORED] for of_direction in (_harmonics, _slopes)
        )
        turned = _drift(table, force, encounter, 2 * share * across * squares, slopes)
        forces[force] = _drift(table, force, encounter, squares, harmonics) + turned
    way = motion("motion.x") * ca.cos(direction) + motion("motion.y") * ca.sin(direction)
    angle = frequencies * clock.symbol + numbers * way + phases(given["seed"])
    waves = heights * ca.cos(angle), heights * ca.sin(angle)
    shown = [
        Quantity("waves.elevation", "m", "Surface of the undisturbed sea at midships, positive up", ca.sum1(waves[0])),
        *(_shown(name, _motion(table, name, chosen, waves, relative)) for name in table.motions),
    ]
    added = {name: ca.SX(0) for name in WAVE_MOTIONS} | {
        quantity.name.removeprefix("waves."): quantity.symbol for quantity in shown[1:]
    }
    poses = _pose(model, added)
    variance = (given["height"] + 1e-6) ** 2 / 8
    covered = ca.sum1(heights**2) / variance
    covering = inside_range((COVERED - covered) * given["height"] / (given["height"] + 0.01), COVERED_MARGIN)
    steepest = 2 * math.pi / given["period"] * ca.sqrt(approach**2 + across**2 + 1e-12) / card.environment.gravity_mps2
    slow = inside_range((steepest - LARGEST_TAU) * given["height"] / (given["height"] + 0.01), TAU_MARGIN)
    outputs = [quantity.name for quantity in (*shown, *poses)]
    sea = with_forces(model, **forces).extend(clock, rate, *shown, *poses, outputs=outputs)
    sea = with_validity(sea, "waves", "the share of the sea within the frequencies of the table", covering)
    cause = "the speed in waves, over the speed up to which its first-order effect on the mean drift holds"
    return with_validity(sea, "wave_speed", cause, slow)


_SENSES = ("forward", "to starboard", "down", "to starboard", "bow up", "to starboard")


def _shown(name: str, value: ca.SX) -> Quantity:
    rotation = name in WAVE_ROTATIONS
    return Quantity(
        f"waves.{name}",
        "rad" if rotation else "m",
        f"{name.capitalize()} by the waves alone, positive {_SENSES[WAVE_MOTIONS.index(name)]}",
        value,
        display_unit="deg" if rotation else None,
        nominal=0.01 if rotation else 1.0,
    )


def _pose(model: Model, added: dict[str, ca.SX]) -> tuple[Quantity, ...]:
    """Position, heave and angles of the ship with its motions in waves."""
    psi = model.symbol("motion.psi")
    north, east = earth_velocity(added["surge"], added["sway"], psi)
    heel = model.symbol("motion.phi") if "motion.phi" in model else ca.SX(0)
    described = (
        ("x", "m", "Position to north", model.symbol("motion.x") + north),
        ("y", "m", "Position to east", model.symbol("motion.y") + east),
        ("z", "m", "Height of the origin below its place in calm water", added["heave"]),
        ("phi", "rad", "Heel, positive to starboard", heel + added["roll"]),
        ("theta", "rad", "Pitch, positive bow up", added["pitch"]),
        ("psi", "rad", "Heading, clockwise from north, continuous", psi + added["yaw"]),
    )
    return tuple(
        Quantity(
            f"pose.{name}",
            unit,
            f"{description}, with the motions in waves",
            value,
            display_unit="deg" if unit == "rad" else None,
        )
        for name, unit, description, value in described
    )


WAVES = Effect(
    name="waves",
    acts_on="force",
    description="Irregular waves push the ship and move it about its course, by a table of what regular ones do to it.",
    source="Fossen (2021), 10.2; Aranha (1994), J. Fluid Mech. 275; JONSWAP by ITTC (2002); ITTC 7.5-02-07-01.1",
    parameters=(
        EffectParameter(
            "height_m",
            "significant height of the waves",
            0.0,
            20.0,
            input_name="waves.height",
            absent=0.0,
            typical=lengths(0.0125),
        ),
        EffectParameter(
            "period_s",
            "peak period of the waves",
            0.3,
            30.0,
            input_name="waves.period",
            typical=lambda card: (2 * math.sqrt(card.ship.length_m / card.environment.gravity_mps2),),
        ),
        bearing("from which the waves come", "waves.direction"),
        EffectParameter(
            "peakedness", "gamma of the JONSWAP spectrum (1: Bretschneider, 3.3: a young wind sea)", 1.0, 7.0, 1.0
        ),
        EffectParameter(
            "speed_effect",
            "share of the effect of speed on the mean drift (0: the frequency of encounter alone)",
            0.0,
            1.0,
            1.0,
        ),
        EffectParameter("seed", "number that determines the phases of the waves", 1.0, 1e6, 1.0),
    ),
    equations=_with_waves,
    sought=False,
    terminal="Sea state, and what it does to the ship",
)
