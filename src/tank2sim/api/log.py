"""A vessel's own log, from its streams to trials."""

from __future__ import annotations

import itertools
import math
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.ship import Ship, as_ship
from tank2sim.api.trial import TrialRecord
from tank2sim.cards import CraftCard
from tank2sim.errors import InputError
from tank2sim.files import writable_folder, write_together
from tank2sim.logs.channels import CHANNELS_FILE, ChannelSet, channels_text, read_channels
from tank2sim.logs.clock import utc_text
from tank2sim.logs.current import DriftCurrent, drift_current
from tank2sim.logs.quantities import QUANTITIES
from tank2sim.logs.reading import read_log
from tank2sim.logs.stretches import Stretch, find_stretches
from tank2sim.logs.trial_files import CUT_BY, TrialCut, cut_trials
from tank2sim.logs.voyage import Voyage, channel_rows, make_voyage
from tank2sim.records.thinning import thin_line

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.api.craft_identification import CraftIdentificationResult

VOYAGE_SAMPLES = 1500
"""Samples of the track and the time line in the JSON. Project choice: a chart is a few hundred pixels wide."""

_HEAD_LINES = 100
"""Lines of a file in which the comments of a trial are looked for."""

NO_RUDDER_NOTICE = (
    "the vessel is steered by two thrusters: its files have columns n_port_rpm, n_starboard_rpm, order_port and "
    "order_starboard in place of a rudder; identify takes them with a card of kind small_craft, gap and audit do not"
)
"""Notice of a craft without a rudder."""


