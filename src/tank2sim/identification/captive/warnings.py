"""All physics warnings on a captive campaign: on its test conditions, and on its derivatives."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.cards import ManoeuvringCard
from tank2sim.cards.plausibility import (
    ADDED_MASSES,
    Caution,
    added_masses,
    levers,
    unusual_signs,
    yaw_damping,
    yaw_force,
)
from tank2sim.identification.captive.plausibility import force_convention, foreign_units
from tank2sim.identification.captive.tank_conditions import (
    LEAST_DEPTH_RATIO,
    CarriedBody,
    OscillationMotion,
    Tank,
    blockage,
    carried_mass,
    depth_froude,
    flow_memory,
    frequency_parameters,
    model_length,
    scale_effect,
    similarity,
    tank_resonance,
    trim,
)
from tank2sim.records.campaigns import Campaign

__all__ = ["Caution", "OscillationMotion", "body_of", "cautions_of_result", "cautions_of_test"]


def cautions_of_test(
    campaign: Campaign, runs: tuple[OscillationMotion, ...], ship: ManoeuvringCard | None = None
) -> tuple[Caution, ...]:
    """Cautions on the test conditions of a campaign, without its forces.

    Parameters
    ----------
    campaign : Campaign
        As read.
    runs : tuple of OscillationMotion
        Its oscillating runs, with frequencies as measured.
    ship : ManoeuvringCard, optional
        The ship of the model.
    """
    model, test = campaign.model, campaign.test
    gravity, speed, length = test.gravity_mps2, test.speed_mps, model.length_m
    tank = Tank(campaign.tank.breadth_m, campaign.tank.depth_m)
    found = [
        *model_length(length),
        *frequency_parameters(runs, speed, gravity),
        *flow_memory(runs, speed, length),
        *trim(model.trim_m, length),
        *tank_resonance(runs, tank, gravity),
        *blockage(model.beam_m, model.draught_m, tank),
        *depth_froude(speed, tank.depth_m, gravity),
        scale_effect(model.scale, length, speed, test.kinematic_viscosity_m2ps),
    ]
    if ship is not None:
        found += similarity(_numbers(campaign), _card_numbers(ship))
    return tuple(found)


def cautions_of_result(
    derivatives: Mapping[str, float], standard_errors: Mapping[str, float], campaign: Campaign
) -> tuple[Caution, ...]:
    """Cautions on derivatives (prime, "hydrodynamic", starboard), with standard errors by the same names."""
    numbers = _numbers(campaign)
    mass, inertia = numbers["m'"], numbers["J_z'"]
    assert mass is not None
    body = body_of(campaign)
    deep = not (campaign.tank.depth_m and body.draught_m) or campaign.tank.depth_m >= LEAST_DEPTH_RATIO * body.draught_m
    draught_ratio = body.draught_m / body.length_m if body.draught_m else None
    if deep and (foreign := tuple(foreign_units(derivatives, mass, inertia, campaign.inertia_removed, body))):
        return foreign  # which is the cause of what else is wrong
    # A positive added mass is reported once, with its likely cause.
    other_derivatives = {name: value for name, value in derivatives.items() if name not in ADDED_MASSES}
    return (
        *force_convention(derivatives, mass, inertia or 0.0, campaign.test.force_convention),
        *carried_mass(body, campaign.model.block_coefficient),
        *(added_masses(derivatives, standard_errors, mass, inertia) if deep else ()),
        *unusual_signs(other_derivatives, standard_errors),
        *yaw_force(derivatives, mass),
        *(yaw_damping(derivatives, standard_errors, draught_ratio) if deep else ()),
        *levers(derivatives, standard_errors),
    )


def body_of(campaign: Campaign) -> CarriedBody:
    """The body that the gauges carry."""
    model = campaign.model
    return CarriedBody(
        length_m=model.length_m,
        mass_kg=model.mass_kg,
        density_kgpm3=campaign.test.water_density_kgpm3,
        yaw_inertia_kgm2=model.yaw_inertia_kgm2,
        beam_m=model.beam_m,
        draught_m=model.draught_m,
        x_G_m=model.x_G_m,
    )


def _numbers(campaign: Campaign) -> dict[str, float | None]:
    model, scales = campaign.model, campaign.scales
    return {
        "m'": model.mass_kg / float(scales.mass),
        "J_z'": None if model.yaw_inertia_kgm2 is None else model.yaw_inertia_kgm2 / float(scales.inertia),
        "x_G'": model.x_G_m / model.length_m,
        "z_G'": None if model.z_G_m is None else model.z_G_m / model.length_m,
    }


def _card_numbers(ship: ManoeuvringCard) -> dict[str, float | None]:
    body = ship.rigid_body
    return {"m'": body.mass, "J_z'": body.yaw_inertia, "x_G'": body.x_G, "z_G'": None}
