"""The form of a ship card: its sections, their keys, and what each may hold.

Values here are in SI and radians (a file may give angles in degrees), but still in the file's own scaling and signs.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0)]
Text = Annotated[str, Field(min_length=1)]


class Section(BaseModel):
    """A section of a card: frozen, every key known, every number finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class Body(Section):
    """``[ship]`` of a body that only surges: principal particulars, SI."""

    name: Text
    source: Text
    length_m: Positive | None = None
    beam_m: Positive | None = None
    draught_m: Positive | None = None
    displacement_kg: Positive | None = None
    block_coefficient: Annotated[float, Field(gt=0, le=1)] | None = None
    speed_trials_mps: Positive | None = None
    projected_area_front_m2: Positive | None = None
    projected_area_side_m2: Positive | None = None
    rudder_area_m2: Positive | None = None
    propeller_diameter_m: Positive | None = None
    metacentric_height_m: float | None = None
    water_depth_m: Positive | None = None
    notes: str | None = None


class Ship(Body):
    """``[ship]`` of a manoeuvring ship, whose length between perpendiculars is the L of the prime system."""

    length_m: Positive


class Environment(Section):
    """``[environment]``: water, air and gravity; the defaults are those of the card format."""

    water_density_kgpm3: Positive = 1025.0
    air_density_kgpm3: Positive = 1.225
    gravity_mps2: Positive = 9.80665
    kinematic_viscosity_m2ps: Positive = 1.19e-6


class ShipModel(Section):
    """``[model]`` of a manoeuvring ship: what kind of equations, and in which conventions the numbers are given."""

    kind: Literal["linear", "abkowitz"]
    speed_mps: Positive
    scaling: Literal["prime", "dimensional"]
    speed_scale: Literal["instantaneous", "nominal"]
    yaw_rate_terms: Literal["total", "hydrodynamic"]
    rudder_sign: Literal["port", "starboard"]
    valid_speed_mps: tuple[float, float] | None = None

    @model_validator(mode="before")
    @classmethod
    def _range_from_list(cls, values: object) -> object:
        return with_tuple(values, "valid_speed_mps")

    @property
    def speed_range_mps(self) -> tuple[float, float]:
        """Speeds (m/s) in which the card holds; by default half to 1.2 times the speed of expansion."""
        return self.valid_speed_mps or (0.5 * self.speed_mps, 1.2 * self.speed_mps)


class SurgeModel(Section):
    """``[model]`` of a body that only surges (eq. 1.5)."""

    kind: Literal["surge"]
    valid_speed_mps: tuple[float, float] | None = None

    @model_validator(mode="before")
    @classmethod
    def _range_from_list(cls, values: object) -> object:
        return with_tuple(values, "valid_speed_mps")


class RigidBody(Section):
    """``[rigid_body]``: mass, yaw inertia about the origin, and position of the centre of gravity."""

    mass: Positive
    yaw_inertia: Positive
    x_G: float


class SteeringGear(Section):
    """``[steering_gear]``: first-order lag, rate and angle limits; absent means none."""

    time_constant_s: Positive | None = None
    max_rate_radps: Positive | None = None
    max_angle_rad: Annotated[float, Field(gt=0, lt=1.5707963267948966)] | None = None


class Propulsion(Section):
    """``[propulsion]``: the effect of revolutions on surge, ``Xnn`` in the prime system at the speed of expansion."""

    nominal_radps: Positive
    Xnn: float


class Surge(Section):
    """``[surge]``: coefficients of (1.5), M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T."""

    total_mass_kg: Positive
    B1_kgs2pm3: float = 0.0
    B2_kgspm2: float = 0.0
    B3_kgpm: float
    force_N: float = 0.0
    dry_mass_kg: Positive | None = None


class EffectEntry(Section):
    """One of ``[[effects]]``: its name, parameters (SI) and their standard errors."""

    name: Text
    parameters: dict[str, float] = {}
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}


class ShipCard(Section):
    """A manoeuvring ship's card, as in its file."""

    format: Literal["tank2sim-ship/1"]
    ship: Ship
    environment: Environment = Environment()
    model: ShipModel
    rigid_body: RigidBody
    derivatives: dict[str, float]
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}
    steering_gear: SteeringGear | None = None
    propulsion: Propulsion | None = None
    effects: list[EffectEntry] = []


class SurgeCard(Section):
    """The card of a body that only surges, as in its file."""

    format: Literal["tank2sim-ship/1"]
    ship: Body
    environment: Environment = Environment()
    model: SurgeModel
    surge: Surge
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}


FORMS: dict[str, type[ShipCard] | type[SurgeCard]] = {"linear": ShipCard, "abkowitz": ShipCard, "surge": SurgeCard}
"""Kind of model to the form of its card."""


def with_tuple(values: object, key: str) -> object:
    """TOML has lists, the form has pairs: a list of two rising numbers becomes a tuple.

    Raises
    ------
    ValueError
        The pair does not rise.
    """
    if isinstance(values, dict) and isinstance(values.get(key), list):
        pair = tuple(values[key])
        numbers = all(isinstance(value, int | float) for value in pair)
        if len(pair) != 2 or not numbers or not 0 <= pair[0] < pair[1]:
            raise ValueError(f"{key} must be two speeds, the lower first")
        return {**values, key: pair}
    return values
