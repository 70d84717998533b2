"""The catalogue of steering models that paper 4 compares, as far as their equations are published."""

from tank2sim.dynamics.steering_models.base import BASE, PAVLENKO, SOBOLEV
from tank2sim.dynamics.steering_models.form import SteeringCoefficient, SteeringForm
from tank2sim.dynamics.steering_models.inoue_hirano import INOUE_HIRANO
from tank2sim.dynamics.steering_models.motion import steering_model

STEERING_FORMS: dict[str, SteeringForm] = {form.name: form for form in (BASE, INOUE_HIRANO, PAVLENKO, SOBOLEV)}
"""The forms by their names, as a card gives them."""

__all__ = ["STEERING_FORMS", "SteeringCoefficient", "SteeringForm", "steering_model"]
