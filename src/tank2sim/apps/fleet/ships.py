"""A fleet: a folder with a sub-folder for each ship, which holds its card and its trials.

::

    FOLDER/
      mariner/       ship.toml  zigzag.csv  turn.csv  holdout/pullout.csv
      esso osaka/    card.toml  ...
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tank2sim.errors import InputError
from tank2sim.files import read_exact_text
from tank2sim.gap.outcome.files import GAP, IMPROVED
from tank2sim.records.reading import called_like_a_trial, looks_like_a_trial, reader_of

HOLDOUT = "holdout"
"""Sub-folder of a ship with the trials that are held out."""

_SHIP, _CAMPAIGN = "tank2sim-ship/", "tank2sim-campaign/"


@dataclass(frozen=True)
class ShipFolder:
    """Files of a ship's card and trials.

    Parameters
    ----------
    name : str
        Name of the folder.
    card : Path
    trials, holdout : tuple of Path
        Fitted and held out, in the order of their names; none held out without that sub-folder.
    """

    name: str
    card: Path
    trials: tuple[Path, ...]
    holdout: tuple[Path, ...]

    @property
    def inputs(self) -> tuple[Path, ...]:
        """All files that are read."""
        return (self.card, *self.trials, *self.holdout)


@dataclass(frozen=True)
class Fleet:
    """The ships of a folder.

    Parameters
    ----------
    folder : Path
    ships : tuple of ShipFolder
    faults : mapping
        Folder's name to its fault, one line.
    passed_over : tuple of Path
        Sub-folders that hold neither card nor trial.
    """

    folder: Path
    ships: tuple[ShipFolder, ...]
    faults: dict[str, str]
    passed_over: tuple[Path, ...] = ()


def fleet_in(folder: Path, output: Path) -> Fleet:
    """The ships in a folder, without hidden folders, the folder of the results, and those without card and trials.

    Parameters
    ----------
    folder : Path
    output : Path
        Where the results go, which may be inside it.

    Raises
    ------
    InputError
        There is no ship, or the results would be written to the folder of the ships.
    """
    if output.exists() and (output.samefile(folder) or (output.parent.samefile(folder) and _cards(output))):
        raise InputError(output, "", "is the folder of a ship's card and trials", "give a folder of its own with -o")
    ships, faults, passed_over = [], {}, []
    for path in _folders_in(folder, output):
        try:
            ship = ship_in(path)
        except InputError as error:
            faults[path.name] = str(error)
            continue
        if ship:
            ships.append(ship)
        else:
            passed_over.append(path)
    if not ships and not faults:
        remedy = "a folder with a sub-folder for each ship was expected, in it its card (.toml) and its trials"
        raise InputError(folder, "", "holds no ship", remedy)
    return Fleet(folder, tuple(ships), faults, tuple(passed_over))


def ship_in(folder: Path) -> ShipFolder | None:
    """The ship whose card and trials are in a folder; None if it has neither.

    Raises
    ------
    InputError
        There is a card and no trial, a trial and no card, or more than one card; a file next to the card is
        named like a trial and is not one; or a file cannot be read.
    """
    cards, (trials, rejected) = _cards(folder), _trials(folder)
    if not cards:
        if not trials:
            return None
        raise InputError(folder, "", "holds trials and no ship card", "put its card (.toml) next to them")
    if len(cards) > 1:
        names = ", ".join(path.name for path in cards)
        raise InputError(folder, "", f"holds {len(cards)} cards ({names})", "leave one of them there")
    _refuse(rejected)
    if not trials:
        raise InputError(folder, "", "holds a card and no trial", "put its trials (.csv or .dat) next to the card")
    held: tuple[Path, ...] = ()
    if (folder / HOLDOUT).is_dir():
        held, rejected = _trials(folder / HOLDOUT)
        _refuse(rejected)
        if not held:
            raise InputError(folder / HOLDOUT, "", "holds no trial", "put one there, or take the folder away")
    return ShipFolder(folder.name, cards[0], trials, held)


def ship_alone(folder: Path) -> ShipFolder | None:
    """The ship whose card is in a folder itself, which then is not a fleet; None if the folder has no card.

    Raises
    ------
    InputError
        As :func:`ship_in`; or its sub-folders hold cards, too.
    """
    if not _cards(folder):
        return None
    for path in _folders_in(folder):
        if path.name != HOLDOUT and _cards(path):
            remedy = "take one of them away, or give the card with its trials"
            raise InputError(folder, "", f"holds a card, and so does its sub-folder {path.name}", remedy)
    return ship_in(folder)


def _folders_in(folder: Path, output: Path | None = None) -> list[Path]:
    """Sub-folders in the order of their names, without folders of results, and without the one for these."""
    found = [path for path in sorted(_visible(folder)) if path.is_dir() and not _is_of_results(path)]
    return [path for path in found if output is None or not output.exists() or not output.samefile(path)]


def _is_of_results(folder: Path) -> bool:
    return (folder / GAP).is_file() and {path.name for path in folder.glob("*.toml")} <= {IMPROVED}


def _visible(folder: Path) -> list[Path]:
    try:
        return [path for path in folder.iterdir() if not path.name.startswith(".")]
    except OSError as error:
        raise InputError(folder, "", f"cannot be read ({error.strerror})", "check its permissions") from None


def _cards(folder: Path) -> list[Path]:
    """The cards in a folder. A campaign of captive tests has a TOML file as well, and CSV files of other tests."""
    found = [path for path in sorted(_visible(folder)) if path.suffix.lower() == ".toml" and path.is_file()]
    texts = {path: read_exact_text(path) for path in found}
    named = [path for path, text in texts.items() if _SHIP in text]
    # A file that is neither may be a card with a fault, which its reader reports.
    return named or ([] if any(_CAMPAIGN in text for text in texts.values()) else found)


def _trials(folder: Path) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Trials, and files that are named like trials and are not."""
    called = [path for path in sorted(_visible(folder)) if called_like_a_trial(path) and path.is_file()]
    found = [path for path in called if _is_trial(path)]
    return tuple(found), tuple(path for path in called if path not in found)


def _refuse(rejected: tuple[Path, ...]) -> None:
    """Refuse files that are named like trials and are not: with a mistyped header, or something else."""
    for path in rejected[:1]:
        why = (
            "no column t_s"
            if path.suffix.lower() == ".csv"
            else f"it does not begin like {reader_of(path).description}"
        )
        raise InputError(path, "", f"is not a trial: {why}", "correct its header, or move it elsewhere")


def _is_trial(path: Path) -> bool:
    try:
        return looks_like_a_trial(path)
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check its permissions") from None
