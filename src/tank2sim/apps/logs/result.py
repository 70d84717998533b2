"""Result of ``log``: channels, stretches and trials of a vessel's log."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tank2sim.answer.charts.motion import History, Signal, TimeMark, TrackData, history_chart, track_chart
from tank2sim.answer.parts import (
    Cell,
    Column,
    Illustration,
    KeyFigure,
    Section,
    Table,
    Verdict,
    data_frame,
    records_table,
    table,
)
from tank2sim.answer.result import Result
from tank2sim.apps.logs.channels import CHANNELS_FILE, channels_text
from tank2sim.apps.logs.gear import LoggedGear
from tank2sim.apps.logs.quantities import QUANTITIES, TIME_LINES
from tank2sim.apps.logs.stretches import Stretch
from tank2sim.apps.logs.study import LogStudy
from tank2sim.apps.logs.trial_files import TrialCut, remove_earlier_trials
from tank2sim.apps.logs.voyage import DriftCurrent, Voyage
from tank2sim.arrays import Columns
from tank2sim.files import folder_made, write_together
from tank2sim.notices import Notice
from tank2sim.results.craft_identification import CraftIdentificationResult, craft_sections

if TYPE_CHECKING:
    import pandas as pd

_UNITS = {name: QUANTITIES[name].units for name in TIME_LINES}
_SIGNALS = tuple(
    Signal(name, words, next(iter(_UNITS[name])), display_unit="rpm" if "rpm" in _UNITS[name] else None)
    for name, words in TIME_LINES.items()
)

_MOST_TRACKS = 8
"""Stretches that have a line of their own on the map. Project choice: as many colours can be distinguished."""

_MOST_NAMED_LOGS = 4
"""Files that the title and the headline name. Project choice: one line of the screen."""

_UNSURE = 0.7
"""Confidence below which an unused channel is named under the table. Project choice."""


@dataclass(frozen=True, eq=False, repr=False)
class LogResult(Result[LogStudy]):
    """Channels, stretches and trials of a vessel's log.

    Parameters
    ----------
    study : LogStudy
    voyage : Voyage, optional
        None if the result was read from its JSON; the following are then empty, too.
    found : tuple of Stretch
    cuts : tuple of TrialCut
        Stretches as trials.
    trials : tuple of TrialRecord
        The trials with a rudder.
    craft : CraftIdentificationResult, optional
        Coefficients of the craft from all trials, if its card was given.
    written : tuple of Path
        Files that were written.
    remarks : tuple of Notice
        Sentences on files of an earlier run.
    """

    study: LogStudy
    voyage: Voyage | None = None
    found: tuple[Stretch, ...] = ()
    cuts: tuple[TrialCut, ...] = ()
    trials: tuple[Any, ...] = ()
    craft: CraftIdentificationResult | None = None
    written: tuple[Path, ...] = ()
    remarks: tuple[Notice, ...] = ()
    command: ClassVar[str] = "log"

    @property
    def channels(self) -> pd.DataFrame:
        """Channels, a row each: quantity, stream, unit, sign, confidence, use, why."""
        return data_frame(map(asdict, self.study.channels))

    @property
    def stretches(self) -> pd.DataFrame:
        """Stretches, a row each: kind, UTC, begin and duration (s), rudder, heading change (deg), speeds, file."""
        return data_frame([{**asdict(stretch), "kind": stretch.kind.value} for stretch in self.study.stretches])

    @property
    def identified(self) -> CraftIdentificationResult | None:
        """Coefficients of the craft from all trials, with a verdict on each; None without its card or trials."""
        if self.craft is None and self.study.identified is not None:
            return CraftIdentificationResult(self.study.identified)
        return self.craft

    @property
    def series(self) -> dict[str, pd.DataFrame]:
        """Quantity to a frame of ``time_s`` (UTC, s since 1970) and ``value`` (SI) of each channel in use."""
        series = self.voyage.series if self.voyage else {}
        return {name: data_frame({"time_s": entry.time_s, "value": entry.values}) for name, entry in series.items()}

    @property
    def current(self) -> DriftCurrent | None:
        """Mean current of the voyage; None where the log does not determine it."""
        return self.study.current

    def files(self, folder: str | Path) -> dict[Path, str | bytes]:
        """Files of the voyage in a folder: ``channels.toml`` and a trial for each stretch that excites the vessel."""
        folder = Path(folder)
        out: dict[Path, str | bytes] = {folder / cut.trial.path.name: cut.text for cut in self.cuts}
        if self.voyage and all(channel.why != "by the channels file" for channel in self.voyage.channels.channels):
            out[folder / CHANNELS_FILE] = channels_text(self.voyage.channels)
        return out

    def save(self, folder: str | Path) -> list[Path]:
        """Write :meth:`files`, all or none, and return them.

        Raises
        ------
        InputError
            The folder or a file cannot be written.
        """
        return list(self.written_to(Path(folder)).written)

    def written_to(self, folder: Path) -> LogResult:
        """Write :meth:`files` as :meth:`save` does, and return the result with them.

        Trials that an earlier run cut into the folder, and this one did not, are removed.

        Parameters
        ----------
        folder : Path
        """
        files = self.files(folder)
        with folder_made(folder):
            write_together(files, inputs=[Path(log.file) for log in self.study.logs])
        removed = remove_earlier_trials(folder, files)
        remarks = (Notice(f"removed trials that an earlier run cut: {', '.join(removed)}"),) if removed else ()
        return replace(self, written=tuple(files), remarks=remarks)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Limits of the log, and files of an earlier run that were removed."""
        return (*self.study.notices, *self.remarks)

    @property
    def title(self) -> str:
        """The files."""
        names = [PurePath(log.file).name for log in self.study.logs]
        return f"Log: {_first_named(names)}"

    @property
    def subtitle(self) -> str:
        """The date."""
        begins = self.study.begins_utc
        return f"Voyage from {begins}" if begins else "Voyage without a date"

    @property
    def headline(self) -> tuple[str, ...]:
        """Length of the voyage, the trials cut out, and how many faults there are."""
        study = self.study
        listed = [f"{PurePath(log.file).name} ({log.format})" for log in study.logs]
        formats = _first_named(listed)
        since = f" from {study.begins_utc}" if study.begins_utc else ""
        used, exciting = sum(one.use for one in study.channels), sum(one.excites for one in study.stretches)
        lines = [
            f"{formats}: {study.duration_s:.5g} s{since}, {used} channel{'s' * (used != 1)} in use.",
            f"{exciting} of {len(study.stretches)} stretches excite the vessel. {_cut_in_words(self._cut)}",
        ]
        if self._faults:
            lines.append(
                "1 fault of the log is noted." if self._faults == 1 else f"{self._faults} faults of the log are noted."
            )
        lines += [study.gear.words] if study.gear else []
        return (*lines, *(self.identified.headline if self.identified else ()))

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Trials, time that excites the vessel, channels and faults."""
        study = self.study
        exciting = sum(stretch.duration_s for stretch in study.stretches if stretch.excites)
        return [
            KeyFigure("Trials cut out", len(self._cut), note=f"of {len(study.stretches)} stretches"),
            KeyFigure("Time that excites the vessel", round(exciting), "s", note=f"of {study.duration_s:.4g} s"),
            KeyFigure("Channels in use", sum(channel.use for channel in study.channels)),
            KeyFigure("Faults", self._faults, verdict=Verdict.CAUTION if self._faults else Verdict.PASSED),
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Map, time line, stretches, coefficients of a craft, channels and logs."""
        study = self.study
        return [
            *([self._map(study.track)] if study.track else []),
            *self._time_line(),
            Section("Channels", tables=self._channel_tables()),
            *([Section("Stretches", tables=[self._stretch_table()])] if study.stretches else []),
            *([_gear_section(study.gear)] if study.gear else []),
            *(craft_sections(study.identified) if study.identified else []),
            Section("Logs", tables=[self._log_table()], folded=True),
        ]

    @property
    def _cut(self) -> dict[str, tuple[float, float]]:
        """File of each trial to its begin and end, s: of one or several stretches."""
        found: dict[str, tuple[float, float]] = {}
        for stretch in self.study.stretches:
            if stretch.file:
                begin, _ = found.get(stretch.file, (stretch.begins_s, 0.0))
                found[stretch.file] = begin, stretch.begins_s + stretch.duration_s
        return found

    @property
    def _faults(self) -> int:
        return sum(finding.kind == "fault" for finding in self.study.findings)

    def _map(self, track: Columns) -> Section:
        time, x, y = track["t_s"], track["x_m"], track["y_m"]
        tracks = [TrackData("voyage", x_m=x, y_m=y, time_s=time)]
        longest = sorted(self._cut.items(), key=lambda trial: trial[1][0] - trial[1][1])[:_MOST_TRACKS]
        for file, (begin, end) in sorted(longest, key=lambda trial: trial[1]):
            inside = (time >= begin) & (time <= end)
            if inside.sum() > 1:
                label = PurePath(file).stem
                tracks.append(TrackData(label, x_m=x[inside], y_m=y[inside], time_s=time[inside]))
        origin = self.study.origin_deg
        caption = f"Origin at {origin[0]:g} deg N, {origin[1]:g} deg E (WGS 84)." if origin else ""
        if len(self._cut) > _MOST_TRACKS:
            caption += f" The longest {_MOST_TRACKS} of {len(self._cut)} trials are shown."
        return Section("Map", charts=[Illustration(track_chart(tracks, title="Map"), caption=caption)])

    def _time_line(self) -> list[Section]:
        line = self.study.time_line
        shown = [signal for signal in _SIGNALS if signal.name in line]
        if not shown:
            return []
        time = np.unique(np.concatenate([line[signal.name]["t_s"] for signal in shown]))
        values = {
            signal.name: np.interp(
                time, line[signal.name]["t_s"], line[signal.name]["value"], left=np.nan, right=np.nan
            )
            for signal in shown
        }
        marks = [
            TimeMark(
                signal=signal.name,
                begin_s=stretch.begins_s,
                end_s=stretch.begins_s + stretch.duration_s,
                text=stretch.file or stretch.kind.value,
            )
            for signal in shown
            for stretch in self.study.stretches
            if stretch.excites
        ]
        logged = [History("log", time_s=time, values=values)]
        chart = history_chart(logged, shown, title="Logged signals", height_px=70, marks=marks)
        caption = "Tinted: the stretches that excite the vessel. Times from the beginning of the log."
        return [Section("Time line", charts=[Illustration(chart, caption=caption)])]

    def _channel_tables(self) -> list[Table]:
        """Channels in use, and all with the reasons of their confidence."""
        channels, fields = self.study.channels, ("quantity", "stream", "unit", "sign", "confidence")
        unsure = [one for one in channels if not one.use and one.confidence < _UNSURE]
        notes = [f"not used: {one.quantity}: {one.stream}: {one.why}" for one in unsure]
        used = records_table("Channels in use", [one for one in channels if one.use], fields=fields, digits=3)
        caption = f"All channels, to be confirmed or corrected in {CHANNELS_FILE}"
        every = records_table(caption, channels, fields=(*fields, "use", "why"), digits=3, folded=True, on_screen=False)
        return [replace(used, notes=notes), every]

    def _stretch_table(self) -> Table:
        fields = {"kind": "stretch", "begins_s": "", "duration_s": "lasts", "steering": "", "heading_change_deg": ""}
        fields |= {"reversals": "", "speed_mps": "speed at the start", "yaw_rate_rms_degps": "rms yaw rate"}
        fields["file"] = ""
        if any(stretch.log for stretch in self.study.stretches):
            fields["log"] = ""
        return replace(records_table("Stretches", self.study.stretches, fields=fields), wide=True)

    def _log_table(self) -> Table:
        rows: list[list[Cell]] = [
            [
                PurePath(log.file).name,
                log.format,
                log.streams,
                ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in log.counts.items()),
            ]
            for log in self.study.logs
        ]
        return table("Logs", ("file", "format", "streams", "read and lost"), rows, on_screen=False)


