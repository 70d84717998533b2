"""A simulated manoeuvre: its figures, its motion as a data frame, and the bands of an ensemble."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.answer.parts import Table
from tank2sim.api.ensemble import FEW, FEW_IN_LANES, EnsembleOptions
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.dynamics.simulator_interface import external_inputs, with_external_forces
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.marks import CHECK
from tank2sim.simulation.card_range import entry_name, single_figures
from tank2sim.simulation.manoeuvres import Manoeuvre, PullOut, parse_manoeuvre
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trial_file import histories, trial_columns, trial_csv
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.analysis.ensemble.results import ManoeuvreBands
    from tank2sim.api.ship import Ship


_LEAST_DEG, _MOST_DEG = 5.0, 45.0
"""Rudder angles that are ordered in manoeuvres, where the card states no largest one: IMO MSC.137(76) has 10 to 35 deg,
spirals go down to 5. Project choice."""


def _doubt_of_radians(run: Run) -> list[str]:
    """A notice if all orders of the rudder are so small in deg that they are angles of manoeuvres in rad."""
    model = run.trajectory.model
    if "rudder.command" not in model.input_names:
        return []
    largest = math.degrees(float(np.abs(run.trajectory["rudder.command"]).max()))
    limits = [parameter.start for parameter in model.parameters if parameter.name == "steering.max_angle"]
    most = math.degrees(limits[0]) if limits else _MOST_DEG
    if not _LEAST_DEG <= math.degrees(largest) <= most + 1e-6:
        return []
    rudder = f"the largest rudder angle is {largest:.3g} deg"
    return [f"{CHECK} {rudder}; if it was meant in rad, give {math.degrees(largest):.3g}: angles are in deg"]


class ManoeuvreResult(PagedResult):
    """A simulated manoeuvre.

    Parameters
    ----------
    ship : Ship
    words : str
        The manoeuvre (``zigzag:20/20``).
    run : Run
        Motion and figures, SI and radians.
    bands : ManoeuvreBands, optional
        Of an ensemble.
    other_side : Run, optional
        Of a pull-out, that from the other side.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> run = t2s.load("mariner").zigzag(20, 20)
    >>> round(run.figures["overshoot_1_deg"])
    8
    >>> list(run.df.columns)[:3]
    ['t_s', 'delta_order_deg', 'delta_deg']
    """

    command = "simulate"

    def __init__(
        self, ship: Ship, words: str, run: Run, bands: ManoeuvreBands | None = None, other_side: Run | None = None
    ) -> None:
        self.ship, self.words, self.run, self.bands, self.other_side = ship, words, run, bands, other_side
        self._of_run = (*_doubt_of_radians(run), *run.notices)
        self.notices = tuple(dict.fromkeys([*self._of_run, *(bands.notices if bands else ())]))

    @property
    def figures(self) -> dict[str, float]:
        """Manoeuvring figures (ITTC 7.5-04-02-01) by name with unit; entries of lists as ``overshoot_1_deg``."""
        return single_figures(self.run.figures)

    @cached_property
    def df(self) -> pd.DataFrame:
        """The motion, one row a step: ``t_s``, ``u_mps``, ``r_degps``, ``psi_deg``, ``x_m`` (north), ``y_m`` (east)."""
        import pandas as pd

        return pd.DataFrame(trial_columns(self.run.trajectory))

    def to_csv(self, path: str | Path | None = None) -> str:
        """The motion as text of a trial CSV, also written to `path`: readable wherever a measured trial is.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        text = trial_csv(self.run.trajectory, f"tank2sim simulation of {self.ship.name}: {self.words}")
        if path is not None:
            write_together({Path(path): text})
        return text

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        particulars = getattr(self.ship.card, "ship", None)
        other = self.other_side
        return {
            "ship": self.ship.name,
            "length_m": getattr(particulars, "length_m", None),
            "beam_m": getattr(particulars, "beam_m", None),
            "manoeuvre": self.words,
            "figures": self.run.figures,
            "limits": self.limits,
            **self.run.reading.as_json(),
            "notices": self._of_run,
            "histories": histories(self.run.trajectory),
            **({"ensemble": asdict(self.bands)} if self.bands else {}),
            **({"other_side": {"figures": other.figures, "histories": histories(other.trajectory)}} if other else {}),
        }

    @property
    def limits(self) -> dict[str, float]:
        """Largest figures that IMO MSC.137(76) allows, by name with unit; empty of manoeuvres that it does not have."""
        from tank2sim.analysis.stability.imo import limits_of

        return {} if self.words.startswith("file:") else limits_of(parse_manoeuvre(self.words), self.ship.model)

    @property
    def headline(self) -> tuple[str, ...]:
        """None: the table says it."""
        return ()

    @property
    def tables(self) -> tuple[Table, ...]:
        """The figures, marked where they were settled outside the card's range; bands of an ensemble."""
        rows = [[*in_words(name), value, self._beyond(name, value)] for name, value in self.run.figures.items()]
        columns: tuple[str, ...] = ("figure", "unit", "value", "card")
        if not self.run.reading.message:
            rows, columns = [row[:3] for row in rows], columns[:3]
        figures = screen_table(self._title, columns, rows)
        if self.bands is None:
            return (figures,)
        from tank2sim.results.ensembles import band_table

        return figures, band_table(self.bands, self.bands.figures)

    @property
    def _title(self) -> str:
        return f"{self.ship.name}, {self.words}"

    def _beyond(self, name: str, value: object) -> str:
        """Whether a figure was settled outside the card's range; of a list, from which entry on."""
        reading = self.run.reading
        if not isinstance(value, list):
            return "beyond" if value is not None and reading.outside(name) else ""
        outside = [place for place in range(len(value)) if reading.outside(entry_name(name, place))]
        return "" if not outside else "beyond" if outside[0] == 0 else f"beyond from no. {outside[0] + 1}"


