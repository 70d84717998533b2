"""All physics warnings on a captive campaign: on its test conditions, and on its derivatives (prime, starboard)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from tank2sim.cards.plausibility import (
    ADDED_MASSES,
    DEEP_ADDED_SHARES,
    LEVERS,
    YAW_DAMPING,
    Caution,
    added_masses,
    levers,
    unusual_signs,
    yaw_damping,
    yaw_force,
)
from tank2sim.identification.captive.tank_conditions import (
    LEAST_DEPTH_RATIO,
    OscillationMotion,
    blockage,
    carried_mass,
    depth_froude,
    flow_memory,
    frequency_parameters,
    model_length,
    scale_effect,
    tank_resonance,
    trim,
)
from tank2sim.records.campaign_form import ModelSection
from tank2sim.records.campaigns import Campaign

__all__ = ["Caution", "OscillationMotion", "cautions_of_result", "cautions_of_test"]

ADDED_SHARE = (0.1, 3.0)
"""Range of added mass over mass, and of added yaw inertia over yaw inertia; about 0.9 and 0.7 are usual."""

FORCE_UNITS = {"kgf": 9.80665, "lbf": 4.4482216, "kN": 1000.0, "gf": 9.80665e-3}
"""Newtons in other units of force."""

MOMENT_UNITS = {
    "kgf m": 9.80665,
    "lbf ft": 1.3558179,
    "kN m": 1000.0,
    "kgf cm": 9.80665e-2,
    "lbf in": 0.11298483,
    "N cm": 1e-2,
    "N mm": 1e-3,
    "gf cm": 9.80665e-5,
}
"""Newton metres in other units of moment."""

SWAY_DAMPING = (0.4, 2.5)
"""Range of Y_v' over the estimate of Clarke, Gedling and Hine (1983), -pi (d/L)^2 (1 + 0.4 C_B B/d): 0.8 (KVLCC2) and
1.0 (Mariner). Project choice: lbf make it 0.2, kgf 0.1."""

_USUAL = {"Yvdot": 0.9, "Yv": 1.0, "Nrdot": 0.8, "Nr": 0.3, "Nv": 0.3, "Nd": -0.47}
"""Usual shares and levers, by which the likeliest of several units is chosen: the ships of the ranges above."""

_USUAL_BLOCK = 0.7
"""Block coefficient of the estimate of Y_v. Project choice: 0.5 to 0.85 change it by 20 %."""


def cautions_of_test(campaign: Campaign, runs: tuple[OscillationMotion, ...]) -> tuple[Caution, ...]:
    """Cautions on the test conditions of a campaign, without its forces.

    `runs`: Its oscillating runs, with frequencies as measured.
    """
    model, test, tank = campaign.model, campaign.test, campaign.tank
    gravity, speed, length = test.gravity_mps2, test.speed_mps, model.length_m
    return (
        *model_length(length),
        *frequency_parameters(runs, speed, gravity),
        *flow_memory(runs, speed, length),
        *trim(model.trim_m, length),
        *tank_resonance(runs, tank, gravity),
        *blockage(model.beam_m, model.draught_m, tank),
        *depth_froude(speed, tank.depth_m, gravity),
        scale_effect(model.scale, length, speed, test.kinematic_viscosity_m2ps),
    )


def cautions_of_result(
    derivatives: Mapping[str, float], standard_errors: Mapping[str, float], campaign: Campaign
) -> tuple[Caution, ...]:
    """Cautions on derivatives (prime, "hydrodynamic", starboard), with standard errors by the same names."""
    model, scales, depth = campaign.model, campaign.scales, campaign.tank.depth_m
    mass = model.mass_kg / float(scales.mass)
    inertia = None if model.yaw_inertia_kgm2 is None else model.yaw_inertia_kgm2 / float(scales.inertia)
    deep = not (depth and model.draught_m) or depth >= LEAST_DEPTH_RATIO * model.draught_m
    draught_ratio = model.draught_m / model.length_m if model.draught_m else None
    if deep and (foreign := tuple(foreign_units(derivatives, mass, inertia, campaign.inertia_removed, model))):
        return foreign  # which is the cause of what else is wrong
    # A positive added mass is reported once, with its likely cause.
    other_derivatives = {name: value for name, value in derivatives.items() if name not in ADDED_MASSES}
    return (
        *force_convention(derivatives, mass, inertia or 0.0, campaign.test.force_convention),
        *carried_mass(model, campaign.test.water_density_kgpm3),
        *(added_masses(derivatives, standard_errors, mass, inertia) if deep else ()),
        *unusual_signs(other_derivatives, standard_errors),
        *yaw_force(derivatives, mass),
        *(yaw_damping(derivatives, standard_errors, draught_ratio) if deep else ()),
        *levers(derivatives, standard_errors),
    )


def force_convention(
    derivatives: Mapping[str, float], mass_prime: float, inertia_prime: float, convention: str
) -> Iterator[Caution]:
    """Added masses that no body has, and whether the opposite sign of the forces would correct them.

    `derivatives`: Prime values; Yvdot and Nrdot are checked; `mass_prime`, `inertia_prime`: m' and J_z'. With forces of
    the wrong sign Y_vdot comes out as 2 m' - Y_vdot and N_rdot as 2 J_z' - N_rdot, by (4.4) of paper 2 and its
    equivalent for yaw; `convention`: ``force_convention`` of the campaign.
    """
    inertias = ((mass_prime, "mass"), (inertia_prime, "yaw inertia"))
    for name, (inertia, what) in zip(ADDED_MASSES, inertias, strict=True):
        value = derivatives.get(name)
        if value is not None and value > 0:
            message = f"{name} is {value:.3g}: the added {what} is negative"
            if value >= inertia:
                message += f", and with the inertia of the model ({inertia:.3g}) the whole is too"
            yield Caution("force convention", f"{message}; {_likely_cause(value, inertia, convention)}.")


def foreign_units(
    derivatives: Mapping[str, float], mass_prime: float, inertia_prime: float | None, removed: bool, model: ModelSection
) -> Iterator[Caution]:
    """Other units of force and moment, that turn impossible derivatives into a ship's, in deep water.

    `derivatives`: Prime values; with a unit that is k newtons Y_v is k times as large, Y_vdot is m' - k (m' - Y_vdot);
    `mass_prime`, `inertia_prime`: m' and J_z', None if unknown; `removed`: The forces were recorded without the inertia
    of the model; `model`: Its length, beam and draught scale the estimates.
    """
    hull = _HullShares.of(derivatives, mass_prime, inertia_prime, removed, model)
    force, moment = "", ""
    if not _of_a_ship(hull.forces(1.0)):
        force = _nearest(FORCE_UNITS, hull.forces)
        if not force:
            return
    factor = FORCE_UNITS.get(force, 1.0)
    if force or not _of_a_ship(hull.moments(1.0, factor)):
        candidates = {"N m": 1.0, **MOMENT_UNITS} if force else MOMENT_UNITS
        moment = _nearest(candidates, lambda tried: hull.moments(tried, factor))
        moment = "" if moment == "N m" else moment
    if force or moment:
        yield Caution(
            "unit",
            "the derivatives are of no ship if forces are in N and moments in N m, and of one if "
            f"{' and '.join(_units_in_words(hull, force, moment))}; convert the columns.",
        )


def _units_in_words(hull: _HullShares, force: str, moment: str) -> Iterator[str]:
    if force:
        factor = FORCE_UNITS[force]
        shares = ", ".join(f"{name} {value:.2g}" for name, value in hull.forces(factor).items())
        yield f"X and Y are in {force}, 1 {force} = {factor:.4g} N (then {shares} times the values of usual hulls)"
    if moment:
        yield f"N is in {moment}, 1 {moment} = {MOMENT_UNITS[moment]:.4g} N m"


@dataclass(frozen=True)
class _HullShares:
    """Derivatives, the shares of the carried inertia in them, and the sizes that a usual hull has; prime."""

    derivatives: Mapping[str, float]
    carried: Mapping[str, float]
    usual: Mapping[str, float]

    @classmethod
    def of(
        cls,
        derivatives: Mapping[str, float],
        mass_prime: float,
        inertia_prime: float | None,
        removed: bool,
        model: ModelSection,
    ) -> _HullShares:
        """As the arguments of :func:`foreign_units`."""
        length, beam, draught = model.length_m, model.beam_m, model.draught_m
        slender = math.pi * (draught / length) ** 2 if draught else 0.0
        sway = slender * (1.0 + 0.4 * _USUAL_BLOCK * beam / draught) if draught and beam else 0.0
        inertias = {"Yvdot": mass_prime, "Nrdot": inertia_prime or 0.0}
        carried = {} if removed else {**inertias, "Nr": mass_prime * model.x_G_m / length}
        return cls(derivatives, carried, {**inertias, "Yv": sway, "Nr": slender})

    def forces(self, factor: float) -> dict[str, float]:
        """Derivatives of Y over their usual sizes, if the force is in a unit of `factor` newtons."""
        return self._sizes(("Yvdot", "Yv"), factor)

    def moments(self, factor: float, force: float) -> dict[str, float]:
        """Derivatives of N over their usual sizes, and levers in ship lengths, with a unit of force, too."""
        found = self._sizes(("Nrdot", "Nr"), factor)
        for moment, against, _, _ in LEVERS:
            if self.derivatives.get(moment) and self.derivatives.get(against):
                found[moment] = factor * self.derivatives[moment] / (force * self.derivatives[against])
        return found

    def _sizes(self, names: Sequence[str], factor: float) -> dict[str, float]:
        found = {}
        for name in names:
            if self.derivatives.get(name) and self.usual[name]:
                own = self.carried.get(name, 0.0)
                found[name] = (factor * (own - self.derivatives[name]) - own) / self.usual[name]
        return found


def _of_a_ship(found: Mapping[str, float]) -> bool:
    limits = {**DEEP_ADDED_SHARES, "Yv": SWAY_DAMPING, "Nr": YAW_DAMPING}
    limits |= {moment: limit for moment, _, limit, _ in LEVERS}
    return all(limits[name][0] <= value <= limits[name][1] for name, value in found.items())


def _nearest(candidates: Mapping[str, float], found: Callable[[float], Mapping[str, float]]) -> str:
    """The unit with which the derivatives are nearest to usual ones; empty if no unit makes them a ship's."""
    fitting = {name: found(factor) for name, factor in candidates.items() if _of_a_ship(found(factor))}
    return min(
        fitting,
        key=lambda name: sum(math.log(value / _USUAL[each]) ** 2 for each, value in fitting[name].items()),
        default="",
    )


def _likely_cause(value: float, inertia: float, convention: str) -> str:
    """Likely cause of a positive acceleration derivative."""
    least, most = ADDED_SHARE
    opposite = {"on_model": "on_gauge", "on_gauge": "on_model"}.get(convention)
    if opposite is None:
        return f"check that the model's inertia is indeed removed from the forces ({convention})"
    for corrected, instead, cause in (
        (2 * inertia - value, opposite, "the signs look reversed"),
        (value - inertia, "hydrodynamic", "the inertia of the model looks removed already"),
    ):
        if -most * inertia <= corrected <= -least * inertia:
            return f'force_convention = "{instead}" would give {corrected:.3g}, as of a ship: {cause}'
    if abs(value - inertia) < least * inertia:
        return "the forces hardly show the model's own inertia: check the unit of the gauges"
    return "check force_convention, the mass and the unit of the gauges"
