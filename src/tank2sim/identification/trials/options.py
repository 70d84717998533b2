"""Options of a fit to trials. Nothing heavy is imported here: the help of the command has these names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PIECE = 5.0
"""Length of the pieces of output error, in L/u0: on the KVLCC2 30 s of model time, in which the model's error stays
small against the motion; shorter pieces show less of the derivatives, longer ones diverge on unstable ships."""

TrialMethod = Literal["residuals", "output_error", "equation_error", "kalman"]
"""Methods of the fit, by name."""

BY_RESIDUALS: TrialMethod = "residuals"
"""The residuals of output error decide between output error and the Kalman filter."""

AUTO, AVERAGE, BY_EVIDENCE = "auto", "average", "evidence"
"""Structures that are not one structure: see :data:`STRUCTURE_WORDS`."""

STRUCTURE_WORDS = {
    "linear": "linear derivatives alone (3.5)",
    "card": "the terms and effects of the card",
    "cross_flow": "linear hull, cross-flow drag, rudder in the propeller's slipstream",
    "third_order": "the card's terms and all third-order terms in v and r",
    AUTO: "cross-validation decides",
    AVERAGE: "intervals of all structures, weighted by their predictions, with the card of the best",
    BY_EVIDENCE: "cross_flow, or card if an information criterion or predictions of trials left out clearly prefer it",
}
"""Built-in structures of the model and choices among them, in a few words."""

Sampler = Literal["nuts", "ensemble"]
"""Samplers of the posterior: no-U-turn, and an ensemble of walkers."""

DRAWS_OF_CHAIN = 400
"""Draws of each chain of the posterior. Each is worth about one independent draw; 1600 in four chains bring R-hat of 24
parameters below its limit (project choice)."""


@dataclass(frozen=True)
class IdentificationOptions:
    """Options of a fit to trials.

    Parameters
    ----------
    method : str
        One of :data:`TrialMethod`; :data:`BY_RESIDUALS` fits trials at sea with the Kalman filter if they show gusts
        or waves, and all others by output error (:mod:`.model_selection`).
    structure : str
        One of :data:`STRUCTURE_WORDS` or of an installed package.
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
        Fit trials even if they look like another ship's (:mod:`.other_ship`).
    posterior : str, optional
        One of :data:`Sampler`.
    draws : int
        Draws of each chain of the posterior.
    """

    method: TrialMethod = BY_RESIDUALS
    structure: str = BY_EVIDENCE
    inertia: bool = False
    piece_s: float | None = None
    scale_prior: bool = True
    members: int = 100
    bootstrap: int = 0
    hold: tuple[str, ...] = ()
    force: bool = False
    posterior: Sampler | None = None
    draws: int = DRAWS_OF_CHAIN
