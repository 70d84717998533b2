"""Captive tests reduced to hydrodynamic derivatives, as a result with its card."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tank2sim.arguments import checked
from tank2sim.errors import InputError
from tank2sim.identification.captive.findings import reduction_findings
from tank2sim.identification.captive.reduction import Reduction, ReductionOptions, reduce_campaign
from tank2sim.identification.captive.result_card import FILLS, Contents, card_contents, reynolds_ratio
from tank2sim.identification.captive.study import study_reduction, terms_of_heel
from tank2sim.records.campaigns import Campaign, read_campaign
from tank2sim.results.reduction import ReductionResult


@checked
def reduce(
    campaign: str | Path,
    *,
    fill: str | None = None,
    scale: float | str | None = None,
    keep_going: bool = False,
    keep_fast: bool = False,
    off_speed: bool = False,
    all_terms: bool = False,
    test_symmetry: bool = False,
) -> ReductionResult:
    """Reduce captive tests to hydrodynamic derivatives with standard errors.

    Parameters
    ----------
    campaign : path
        ``campaign.toml``.
    fill : str, optional
        Published estimate of derivatives that the campaign cannot give; they are marked and have a wide uncertainty.
    scale : float or str, optional
        Make the card of a ship so many times as long as the model; ``"ship"``: as the campaign says.
    keep_going : bool
        Leave out runs at fault and reduce the rest.
    keep_fast : bool
        Use runs with omega U/g of 0.1 and more, too.
    off_speed : bool
        Use runs away from the test speed, too, for terms in the speed.
    all_terms : bool
        Keep terms that the tests do not determine.
    test_symmetry : bool
        Test terms that port-starboard symmetry leaves out.

    Raises
    ------
    InputError
        A file is missing or at fault, or the runs do not determine the derivatives.
    """
    if fill is not None and fill not in FILLS:
        raise InputError("fill", "", f"{fill!r} is not a published estimate here", f"there are: {', '.join(FILLS)}")
    read = read_campaign(Path(campaign), keep_going=keep_going)
    ratio = _ratio(read, scale)
    if ratio is not None:
        read = replace(read, model=read.model.model_copy(update={"scale": ratio}))
    options = ReductionOptions(
        keep_going=keep_going,
        keep_fast=keep_fast,
        off_speed=off_speed,
        all_terms=all_terms,
        test_symmetry=test_symmetry,
    )
    reduction = reduce_campaign(read, options)
    contents = card_contents(reduction, fill)
    fillings = _fill_notices(contents, fill, ratio, read)
    warnings = (*reduction_findings(reduction), *fillings, *_heel_notices(reduction))
    return ReductionResult(study_reduction(reduction, contents, warnings, ratio), reduction, contents)


def _ratio(campaign: Campaign, given: float | str | None) -> float | None:
    """The ratio of lengths: a number, or ``ship`` for the ratio of the campaign; None if none was given."""
    if given is None:
        return None
    if given == "ship":
        if campaign.model.scale is None:
            raise InputError(campaign.path, "model.scale", "is missing", "add it, or give --scale a number")
        return campaign.model.scale
    try:
        ratio = float(given)
    except ValueError:
        ratio = 0.0
    if not 1.0 <= ratio < 1e4:
        raise InputError("--scale", "", f"{given} is not a ratio of lengths", "give a number such as 46.4, or 'ship'")
    return ratio


def _heel_notices(reduction: Reduction) -> list[str]:
    names = terms_of_heel(reduction)
    if not names:
        return []
    return [
        f"Found and not on the card, which does not roll: {', '.join(names)} (prime, heel in rad). A card with [roll], "
        "a metacentric height and terms of K takes them."
    ]


def _fill_notices(card: Contents, fill: str | None, ratio: float | None, campaign: Campaign) -> list[str]:
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
    return notices
