"""The model of Pavlenko, as far as paper 4 prints it: the form (1), in which a card may give its coefficients."""

from __future__ import annotations

from tank2sim.dynamics.steering_models.base import EQUATION_1, PAPER_4, equation_1
from tank2sim.dynamics.steering_models.form import SteeringForm

PAVLENKO = SteeringForm(
    name="pavlenko",
    title="model of Pavlenko",
    source=f"{PAPER_4}, which names Pavlenko, V. G. (1991), Khodkost i upravlyaemost sudov, Transport, Moscow",
    coefficients=EQUATION_1,
    rates=equation_1,
    missing=(
        "the paper prints neither coefficients nor results of it: they agree worse with the trials, it says",
        'it has "another set of terms in the right-hand sides" of (1); which ones is not printed, and (1) as printed '
        "is used here in their place",
    ),
)
"""The model of Pavlenko."""
