"""Steady captive tests reduced to the coefficients of the MMG method."""

from __future__ import annotations

from pathlib import Path

from tank2sim.arguments import checked
from tank2sim.identification.captive_mmg.regression import fit_mmg
from tank2sim.identification.captive_mmg.steady_tests import read_steady_tests
from tank2sim.identification.captive_mmg.study import mmg_card, study_mmg
from tank2sim.results.mmg_reduction import MmgReductionResult


@checked
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
    fit = fit_mmg(read_steady_tests(Path(campaign)))
    return MmgReductionResult(study_mmg(fit), fit, mmg_card(fit))