class LogResult(PagedResult):
    """What a vessel's log holds: channels, stretches and trials.

    Parameters
    ----------
    voyage : Voyage
    craft : Ship, optional
        With the card of a small craft: what the trials say of each of its coefficients.
    """

    command = "log"

    def __init__(self, voyage: Voyage, craft: Ship | None = None) -> None:
        self.voyage, self.craft = voyage, craft
        self.found = find_stretches(voyage)
        self.cuts = cut_trials(voyage, self.found)
        notices = list(voyage.notices)
        if not self.cuts:
            notices.append(_why_no_trial(voyage, self.found))
        elif not all(cut.steered for cut in self.cuts):
            notices.append(NO_RUDDER_NOTICE)
        if current := self.current:
            notices.append(
                f"a current of {current.speed_mps:.2g} m/s towards {current.direction_deg:.0f} deg, by {current.by}: "
                "give it to the card as the effect current, for positions and courses are over the ground"
            )
        self.notices = tuple(notices)

    @property
    def channels(self) -> pd.DataFrame:
        """Channels, a row each: quantity, stream, unit, sign, confidence, use, why."""
        import pandas as pd

        heads = ["quantity", "stream", "unit", "sign", "confidence", "use", "why"]
        return pd.DataFrame(channel_rows(self.voyage), columns=heads)

    @property
    def stretches(self) -> pd.DataFrame:
        """Stretches, a row each: kind, UTC, begin and duration (s), rudder, heading change (deg), speeds, file."""
        import pandas as pd

        return pd.DataFrame([self._stretch_json(stretch) for stretch in self.found])

    @property
    def trials(self) -> list[TrialRecord]:
        """The trials that were cut, those with a rudder."""
        return [TrialRecord(cut.trial) for cut in self.cuts if cut.steered]

    @cached_property
    def identified(self) -> CraftIdentificationResult | None:
        """Coefficients of the craft from all trials, with a verdict on each; None without its card or trials.

        Raises
        ------
        InputError
            The trials lack a position, a heading or the revolutions of a thruster of the card.
        """
        from tank2sim.api.craft_identification import identify_craft

        if self.craft is None:
            return None
        assert isinstance(self.craft.card, CraftCard)
        turning = any(thruster.max_azimuth_rad is not None for thruster in self.craft.card.thrusters)
        cut = [entry for entry in self.cuts if turning or not entry.steered]
        if not cut:
            return None
        with tempfile.TemporaryDirectory() as name:
            paths = [Path(name) / entry.trial.path.name for entry in cut]
            write_together({path: entry.text for path, entry in zip(paths, cut, strict=True)})
            return identify_craft(self.craft, paths)

    @property
    def series(self) -> dict[str, pd.DataFrame]:
        """Quantity to a frame of ``time_s`` (UTC, s since 1970) and ``value`` (SI) of each channel in use."""
        import pandas as pd

        return {
            name: pd.DataFrame({"time_s": entry.time_s, "value": entry.values})
            for name, entry in self.voyage.series.items()
        }

    @property
    def current(self) -> DriftCurrent | None:
        """Mean current of the voyage; None where the log does not determine it."""
        return drift_current(self.voyage, self.voyage.begin_s, self.voyage.end_s)

    def files(self, folder: str | Path) -> dict[Path, str | bytes]:
        """Files of the voyage in a folder: ``channels.toml`` and a trial for each stretch that excites the vessel."""
        folder = Path(folder)
        out: dict[Path, str | bytes] = {folder / cut.trial.path.name: cut.text for cut in self.cuts}
        if all(channel.why != "by the channels file" for channel in self.voyage.channels.channels):
            out[folder / CHANNELS_FILE] = channels_text(self.voyage.channels)
        return out

    def save(self, folder: str | Path) -> list[Path]:
        """Write :meth:`files`, all or none, and return them.

        Raises
        ------
        InputError
            The folder or a file cannot be written.
        """
        files = self.files(folder)
        writable_folder(Path(folder))
        write_together(files, inputs=[log.path for log in self.voyage.logs])
        remove_earlier_trials(Path(folder), files)
        return list(files)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        voyage = self.voyage
        return {
            "logs": [
                {
                    "file": str(log.path),
                    "format": log.format,
                    "streams": len(log.streams),
                    "counts": dict(voyage.counts[log.path.name]),
                }
                for log in voyage.logs
            ],
            "begins_utc": utc_text(voyage.begin_s) if voyage.dated else None,
            "duration_s": voyage.end_s - voyage.begin_s,
            "origin_deg": list(voyage.origin_deg) if voyage.origin_deg else None,
            "channels": [
                dict(zip(("quantity", "stream", "unit", "sign", "confidence", "use", "why"), row, strict=True))
                for row in channel_rows(voyage)
            ],
            "stretches": [self._stretch_json(stretch) for stretch in self.found],
            "current": None if self.current is None else asdict(self.current),
            "track": self._track(),
            "time_line": self._time_line(),
            "identified": self._identified_json(),
            "findings": [
                {
                    "kind": finding.kind,
                    "stream": finding.stream,
                    "text": finding.text,
                    "evidence": dict(finding.evidence),
                }
                for finding in voyage.findings
            ],
            "notices": list(self.notices),
        }

    def _identified_json(self) -> dict[str, object] | None:
        found = self.identified
        if found is None:
            return None
        content = found.content()
        return {name: content[name] for name in ("coefficients", "next_trials", "notices")}

    @property
    def headline(self) -> tuple[str, ...]:
        """Length of the voyage, and how many stretches and trials it has."""
        voyage = self.voyage
        formats = ", ".join(f"{log.path.name} ({log.format})" for log in voyage.logs)
        since = f" from {utc_text(voyage.begin_s)}" if voyage.dated else ""
        exciting = sum(stretch.kind.excites for stretch in self.found)
        return (
            f"{formats}: {voyage.end_s - voyage.begin_s:.5g} s{since}, {len(voyage.series)} quantities",
            f"{exciting} stretches excite the vessel, {len(self.found) - exciting} are steady or at rest; "
            f"{len(self.cuts)} trials",
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Channels and stretches."""
        heads = ("quantity", "stream", "unit", "sign", "confidence", "used")
        unsure = [channel for channel in self.voyage.channels.channels if not channel.use and channel.confidence < 0.7]
        rows = [row[:6] for row in channel_rows(self.voyage) if row[5]]
        notes = tuple(f"not used: {channel.quantity}: {channel.stream}: {channel.why}" for channel in unsure)
        channels = screen_table("Channels", heads, rows, notes)
        stretches = [
            [
                entry["kind"],
                entry["begins_s"],
                entry["duration_s"],
                entry["steering"],
                entry["heading_change_deg"],
                entry["file"],
            ]
            for entry in map(self._stretch_json, self.found)
        ]
        columns = ("stretch", "begins (s)", "lasts (s)", "steering", "heading change (deg)", "file")
        verdicts = self.identified.tables if self.identified else ()
        return channels, screen_table("Stretches", columns, stretches, wide=True), *verdicts

    def _cut_of(self, stretch: Stretch) -> TrialCut | None:
        return next((cut for cut in self.cuts if cut.stretch is stretch), None)

    def _stretch_json(self, stretch: Stretch) -> dict[str, object]:
        cut = self._cut_of(stretch)
        rudder = "rudder_angle" in self.voyage.series or "rudder_order" in self.voyage.series
        level = None
        if not math.isnan(stretch.rudder_rad):
            level = f"{math.degrees(stretch.rudder_rad):+.1f} deg" if rudder else f"{100 * stretch.rudder_rad:+.0f} %"
        begin, least, most = stretch.speed_mps
        return {
            "kind": stretch.kind.value,
            "excites": stretch.kind.excites,
            "begins_utc": utc_text(stretch.begin_s) if self.voyage.dated else None,
            "begins_s": round(stretch.begin_s - self.voyage.begin_s, 3),
            "duration_s": round(stretch.duration_s, 3),
            "steering": level,
            "heading_change_deg": math.degrees(stretch.heading_change_rad),
            "reversals": stretch.reversals,
            "speed_mps": begin,
            "least_speed_mps": least,
            "largest_speed_mps": most,
            "yaw_rate_rms_degps": math.degrees(stretch.yaw_rate_radps),
            "file": None if cut is None else cut.trial.path.name,
        }

    def _track(self) -> dict[str, list[float]] | None:
        series = self.voyage.series
        if "x" not in series or "y" not in series:
            return None
        x, time = series["x"], series["x"].time_s
        y = np.interp(time, series["y"].time_s, series["y"].values)
        kept = thin_line([x.values, y], VOYAGE_SAMPLES)
        begin = self.voyage.begin_s
        return {"t_s": (time[kept] - begin).tolist(), "x_m": x.values[kept].tolist(), "y_m": y[kept].tolist()}

    def _time_line(self) -> dict[str, dict[str, list[float]]]:
        """Each quantity that is drawn over time, thinned: ``t_s`` from the begin, and ``value`` in SI."""
        out = {}
        for name, entry in self.voyage.series.items():
            if name in ("x", "y", "a_x", "a_y", "latitude", "longitude"):
                continue
            kept = thin_line([entry.values], VOYAGE_SAMPLES)
            time = (entry.time_s[kept] - self.voyage.begin_s).tolist()
            out[name] = {"t_s": time, "value": entry.values[kept].tolist()}
        return out


def remove_earlier_trials(folder: Path, written: Iterable[Path]) -> list[str]:
    """Remove the trials that an earlier run cut into a folder and this one did not write; return their names.

    Only files that say in their comments that they were cut by tank2sim are removed.

    Parameters
    ----------
    folder : Path
    written : iterable of Path
        Files of this run, which stay.
    """
    removed = []
    for path in sorted(set(folder.glob("[0-9][0-9]*_*.csv")) - set(written)):
        with path.open(encoding="utf-8", errors="replace") as file:
            head = [line for line in itertools.islice(file, _HEAD_LINES) if line.startswith("#")]
        if any(CUT_BY in line for line in head):
            path.unlink()
            removed.append(path.name)
    return removed


@checked
def log(
    files: str | Path | Sequence[str | Path],
    *,
    channels: str | Path | ChannelSet | None = None,
    card: Ship | str | Path | None = None,
) -> LogResult:
    """Read logs of a vessel, find their channels and manoeuvres, and cut these into trials.

    Formats: NMEA 0183, NMEA 2000 (candump, Actisense), ROS 1 and ROS 2 bags, MCAP, ArduPilot ``.bin`` and ``.tlog``,
    PX4 ULog, any CSV. All but CSV need the extra ``tank2sim[logs]``.

    Parameters
    ----------
    files : path or sequence of paths
        Logs of one voyage.
    channels : path or ChannelSet, optional
        Which stream is which quantity, as ``channels.toml`` has it; by default they are found.
    card : Ship, str or path, optional
        Of a small craft: what the trials say of each of its coefficients is then in the result.

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
    paths = [Path(files)] if isinstance(files, str | Path) else [Path(file) for file in files]
    if not paths:
        raise InputError("log", "", "has no file", "give at least one log")
    stated = channels if isinstance(channels, ChannelSet) or channels is None else read_channels(Path(channels))
    craft = None if card is None else as_ship(card)
    if craft is not None and not isinstance(craft.card, CraftCard):
        remedy = "give the card of a small craft; of a ship with a rudder run identify on the trials"
        raise InputError(craft.card.source, "model.kind", f"is {craft.card.model.kind}", remedy)
    return LogResult(make_voyage([read_log(path) for path in paths], stated), craft)


def _why_no_trial(voyage: Voyage, stretches: Sequence[Stretch]) -> str:
    series = voyage.series
    if not any(name in series for name in ("rudder_angle", "rudder_order", "thrust_order_port", "rpm_port")):
        unused = [channel for channel in voyage.channels.channels if "rudder" in channel.quantity]
        candidates = ", ".join(f"{channel.stream} ({QUANTITIES[channel.quantity].words})" for channel in unused)
        hint = f"; it may be {candidates}" if candidates else ""
        return f"UNCONFIRMED: no rudder or thruster is known{hint}: name it in {CHANNELS_FILE}; no trial is cut"
    if not any(stretch.kind.excites for stretch in stretches):
        return "no stretch excites the vessel: no trial is cut"
    return "the stretches are too short, or lack a heading and a position: no trial is cut"