def _gear_section(gear: LoggedGear) -> Section:
    """The steering gear with standard errors."""
    pairs: dict[str, tuple[str, float | None, float | None]] = {
        "rate": ("deg/s", gear.rate_degps, gear.rate_error_degps),
        "fastest movement": ("deg/s", gear.fastest_degps, None),
        "lag": ("s", gear.lag_s, gear.lag_error_s),
        "dead band": ("deg", gear.dead_band_deg, gear.dead_band_error_deg),
    }
    for side, limit in (("port", gear.port), ("starboard", gear.starboard)):
        if limit:
            pairs[f"largest angle held to {side}"] = "deg", limit.angle_deg, limit.standard_error_deg
    rows: list[list[Cell]] = [[name, unit, value, error] for name, (unit, value, error) in pairs.items()]
    text = (
        f"{gear.angle} follows {gear.order} as a gear of one rate does, with a lag and a dead band; what remains is "
        f"{gear.residual_deg:.2g} deg rms over {gear.duration_s:.3g} s."
    )
    heads = ("quantity", "unit", "value", Column("standard error", digits=2))
    return Section("Steering gear", text=text, tables=[table("Steering gear by this log", heads, rows)])


def _first_named(names: Sequence[str]) -> str:
    """The names, at most :data:`_MOST_NAMED_LOGS` of them."""
    more = len(names) - _MOST_NAMED_LOGS
    return ", ".join(names[:_MOST_NAMED_LOGS]) + (f" and {more} more" if more > 0 else "")


def _cut_in_words(files: Collection[str]) -> str:
    """The trials of the log by their kinds and orders."""
    if not files:
        return "No manoeuvre could be cut out as a trial."
    orders: dict[str, list[str]] = {}  # kind to the orders of its trials, empty without any
    for file in files:
        _, kind, *order = PurePath(file).stem.split("_")  # such as 02_zigzag_-20
        orders.setdefault(kind, []).append(" ".join(order))
    names = ", ".join(f"{kind} {_in_short(each)}".rstrip() for kind, each in orders.items())
    count = f"{len(files)} trials are" if len(files) > 1 else "One trial is"
    return f"{count} cut out: {names}."


def _in_short(orders: Sequence[str]) -> str:
    """Orders of the trials of a kind, or how many these are."""
    if all(orders):
        return " ".join(orders)
    return f"({len(orders)})" if len(orders) > 1 else ""
