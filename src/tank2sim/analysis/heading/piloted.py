"""An autopilot with its ship and their motions, and what a study states of its FMU."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tank2sim.analysis.heading.track_keeping import TrackKeeping
from tank2sim.arrays import Array, Columns
from tank2sim.dynamics.model import Model
from tank2sim.notices import Notice
from tank2sim.simulation.trajectory import Trajectory


@dataclass(frozen=True)
class StepError:
    """Largest difference of heading between a co-simulation with a communication step and one model of both."""

    step_s: float
    error_deg: float


@dataclass(frozen=True)
class CoSimulated:
    """Ship and autopilot co-simulated, against one model of both.

    `steps`: rising communication steps; `order`: power of the step by which the difference falls.
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


@dataclass(frozen=True, eq=False, kw_only=True)
class PilotStudy:
    """A controller and its runs, by rudder or by thrusters."""

    # `ship`, `source`: Name of the ship, and how the controller was found, in a sentence.
    ship: str
    source: str
    gains: dict[str, float]  # Figures of the controller by name with their unit
    weather: dict[str, float]  # Fields of :class:`.Weather`, angles in degrees
    # Figures of the track by guidance (``line of sight``, ``with integral``); empty without waypoints.
    track: dict[str, TrackKeeping]
    waypoints_m: Array  # (n, 2): North and east; empty without a track
    # `histories`, `track_histories`: Columns to draw by run, and by guidance.
    histories: dict[str, Columns]
    track_histories: dict[str, Columns]
    notices: tuple[Notice, ...]
    export: AutopilotExport | None = None  # The controller as an FMU, if one was made


@dataclass(frozen=True, eq=False)
class Piloted:
    """A ship or craft and its autopilot, and their simulated motions by name."""

    ship: Model
    autopilot: Model
    runs: Mapping[str, Trajectory]
