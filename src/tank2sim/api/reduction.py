"""Captive tests reduced to hydrodynamic derivatives, as a result with its card."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.cards import Card, parse_card
from tank2sim.cards.covariance import Covariance
from tank2sim.errors import InputError
from tank2sim.identification.captive.as_json import reduction_as_json
from tank2sim.identification.captive.findings import implausible, reduction_findings
from tank2sim.identification.captive.reduction import Reduction, ReductionOptions, reduce_campaign, reduction_covariance
from tank2sim.identification.captive.result_card import (
    FILLS,
    Contents,
    card_contents,
    reduced_card_text,
    reynolds_ratio,
)
from tank2sim.identification.captive.tables import (
    derivative_rows,
    prediction_errors,
    prediction_rows,
    terms_left_out,
    terms_not_excited,
    terms_of_heel,
)
from tank2sim.identification.captive.uncertainty_budget import uncertainty_budget
from tank2sim.records.campaigns import FORCE_COLUMNS, Campaign, read_campaign

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd

    from tank2sim.api.ship import Ship


class ReductionResult(OldResult):
    """Hydrodynamic derivatives from captive tests.

    Parameters
    ----------
    reduction : Reduction
    contents : Contents
        Of the card: what was measured, and what was taken from published estimates.
    fill : str or None
        Name of those estimates.
    ratio : float or None
        Length of the card's ship over that of the model.

    Raises
    ------
    InputError
        The derivatives are not those of a ship: no card can be made of them.
    """

    command = "reduce"

    def __init__(self, reduction: Reduction, contents: Contents, fill: str | None, ratio: float | None) -> None:
        self.reduction, self.contents, self.ratio = reduction, contents, ratio
        self.findings = tuple(implausible(reduction))
        fillings = _fill_notices(contents, fill, ratio, reduction.campaign)
        self.notices = (*reduction_findings(reduction), *fillings, *_heel_notices(reduction))

    @cached_property
    def card(self) -> Card:
        """The card found, with the covariance of what was measured; ``card.save("ship.toml")`` writes it."""
        text = reduced_card_text(self.reduction, self.contents, self.ratio or 1.0)
        card = parse_card(text, "the reduced card")
        # What is estimated is independent of what was measured.
        entries, estimated = self.contents.entries, self.contents.estimated
        names = [name for name in entries if name in self.reduction.derivatives and name not in estimated]
        matrix = reduction_covariance(self.reduction, names)
        return replace(card, covariance=Covariance(tuple(f"derivatives.{name}" for name in names), matrix))

    @property
    def ship(self) -> Ship:
        """The ship of the card found."""
        from tank2sim.api.ship import Ship

        return Ship(self.card)

    @property
    def derivatives(self) -> pd.DataFrame:
        """Derivatives by name: prime value, standard error, origin; rudder positive to starboard."""
        import pandas as pd

        rows = [
            (row.name, row.value, row.standard_error, row.origin)
            for row in derivative_rows(self.reduction, self.contents)
        ]
        return pd.DataFrame(rows, columns=["name", "value", "standard_error", "origin"]).set_index("name")

    @property
    def budget(self) -> pd.DataFrame:
        """Uncertainty budget by derivative (ITTC 7.5-02-06-04): share of the variance of each source; prime
        ``combined`` and ``expanded`` (k = 2) uncertainty."""
        import pandas as pd

        rows = [
            {"name": row.name, "value": row.value, "combined": row.combined, "expanded": row.expanded, **row.shares}
            for row in uncertainty_budget(self.reduction)
        ]
        return pd.DataFrame(rows).set_index("name")

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return reduction_as_json(self.reduction, self.contents, self.notices)

    @property
    def headline(self) -> tuple[str, ...]:
        """Whose size the card has, if the campaign states a ship."""
        model = self.reduction.campaign.model
        if self.ratio is not None or model.scale is None:
            return ()
        size = (
            f"{model.length_m:.4g} m long; --scale ship makes that of the ship of {model.length_m * model.scale:.4g} m"
        )
        return (f"The card is of the model, {size}.",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Derivatives, terms left out, and errors of runs predicted from the others."""
        rows: list[list[object]] = []
        for row in derivative_rows(self.reduction, self.contents):
            value, stepped = f"{row.value:.5g} ± {row.standard_error:.2g}", row.stepped
            stepwise = f"{stepped.value:.5g} ± {stepped.standard_error:.2g} ({stepped.found_in})" if stepped else "-"
            rows.append([row.name, value, stepwise, row.origin])
        name, count = self.reduction.campaign.model.name, len(self.reduction.runs)
        tables = [
            screen_table(
                f"{name}: derivatives from {count} runs (prime, rudder to starboard)",
                ("", "whole campaign", "test by test", ""),
                rows,
            )
        ]
        if left_out := [[choice.name, choice.reason, choice.explanation] for choice in terms_left_out(self.reduction)]:
            tables.append(screen_table("Terms that the runs excite and that were left out", ("", "", "why"), left_out))
        errors_by_type = prediction_rows(prediction_errors(self.reduction))
        tables.append(
            screen_table(
                "Leave-one-out: root mean square error of each run predicted from the others, % of the range",
                ("runs of type", *FORCE_COLUMNS),
                [
                    [kind, *(f"{errors[force]:.2g}" if force in errors else "-" for force in FORCE_COLUMNS)]
                    for kind, errors in errors_by_type.items()
                ],
                (f"Not excited by any run: {', '.join(terms_not_excited(self.reduction))}",),
            )
        )
        return tuple(tables)

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Force fits with bands, loops, harmonics and residuals, by file stem."""
        from tank2sim.report.captive.page import reduction_charts

        return dict(reduction_charts(self.to_dict()))


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
        Take what the campaign cannot give from this published estimate, marked and with a wide uncertainty.
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
    return ReductionResult(reduction, card_contents(reduction, fill), fill, ratio)


def _ratio(campaign: Campaign, given: float | str | None) -> float | None:
    """The ratio of lengths: a number, or ``ship`` for that of the campaign; None if none was given."""
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
        remedy = "" if fill else f" --fill {next(iter(FILLS))} takes what it can from a published estimate."
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
