"""Study of a simulated manoeuvre: its figures, their limits, and the motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.ensemble.results import ManoeuvreBands
from tank2sim.analysis.stability.imo import limits_of
from tank2sim.arrays import Columns
from tank2sim.dynamics.model import Model
from tank2sim.notices import Notice, caution
from tank2sim.simulation.figures import Figures
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import Run
from tank2sim.simulation.trial_file import histories

_LEAST_DEG, _MOST_DEG = 5.0, 45.0
"""Rudder angles that are ordered in manoeuvres, where the card states no largest one: IMO MSC.137(76) has 10 to 35 deg,
spirals go down to 5. Project choice."""


@dataclass(frozen=True, eq=False)
class OtherSide:
    """Figures and motion of the pull-out from the other side."""

    figures: Figures
    histories: Columns


@dataclass(frozen=True, eq=False, kw_only=True)
class ManoeuvreStudy:
    """A simulated manoeuvre.

    Parameters
    ----------
    length_m, beam_m : float, optional
        Dimensions of the ship; None if its card does not state them.
    manoeuvre : str
        Name with its argument: ``zigzag:20/20``.
    limits : dict
        Largest figures that IMO MSC.137(76) allows, by name with unit; empty for manoeuvres without any.
    left_card_range_s : float, optional
        Time at which the run leaves the card's range, s from the order.
    left_card_range_by : str
        Quantities that leave it, with both ranges.
    outside_card_range : tuple of str
        Names of the figures outside the card's range; entries of lists as ``overshoot_1_deg``.
    histories : dict
        Columns of a trial file, thinned for charts.
    other_side : OtherSide, optional
        Of a pull-out.
    """

    ship: str
    length_m: float | None
    beam_m: float | None
    manoeuvre: str
    figures: Figures
    limits: dict[str, float]
    left_card_range_s: float | None
    left_card_range_by: str
    outside_card_range: tuple[str, ...]
    histories: Columns
    notices: tuple[Notice, ...]
    other_side: OtherSide | None = None
    ensemble: ManoeuvreBands | None = None

    @property
    def kind(self) -> str:
        """Name of the manoeuvre without its argument: ``zigzag``."""
        return self.manoeuvre.partition(":")[0]

    @property
    def argument(self) -> str:
        """Argument of the manoeuvre: ``20/20``; empty without one."""
        return self.manoeuvre.partition(":")[2]


def study_manoeuvre(
    model: Model, words: str, run: Run, particulars: object, other_side: Run | None = None
) -> ManoeuvreStudy:
    """Return the study of a run.

    Parameters
    ----------
    model : Model
        The ship, at the speed of its card.
    words : str
        Name of the manoeuvre with its argument.
    particulars : object
        Section of the card with ``length_m`` and ``beam_m``, where it has them.
    other_side : Run, optional
        The pull-out from the other side.
    """
    other = None
    if other_side is not None:
        other = OtherSide(other_side.figures, histories(other_side.trajectory))
    reading = run.reading
    return ManoeuvreStudy(
        ship=model.name,
        length_m=getattr(particulars, "length_m", None),
        beam_m=getattr(particulars, "beam_m", None),
        manoeuvre=words,
        figures=run.figures,
        limits={} if words.startswith("file:") else limits_of(parse_manoeuvre(words), model),
        left_card_range_s=reading.exit_s,
        left_card_range_by=reading.how,
        outside_card_range=reading.outside_names,
        histories=histories(run.trajectory),
        notices=tuple(dict.fromkeys([*_doubt_of_radians(run), *run.notices])),
        other_side=other,
    )


def _doubt_of_radians(run: Run) -> list[Notice]:
    """A notice if all orders of the rudder are so small in deg that they are angles of manoeuvres in rad."""
    model = run.trajectory.model
    if "rudder.command" not in model.input_names:
        return []
    largest = math.degrees(float(np.abs(run.trajectory["rudder.command"]).max()))
    limit = model.defaults.get("steering.max_angle")
    most = _MOST_DEG if limit is None else math.degrees(limit)
    if not _LEAST_DEG <= math.degrees(largest) <= most + 1e-6:
        return []
    rudder = f"the largest rudder angle is {largest:.3g} deg"
    return [caution(f"{rudder}; if it was meant in rad, give {math.degrees(largest):.3g}: angles are in deg")]
