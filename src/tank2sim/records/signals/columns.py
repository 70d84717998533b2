"""Names, words and units of the signals of a trial, as a reader of its file knows them."""

from __future__ import annotations

from dataclasses import dataclass

from tank2sim.arrays import Array
from tank2sim.records.trials import SIGNALS, Trial
from tank2sim.units import from_si, to_si

HELD_COLUMNS = frozenset(name for name in SIGNALS if "held" in SIGNALS[name])
"""Signals that hold until their next value: orders."""

DIRECTION_COLUMNS = frozenset(name for name in SIGNALS if "direction" in SIGNALS[name])
"""Signals that go round the compass: a step through north is not a jump."""

# Suffix in SI to the suffix in which the trial format writes it, and to the unit as it is read.
_FILE_SUFFIX = {"rad": "deg", "radps": "degps"}
_UNIT = {"deg": "deg", "degps": "deg/s", "rpm": "rpm", "mps": "m/s", "m": "m"}


@dataclass(frozen=True)
class SignalName:
    """One signal of a trial.

    Parameters
    ----------
    si : str
        Its name in SI, the key in ``Trial.signals``: ``r_radps``.
    """

    si: str

    @property
    def stem(self) -> str:
        """The quantity without its unit: ``r``."""
        return self.si.rpartition("_")[0] or self.si

    @property
    def file(self) -> str:
        """Its column in a trial file: ``r_degps``, ``n_rpm``."""
        stem, _, suffix = self.si.rpartition("_")
        return "n_rpm" if self.si == "n_radps" else f"{stem}_{_FILE_SUFFIX.get(suffix, suffix)}"

    @property
    def unit(self) -> str:
        """Unit of that column, for a reader: ``deg/s``."""
        return _UNIT.get(self.file.rpartition("_")[2], "")

    @property
    def words(self) -> str:
        """The quantity in words: ``yaw rate``."""
        return str(SIGNALS.get(self.si, {}).get("words", self.stem.replace("_", " ")))

    @property
    def factor(self) -> float:
        """Value in that column over the value in SI."""
        return from_si(self.file, 1.0)


def file_columns(trial: Trial) -> dict[str, Array]:
    """Columns (n,) of a trial by their names and in the units of a trial file, ``t_s`` first."""
    names = {SignalName(name): values for name, values in trial.signals.items()}
    return {"t_s": trial.time_s, **{name.file: name.factor * values for name, values in names.items()}}


def find_signal(asked: str, trial: Trial) -> str:
    """The name in SI of a signal asked for as ``r_degps``, ``r_radps``, ``r``, or as its file calls it.

    Raises InputError: The signal is not in the trial.
    """
    name = to_si(asked, 1.0)[0]
    for signal in trial.signals:
        if name in (signal, SignalName(signal).stem) or asked == trial.heading(signal):
            return signal
    columns = ", ".join(SignalName(signal).file for signal in trial.signals)
    raise trial.fault(f"column {asked}", "is not in the trial", f"give one of {columns}")
