"""A measured trial in degrees, m/s and rpm, as a data frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from tank2sim.api.commands import VERBS
from tank2sim.arguments import checked
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import write_together
from tank2sim.notices import Notice
from tank2sim.records.csv_table import CsvTable, is_frame, table_of_frame, table_or_path
from tank2sim.records.reading import READERS, looks_like_a_trial
from tank2sim.records.reading import read_trial_file as read_record
from tank2sim.records.signals.columns import SignalName, file_columns
from tank2sim.records.signals.writing import trial_text
from tank2sim.records.trials import Trial, distinctly_named

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.answer.result import Result
    from tank2sim.cards import SteeredCard
    from tank2sim.cards.form import ThrusterSection
    from tank2sim.identification.trials.problem.prepare_trials import Measured
    from tank2sim.results.audit import AuditResult


class TrialRecord:
    """A free-running trial as it was measured; :func:`read_trial` gives one.

    Angles are in degrees, speeds in m/s, revolutions in rpm, times in s; rudder and turns are positive to starboard.

    Parameters
    ----------
    trial : Trial
        SI and radians.
    """

    def __init__(self, trial: Trial) -> None:
        self.trial = trial

    @property
    def name(self) -> str:
        """File name without its ending."""
        return self.trial.name

    @property
    def path(self) -> Path:
        """The file."""
        return self.trial.path

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Repairs of the data on reading."""
        return self.trial.notices

    @cached_property
    def df(self) -> pd.DataFrame:
        """The record, one row a sample: ``t_s``, ``delta_deg``, ``u_mps``, ``r_degps``, ``psi_deg``, ..."""
        import pandas as pd

        return pd.DataFrame(file_columns(self.trial))

    @property
    def noise(self) -> dict[str, float]:
        """Standard deviation of the measurement by column of :attr:`df`, where the file states it."""
        return {SignalName(name).file: SignalName(name).factor * sigma for name, sigma in self.trial.noise.items()}

    def to_csv(self, path: str | Path | None = None) -> str:
        """The record as text of a trial CSV with its notices as comments, also written to `path`.

        Raises
        ------
        InputError
            The file cannot be written, or is the one that was measured.
        """
        text = trial_text(self.trial, [f"tank2sim, from {self.path.name}", *self.notices])
        if path is not None:
            write_together({Path(path): text}, inputs=[self.path])
        return text

    def audit(self) -> AuditResult:
        """Faults of the data, as :func:`tank2sim.audit` finds them."""
        result: AuditResult = VERBS["audit"].function(self)
        return result

    def signals(
        self,
        columns: Sequence[str] = (),
        *,
        max_gap_s: float | None = None,
        segment_s: float | None = None,
        filter: str | None = None,
    ) -> Result[Any]:
        """Statistics and spectra of the columns, and a `filter`; parameters as for :func:`tank2sim.signals`."""
        result: Result[Any] = VERBS["signals"].function(
            self, columns, max_gap_s=max_gap_s, segment_s=segment_s, filter=filter
        )
        return result

    def __repr__(self) -> str:
        columns = file_columns(self.trial)
        time = columns.pop("t_s")
        return f"{self.name}: {len(time)} rows, {time[0]:.5g} to {time[-1]:.5g} s; columns {', '.join(columns)}"

    def _repr_html_(self) -> str:
        text: str = self.df._repr_html_()
        return text


if TYPE_CHECKING:
    TrialSource: TypeAlias = TrialRecord | Trial | pd.DataFrame | str | Path
    TrialPaths: TypeAlias = TrialSource | Sequence[TrialSource]


@checked
def read_trial(path: str | Path | pd.DataFrame) -> TrialRecord:
    """Read a trial: the project's CSV, a SIMMAN ``.dat`` or an Esso Osaka CSV, by its first line.

    Parameters
    ----------
    path : path or DataFrame
        A data frame has the columns of the project's CSV (``t_s``, ``delta_deg``, ``r_degps``, ...).

    Raises
    ------
    InputError
        The file is missing or of no known format, its content is faulty, or its time does not rise.

    Examples
    --------
    >>> import tempfile
    >>> import tank2sim as t2s
    >>> file = tempfile.mkdtemp() + "/turn.csv"
    >>> text = t2s.load("mariner").turn(35, duration_s=60).to_csv(file)
    >>> trial = t2s.read_trial(file)
    >>> float(trial.df["delta_deg"].max())
    35.0
    """
    return TrialRecord(read_record(table_or_path(path, "path")))


def trial_files(given: TrialPaths, name: str = "trials") -> list[Path]:
    """The files among the trials that are meant; a folder means the trials in it. Raises as :func:`trials_of`."""
    sources = trial_sources(given, name)
    return [
        source.path if isinstance(source, Trial) else source for source in sources if not isinstance(source, CsvTable)
    ]


