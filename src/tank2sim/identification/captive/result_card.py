"""The ship card of a reduction: measured values, published estimates of missing ones, and the scale."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.cards.estimates import CLARKE, ESTIMATED, GYRATION, RELATIVE_ERROR, Particulars, estimate
from tank2sim.cards.writing import DerivativeEntry, ManoeuvringResult, TestedRange, manoeuvring_card_text
from tank2sim.dynamics.abkowitz import ALL_TERMS
from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.captive.reduction import ESSENTIAL, Reduction, is_resistance, terms_of_heel
from tank2sim.identification.captive.tank_conditions import FroudeScaling
from tank2sim.notices import Notice
from tank2sim.records.campaign_form import FullScaleSection, ModelSection, TankTest
from tank2sim.records.campaigns import Campaign

FILLS: Mapping[str, str] = {"clarke1983": CLARKE}
"""Name of a published estimate to its source."""


@dataclass(frozen=True, kw_only=True)
class Contents:
    """Contents of the card."""

    entries: Mapping[str, DerivativeEntry]  # Name to value, standard error (prime) and origin, in the canonical order
    estimated: tuple[str, ...]  # Names of the estimates
    missing: tuple[str, ...]  # Names of essential derivatives that are neither measured nor estimated
    # `mass`, `yaw_inertia`, `x_G`: Prime
    mass: float
    yaw_inertia: float
    x_G: float
    inertia_source: str  # Source of the yaw inertia


def card_contents(reduction: Reduction, fill: str | None = None) -> Contents:
    """Contents of the card of a reduction.

    `fill`: Key of :data:`FILLS`: the source of derivatives that the campaign does not give.

    Raises InputError: The estimate needs beam and draught, and the campaign lacks them.
    """
    campaign = reduction.campaign
    model, scales = campaign.model, campaign.scales
    found = {
        name: DerivativeEntry(derivative.value, derivative.standard_error, _how(reduction, name))
        for name, derivative in reduction.derivatives.items()
        if not (name == "X0" and is_resistance(campaign))
    }
    estimates = {} if fill is None else _estimates(reduction, found)
    entries = {  # in the card's figures, so that card and JSON agree exactly
        name: DerivativeEntry(float(f"{entry.value:.7g}"), float(f"{entry.standard_error:.3g}"), entry.how)
        for name, entry in (found | estimates).items()
    }
    inertia, source = model_yaw_inertia(model)
    return Contents(
        entries={name: entries[name] for name in ALL_TERMS if name in entries},
        estimated=tuple(estimates),
        missing=tuple(name for name in ESSENTIAL if name not in entries),
        mass=model.mass_kg / float(scales.mass),
        yaw_inertia=inertia / float(scales.inertia),
        x_G=model.x_G_m / model.length_m,
        inertia_source=source,
    )


def _estimates(reduction: Reduction, found: Mapping[str, DerivativeEntry]) -> dict[str, DerivativeEntry]:
    """Estimates of the essential derivatives that were not found."""
    lacking = [name for name in ESSENTIAL if name not in found and name in ESTIMATED]
    estimates = {
        name: DerivativeEntry(number.value, number.standard_error, f"ESTIMATED: {number.source}")
        for name, number in estimate(_particulars(reduction.campaign), lacking).items()
    }
    return estimates | _constant_thrust(reduction, found)


def _how(reduction: Reduction, name: str) -> str:
    """Short origin of a derivative, with its value in the paper's order."""
    result = reduction.forces[name[0]]
    steps = result.stepwise
    if any(trend.name == name and trend.used for trend in result.trends):
        return "measured, extrapolated to zero frequency"
    if name not in steps.names:
        return "measured, all runs together"
    place = steps.names.index(name)
    return f"measured; test by test {steps.values[place]:.4g}, from {steps.found_in[place]}"


