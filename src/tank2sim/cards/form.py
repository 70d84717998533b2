"""The form of a ship card: its sections, their keys, and what each may hold.

Values here are in SI and radians (a file may give angles in degrees), but still in the file's own scaling and signs.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
# Bounds of plausibility, far outside anything that was ever built, towed or steered: a number beyond them is a slip of
# the pen or of the unit, and the powers of it in the prime system (up to L^5) leave the range of a float.
Length = Annotated[float, Field(ge=0.01, le=1000.0)]
Speed = Annotated[float, Field(ge=0.001, le=100.0)]
WaterDensity = Annotated[float, Field(ge=1.0, le=20000.0)]
AirDensity = Annotated[float, Field(ge=1e-3, le=100.0)]
Gravity = Annotated[float, Field(ge=0.01, le=1000.0)]
Viscosity = Annotated[float, Field(ge=1e-9, le=1.0)]
TimeConstant = Annotated[float, Field(ge=1e-3, le=1000.0)]
AngularRate = Annotated[float, Field(ge=1e-6, le=1e5)]
Mass = Annotated[float, Field(ge=1e-6, le=1e12)]
Text = Annotated[str, Field(min_length=1)]


def _rising_pair(value: object) -> object:
    """TOML has lists, the form has pairs.

    Raises
    ------
    ValueError
        It is no list of two plausible speeds, the lower first.
    """
    if not isinstance(value, list):
        return value
    numbers = all(isinstance(speed, int | float) and not isinstance(speed, bool) for speed in value)
    if len(value) != 2 or not numbers or not 0 <= value[0] < value[1] <= 100:
        raise ValueError("two speeds, the lower first, from 0 to 100 m/s were expected")
    return tuple(value)


SpeedRange = Annotated[tuple[float, float], BeforeValidator(_rising_pair)]


class Section(BaseModel):
    """A section of a card: frozen, every key known, every number finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class Body(Section):
    """``[ship]`` of a body that only surges: principal particulars, SI."""

    name: Text
    source: Text
    length_m: Length | None = None
    beam_m: Positive | None = None
    draught_m: Positive | None = None
    displacement_kg: Positive | None = None
    block_coefficient: Annotated[float, Field(gt=0, le=1)] | None = None
    speed_trials_mps: Speed | None = None
    projected_area_front_m2: Positive | None = None
    projected_area_side_m2: Positive | None = None
    rudder_area_m2: Positive | None = None
    propeller_diameter_m: Positive | None = None
    metacentric_height_m: float | None = None
    water_depth_m: Positive | None = None
    notes: str | None = None


class Ship(Body):
    """``[ship]`` of a manoeuvring ship, whose length between perpendiculars is the L of the prime system."""

    length_m: Length


class Environment(Section):
    """``[environment]``: water, air and gravity; the defaults are those of the card format."""

    water_density_kgpm3: WaterDensity = 1025.0
    air_density_kgpm3: AirDensity = 1.225
    gravity_mps2: Gravity = 9.80665
    kinematic_viscosity_m2ps: Viscosity = 1.19e-6


class ShipModel(Section):
    """``[model]`` of a manoeuvring ship: what kind of equations, and in which conventions the numbers are given."""

    kind: Literal["linear", "abkowitz"]
    speed_mps: Speed
    scaling: Literal["prime", "dimensional"]
    speed_scale: Literal["instantaneous", "nominal"]
    yaw_rate_terms: Literal["total", "hydrodynamic"]
    rudder_sign: Literal["port", "starboard"]
    valid_speed_mps: SpeedRange | None = None

    @property
    def speed_range_mps(self) -> tuple[float, float]:
        """Speeds (m/s) in which the card holds; by default half to 1.2 times the speed of expansion."""
        return self.valid_speed_mps or (0.5 * self.speed_mps, 1.2 * self.speed_mps)


class SurgeModel(Section):
    """``[model]`` of a body that only surges (eq. 1.5)."""

    kind: Literal["surge"]
    valid_speed_mps: SpeedRange | None = None


class RigidBody(Section):
    """``[rigid_body]``: mass, yaw inertia about the origin, and position of the centre of gravity."""

    mass: Positive
    yaw_inertia: Positive
    x_G: float


class SteeringGear(Section):
    """``[steering_gear]``: first-order lag, rate and angle limits; absent means none."""

    time_constant_s: TimeConstant | None = None
    max_rate_radps: AngularRate | None = None
    max_angle_rad: Annotated[float, Field(gt=0, lt=1.5707963267948966)] | None = None


class Propulsion(Section):
    """``[propulsion]``: the effect of revolutions on surge, ``Xnn`` in the prime system at the speed of expansion."""

    nominal_radps: AngularRate
    Xnn: float


class Surge(Section):
    """``[surge]``: coefficients of (1.5), M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T."""

    total_mass_kg: Mass
    B1_kgs2pm3: float = 0.0
    B2_kgspm2: float = 0.0
    B3_kgpm: float
    force_N: float = 0.0
    dry_mass_kg: Mass | None = None


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
