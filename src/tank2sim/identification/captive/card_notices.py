"""Notices of a reduction, and the ratio of lengths of its card."""

from __future__ import annotations

from tank2sim.errors import ArgumentError, InputError
from tank2sim.identification.captive.reduction import Reduction
from tank2sim.identification.captive.result_card import FILLS, Contents, reynolds_ratio
from tank2sim.identification.captive.study import terms_of_heel
from tank2sim.notices import Notice
from tank2sim.records.campaigns import Campaign


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

    Parameters
    ----------
    card : Contents
    fill : str or None
        Published estimate.
    ratio : float or None
        Length of the card's ship over the model's.
    campaign : Campaign
    """
    notices = []
    if card.estimated:
        notices.append(
            f"Estimated, not measured, with wide standard errors ({FILLS[fill or '']}): {', '.join(card.estimated)}."
        )
    if card.missing:
        remedy = "" if fill else f" --fill {next(iter(FILLS))} takes some of them from a published estimate."
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
