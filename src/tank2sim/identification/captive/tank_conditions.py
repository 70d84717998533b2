"""Physics warnings on the conditions of captive tests, which a correct reduction does not remove.

Each function checks one condition and yields a :class:`Caution` of one sentence where necessary; data are neither
omitted nor changed. A check that lacks data yields a caution with the missing key. "Paper 2" is Krezelewski and Misiag,
section 5; "ITTC" is the recommended procedure 7.5-02-06-02, Captive Model Tests.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from tank2sim.cards.plausibility import Caution
from tank2sim.records.campaign_form import ModelSection, TankSection


def lacking(kind: str, what: str, key: str) -> Caution:
    """A caution of a `kind` on a check that lacks a key: `what` is unknown, and the key."""
    return Caution(kind, f"Not known: {what}; give {key}.", missing=key)


SHORTEST_MODEL_M = 4.0
"""Paper 2: between models of 4 m and 2 m most coefficients differ by about 10 %."""

LARGEST_FREQUENCY_PARAMETER = 0.1
"""omega U/g. Paper 2: coefficients fall steeply above."""

LARGEST_REDUCED_FREQUENCY = {"sway": 2.0, "yaw": 3.0}
"""omega L/U above which the flow has memory. ITTC quotes limits of 1 to 2 in sway and 2 to 3 in yaw; the upper ones."""

NEAR_RESONANCE = 0.1
"""A harmonic of the motion this near (relatively) to a standing wave of the tank excites it: project choice."""

WIDEST_TANK_M, DEEPEST_TANK_M = 150.0, 60.0
"""Larger than any tank. Project choice: twice the widest basins (some 75 m) and the deepest pits (some 30 m)."""

LARGEST_BLOCKAGE = 0.01
"""Midship section over tank section: project choice; blockage corrections of resistance begin to matter there."""

LEAST_DEPTH_RATIO = 4.0
"""Depth over draught of deep water: IMO MSC.137(76), standards for ship manoeuvrability."""

LARGEST_DEPTH_FROUDE = 0.6
"""U/sqrt(g h) at which the bottom changes the model's waves by 1 %: they have k h = 1/Fn_h^2, and tanh(k h) = 0.99."""

BLOCK_TOLERANCE = 0.05
"""Relative difference between a stated block coefficient and the one of the mass: project choice."""

BLOCK_COEFFICIENTS = (0.4, 0.9)
"""Mass over rho L B T of ships: 0.45 (destroyers) to 0.87 (tankers); a project choice on either side."""

POSSIBLE_BLOCKS = (0.05, 1.05)
"""Possible block coefficients of floating bodies. Above: a body displaces no more than its box; 5 % for a waterline
longer than the length given. Below: catamarans with their overall beam have 0.1 and more, kg for t or cm for m 0.01 and
less."""

POSSIBLE_MASSES = (5e-4, 0.1)
"""m' = m/(1/2 rho L^3) where beam or draught is not given: 2 C_B (B/L)(T/L), from a rowing eight's 0.3, 0.06, 0.015 to
a stubby barge's 0.95, 0.4, 0.13."""

RADII_OF_GYRATION = (0.18, 0.32)
"""In yaw, in lengths, about midships: 0.25 is usual; project choice on either side."""

POSSIBLE_RADII = (0.1, 0.5)
"""Above: a body of length L has at most L/2, all its mass at its ends. Below: all mass within 0.17 L of midships; a
project choice that detects t m2 or kg cm2."""

POSSIBLE_CENTRE = 0.5
"""|x_G| in lengths from midships at which the centre of gravity is at the end of the ship."""

CENTRES_OF_GRAVITY = 0.1
"""|x_G| in lengths of ships that float on even keel: some 0.05 at most; a project choice beyond it."""


@dataclass(frozen=True)
class OscillationMotion:
    """Motion of one run: ``sway`` or ``yaw``, and its angular frequency (rad/s) as measured."""

    run: str
    motion: str
    frequency_radps: float


