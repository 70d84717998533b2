"""An autopilot with its ship and their motions, and what a study states of its FMU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tank2sim.dynamics.model import Model
from tank2sim.simulation.trajectory import Trajectory


@dataclass(frozen=True)
class StepError:
    """Largest difference of heading between a co-simulation with a communication step and one model of both."""

    step_s: float
    error_deg: float


@dataclass(frozen=True)
class CoSimulated:
    """Ship and autopilot co-simulated, against one model of both.

    Parameters
    ----------
    steps : tuple of StepError
        Rising communication steps.
    order : float
        Power of the step by which the difference falls.
    """

    steps: tuple[StepError, ...]
    order: float


@dataclass(frozen=True, kw_only=True)
class AutopilotExport:
    """The controller as an FMU: where it goes, version of FMI, identifier, token, platforms, size."""

    path: str
    fmi: int
    model_identifier: str
    token: str
    platforms: tuple[str, ...]
    size_bytes: int
    co_simulation: CoSimulated | None = None


@dataclass(frozen=True, eq=False)
class Piloted:
    """A ship or craft and its autopilot, and their simulated motions by name."""

    ship: Model
    autopilot: Model
    runs: Mapping[str, Trajectory]
