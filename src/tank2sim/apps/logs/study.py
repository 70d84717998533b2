"""Study of a vessel's log: channels, stretches, track and time line."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.apps.logs.channels import CHANNELS_FILE, LogChannel
from tank2sim.apps.logs.clock import utc_text
from tank2sim.apps.logs.findings import LogFinding
from tank2sim.apps.logs.gear import LoggedGear, logged_gear
from tank2sim.apps.logs.quantities import QUANTITIES
from tank2sim.apps.logs.stretches import Stretch, StretchKind
from tank2sim.apps.logs.trial_files import TrialCut
from tank2sim.apps.logs.voyage import DriftCurrent, Voyage, drift_current, records_of
from tank2sim.arrays import Columns, Number
from tank2sim.identification.craft.study import CraftIdentificationStudy
from tank2sim.notices import Notice, caution
from tank2sim.records.thinning import thin_line

VOYAGE_SAMPLES = 1500
"""Samples of the track and the time line in the JSON. Project choice: a chart is a few hundred pixels wide."""

NO_RUDDER_NOTICE = (
    "the vessel is steered by two thrusters: its files have columns n_port_rpm, n_starboard_rpm, order_port and "
    "order_starboard in place of a rudder; identify and gap take them with a card of kind small_craft, audit does not"
)
"""Notice of a craft without a rudder."""


@dataclass(frozen=True, kw_only=True)
class LogFile:
    """A log: its file and format, number of streams, and what was read and lost by name."""

    file: str
    format: str
    streams: int
    counts: dict[str, int]


@dataclass(frozen=True, kw_only=True)
class ChannelStudy:
    """A quantity and the stream that holds it.

    Parameters
    ----------
    quantity, stream, unit : str
        The unit may have a factor: ``0.0875 deg``.
    sign : int
    confidence : float
        0 to 1.
    use : bool
    why : str
        Reason of the confidence.
    """

    quantity: str
    stream: str
    unit: str
    sign: int
    confidence: float
    use: bool
    why: str


@dataclass(frozen=True, kw_only=True)
class StretchStudy:
    """A stretch of a voyage, and the trial that it became.

    Parameters
    ----------
    kind : StretchKind
    excites : bool
        Whether it reveals more of the vessel than a straight course does.
    begins_utc : str or None
        None for a voyage without a date.
    begins_s : float
        From the begin of the voyage.
    duration_s : float
    steering : str or None
        First held rudder, or difference of two thrusters in % of full; None without.
    heading_change_deg : float
    reversals : int
        Changes of the side of the rudder.
    speed_mps, least_speed_mps, largest_speed_mps : float
        At the begin, least and largest; NaN where no speed is known.
    yaw_rate_rms_degps : float
    file : str or None
        The trial; None if none was cut.
    log : str or None
        First file of its record; None where the voyage is one record.
    """

    kind: StretchKind
    excites: bool
    begins_utc: str | None
    begins_s: float
    duration_s: float
    steering: str | None
    heading_change_deg: Number
    reversals: int
    speed_mps: Number
    least_speed_mps: Number
    largest_speed_mps: Number
    yaw_rate_rms_degps: Number
    file: str | None
    log: str | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class LogStudy:
    """Content of a vessel's log.

    Parameters
    ----------
    logs : tuple of LogFile
    begins_utc : str or None
        None for a voyage without a date.
    duration_s : float
        The sum, where there are several records.
    origin_deg : (float, float) or None
        Latitude and longitude of the origin of the track; None where positions are local.
    channels : tuple of ChannelStudy
    stretches : tuple of StretchStudy
    current : DriftCurrent or None
        Mean current; None where the log does not determine it.
    track : dict or None
        ``t_s`` from the begin, ``x_m`` north and ``y_m`` east; None without positions.
    time_line : dict
        ``t_s`` and ``value`` (SI) by quantity.
    gear : LoggedGear or None
        Steering gear by the rudder's angle and order; None without both, or with too few movements.
    identified : CraftIdentificationStudy or None
        Coefficients of the craft, if its card was given.
    findings : tuple of LogFinding
    notices : tuple of Notice
    """

    logs: tuple[LogFile, ...]
    begins_utc: str | None
    duration_s: float
    origin_deg: tuple[float, float] | None
    channels: tuple[ChannelStudy, ...]
    stretches: tuple[StretchStudy, ...]
    current: DriftCurrent | None
    track: Columns | None
    time_line: dict[str, Columns]
    findings: tuple[LogFinding, ...]
    notices: tuple[Notice, ...]
    identified: CraftIdentificationStudy | None = None
    gear: LoggedGear | None = None


def study_log(voyage: Voyage, stretches: Sequence[Stretch], cuts: Sequence[TrialCut]) -> LogStudy:
    """Study of a voyage, its stretches and the trials that were cut from it."""
    current = drift_current(voyage, voyage.begin_s, voyage.end_s)
    records = records_of(voyage)
    files = {id(stretch): cut.trial.path.name for cut in cuts for stretch in cut.stretches}
    return LogStudy(
        logs=tuple(
            LogFile(
                file=str(log.path),
                format=log.format,
                streams=len(log.streams),
                counts=dict(voyage.counts[log.path.name]),
            )
            for log in voyage.logs
        ),
        begins_utc=utc_text(voyage.begin_s) if voyage.dated else None,
        duration_s=sum(record.end_s - record.begin_s for record in records),
        origin_deg=voyage.origin_deg,
        channels=tuple(map(_channel, voyage.channels.channels)),
        stretches=tuple(
            _stretch(voyage, stretch, files.get(id(stretch)), _log_of(records, stretch)) for stretch in stretches
        ),
        current=current,
        track=_track(voyage),
        time_line=_time_line(voyage),
        findings=voyage.findings,
        notices=_notices(voyage, stretches, cuts, current),
        gear=logged_gear(voyage),
    )


def _notices(
    voyage: Voyage, stretches: Sequence[Stretch], cuts: Sequence[TrialCut], current: DriftCurrent | None
) -> tuple[Notice, ...]:
    notices = list(voyage.notices)
    if not cuts:
        notices.append(_why_no_trial(voyage, stretches))
    elif not all(cut.steered for cut in cuts):
        notices.append(Notice(NO_RUDDER_NOTICE))
    if current:
        notices.append(
            Notice(
                f"a current of {current.speed_mps:.2g} m/s towards {current.direction_deg:.0f} deg, by {current.by}: "
                "give it to the card as the effect current, for positions and courses are over the ground"
            )
        )
    return tuple(notices)


def _why_no_trial(voyage: Voyage, stretches: Sequence[Stretch]) -> Notice:
    series = voyage.series
    if not any(name in series for name in ("rudder_angle", "rudder_order", "thrust_order_port", "rpm_port")):
        unused = [channel for channel in voyage.channels.channels if "rudder" in channel.quantity]
        candidates = ", ".join(f"{channel.stream} ({QUANTITIES[channel.quantity].words})" for channel in unused)
        hint = f"; it may be {candidates}" if candidates else ""
        return caution(f"no rudder or thruster is known{hint}: name it in {CHANNELS_FILE}; no trial is cut")
    if not any(stretch.kind.excites for stretch in stretches):
        return Notice("no stretch excites the vessel: no trial is cut")
    return Notice("the stretches are too short, or lack a heading and a position: no trial is cut")


def _channel(channel: LogChannel) -> ChannelStudy:
    unit = channel.unit
    if channel.scale != 1:
        words = {"1": "of full order per recorded unit", "": "of an unknown unit"}.get(unit, unit)
        unit = f"{channel.scale:.4g} {words}"
    same = {name: getattr(channel, name) for name in ("quantity", "stream", "sign", "confidence", "use", "why")}
    return ChannelStudy(unit=unit, **same)


def _log_of(records: Sequence[Voyage], stretch: Stretch) -> str | None:
    """First file of the record of a stretch; None of one record."""
    if len(records) == 1:
        return None
    return next((one.logs[0].path.name for one in reversed(records) if one.begin_s <= stretch.begin_s), None)


def _stretch(voyage: Voyage, stretch: Stretch, file: str | None, log: str | None) -> StretchStudy:
    rudder = "rudder_angle" in voyage.series or "rudder_order" in voyage.series
    level = None
    if not math.isnan(stretch.rudder_rad):
        level = f"{math.degrees(stretch.rudder_rad):+z.1f} deg" if rudder else f"{100 * stretch.rudder_rad:+z.0f} %"
    begin, least, most = stretch.speed_mps
    return StretchStudy(
        kind=stretch.kind,
        excites=stretch.kind.excites,
        begins_utc=utc_text(stretch.begin_s) if voyage.dated else None,
        begins_s=round(stretch.begin_s - voyage.begin_s, 3),
        duration_s=round(stretch.duration_s, 3),
        steering=level,
        heading_change_deg=math.degrees(stretch.heading_change_rad),
        reversals=stretch.reversals,
        speed_mps=begin,
        least_speed_mps=least,
        largest_speed_mps=most,
        yaw_rate_rms_degps=math.degrees(stretch.yaw_rate_radps),
        file=file,
        log=log,
    )


def _track(voyage: Voyage) -> Columns | None:
    series = voyage.series
    if "x" not in series or "y" not in series:
        return None
    x, time = series["x"], series["x"].time_s
    y = np.interp(time, series["y"].time_s, series["y"].values)
    kept = thin_line([x.values, y], VOYAGE_SAMPLES)
    return {"t_s": time[kept] - voyage.begin_s, "x_m": x.values[kept], "y_m": y[kept]}


def _time_line(voyage: Voyage) -> dict[str, Columns]:
    """Each quantity that is drawn over time, thinned."""
    found: dict[str, Columns] = {}
    for name, entry in voyage.series.items():
        if name not in ("x", "y", "a_x", "a_y", "latitude", "longitude"):
            kept = thin_line([entry.values], VOYAGE_SAMPLES)
            found[name] = {"t_s": entry.time_s[kept] - voyage.begin_s, "value": entry.values[kept]}
    return found
