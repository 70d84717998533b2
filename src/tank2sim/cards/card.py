"""A ship's data in the conventions of the program: prime system, starboard positive, SI, radians."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from tank2sim.cards.covariance import Covariance, covariance_file, not_referring, referring
from tank2sim.cards.craft_terms import body_scales, craft_scale
from tank2sim.cards.form import (
    BodyModel,
    BodySection,
    CraftModel,
    EffectEntry,
    Environment,
    FittedTrial,
    MmgModel,
    MmgPropeller,
    MmgRudder,
    MmgShipSection,
    Propulsion,
    RigidBody,
    Roll,
    ShipModel,
    ShipSection,
    SteeringGear,
    ThrusterSection,
    WavesSection,
)
from tank2sim.cards.scaling import FileScales, OtherPrime, Scales, file_factor
from tank2sim.cards.terms import known_term
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.units import from_si

DEFAULT_RELATIVE_ERROR = 0.02
"""Standard error of a derivative without ``[uncertainty]``, relative to its value (card format)."""


@dataclass(frozen=True)
class Card:
    """A card: its text, and what the text says.

    The text is kept as it was read (comments, line ends and byte order mark), so that a card is written back without
    loss; the other fields are converted from it once.

    Parameters
    ----------
    source : str
        File name, for messages.
    text : str
        The TOML text.
    ship, environment
        Particulars and surroundings, SI.
    model
        Kind of equations.
    covariance : Covariance, optional
        Covariance of the card's numbers, where they were estimated here; a card that was read refers to a file of it
        (:func:`tank2sim.cards.covariance_reading.read_covariance`).
    """

    source: str
    text: str
    ship: BodySection
    environment: Environment
    model: ShipModel | CraftModel | BodyModel
    covariance: Covariance | None = field(default=None, kw_only=True, compare=False, repr=False)

    def files(self, path: Path) -> dict[Path, str | bytes]:
        """The files of the card at `path`: its text, and the covariance next to it if it was estimated here.

        What is not a regular file (a pipe) takes the card alone.
        """
        if self.covariance is None:
            return {path: self.text}
        if path.exists() and not path.is_file():
            return {path: not_referring(self.text)}
        return {path: referring(self.text, path), covariance_file(path): self.covariance.as_text()}

    def save(self, path: str | Path) -> None:
        """Write the card to a file, with its covariance next to it; all or nothing.

        Raises
        ------
        InputError
            A file cannot be written.
        """
        write_together(self.files(Path(path)))

    def fault(self, place: str, problem: str, remedy: str) -> InputError:
        """An error about this card, to be raised: its place, the problem, and the remedy."""
        return InputError(self.source, place, problem, remedy)

    @property
    def speed_range_mps(self) -> tuple[float, float] | None:
        """Speeds through the water (m/s) at which the card holds; None where it states none."""
        return self.model.valid_speed_mps

    def steered(self) -> SteeredCard:
        """The card, if its vessel is steered in the horizontal plane, by a rudder or by thrusters.

        Raises
        ------
        InputError
            It is not: a towed body, a yaw rig or a glider.
        """
        raise self.fault("model.kind", NOT_STEERED, f"give {SHIP_KINDS} card, or one of kind small_craft")

    def manoeuvring(self) -> ManoeuvringCard:
        """The card, if its ship is steered by a rudder.

        Raises
        ------
        InputError
            It is not: a towed body, a yaw rig, a glider or a craft with thrusters.
        """
        raise self.fault("model.kind", NOT_STEERED, f"give {SHIP_KINDS} card")


SHIP_KINDS = "a linear, abkowitz or mmg"
NOT_STEERED = "is not a manoeuvring ship: it has no rudder"


class SteeredBy(StrEnum):
    """Means of steering a vessel."""

    RUDDER = "rudder"
    THRUSTERS = "thrusters"


@dataclass(frozen=True)
class SteeredCard(Card):
    """Card of a vessel that is steered in the horizontal plane, by a rudder or by thrusters.

    Parameters
    ----------
    rigid_body : RigidBody
        Mass, yaw inertia and x_G, all about the origin: prime for a ship, SI for a craft.
    derivatives : mapping
        Canonical name to value, prime or SI as the rigid body, rudder positive to starboard; absent means 0.
    uncertainty : mapping
        Canonical name to standard error, same scaling; absent means :data:`DEFAULT_RELATIVE_ERROR`.
    places : mapping
        Canonical name to the key under which the file has it.
    spelt : mapping
        Place of an angle or a rate in SI (``effects.0.parameters.direction_rad``) to its place in the file
        (``effects.0.parameters.direction_deg``).
    roll : Roll, optional
        What makes roll a degree of freedom; its inertia is prime.
    effects : tuple
        Effects on top of the hull's forces, in the order of the file.
    thrusters : tuple of ThrusterSection
        Thrusters of a craft; none of a ship with a rudder.
    """

    ship: ShipSection
    model: ShipModel | CraftModel
    rigid_body: RigidBody
    derivatives: Mapping[str, float]
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    places: Mapping[str, str] = field(default_factory=dict)
    spelt: Mapping[str, str] = field(default_factory=dict)
    roll: Roll | None = None
    steering_gear: SteeringGear | None = None
    propulsion: Propulsion | None = None
    effects: tuple[EffectEntry, ...] = ()
    thrusters: tuple[ThrusterSection, ...] = ()

    @property
    def steered_by(self) -> SteeredBy:
        """Means of steering the vessel."""
        return SteeredBy.THRUSTERS if self.thrusters else SteeredBy.RUDDER

    @property
    def speed_range_mps(self) -> tuple[float, float]:
        """Speeds through the water (m/s) at which the card holds, stated or usual."""
        return self.model.speed_range_mps

    @property
    def scales(self) -> Scales:
        """Density, length and speed, which make the numbers of the vessel non-dimensional."""
        return Scales(self.environment.water_density_kgpm3, self.ship.length_m, self.model.speed_mps)

    @property
    def file_scales(self) -> FileScales | None:
        """System of the numbers in the card's text; None for the prime system."""
        return scales_of_file(self.ship, self.environment, self.model)

    @property
    def body_si(self) -> dict[str, float]:
        """``mass`` (kg), ``yaw_inertia`` (kg m2) and ``x_G`` (m)."""
        raise NotImplementedError

    @property
    def body_file_factors(self) -> dict[str, float]:
        """Factor from each number of :attr:`body_si` to the number of the card's text."""
        in_file = self.file_scales
        known = body_scales(in_file) if in_file else {}
        return {key: known.get(key, 1.0) / scale for key, scale in body_scales(self.scales).items()}

    def file_factor(self, name: str) -> float:
        """Factor from a derivative (canonical name) to the number of the card's text."""
        raise NotImplementedError

    def steered(self) -> SteeredCard:
        """The card itself."""
        return self

    def in_file(self, place: str, value: float) -> tuple[str, float]:
        """Place and value as the file has them, from those in SI: for messages about an angle."""
        spelling = self.spelt.get(place, place)
        return spelling, from_si(spelling, value)

    def standard_error(self, name: str) -> float:
        """Standard error of a derivative, in its scaling: as stated, or the default share of its value."""
        return self.uncertainty.get(name, DEFAULT_RELATIVE_ERROR * abs(self.derivatives.get(name, 0.0)))