def _constant_thrust(reduction: Reduction, found: Mapping[str, DerivativeEntry]) -> dict[str, DerivativeEntry]:
    """Xu and Xuu with constant thrust that balances the measured resistance, which varies as U^2.

    X = R0 (U/u0)^2 - R0 over 1/2 rho L^2 U^2 is X0' (1 - (u0/U)^2), X0' the measured resistance (negative), and with
    u0/U = 1 - Du' it is X0' (2 Du' - Du'^2). Thrust grows as a ship slows, so that this is a cautious estimate.
    """
    if not is_resistance(reduction.campaign) or "X0" not in reduction.derivatives or "Xu" in found:
        return {}
    resistance = reduction.derivatives["X0"].value
    how = "ESTIMATED: constant thrust against the measured resistance, which goes as U^2"
    return {
        "Xu": DerivativeEntry(2 * resistance, RELATIVE_ERROR * abs(2 * resistance), how),
        "Xuu": DerivativeEntry(-resistance, RELATIVE_ERROR * abs(resistance), how),
    }


def _particulars(campaign: Campaign) -> Particulars:
    model = campaign.model
    if model.beam_m is None or model.draught_m is None:
        key = "beam_m" if model.beam_m is None else "draught_m"
        raise InputError(campaign.path, f"model.{key}", "is missing, and estimates need it", "add it")
    return model_particulars(model, campaign.test)


def model_particulars(model: ModelSection, test: TankTest) -> Particulars:
    """Main dimensions of a model whose beam and draught are stated, for estimates."""
    assert model.beam_m is not None and model.draught_m is not None
    return Particulars(
        length_m=model.length_m,
        beam_m=model.beam_m,
        draught_m=model.draught_m,
        density_kgpm3=test.water_density_kgpm3,
        mass_kg=model.mass_kg,
        block_coefficient=model.block_coefficient,
        x_G_m=model.x_G_m,
    )


def model_yaw_inertia(model: ModelSection) -> tuple[float, str]:
    """J_z about midships (kg m2), as stated or by the usual radius of gyration, and where it is from."""
    if model.yaw_inertia_kgm2 is not None:
        return model.yaw_inertia_kgm2, "campaign"
    return model.mass_kg * ((0.25 * model.length_m) ** 2 + model.x_G_m**2), f"ESTIMATED: {GYRATION}"


def reduced_card_text(reduction: Reduction, card: Contents, scale: float = 1.0) -> str:
    """The card's text at model scale, or Froude-scaled to a ship `scale` times as long.

    Prime numbers hold at every scale; length and speed follow lambda and lambda^0.5 (paper 2, section 5).
    """
    campaign = reduction.campaign
    model, test = campaign.model, campaign.test
    water = (campaign.full_scale or FullScaleSection()) if scale != 1.0 else test
    ratio = FroudeScaling(scale, water.water_density_kgpm3 / test.water_density_kgpm3)
    factors = dict.fromkeys(("length_m", "beam_m", "draught_m", "propeller_diameter_m"), scale)
    factors |= {"displacement_kg": ratio.force, "block_coefficient": 1.0, "rudder_area_m2": scale**2}
    of_model = {**model.model_dump(exclude_none=True), "displacement_kg": model.mass_kg}
    sizes = {key: of_model[key] * factor for key, factor in factors.items() if key in of_model}
    environment = {"water_density_kgpm3": water.water_density_kgpm3, "gravity_mps2": water.gravity_mps2}
    if water.kinematic_viscosity_m2ps is not None:
        environment["kinematic_viscosity_m2ps"] = water.kinematic_viscosity_m2ps
    speed = test.speed_mps * math.sqrt(scale * environment["gravity_mps2"] / test.gravity_mps2)
    return manoeuvring_card_text(
        ManoeuvringResult(
            particulars={"name": model.name} | {key: float(f"{size:.6g}") for key, size in sizes.items()},
            source=f"tank2sim reduce {campaign.path.parent.name}/{campaign.path.name}",
            notes=_notes(reduction, card, scale),
            environment=environment,
            speed_mps=float(f"{speed:.6g}"),
            largest=_tested(reduction),
            rigid_body={"mass": card.mass, "yaw_inertia": card.yaw_inertia, "x_G": card.x_G},
            inertia_source=card.inertia_source,
            derivatives=card.entries,
        )
    )


