"""The office after a sea trial."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, verb
from tank2sim.arguments import VALIDATION_MEMBERS, AngleArgument, SmallEnsemble
from tank2sim.quantities import Draught, SeaState, WaterDepth, WindSpeed

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.trial import TrialRecord
    from tank2sim.apps.trial_office.result import TrialOfficeResult
    from tank2sim.dynamics.vessel import Vessel


@verb(
    "the report of a sea trial, corrected to full load and calm water",
    Output(
        "-o", (), "Write report, form, poster, pilot card and cards.", lambda result, path: result.files(path), "DIR"
    ),
    name="trials",
    options={"ship": "--ship"},
    results=("tank2sim.apps.trial_office.result:TrialOfficeResult",),
)
def trial_office(
    trials: str | Path | TrialRecord | pd.DataFrame | Sequence[str | Path | TrialRecord | pd.DataFrame] = (),
    *,
    ship: Vessel | str | Path,
    notes: str | Path | None = None,
    draught_fore_m: Draught | None = None,
    draught_aft_m: Draught | None = None,
    full_load_draught_m: Draught | None = None,
    depth_m: WaterDepth | None = None,
    wind_speed_mps: WindSpeed | None = None,
    wind_from_deg: AngleArgument | None = None,
    sea_state: SeaState | None = None,
    members: SmallEnsemble = VALIDATION_MEMBERS,
) -> TrialOfficeResult:
    """Make the report of a sea trial: conditions, figures without current and wind, the ship at full load, a verdict.

    The current comes from the turns (MSC/Circ.1053, 3.4.2), to both sides, for a wind drifts them, too. Full load is
    R = T F/B: measured T, and simulated F at full load over B as tried.

    Parameters
    ----------
    trials : path, TrialRecord, DataFrame, or sequence of them
        Records of turns to both sides, zigzags and stops; a folder means the trials in it.
    ship : Vessel, str or path
        Card of the ship, by default at full load.
    notes : path, optional
        TOML file of the trial master's notes; its keys are the arguments below, and those of
        :class:`~tank2sim.apps.trial_office.notes.TrialNotes`.
    draught_fore_m, draught_aft_m : float, optional
        Draughts of the trial, m; by default the card's, on even keel.
    full_load_draught_m : float, optional
        Draught at full load, m; by default the card's.
    depth_m : float, optional
        Depth of the water, m.
    wind_speed_mps, wind_from_deg : float, optional
        True wind where the records have none: m/s, and the direction it comes from, deg clockwise from north.
    sea_state : int, optional
        By the code of the WMO.
    members : int
        Ships drawn within the errors of the card, for the intervals.

    Raises
    ------
    InputError
        No record holds a manoeuvre, a file is at fault, or the card is not one of a ship with a rudder.

    Examples
    --------
    >>> import tempfile
    >>> import tank2sim as t2s
    >>> folder, ship = tempfile.mkdtemp(), t2s.load("mariner")
    >>> for rudder in (35, -35):
    ...     text = ship.turn(rudder, duration_s=1100).to_csv(f"{folder}/turn{rudder}.csv")
    >>> found = t2s.trial_office(folder, ship="mariner", members=0)
    >>> found.study.current.speed_mps < 0.01
    True
    """
    from tank2sim.api.trial import trials_of
    from tank2sim.apps.trial_office.notes import TrialNotes, notes_with, read_notes
    from tank2sim.apps.trial_office.result import TrialOfficeResult
    from tank2sim.apps.trial_office.study import study_trials
    from tank2sim.dynamics.vessel import as_vessel

    given = TrialNotes() if notes is None else read_notes(notes)
    given = notes_with(
        given,
        "trials" if notes is None else notes,
        draught_fore_m=draught_fore_m,
        draught_aft_m=draught_aft_m,
        full_load_draught_m=full_load_draught_m,
        depth_m=depth_m,
        wind_speed_mps=wind_speed_mps,
        wind_from_deg=wind_from_deg,
        sea_state=sea_state,
    )
    card = as_vessel(ship).manoeuvring()
    none = isinstance(trials, list | tuple) and not trials
    return TrialOfficeResult(*study_trials(card, [] if none else trials_of(trials), given, members))