@dataclass(frozen=True)
class FroudeScaling:
    """Ship over model at equal Froude number (paper 2, section 5), from the ratios of lengths and densities."""

    length: float
    density: float = 1.0
    viscosity: float = 1.0

    @property
    def speed(self) -> float:
        """Ratio of speeds and of times: the root of the ratio of lengths."""
        return math.sqrt(self.length)

    @property
    def frequency(self) -> float:
        """The inverse of the ratio of times."""
        return 1 / math.sqrt(self.length)

    @property
    def force(self) -> float:
        """Ratio of forces and of masses."""
        return self.density * self.length**3

    @property
    def moment(self) -> float:
        """Force times length."""
        return self.density * self.length**4

    @property
    def reynolds(self) -> float:
        """Reynolds number of the ship over the model's: lambda^1.5 over the ratio of kinematic viscosities."""
        return math.pow(self.length, 1.5) / self.viscosity


def brard_number(frequency_radps: float, speed_mps: float, gravity_mps2: float) -> float:
    """zeta = omega U/g, which is also omega' Fn^2 (paper 2, section 5)."""
    return frequency_radps * speed_mps / gravity_mps2


def reduced_frequency(frequency_radps: float, speed_mps: float, length_m: float) -> float:
    """omega' = omega L/U."""
    return frequency_radps * length_m / speed_mps


def shortest_period_s(speed_mps: float, gravity_mps2: float) -> float:
    """Period at which omega U/g is 0.1: 2 pi U/(0.1 g), s."""
    return 2 * math.pi * speed_mps / (LARGEST_FREQUENCY_PARAMETER * gravity_mps2)


def standing_wave_frequency(mode: int, tank_breadth_m: float, depth_m: float, gravity_mps2: float) -> float:
    """Angular frequency (rad/s) of the tank's transverse standing wave with `mode` half waves across.

    omega^2 = g k tanh(k h), k = mode pi/B: linear waves between vertical walls (Lamb, Hydrodynamics, art. 228).
    """
    number = mode * math.pi / tank_breadth_m
    return math.sqrt(gravity_mps2 * number * math.tanh(number * depth_m))


def model_length(length_m: float) -> Iterator[Caution]:
    """A model shorter than 4 m."""
    if length_m < SHORTEST_MODEL_M:
        yield Caution(
            "model length",
            f"The model is {length_m:.3g} m long: below {SHORTEST_MODEL_M:g} m the scale effect grows, and most "
            "coefficients of 2 m models differ by about 10 % from 4 m models (Krezelewski and Misiag).",
        )


def frequency_parameters(
    runs: tuple[OscillationMotion, ...], speed_mps: float, gravity_mps2: float
) -> Iterator[Caution]:
    """Runs with omega U/g of 0.1 or more, which should be omitted."""
    values = {run.run: brard_number(run.frequency_radps, speed_mps, gravity_mps2) for run in runs}
    high = tuple(name for name, value in values.items() if value >= LARGEST_FREQUENCY_PARAMETER)
    if high:
        yield Caution(
            "frequency parameter",
            f"omega U/g reaches {max(values[name] for name in high):.3g}; from {LARGEST_FREQUENCY_PARAMETER:g} on "
            "coefficients fall steeply (Krezelewski and Misiag): oscillate with periods above "
            f"{shortest_period_s(speed_mps, gravity_mps2):.3g} s at this speed.",
            high,
        )


def flow_memory(runs: tuple[OscillationMotion, ...], speed_mps: float, length_m: float) -> Iterator[Caution]:
    """Runs so fast that the force depends on earlier motion, one caution for each kind of motion."""
    for motion, limit in LARGEST_REDUCED_FREQUENCY.items():
        values = {
            run.run: reduced_frequency(run.frequency_radps, speed_mps, length_m) for run in runs if run.motion == motion
        }
        high = tuple(name for name, value in values.items() if value > limit)
        if high:
            yield Caution(
                "flow memory",
                f"omega L/U of {motion} reaches {max(values.values()):.3g}, above the {limit:g} that ITTC quotes: the "
                "flow has memory of earlier motion, and derivatives may depend on frequency; the runs are kept, see "
                "the trend with frequency.",
                high,
            )


def trim(trim_m: float | None, length_m: float) -> Iterator[Caution]:
    """A model that is not on even keel."""
    if trim_m is None:
        yield lacking("trim", "the trim, which acts strongly on Y_r and N_r (Krezelewski and Misiag)", "[model] trim_m")
    elif trim_m != 0:
        yield Caution(
            "trim",
            f"The model is trimmed by {abs(trim_m):.3g} m ({100 * abs(trim_m) / length_m:.2g} % of the length): trim "
            "acts strongly on Y_r and N_r, a change by 1 % changed one of them by 7.5 % (Krezelewski and Misiag).",
        )