OPPOSITE = {"R0": ("X0", -1.0), "mx": ("Xudot", -1.0), "my": ("Yvdot", -1.0), "Jz": ("Nrdot", -1.0)}
"""Names of the MMG method in ``[derivatives]``: R_0', m_x', m_y', J_z' to the derivative and the factor."""


def scales_of_file(ship: ShipSection, environment: Environment, model: ShipModel | CraftModel) -> FileScales | None:
    """System of the numbers in a card's text, by its ``scaling``; None for the prime system.

    Raises
    ------
    KeyError
        The card lacks the particular (its key) that the scaling needs.
    """
    scales = Scales(environment.water_density_kgpm3, ship.length_m, model.speed_mps)
    if model.scaling == "dimensional":
        return scales
    if model.scaling == "prime_ii":
        if ship.draught_m is None:
            raise KeyError("draught_m")
        return OtherPrime(scale=ship.length_m / ship.draught_m)
    if model.scaling == "bis":
        if ship.displacement_kg is None:
            raise KeyError("displacement_kg")
        froude = model.speed_mps / (environment.gravity_mps2 * ship.length_m) ** 0.5
        return OtherPrime(froude=froude, ship_mass=ship.displacement_kg / scales.mass)
    return None


@dataclass(frozen=True)
class ManoeuvringCard(SteeredCard):
    """Card of a ship with a rudder, in the prime system.

    Parameters
    ----------
    model : ShipModel
        Kind of equations; ``speed_scale`` and ``yaw_rate_terms`` hold for the numbers below, the file's ``scaling`` and
        ``rudder_sign`` only for the text.
    waves : WavesSection, optional
        What regular waves do to the ship.
    fitted_trials : tuple
        Trials that the card was fitted to.
    """

    model: ShipModel
    waves: WavesSection | None = None
    fitted_trials: tuple[FittedTrial, ...] = ()

    def manoeuvring(self) -> ManoeuvringCard:
        """The card itself."""
        return self

    @property
    def body_si(self) -> dict[str, float]:
        """``mass`` (kg), ``yaw_inertia`` (kg m2) and ``x_G`` (m)."""
        return {key: getattr(self.rigid_body, key) * scale for key, scale in body_scales(self.scales).items()}

    def file_factor(self, name: str) -> float:
        """Factor from a derivative (canonical name; prime, starboard) to the number of the card's text."""
        to_port = self.model.rudder_sign == "port"
        sign = OPPOSITE.get(self.places.get(name, name), (name, 1.0))[1]
        return sign * file_factor(known_term(name), self.file_scales, rudder_to_port=to_port)


