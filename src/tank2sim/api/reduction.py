"""Captive tests reduced to hydrodynamic derivatives, or to the coefficients of the MMG method."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tank2sim.api.verbs import Output, verb
from tank2sim.files import CARD, TABLE

if TYPE_CHECKING:
    from tank2sim.results.mmg_reduction import MmgReductionResult
    from tank2sim.results.reduction import ReductionResult


def _budget(result: ReductionResult, path: Path) -> dict[Path, str | bytes]:
    return {path: result.budget.to_csv(float_format="%.6g", lineterminator="\n")}


@verb(
    "coefficients of the MMG method, from steady tests with thrust and normal force of the rudder",
    Output("-o", CARD, "Write the ship card.", lambda result, path: result.card.files(path), "CARD.toml"),
    results=("tank2sim.results.mmg_reduction:MmgReductionResult",),
)
def reduce_to_mmg(campaign: str | Path) -> MmgReductionResult:
    """Reduce steady captive tests with thrust and rudder normal force to the coefficients of the MMG method.

    One weighted regression of X, Y, N, thrust and normal force of all conditions, with the open-water points, gives the
    hull (R_0' to N_rrr'), t_P, w_P0, C_1, C_2+-, t_R, a_H, x_H', eps, kappa, l_R' and gamma_R+- with standard errors
    (Yasukawa and Yoshimura 2015; :mod:`tank2sim.identification.captive_mmg.regression`).

    Parameters
    ----------
    campaign : path
        ``campaign.toml`` with ``[averages]``, ``[open_water]``, ``[propeller]`` and ``[rudder]``.

    Raises
    ------
    InputError
        A file is missing or at fault, the tests do not show hull or rudder, or the method does not describe a channel.
    """
    from tank2sim.identification.captive_mmg.regression import fit_mmg
    from tank2sim.identification.captive_mmg.steady_tests import read_steady_tests
    from tank2sim.identification.captive_mmg.study import mmg_card, study_mmg
    from tank2sim.results.mmg_reduction import MmgReductionResult

    fit = fit_mmg(read_steady_tests(Path(campaign)))
    return MmgReductionResult(study_mmg(fit), fit, mmg_card(fit))


@verb(
    "captive tests to derivatives",
    Output("-o", CARD, "Write the ship card.", lambda result, path: result.card.files(path), "CARD.toml"),
    Output(
        "--budget",
        TABLE,
        "Write the uncertainty budget (ITTC 7.5-02-06-04): shares of the variance, combined and expanded.",
        _budget,
        "FILE.csv",
    ),
    variants={"mmg": reduce_to_mmg},
    results=("tank2sim.results.reduction:ReductionResult",),
)
def reduce(
    campaign: str | Path,
    *,
    fill: Literal["clarke1983"] | None = None,
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
        Make the card of a ship so many times as long as the model; ``ship``: as the campaign says.
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
    from tank2sim.identification.captive.findings import reduction_findings
    from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
    from tank2sim.identification.captive.result_card import card_contents, fill_notices, heel_notices, length_ratio
    from tank2sim.identification.captive.study import study_reduction
    from tank2sim.records.campaigns import read_campaign
    from tank2sim.results.reduction import ReductionResult

    read = read_campaign(Path(campaign), keep_going=keep_going)
    ratio = length_ratio(read, scale)
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
    fillings = fill_notices(contents, fill, ratio, read)
    notices = (*reduction_findings(reduction), *fillings, *heel_notices(reduction))
    return ReductionResult(study_reduction(reduction, contents, notices, ratio), reduction, contents)