def tank_resonance(runs: tuple[OscillationMotion, ...], tank: TankSection, gravity_mps2: float) -> Iterator[Caution]:
    """Runs whose motion or its third harmonic is near a transverse standing wave of the tank.

    A model on the centreline that sways or yaws excites the waves that are odd across the tank, modes 1, 3, 5.
    """
    if not runs:
        return
    if tank.breadth_m is None:
        yield lacking("tank resonance", "whether the motion excites standing waves of the tank", "[tank] breadth_m")
        return
    depth = math.inf if tank.depth_m is None else tank.depth_m
    for mode in (1, 3, 5):
        wave = standing_wave_frequency(mode, tank.breadth_m, depth, gravity_mps2)
        for harmonic in (1, 3):
            near = tuple(run.run for run in runs if abs(harmonic * run.frequency_radps - wave) <= NEAR_RESONANCE * wave)
            if near:
                what = "the motion" if harmonic == 1 else "the third harmonic of the motion"
                yield Caution(
                    "tank resonance",
                    f"The frequency of {what} is within {100 * NEAR_RESONANCE:.0f} % of standing wave {mode} across "
                    f"the tank ({wave:.3g} rad/s, {tank.breadth_m:g} m wide): its waves add to the forces.",
                    near,
                )


def tank_size(tank: TankSection) -> Iterator[Caution]:
    """A tank larger than any."""
    for what, size, most in (("breadth_m", tank.breadth_m, WIDEST_TANK_M), ("depth_m", tank.depth_m, DEEPEST_TANK_M)):
        if size is not None and size > most:
            yield Caution(
                "tank",
                f"[tank] {what} is {size:g} m, and no tank has more than {most:g} m (if in cm: {size / 100:g} m):"
                " what depends on it (resonance, blockage, shallow water) was not found.",
            )


def blockage(beam_m: float | None, draught_m: float | None, tank: TankSection) -> Iterator[Caution]:
    """A tank too small in section or depth for the model to behave as in open water."""
    sizes = {"[model] beam_m": beam_m, "[model] draught_m": draught_m}
    sizes |= {"[tank] breadth_m": tank.breadth_m, "[tank] depth_m": tank.depth_m}
    known = {key: size for key, size in sizes.items() if size is not None}
    if len(known) < len(sizes):
        missing = ", ".join(key for key in sizes if key not in known)
        yield lacking("blockage", "the share of the tank's section that the model blocks", missing)
    else:
        beam, draught, breadth, depth = known.values()
        share = beam * draught / (breadth * depth)
        if share > LARGEST_BLOCKAGE:
            yield Caution(
                "blockage",
                f"The model fills {100 * share:.2g} % of the tank's section, more than "
                f"{100 * LARGEST_BLOCKAGE:g} %: forces are larger than in open water.",
            )
    if draught_m is not None and tank.depth_m is not None and tank.depth_m < LEAST_DEPTH_RATIO * draught_m:
        yield Caution(
            "blockage",
            f"The water is {tank.depth_m / draught_m:.2g} draughts deep; deep water is more than "
            f"{LEAST_DEPTH_RATIO:g} (IMO MSC.137(76)): the derivatives hold in shallow water.",
        )


def depth_froude(speed_mps: float, depth_m: float | None, gravity_mps2: float) -> Iterator[Caution]:
    """A depth Froude number U/sqrt(g h) that changes the waves."""
    if depth_m is None:
        yield lacking("depth Froude number", "whether the bottom changes the waves", "[tank] depth_m")
        return
    number = speed_mps / math.sqrt(gravity_mps2 * depth_m)
    if number > LARGEST_DEPTH_FROUDE:
        message = f"The depth Froude number is {number:.2g}, above {LARGEST_DEPTH_FROUDE:g}: the bottom changes the "
        yield Caution("depth Froude number", message + "waves of the model.")


def _block(model: ModelSection, density_kgpm3: float) -> float | None:
    """Mass over rho L B T; None if beam or draught is not known."""
    if model.beam_m is None or model.draught_m is None:
        return None
    return model.mass_kg / (density_kgpm3 * model.length_m * model.beam_m * model.draught_m)