def simulate_manoeuvre(
    ship: Ship,
    manoeuvre: Manoeuvre,
    words: str,
    duration_s: float | None,
    ensemble: EnsembleOptions,
    external: Mapping[str, float] | None = None,
) -> ManoeuvreResult:
    """Simulate a manoeuvre of a ship, called by its `words`, with an ensemble if it has members.

    Parameters
    ----------
    ship, manoeuvre, words
        What is simulated, and what it is called.
    duration_s : float or None
        None: as long as the manoeuvre needs.
    ensemble : EnsembleOptions
        Size, seed and computer of the ensemble.
    external : mapping, optional
        As in :meth:`.Ship.simulate`.

    Raises
    ------
    InputError
        As :meth:`.Ship.simulate`.
    """
    if external and ensemble.members:
        raise InputError("external", "", "cannot act on an ensemble", "leave out either the members or the force")
    inputs = external_inputs(external or {}, rolls="force.K" in ship.model)
    model = with_external_forces(ship.model) if inputs else ship.model
    run = simulate(model, manoeuvre, duration_s=duration_s, inputs=inputs)
    other = None
    if isinstance(manoeuvre, PullOut):
        other = simulate(model, PullOut(-manoeuvre.rudder), duration_s=duration_s, inputs=inputs)
    bands = None
    if ensemble.members:
        from tank2sim.analysis.ensemble.results import EnsembleRequest, manoeuvre_bands
        from tank2sim.simulation.lane_figures import runs_in_lanes

        length = duration_s, float(run.trajectory.t[-1])
        request = EnsembleRequest(ensemble.members, ensemble.seed)
        with ensemble.computing(FEW_IN_LANES if runs_in_lanes(manoeuvre, duration_s) else FEW) as executor:
            bands = manoeuvre_bands(ship.manoeuvring(), manoeuvre, length, request, executor)
    return ManoeuvreResult(ship, words, run, bands, other)
