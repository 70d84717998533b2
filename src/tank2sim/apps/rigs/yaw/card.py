"""The card of a body on the yaw rig: (3) of paper 3 (Alyshev 2019)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from tank2sim.cards.card import Card
from tank2sim.cards.form import CardSection, Uncertainty
from tank2sim.quantities import Length, MotorCurrent, TimeConstant, TorqueConstant, YawInertia


class TankWalls(CardSection):
    """``[yaw_rig.walls]``: a rectangular tank, and the coefficients of lambda_66l and f_66l; SI.

    Each is c_a/(l_a + 1) + c_f/(l_f + 1), l_a and l_f in m from the ends of the waterline to the nearest wall. (Paper 3
    says "the flat wall"; the nearest of the four is our choice. Its a is the bow, its f the stern.)

    Parameters
    ----------
    length_m, breadth_m : float
        The tank, along the body's axis at psi = 0 and across it.
    x_m, y_m : float
        Axis of rotation, from the middle of the tank.
    body_length_m : float
        On the waterline.
    bow_inertia_kgm2, stern_inertia_kgm2 : float
        lambda_66a0, lambda_66f0.
    bow_damping_Nms, stern_damping_Nms : float
        f_66a0, f_66f0, N m s.

    Raises
    ------
    ValueError
        The body strikes the walls when it turns.
    """

    length_m: Length = 1.6
    breadth_m: Length = 1.4
    x_m: float = 0.0
    y_m: float = 0.0
    body_length_m: Length
    bow_inertia_kgm2: float = 0.0
    stern_inertia_kgm2: float = 0.0
    bow_damping_Nms: float = 0.0
    stern_damping_Nms: float = 0.0

    @model_validator(mode="after")
    def _holds_the_body(self) -> Self:
        reach = self.body_length_m / 2
        if abs(self.x_m) + reach >= self.length_m / 2 or abs(self.y_m) + reach >= self.breadth_m / 2:
            raise ValueError(f"a body of {self.body_length_m:g} m strikes the walls of the tank when it turns")
        return self


class YawRig(CardSection):
    """``[yaw_rig]``: coefficients of (3) of paper 3, motor, current loop and encoder, SI.

    Parameters
    ----------
    inertia_kgm2 : float
        J_zz, of the body with the rotor of the motor.
    added_inertia_kgm2 : float
        lambda_661; 0 in air.
    coulomb_Nm, viscous_Nms, quadratic_Nms2 : float
        f_c, f_1 (in water f_12 + f_661), f_662.
    torque_constant_NmpA, current_lag_s, max_current_A : float
        k_t, T_c, and the largest current asked of the motor.
    inertia_accelerating_kgm2, inertia_braking_kgm2 : float
        lambda_662a, lambda_662d at 1 rad/s.
    braking_quadratic_Nms2 : float, optional
        f_662d; by default `quadratic_Nms2`, which is then f_662a = f_662d.
    gravity_Nm, gravity_angle_rad : float
        Moment of gravity -G sin(psi - psi_0).
    pulses_per_turn : float
        Pulses of the encoder in a turn.
    """

    inertia_kgm2: YawInertia
    added_inertia_kgm2: float = 0.0
    coulomb_Nm: float = 0.0
    viscous_Nms: float = 0.0
    quadratic_Nms2: float = 0.0
    torque_constant_NmpA: TorqueConstant
    current_lag_s: TimeConstant = 0.055
    max_current_A: MotorCurrent = 1.0
    inertia_accelerating_kgm2: float = 0.0
    inertia_braking_kgm2: float = 0.0
    braking_quadratic_Nms2: float | None = None
    gravity_Nm: float = 0.0
    gravity_angle_rad: float = 0.0
    pulses_per_turn: Annotated[float, Field(ge=4, le=1e9)] = 3000.0
    walls: TankWalls | None = None

    @property
    def quadratic_braking(self) -> float:
        """f_662d."""
        return self.quadratic_Nms2 if self.braking_quadratic_Nms2 is None else self.braking_quadratic_Nms2


class ProgrammeSection(CardSection):
    """``[programme]`` of the yaw rig: the motion that is run."""

    kind: Literal["unidirectional", "reversing", "full_turn"] = "unidirectional"
    max_rate_radps: Annotated[float, Field(ge=-100, le=100)]
    rise_s: Annotated[float, Field(ge=0.01, le=1e5)]
    settle_s: Annotated[float, Field(ge=0, le=1e4)] = 0.5
    humps: Annotated[int, Field(ge=1, le=1000)] = 5


@dataclass(frozen=True)
class YawRigCard(Card):
    """Card of a body on the yaw rig: (3) of paper 3 (Alyshev 2019), SI, and the programme that it runs."""

    yaw_rig: YawRig
    programme: ProgrammeSection | None = None
    uncertainty: Uncertainty = field(default_factory=dict)