def _radius(model: ModelSection) -> float | None:
    """Radius of gyration in yaw, lengths; None if the yaw inertia is not known."""
    if model.yaw_inertia_kgm2 is None:
        return None
    return math.sqrt(model.yaw_inertia_kgm2 / model.mass_kg) / model.length_m


def impossible_body(model: ModelSection, density_kgpm3: float) -> Iterator[tuple[str, str]]:
    """Impossible numbers of a body: the key under ``[model]`` and the problem, usually a wrong unit."""
    block, radius, length = _block(model, density_kgpm3), _radius(model), model.length_m
    if block is not None and not _within(block, POSSIBLE_BLOCKS):
        yield (
            "mass_kg",
            f"is {model.mass_kg:.4g}, {block:.3g} times the water in L x B x T ({length:g} m x {model.beam_m:g} m x "
            f"{model.draught_m:g} m at {density_kgpm3:g} kg/m3); ships have {BLOCK_COEFFICIENTS[0]:g} to "
            f"{BLOCK_COEFFICIENTS[1]:g}",
        )
    prime = model.mass_kg / (0.5 * density_kgpm3 * length**3)
    if block is None and not _within(prime, POSSIBLE_MASSES):
        yield (
            "mass_kg",
            f"is {model.mass_kg:.4g}, m' = {prime:.3g} with L = {length:g} m at {density_kgpm3:g} kg/m3; floating "
            f"bodies have {POSSIBLE_MASSES[0]:g} to {POSSIBLE_MASSES[1]:g}",
        )
    if radius is not None and not _within(radius, POSSIBLE_RADII):
        yield (
            "yaw_inertia_kgm2",
            f"is {model.yaw_inertia_kgm2:.4g}: with {model.mass_kg:.4g} kg the radius of gyration is {radius:.3g} L, "
            f"and ships have {RADII_OF_GYRATION[0]:g} to {RADII_OF_GYRATION[1]:g}",
        )
    if abs(model.x_G_m) >= POSSIBLE_CENTRE * length:
        yield "x_G_m", f"is {model.x_G_m:.4g}: the centre of gravity is off the ship, {length:g} m long"


def carried_mass(model: ModelSection, density_kgpm3: float) -> Iterator[Caution]:
    """A mass that does not fit the hull, a yaw inertia or a centre of gravity that does not fit a ship."""
    block, radius, stated = _block(model, density_kgpm3), _radius(model), model.block_coefficient
    if block is not None and not _within(block, BLOCK_COEFFICIENTS):
        low, high = BLOCK_COEFFICIENTS
        yield Caution(
            "mass",
            f"The mass is {block:.3g} times the mass of the water in L x B x T, and ships have {low:g} to {high:g}: "
            "check mass, length, beam and draught.",
        )
    if block is not None and stated is not None and abs(block / stated - 1) > BLOCK_TOLERANCE:
        yield Caution(
            "mass",
            f"The mass corresponds to a block coefficient of {block:.3g}, and {stated:.3g} is given: do the gauges "
            "carry a part of the model alone?",
        )
    if radius is not None and not _within(radius, RADII_OF_GYRATION):
        low, high = RADII_OF_GYRATION
        yield Caution(
            "mass", f"The radius of gyration in yaw is {radius:.3g} L; ships and their models have {low:g} to {high:g}."
        )
    if abs(model.x_G_m) > CENTRES_OF_GRAVITY * model.length_m:
        yield Caution(
            "mass",
            f"The centre of gravity is {abs(model.x_G_m) / model.length_m:.2g} L from midships, and ships have 0.05 "
            "L at most: check [model] x_G_m.",
        )


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def scale_effect(scale: float | None, length_m: float, speed_mps: float, viscosity_m2ps: float | None) -> Caution:
    """Caution on the Reynolds number, which Froude scaling does not preserve (paper 2, section 5)."""
    if scale is None:
        return lacking("scale effect", "the Reynolds number of the ship", "[model] scale")
    model_number = ""
    if viscosity_m2ps is not None:
        model_number = f" ({speed_mps * length_m / viscosity_m2ps:.2g} of the model)"
    ratio = FroudeScaling(scale).reynolds
    return Caution(
        "scale effect",
        f"At equal Froude number the ship's Reynolds number is {ratio:.4g} times the model's{model_number}: its "
        "boundary layer is thinner, its resistance coefficient and the wake at the rudder smaller.",
    )
