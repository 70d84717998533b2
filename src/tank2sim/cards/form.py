"""The form of a ship card: its sections, their keys, and what each may hold.

Values here are in SI and radians (a file may give angles in degrees), but still in the file's own scaling and signs.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from tank2sim.cards.wave_table import wave_table
from tank2sim.quantities import (
    Area,
    BlockCoefficient,
    BodyPlace,
    Breadth,
    Draught,
    Length,
    Mass,
    Speed,
    TimeConstant,
    Viscosity,
    WaterDensity,
    WaterDepth,
)

Positive = Annotated[float, Field(gt=0)]
AirDensity = Annotated[float, Field(gt=0.3, lt=2.0)]
"""kg/m3. Air has 1.23 at sea level and 15 deg, 1.5 at -40 deg, 0.7 on the highest lakes."""
Gravity = Annotated[float, Field(gt=9.7, lt=9.9)]
"""On Earth: 9.764 m/s2 (Huascaran) to 9.834 (Arctic Ocean), EGM2008; wider by half a percent."""
AngularRate = Annotated[float, Field(ge=1e-6, le=1e5)]
Text = Annotated[str, Field(min_length=1)]


DRIFT_OF_CAPTIVE_TESTS, YAW_RATE_OF_CAPTIVE_TESTS = 0.5235987755982988, 1.0
"""Drift angle (rad, 30 deg) and abs(r') (a turn of one length of radius) up to which a card that states no others is
taken to hold: captive tests seldom go further. Project choice."""


ASTERN_THRUST = 0.765
"""Thrust at rest of a reversed propeller over that ahead: 0.251/0.328 of the Esso Osaka's (Miyauchi et al. 2022)."""


def _rising_pair(value: object) -> object:
    """Pair of two plausible speeds, the lower first, from a list (TOML has no pairs); else ValueError."""
    if not isinstance(value, list):
        return value
    numbers = all(isinstance(speed, int | float) and not isinstance(speed, bool) for speed in value)
    if len(value) != 2 or not numbers or not 0 <= value[0] < value[1] <= 100:
        raise ValueError("two speeds, the lower first, from 0 to 100 m/s were expected")
    return tuple(value)


SpeedRange = Annotated[tuple[float, float], BeforeValidator(_rising_pair)]


class CardSection(BaseModel):
    """A section of a card: frozen, every key known, every number finite."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class BodySection(CardSection):
    """``[ship]`` of a body that only surges: principal particulars, SI."""

    name: Text
    source: Text
    length_m: Length | None = None
    beam_m: Breadth | None = None
    draught_m: Draught | None = None
    displacement_kg: Mass | None = None
    block_coefficient: BlockCoefficient | None = None
    speed_trials_mps: Speed | None = None
    projected_area_front_m2: Area | None = None
    projected_area_side_m2: Area | None = None
    rudder_area_m2: Area | None = None
    propeller_diameter_m: Breadth | None = None
    metacentric_height_m: float | None = None
    water_depth_m: WaterDepth | None = None
    notes: str | None = None


class ShipSection(BodySection):
    """``[ship]`` of a manoeuvring ship, whose length between perpendiculars is the L of the prime system."""

    length_m: Length


class Environment(CardSection):
    """``[environment]``: water, air and gravity; defaults as in the card format."""

    water_density_kgpm3: WaterDensity = 1025.0
    air_density_kgpm3: AirDensity = 1.225
    gravity_mps2: Gravity = 9.80665
    kinematic_viscosity_m2ps: Viscosity = 1.19e-6


class ShipModel(CardSection):
    """``[model]`` of a manoeuvring ship: what kind of equations, and in which conventions the numbers are given."""

    kind: Literal["linear", "abkowitz", "mmg"]
    speed_mps: Speed
    scaling: Literal["prime", "prime_ii", "bis", "dimensional"]
    speed_scale: Literal["instantaneous", "nominal"]
    yaw_rate_terms: Literal["total", "hydrodynamic"]
    rudder_sign: Literal["port", "starboard"]
    valid_speed_mps: SpeedRange | None = None
    valid_drift_rad: Annotated[float, Field(ge=0, le=1.5707963267948966)] = DRIFT_OF_CAPTIVE_TESTS
    valid_rudder_rad: Annotated[float, Field(ge=0, le=1.5707963267948966)] | None = None
    valid_yaw_rate_prime: Annotated[float, Field(ge=0, le=10)] = YAW_RATE_OF_CAPTIVE_TESTS
    low_speed_below_mps: Annotated[float, Field(ge=0, le=100)] | None = None

    @property
    def speed_range_mps(self) -> tuple[float, float]:
        """Speeds (m/s) in which the card holds; by default half to 1.2 times the speed of expansion."""
        return self.valid_speed_mps or (0.5 * self.speed_mps, 1.2 * self.speed_mps)

    @property
    def low_speed_bound_mps(self) -> float:
        """Speed (m/s) below which the forces at low speed replace the polynomial; by default the lowest of the card."""
        return self.speed_range_mps[0] if self.low_speed_below_mps is None else self.low_speed_below_mps


LOWEST_OF_MMG = 0.2
"""Lowest speed over the speed of approach at which an MMG card that states no other is taken to hold: below that of any
steady turn (a tanker at full rudder keeps 0.35), for its coefficients do not depend on speed. Project choice."""


class MmgModel(ShipModel):
    """``[model]`` of an MMG card: conventions of the method, except for the scaling."""

    kind: Literal["mmg"]
    scaling: Literal["prime", "prime_ii", "bis", "dimensional"] = "prime_ii"
    speed_scale: Literal["instantaneous"] = "instantaneous"
    yaw_rate_terms: Literal["hydrodynamic"] = "hydrodynamic"
    rudder_sign: Literal["starboard"] = "starboard"

    @property
    def speed_range_mps(self) -> tuple[float, float]:
        """Speeds (m/s) in which the card holds; by default 0.2 to 1.2 times the speed of approach."""
        return self.valid_speed_mps or (LOWEST_OF_MMG * self.speed_mps, 1.2 * self.speed_mps)


class BodyModel(CardSection):
    """``[model]`` of a body that is neither a ship nor a craft."""

    kind: str
    valid_speed_mps: SpeedRange | None = None


class BodyForm(CardSection):
    """The card of such a body, as in its file; each kind has sections of its own in addition."""

    format: Literal["tank2sim-ship/1"]
    ship: BodySection
    environment: Environment = Environment()
    model: BodyModel


Uncertainty = dict[str, Annotated[float, Field(ge=0)]]
"""``[uncertainty]``: key of a coefficient to its standard error, in the coefficient's unit."""


class CraftModel(CardSection):
    """``[model]`` of a small craft with thrusters: Fossen's equations in three degrees of freedom.

    Parameters
    ----------
    kind : str
    speed_mps : float
        Cruising speed, m/s, at which runs start; and, with ``scaling = "prime"``, V of the prime system.
    scaling : str
        Scaling of ``[rigid_body]``, ``[derivatives]`` and ``[uncertainty]``: ``dimensional`` is SI.
    valid_speed_mps : pair of float, optional
        Speeds through the water at which the card holds; by default 0 to 1.2 times the cruising speed.
    """

    kind: Literal["small_craft"]
    speed_mps: Speed
    scaling: Literal["dimensional", "prime"] = "dimensional"
    valid_speed_mps: SpeedRange | None = None

    @property
    def speed_range_mps(self) -> tuple[float, float]:
        """Speeds (m/s) in which the card holds; by default rest to 1.2 times the cruising speed."""
        return self.valid_speed_mps or (0.0, 1.2 * self.speed_mps)


class RigidBody(CardSection):
    """``[rigid_body]``: mass, yaw inertia about the origin, and position of the centre of gravity."""

    mass: Positive
    yaw_inertia: Positive
    x_G: float


class Roll(CardSection):
    """``[roll]``: what makes roll a degree of freedom; ``ship.metacentric_height_m`` and terms of K belong to it.

    Parameters
    ----------
    roll_inertia : float
        I_x of the ship about the longitudinal axis through the origin.
    z_G : float
        Centre of gravity below the origin, over L.
    z_R : float
        Where the rudder's sway force acts below the origin, over L (z'_R of Son and Nomoto): K = -z_R L Y_R.
    l_x : float
        Where the added mass in surge acts below the origin, over L: K = m_x l_x L u r.
    """

    roll_inertia: Positive
    z_G: float = 0.0
    z_R: float = 0.0
    l_x: float = 0.0


class SteeringGear(CardSection):
    """``[steering_gear]``: first-order lag, rate and angle limits; absent means none."""

    time_constant_s: TimeConstant | None = None
    max_rate_radps: AngularRate | None = None
    max_angle_rad: Annotated[float, Field(gt=0, lt=1.5707963267948966)] | None = None


class Propulsion(CardSection):
    """``[propulsion]``: the effect of revolutions on surge, ``Xnn`` in the prime system at the speed of expansion."""

    nominal_radps: AngularRate
    Xnn: float


class MmgShipSection(ShipSection):
    """``[ship]`` of an MMG card, whose propeller and rudder need their sizes."""

    draught_m: Draught
    propeller_diameter_m: Breadth
    rudder_area_m2: Area


class MmgPropulsion(CardSection):
    """``[propulsion]`` of an MMG card: revolutions of the approach; absent, those that hold ``model.speed_mps``."""

    nominal_radps: AngularRate | None = None


Share = Annotated[float, Field(gt=-1, lt=1)]
Place = Annotated[float, Field(ge=-2, le=2)]
Coefficient = Annotated[float, Field(ge=-1e3, le=1e3)]
CardNotNegative = Annotated[float, Field(ge=0, le=1e3)]


class MmgPropeller(CardSection):
    """``[propeller]`` of an MMG card.

    Parameters
    ----------
    number : int
        1, or 2 side by side at ``y_P`` to either side.
    k_0, k_1, k_2 : float, optional
        K_T = k_0 + k_1 J + k_2 J^2.
    q_0, q_1, q_2 : float, optional
        K_Q = q_0 + q_1 J + q_2 J^2, for torque and power.
    J, K_T, K_Q : list of float, optional
        Points of the open-water curves in their place.
    eta_R : float, optional
        Relative rotative efficiency, torque in open water over that behind the hull; 1 unless given.
    t_P : float
        Thrust deduction, constant.
    w_P0 : float
        Wake fraction straight ahead.
    x_P, y_P : float
        Place of the propeller over L, positive forward and (of the right one) to starboard.
    C_1, C_2_plus, C_2_minus : float, optional
        Change of the wake by drift; without them it is constant.
    tau, C_Pv, C_Pr : float, optional
        In their place: (1 - w_P0) + tau ((v' + x_P r')^2 + C_Pv v' + C_Pr r') instead of 1 - w_P.
    astern : float
        Thrust at rest with reversed revolutions over that with the same ahead.
    """

    number: Literal[1, 2] = 1
    k_0: Coefficient | None = None
    k_1: Coefficient | None = None
    k_2: Coefficient | None = None
    J: list[float] | None = None
    K_T: list[float] | None = None
    q_0: Coefficient | None = None
    q_1: Coefficient | None = None
    q_2: Coefficient | None = None
    K_Q: list[float] | None = None
    eta_R: Annotated[float, Field(gt=0, le=2)] | None = None
    t_P: Share
    w_P0: Share
    x_P: Place = -0.5
    y_P: Place | None = None
    C_1: CardNotNegative | None = None
    C_2_plus: Positive | None = None
    C_2_minus: Positive | None = None
    tau: Coefficient | None = None
    C_Pv: Coefficient | None = None
    C_Pr: Coefficient | None = None
    astern: CardNotNegative = ASTERN_THRUST


class MmgRudder(CardSection):
    """``[rudder]`` of an MMG card.

    Parameters
    ----------
    number : int
        1, or 2 side by side at ``y_R`` to either side; ``ship.rudder_area_m2`` is the area of one.
    height_m : float
        H_R.
    aspect_ratio, f_alpha : float, optional
        Lambda, or the slope of the normal force at zero angle in its place.
    t_R, a_H, x_H, x_R : float
        Interaction with the hull; places over L, positive forward.
    y_R : float, optional
        Place of the right one of two, over L.
    eta : float, optional
        Share of the rudder in the propeller's race; by default D_P/H_R.
    eps, kappa, l_R, gamma_R_plus, gamma_R_minus : float
        Flow to the rudder; gamma_R for positive and for negative beta_R.
    C_Rv, C_Rr, C_Rrrr, C_Rrrv : float, optional
        In place of l_R and gamma_R: v_R' = -(C_Rv v' + C_Rr r' + C_Rrrr r'^3 + C_Rrrv r'^2 v').
    """

    number: Literal[1, 2] = 1
    height_m: Breadth
    aspect_ratio: Positive | None = None
    f_alpha: Positive | None = None
    t_R: Share
    a_H: Coefficient
    x_H: Place
    x_R: Place = -0.5
    y_R: Place | None = None
    eta: Annotated[float, Field(gt=0, le=1)] | None = None
    eps: Positive
    kappa: CardNotNegative
    l_R: Place | None = None
    gamma_R_plus: Coefficient | None = None
    gamma_R_minus: Coefficient | None = None
    C_Rv: Coefficient | None = None
    C_Rr: Coefficient | None = None
    C_Rrrr: Coefficient | None = None
    C_Rrrv: Coefficient | None = None


class ThrusterSection(CardSection):
    """One of ``[[thrusters]]`` of a small craft: its place, thrust curve and limits, SI.

    T = k n|n| - l max(n, 0) u_T, n its revolutions (rad/s, positive ahead), k ``ahead_Ns2`` for n > 0 and
    ``astern_Ns2`` for n < 0, u_T (m/s) the craft's velocity through the water along the thruster.

    Parameters
    ----------
    name : str
        Small letters, digits and ``_``: it is in the names of the model's variables.
    x_m, y_m : float
        Place, m forward and to starboard of the origin.
    azimuth_rad : float
        Direction in which it pushes the craft with n > 0, rad clockwise from the bow.
    ahead_Ns2, astern_Ns2 : float
        Thrust over the square of the revolutions at rest, N s^2.
    speed_loss_kg : float
        l: loss of thrust by revolutions ahead (rad/s) and speed (m/s), N s^2/m = kg.
    max_radps, max_astern_radps : float
        Largest revolutions, either way; astern by default as ahead.
    dead_band_radps : float
        Orders that are no larger leave the propeller at rest.
    order_exponent : float, optional
        e: an order o, within its largest m, goes to the revolutions m (o/m)^e. By default, with e = 1, these are the
        order. Pulses of controllers without a speed loop have less than 1.
    time_constant_s : float, optional
        Lag of the revolutions behind their order; by default none.
    max_azimuth_rad : float, optional
        An azimuth or outboard: how far it turns to either side of ``azimuth_rad``.
    azimuth_time_constant_s, max_azimuth_rate_radps : float, optional
        Lag and largest rate of that turn; the lag is required with ``max_azimuth_rad``.
    uncertainty : dict
        Standard errors of ``ahead_Ns2``, ``astern_Ns2``, ``speed_loss_kg``, ``dead_band_radps``, ``order_exponent``,
        ``time_constant_s``.
    """

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,30}$")]
    x_m: BodyPlace = 0.0
    y_m: BodyPlace = 0.0
    azimuth_rad: Annotated[float, Field(ge=-6.283185307179586, le=6.283185307179586)] = 0.0
    ahead_Ns2: Annotated[float, Field(ge=1e-9, le=1e6)]
    astern_Ns2: Annotated[float, Field(ge=0.0, le=1e6)]
    speed_loss_kg: Annotated[float, Field(ge=0.0, le=1e6)] = 0.0
    max_radps: AngularRate
    max_astern_radps: AngularRate | None = None
    dead_band_radps: Annotated[float, Field(ge=0.0, le=1e5)] = 0.0
    order_exponent: Annotated[float, Field(ge=0.1, le=5.0)] | None = None
    time_constant_s: TimeConstant | None = None
    max_azimuth_rad: Annotated[float, Field(gt=0, le=6.283185307179586)] | None = None
    azimuth_time_constant_s: TimeConstant | None = None
    max_azimuth_rate_radps: AngularRate | None = None
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}

    @property
    def largest_thrust_N(self) -> float:
        """Thrust at rest at the largest revolutions ahead, N."""
        return self.ahead_Ns2 * self.max_radps**2

    @property
    def lowest_radps(self) -> float:
        """Largest revolutions astern, rad/s, negative."""
        return -(self.max_radps if self.max_astern_radps is None else self.max_astern_radps)


