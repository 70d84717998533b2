"""Options of a fit to trials."""

from __future__ import annotations

from dataclasses import dataclass

from tank2sim.identification.trials.methods.posterior_sampling import DRAWS_OF_CHAIN
from tank2sim.identification.trials.problem.structures import BY_EVIDENCE

PIECE = 5.0
"""Length of the pieces of output error, in L/u0: on the KVLCC2 30 s of model time, in which the model's error stays
small against the motion; shorter pieces show less of the derivatives, longer ones diverge on unstable ships."""

BY_RESIDUALS = "residuals"
"""Name of the choice between output error and the Kalman filter by the residuals of the former."""

TRIAL_METHODS: tuple[str, ...] = (BY_RESIDUALS, "output_error", "equation_error", "kalman", "recursive")
"""Methods of the fit, by name."""


@dataclass(frozen=True)
class IdentificationOptions:
    """Options of a fit to trials.

    Parameters
    ----------
    method : str
        One of :data:`TRIAL_METHODS`; :data:`BY_RESIDUALS` fits trials at sea with the Kalman filter if they show gusts
        or waves, and all others by output error (:mod:`.method_choice`).
    structure : str
        One of :data:`tank2sim.identification.trials.problem.structures.STRUCTURES`, :data:`.structures.BY_EVIDENCE`,
        :data:`.structures.AUTO` or :data:`.structures.AVERAGE`.
    inertia : bool
        Estimate acceleration derivatives, too.
    piece_s : float, optional
        Length of the pieces of output error, s; by default :data:`PIECE`.
    scale_prior : bool
        Widen the card's standard errors as far as the trials require.
    members : int
        Simulations for the prediction intervals of the figures of held-out trials; 0 for none.
    bootstrap : int
        Members of a parametric bootstrap of the estimates; 0 for none.
    hold : tuple of str
        Derivatives (``Xuuu``) and parameters of effects (``wind.yaw_coefficient``) that keep the card's values.
    force : bool
        Fit trials even if they look like those of another ship (:mod:`.other_ship`).
    posterior : str
        One of :data:`.posterior_sampling.SAMPLERS`; "" for none.
    draws : int
        Draws of each chain of the posterior.
    """

    method: str = BY_RESIDUALS
    structure: str = BY_EVIDENCE
    inertia: bool = False
    piece_s: float | None = None
    scale_prior: bool = True
    members: int = 100
    bootstrap: int = 0
    hold: tuple[str, ...] = ()
    force: bool = False
    posterior: str = ""
    draws: int = DRAWS_OF_CHAIN