def _tested(reduction: Reduction) -> TestedRange:
    """Largest drift, rudder angle and yaw rate of the runs used."""
    drift, rudder, rate = [0.0], [0.0], [0.0]
    for run in reduction.runs:
        motion, speed = run.motion, run.motion.speed_mps
        drift.append(float(np.max(np.arcsin(np.minimum(np.abs(motion.v_mps) / speed, 1.0)))))
        rudder.append(float(np.max(np.abs(motion.delta_rad))))
        rate.append(float(np.max(np.abs(motion.r_radps) / speed)) * reduction.campaign.model.length_m)
    return TestedRange(max(drift), max(rudder), max(rate))


def _notes(reduction: Reduction, card: Contents, scale: float) -> str:
    messages = [f"From {len(reduction.runs)} captive runs."]
    if card.estimated:
        messages.append(f"Estimated, not measured: {', '.join(card.estimated)}.")
    if card.missing:
        messages.append(f"Neither measured nor estimated, and zero here: {', '.join(card.missing)}.")
    if scale != 1.0:
        messages.append(f"Froude-scaled from the model by {scale:g}; no correction for the Reynolds number was made.")
    return " ".join(messages)


def reynolds_ratio(campaign: Campaign, scale: float) -> float:
    """Reynolds number of the ship over the model's: lambda^1.5 over the ratio of viscosities, where given."""
    model_water = campaign.test.kinematic_viscosity_m2ps
    if model_water is None or campaign.full_scale is None:
        return FroudeScaling(scale).reynolds
    return FroudeScaling(scale, viscosity=campaign.full_scale.kinematic_viscosity_m2ps / model_water).reynolds


def length_ratio(campaign: Campaign, given: float | str | None) -> float | None:
    """The ratio of lengths: a number, or ``ship`` for the ratio of the campaign; None if none was given."""
    if given is None:
        return None
    if given == "ship":
        if campaign.model.scale is None:
            raise InputError(campaign.path, "model.scale", "is missing", "add it, or give the scale as a number")
        return campaign.model.scale
    try:
        ratio = float(given)
    except ValueError:
        ratio = 0.0
    if not 1.0 <= ratio < 1e4:
        raise ArgumentError("scale", "", f"{given} is not a ratio of lengths", "give a number such as 46.4, or 'ship'")
    return ratio


def heel_notices(reduction: Reduction) -> list[Notice]:
    """Notices on terms of heel that the card does not take."""
    names = terms_of_heel(reduction)
    if not names:
        return []
    return [
        Notice(
            f"Found and not on the card, which does not roll: {', '.join(names)} (prime, heel in rad). A card with "
            "[roll], a metacentric height and terms of K takes them."
        )
    ]


def fill_notices(card: Contents, fill: str | None, ratio: float | None, campaign: Campaign) -> list[Notice]:
    """Notices on what the card has from estimates, lacks, and takes from another size.

    `fill`: Published estimate; `ratio`: Length of the card's ship over the model's.
    """
    notices = []
    if card.estimated:
        notices.append(
            f"Estimated, not measured, with wide standard errors ({FILLS[fill or '']}): {', '.join(card.estimated)}."
        )
    if card.missing:
        remedy = "" if fill else f' fill="{next(iter(FILLS))}" takes some of them from a published estimate.'
        notices.append(
            f"The card has no {', '.join(card.missing)}: they are zero there, and a manoeuvre simulated with it is as "
            f"wrong as that.{remedy}"
        )
    if {"Yr", "Nr"} & set(card.estimated) and not {"Nvvr", "Nrrr"} & set(card.entries):
        notices.append(
            "No term of third order in the yaw rate was measured or estimated: hard turns come out too tight."
        )
    if ratio:
        notices.append(
            f"The card is of a ship {ratio:g} times as long as the model, at the same Froude number; its Reynolds "
            f"number is {reynolds_ratio(campaign, ratio):.4g} times the model's, for which nothing was corrected."
        )
    return [Notice(text) for text in notices]
