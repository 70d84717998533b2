"""A vessel's own log, from its streams to trials."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tank2sim.api.verbs import Written, verb
from tank2sim.errors import ArgumentError
from tank2sim.files import folder_made, write_together

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.apps.logs.channels import ChannelSet
    from tank2sim.apps.logs.result import LogResult
    from tank2sim.apps.logs.streams import VesselLog
    from tank2sim.apps.logs.stretches import Stretch
    from tank2sim.apps.logs.trial_files import TrialCut
    from tank2sim.apps.logs.voyage import Voyage
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.craft_identification import CraftIdentificationResult


@verb("a vessel's own log, cut into trials", results=("tank2sim.apps.logs.result:LogResult",))
def log(
    files: str | Path | pd.DataFrame | Sequence[str | Path | pd.DataFrame],
    output: str | Annotated[Path, Written((), "DIR", by_function=True)] | None = None,
    *,
    channels: str | Path | ChannelSet | None = None,
    card: Vessel | str | Path | None = None,
) -> LogResult:
    """Read the logs of a vessel, find which stream is which quantity, and cut its manoeuvres into trials.

    Formats: NMEA 0183, NMEA 2000 (candump, Actisense), ROS 1 and ROS 2 bags, MCAP, ArduPilot ``.bin`` and ``.tlog``,
    PX4 ULog, any CSV. All but CSV need the extra ``tank2sim[logs]``. Channels are written to ``channels.toml`` with
    their confidence; correct that file and run again, and it is used unchanged.

    Several files are one voyage: parts that follow each other, or other instruments of the same time. Files with the
    same columns that are apart in time, or whose clocks start again, are records of their own: channels are found from
    all of them together, and no stretch reaches from one into another.

    Parameters
    ----------
    files : path, DataFrame, or sequence of them
        Logs of one vessel; a data frame is read as a CSV file of its columns.
    output : path, optional
        Folder for ``channels.toml`` and the trials.
    channels : path or ChannelSet, optional
        File that states which stream is which quantity; by default ``channels.toml`` of the folder if it exists, else
        the channels are found.
    card : Vessel, str or path, optional
        Card of a small craft: states for each coefficient whether these trials determine it, and which five minutes
        would.

    Raises
    ------
    InputError
        A file is missing, of no known format or broken, a library is missing, the channels file is wrong, or nothing in
        the logs is understood.

    Examples
    --------
    >>> import tempfile
    >>> import tank2sim as t2s
    >>> file = tempfile.mkdtemp() + "/voyage.csv"
    >>> text = t2s.load("mariner").zigzag(20, 20).to_csv(file)
    >>> found = t2s.log(file)
    >>> list(found.stretches["kind"])[-1]
    'zigzag'
    """
    from tank2sim.api.trial import TrialRecord
    from tank2sim.apps.logs.result import LogResult
    from tank2sim.apps.logs.study import study_log
    from tank2sim.apps.logs.voyage import make_voyage

    named = _named(files)
    folder = None if output is None else Path(output)
    with nullcontext() if folder is None else folder_made(folder):
        stated = _stated(channels, folder)
        craft = None if card is None else _craft(card)
        voyage = make_voyage([_read(name, file) for name, file in named.items()], stated)
        found, cuts = _cut(voyage)
        identified = None if craft is None else _identified(craft, cuts)
        study = replace(study_log(voyage, found, cuts), identified=identified.study if identified else None)
        trials = tuple(TrialRecord(cut.trial) for cut in cuts if cut.steered)
        result = LogResult(study, voyage, tuple(found), tuple(cuts), trials, identified)
        return result if folder is None else result.written_to(folder)


def _stated(channels: str | Path | ChannelSet | None, folder: Path | None) -> ChannelSet | None:
    """Channels that are given, or in the file of an earlier run; None without either."""
    from tank2sim.apps.logs.channels import CHANNELS_FILE, read_channels

    if channels is None and folder is not None and (folder / CHANNELS_FILE).is_file():
        channels = folder / CHANNELS_FILE
    return read_channels(Path(channels)) if isinstance(channels, str | Path) else channels


def _named(files: str | Path | pd.DataFrame | Sequence[str | Path | pd.DataFrame]) -> dict[str, Any]:
    """Logs by the names of their arguments."""
    from tank2sim.records.csv_table import is_frame

    if isinstance(files, str | Path) or is_frame(files):
        return {"files": files}
    if not len(files):
        raise ArgumentError("files", "", "is empty", "give at least one log")
    return {f"files[{number}]": file for number, file in enumerate(files)}


def _cut(voyage: Voyage) -> tuple[list[Stretch], list[TrialCut]]:
    """Stretches and trials of each record; trials are numbered through."""
    from tank2sim.apps.logs.stretches import find_stretches
    from tank2sim.apps.logs.trial_files import cut_trials
    from tank2sim.apps.logs.voyage import records_of

    found: list[Stretch] = []
    cuts: list[TrialCut] = []
    for record in records_of(voyage):
        found += (stretches := find_stretches(record))
        cuts += cut_trials(record, stretches, len(cuts) + 1)
    return found, cuts


def _read(name: str, file: str | Path | pd.DataFrame) -> VesselLog:
    """A log; a data frame goes through a file, for a log may have dates, units and words in any form."""
    from tank2sim.apps.logs.reading import read_log
    from tank2sim.records.csv_table import is_frame

    if not is_frame(file):
        return read_log(Path(file))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.csv"
        file.to_csv(path, index=file.index.name is not None)
        return replace(read_log(path), path=Path(name))


def _craft(card: Vessel | str | Path) -> Vessel:
    """A small craft; InputError for a ship with a rudder."""
    from tank2sim.cards import SteeredBy
    from tank2sim.dynamics.vessel import as_vessel

    craft = as_vessel(card)
    if craft.steered().steered_by is SteeredBy.RUDDER:
        remedy = "give the card of a small craft; of a ship with a rudder run identify on the trials"
        raise craft.card.fault("model.kind", f"is {craft.card.model.kind}", remedy)
    return craft


def _identified(craft: Vessel, cuts: Sequence[TrialCut]) -> CraftIdentificationResult | None:
    """Coefficients of a craft from all trials; None without any."""
    from tank2sim.api.identification import identify_craft
    from tank2sim.api.trial import trials_of

    card = craft.steered()
    turning = any(thruster.max_azimuth_rad is not None for thruster in card.thrusters)
    taken = [cut for cut in cuts if turning or not cut.steered]
    if not taken:
        return None
    with tempfile.TemporaryDirectory() as name:
        paths = [Path(name) / cut.trial.path.name for cut in taken]
        write_together({path: cut.text for path, cut in zip(paths, taken, strict=True)})
        return identify_craft(card, trials_of(paths, thrusters=card.thrusters), [])
