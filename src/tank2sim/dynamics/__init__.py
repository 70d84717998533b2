"""The equations, each once, in CasADi; :func:`build` makes the model of a card."""

from tank2sim.dynamics.build import build
from tank2sim.dynamics.model import Model

__all__ = ["Model", "build"]