@dataclass(frozen=True)
class MmgCard(ManoeuvringCard):
    """Card of a ship by the MMG method: its hull is in ``derivatives`` (prime), X0 = -R_0', Xudot = -m_x' and so on.

    Parameters
    ----------
    propeller : MmgPropeller
        With k_0 to k_2, also where the file has a table.
    rudder : MmgRudder
        With f_alpha, also where the file has an aspect ratio.
    interaction_errors : mapping
        Standard errors of numbers in ``[propeller]`` and ``[rudder]``, by key.
    """

    ship: MmgShipSection
    model: MmgModel
    propeller: MmgPropeller = field(kw_only=True)
    rudder: MmgRudder = field(kw_only=True)
    interaction_errors: Mapping[str, float] = field(default_factory=dict, kw_only=True)

    def interaction_places(self) -> dict[str, str]:
        """Key of each number of ``[propeller]`` and ``[rudder]`` that is a coefficient, to its dotted place."""
        return {
            **{key: f"propeller.{key}" for key in PROPELLER_COEFFICIENTS if getattr(self.propeller, key) is not None},
            **{key: f"rudder.{key}" for key in RUDDER_COEFFICIENTS if getattr(self.rudder, key) is not None},
        }

    def interaction_error(self, key: str) -> float:
        """Standard error of a coefficient of propeller or rudder: as stated, or the default share of its value."""
        return self.interaction_errors.get(key, DEFAULT_RELATIVE_ERROR * abs(self.interaction(key)))

    def interaction(self, key: str) -> float:
        """A coefficient of propeller or rudder."""
        section = self.propeller if key in PROPELLER_COEFFICIENTS else self.rudder
        return float(getattr(section, key))


WAKE_BY_DRIFT = (("C_1", "C_2_plus", "C_2_minus"), ("tau", "C_Pv", "C_Pr"))
"""The keys of either form of the wake's change by drift and yaw."""

CROSS_FLOW_AT_RUDDER = (("l_R", "gamma_R_plus", "gamma_R_minus"), ("C_Rv", "C_Rr", "C_Rrrr", "C_Rrrv"))
"""The keys of either form of the cross flow to the rudder."""

TORQUE_COEFFICIENTS = ("q_0", "q_1", "q_2", "eta_R")
"""Keys that only the torque depends on; no motion shows them."""

PROPELLER_COEFFICIENTS = (
    *("k_0", "k_1", "k_2", "t_P", "w_P0", "x_P"),
    *(*WAKE_BY_DRIFT[0], *WAKE_BY_DRIFT[1], "astern", *TORQUE_COEFFICIENTS),
)
RUDDER_COEFFICIENTS = (
    *("f_alpha", "t_R", "a_H", "x_H", "x_R", "eta", "eps", "kappa"),
    *(*CROSS_FLOW_AT_RUDDER[0], *CROSS_FLOW_AT_RUDDER[1]),
)
"""Keys of the coefficients in ``[propeller]`` and ``[rudder]``, which are parameters ``mmg.*`` of the model."""


@dataclass(frozen=True)
class CraftCard(SteeredCard):
    """Card of a small craft with thrusters: Fossen's equations in three degrees of freedom, SI.

    Parameters
    ----------
    derivatives : mapping
        Name (:data:`tank2sim.cards.craft_terms.CRAFT_TERMS`) to value, SI; absent means 0.
    effects : tuple of EffectEntry
        Current, wind and others that a craft can have.
    """

    model: CraftModel
    roll: None = None

    def manoeuvring(self) -> ManoeuvringCard:
        """Raise InputError: a craft has no rudder."""
        remedy = f"craft with thrusters are taken by {CRAFT_COMMANDS}"
        raise self.fault("model.kind", f"is {self.model.kind}, and this is for ships with a rudder", remedy)

    @property
    def body_si(self) -> dict[str, float]:
        """``mass`` (kg), ``yaw_inertia`` (kg m2) and ``x_G`` (m)."""
        return {key: getattr(self.rigid_body, key) for key in body_scales(self.scales)}

    def file_factor(self, name: str) -> float:
        """Factor from a derivative (SI) to the number of the card's text."""
        return 1 / craft_scale(name, self.scales) if self.model.scaling == "prime" else 1.0


CRAFT_COMMANDS = (
    "identify, validate, compare, gap, simulate, stability, autopilot, influence, convert, export, steer, serve"
)
"""Commands that take the card of a craft with thrusters."""
