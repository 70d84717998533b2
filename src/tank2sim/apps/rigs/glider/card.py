"""The card of an underwater glider: paper 5 (Kulikovsky and Velikanov 2012)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from tank2sim.cards.card import Card
from tank2sim.cards.form import CardSection
from tank2sim.quantities import Area, Mass, TimeConstant, Volume


class Glider(CardSection):
    """``[glider]``: mass, size and coefficients of an underwater glider, SI, incidence in rad.

    C_L = ``lift_slope`` alpha + ``lift_quadratic`` alpha |alpha|; C_D = ``drag_zero`` + ``drag_quadratic`` alpha^2;
    both with ``reference_area_m2``. ``mass_kg`` is hull and ballast, ``buoyancy_kg`` the size of the net
    buoyancy (displaced mass less own mass) with which it usually glides.
    """

    mass_kg: Mass
    volume_m3: Volume
    buoyancy_kg: Mass
    hull_mass_kg: Mass | None = None
    reference_area_m2: Area
    lift_slope: Annotated[float, Field(ge=1e-3, le=1e4)]
    lift_quadratic: Annotated[float, Field(ge=0.0, le=1e4)]
    drag_zero: Annotated[float, Field(ge=1e-6, le=1e3)]
    drag_quadratic: Annotated[float, Field(ge=1e-3, le=1e4)]
    added_mass_axial_kg: Annotated[float, Field(ge=0.0, le=1e12)] = 0.0
    added_mass_normal_kg: Annotated[float, Field(ge=0.0, le=1e12)] = 0.0
    buoyancy_time_constant_s: TimeConstant = 10.0
    pitch_time_constant_s: TimeConstant = 5.0
    roll_time_constant_s: TimeConstant = 5.0


@dataclass(frozen=True)
class GliderCard(Card):
    """Card of an underwater glider: paper 5 (Kulikovsky and Velikanov 2012), SI."""

    glider: Glider