class WavesSection(CardSection):
    """``[waves]``: what regular waves of unit amplitude do to the ship at rest, by frequency and direction.

    Parameters
    ----------
    source : str
        Where the numbers come from.
    columns : list of str
        What each number of a row is (:mod:`tank2sim.cards.wave_table`).
    rows : list of list of float
        One for each frequency and direction, in any order.

    Raises
    ------
    ValueError
        A column is unknown, or the rows are not a table of all frequencies and directions.
    """

    source: Text
    columns: Annotated[list[str], Field(max_length=100)]
    rows: Annotated[list[Annotated[list[float], Field(max_length=100)]], Field(max_length=10_000)]

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        wave_table(self.columns, self.rows)
        return self


class EffectEntry(CardSection):
    """One of ``[[effects]]``: its name, parameters (SI) and their standard errors."""

    name: Text
    parameters: dict[str, float] = {}
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}


class FittedTrial(CardSection):
    """One of ``[[fitted_trials]]``: a trial that the card was fitted to, and some of its rows to know it by.

    Parameters
    ----------
    name : str
        Name of its file, without ending.
    t_s : list of float
        Times of these rows, rising.
    signals : mapping
        Name of the trial format in SI (``psi_rad``) to values at these times, at the size of the card's ship.

    Raises
    ------
    ValueError
        Times do not rise, or a signal has not as many values as there are times.
    """

    name: Text
    t_s: Annotated[list[float], Field(max_length=1000)] = []
    signals: dict[str, Annotated[list[float], Field(max_length=1000)]] = {}

    @model_validator(mode="after")
    def _is_a_table(self) -> Self:
        if any(later <= earlier for earlier, later in pairwise(self.t_s)):
            raise ValueError("times t_s that rise were expected")
        for name, values in self.signals.items():
            if len(values) != len(self.t_s):
                raise ValueError(f"{name} has {len(values)} values and t_s {len(self.t_s)}: as many were expected")
        return self


class ShipCard(CardSection):
    """A manoeuvring ship's card, as in its file."""

    format: Literal["tank2sim-ship/1"]
    ship: ShipSection
    environment: Environment = Environment()
    model: ShipModel
    rigid_body: RigidBody
    derivatives: dict[str, float]
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}
    roll: Roll | None = None
    steering_gear: SteeringGear | None = None
    propulsion: Propulsion | None = None
    waves: WavesSection | None = None
    effects: list[EffectEntry] = []
    fitted_trials: list[FittedTrial] = []


class MmgForm(ShipCard):
    """The card of a ship by the MMG method, as in its file."""

    ship: MmgShipSection
    model: MmgModel
    propulsion: MmgPropulsion | None = None  # type: ignore[assignment]
    propeller: MmgPropeller
    rudder: MmgRudder


class CraftForm(CardSection):
    """The card of a small craft with thrusters, as in its file."""

    format: Literal["tank2sim-ship/1"]
    ship: ShipSection
    environment: Environment = Environment()
    model: CraftModel
    rigid_body: RigidBody
    derivatives: dict[str, float]
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = {}
    thrusters: Annotated[list[ThrusterSection], Field(min_length=1, max_length=8)]
    effects: list[EffectEntry] = []