def trials_of(
    given: TrialPaths, name: str = "trials", *, rising: bool = True, thrusters: Sequence[ThrusterSection] = ()
) -> list[Trial]:
    """The trials that are meant: records as they are, files and data frames read, and of a folder the trials in it.

    `given`: a data frame has the columns of a trial CSV (``t_s``, ``delta_deg``, ``r_degps``, ...); its ``attrs`` are
    the comments of the file (``noise``, ``scale``, ``rudder_sign``, ``origin``); `name`: of the argument, by which data
    frames are called ``trials[0]``, ...; `rising`: False lets times through that do not rise; `thrusters`: those of the
    craft that was tried, by which its files (of records, too) are read; none of a ship with a rudder.

    Raises InputError: it is none of these; as :func:`tank2sim.records.reading.read_trial_file`, or of a craft as
    :func:`tank2sim.records.craft_trials.read_craft_trial`; or a folder holds no trial.
    """
    sources = trial_sources(given, name)
    if thrusters:
        from tank2sim.records.craft_trials import read_craft_trial

        files = [source.path if isinstance(source, Trial) else source for source in sources]
        found = [read_craft_trial(file, thrusters) for file in files]
    else:
        found = [source if isinstance(source, Trial) else read_record(source, rising=rising) for source in sources]
    return distinctly_named(found)[0]


def trial_sources(given: TrialPaths, name: str = "trials") -> list[Trial | Path | CsvTable]:
    """Records, files, and tables of data frames among the trials that are meant. Raises as :func:`trials_of`."""
    several = isinstance(given, Iterable) and not isinstance(given, str | Path | Mapping) and not is_frame(given)
    found: list[Trial | Path | CsvTable] = []
    for number, item in enumerate(given if several else [given]):  # type: ignore[arg-type]
        place = f"{name}[{number}]" if several else name
        if isinstance(item, TrialRecord | Trial):
            found.append(item.trial if isinstance(item, TrialRecord) else item)
        elif is_frame(item):
            found.append(table_of_frame(item, place))
        elif isinstance(item, str | Path):
            found += _files(Path(item))
        else:
            remedy = (
                "give a path, a TrialRecord, or a DataFrame with the columns of a trial CSV (t_s, delta_deg, r_degps)"
            )
            raise ArgumentError(place, "", f"is of the type {type(item).__name__}", remedy)
    return found


def _files(path: Path) -> list[Path]:
    """A file, or the trials in a folder."""
    files = sorted(file for file in path.glob("*") if looks_like_a_trial(file)) if path.is_dir() else [path]
    if not files:
        endings = ", ".join(dict.fromkeys(ending for reader in READERS.values() for ending in reader.suffixes))
        raise InputError(path, "", "holds no trial", f"a folder with trials ({endings}) was expected")
    return files


def fitted_and_held(
    trials: TrialPaths, holdout: TrialPaths, card: SteeredCard, *, report_unused: bool = True
) -> tuple[Measured, Measured]:
    """Trials to be fitted and the trials of `holdout`, at the size of the card's ship.

    `report_unused`: whether a notice says that a wind or depth was measured which no effect of the card uses. Raises
    InputError: a file is at fault (:func:`tank2sim.identification.trials.problem.prepare_trials.measured`), or two have
    one name or are one record, also where one of them is held out; the card was fitted to one that is held out; or
    there is none to fit.
    """
    from tank2sim.cards import SteeredBy
    from tank2sim.identification.craft.problem import measured_of_craft
    from tank2sim.identification.trials.problem.prepare_trials import fitted_as, measured
    from tank2sim.records.same_record import refuse_copies

    of_craft, ship = card.thrusters, None
    groups = distinctly_named(trials_of(trials, thrusters=of_craft), trials_of(holdout, "holdout", thrusters=of_craft))
    if card.steered_by is SteeredBy.THRUSTERS:
        fitted, held = measured_of_craft(card, *groups)
    else:
        ship = card.manoeuvring()
        fitted, held = (measured(group, ship, report_unused=report_unused) for group in groups)
    if not fitted.trials:
        raise InputError("trials", "", "is empty", "give a file of a trial or a folder with trials")
    for trial in held.trials:
        if trial.name in {trial_fitted.name for trial_fitted in fitted.trials}:
            raise trial.fault("", "is both fitted and held out", "hold out what is not fitted")
    held = replace(held, notices=(*refuse_copies(fitted.trials, held.trials), *held.notices))
    for trial in held.trials:
        if ship and (name := fitted_as(ship, trial)) is not None:
            problem = f"is held out, and {card.source} was fitted to it: it is the record of {name}"
            raise trial.fault("", problem, "hold out what the card was not fitted to")
    return fitted, held
