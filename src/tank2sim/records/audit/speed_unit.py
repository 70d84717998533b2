"""Units of velocities and positions: speed over ground against the speed given, whatever the frame of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tank2sim.records.audit.finding import Finding
from tank2sim.records.audit.time_base import MISCALIBRATED
from tank2sim.records.audit.track import PAIRS, TRACK_READINGS, AuditedTrack, audited_track
from tank2sim.records.audit.weak import Complex, WeakFit, fit
from tank2sim.records.trials import Trial, with_signals
from tank2sim.units import KNOT_MPS

FOOT_M = 0.3048
_UNITS = {KNOT_MPS: "knots", 1 / 3.6: "km/h", FOOT_M: "ft/s"}
"""Factor between speed over ground and speed as given, to the unit of the velocities that it indicates."""
LENGTHS = {1e-3: "kilometres", 1 / FOOT_M: "feet", 1 / 1852: "nautical miles"}
"""The same, to the unit of the positions."""
CERTAIN = 0.02
"""How near to that of a unit a factor must be: IMO MSC.96(72) allows a speed log 2 %. Twice too slow a clock is 3 %
from knots."""
KNOWN = 0.01
"""Standard error, as a share of it, up to which a factor is known: a good part of `CERTAIN`. Project choice."""


@dataclass(frozen=True)
class _Scale:
    """Speed over ground over the speed given, and its standard error; infinite where a current explains it as well."""

    factor: float
    error: float
    unexplained: float = 0.0
    """What a current and this factor leave of the velocity over ground, as a share of it."""

    @property
    def known(self) -> bool:
        return self.error < KNOWN * self.factor

    def is_of(self, unit: float) -> bool:
        return bool(abs(np.log(self.factor / unit)) < CERTAIN) and self.unexplained < MISCALIBRATED

    @property
    def usual(self) -> bool:
        return bool(abs(np.log(self.factor)) < np.log(1 + MISCALIBRATED))


def speed_unit_findings(trial: Trial) -> list[Finding]:
    """A unit of velocities or positions, or a factor between them that is none of a unit.

    A unit is repaired if the factor is its own to :data:`CERTAIN` and nothing else explains it.
    """
    if not {"x_m", "y_m", "psi_rad"} <= set(trial.signals):
        return []
    present = [pair for pair in PAIRS if set(pair) <= set(trial.signals)]
    alone = [(name,) for name in ("u_mps", "sog_mps") if name in trial.signals]
    findings: list[Finding] = []
    for names in [*present, *(names for names in alone if not any(names[0] in pair for pair in present))]:
        found = _of(trial, names)
        if found is None:
            continue
        findings.append(found)
        if found.open:
            break
        if found.repair is not None:
            trial = found.repair(trial)
    return findings


def _of(trial: Trial, names: tuple[str, ...]) -> Finding | None:
    track = audited_track(trial)
    values = [track.signals[name] for name in names]
    given = np.asarray(values[0] + 1j * (values[1] if len(values) > 1 else 0.0), dtype=np.complex128)
    if np.count_nonzero(np.isfinite(track.windows.mean(given) + track.ground)) < 10:
        return None
    scale = _scale(track, given, names)
    if scale is None or scale.usual:
        return None
    factor = scale.factor
    evidence = {"factor": factor} | ({"standard_error": scale.error} if scale.known else {})
    what = f"speed over ground is {factor:.3g} times the speed given"
    speeds = tuple(trial.heading(name) for name in names)
    places = tuple(trial.heading(name) for name in ("x_m", "y_m"))
    fault = Finding(trial.path, (*speeds, *places), what, "", "fault", evidence)
    for unit, name in _UNITS.items():
        if scale.is_of(unit):
            wrong = names[:1] if len(names) > 1 and _sway_is_right(track, given, unit) else names
            return _in_unit(fault, wrong, unit, name, trial)
    for unit, name in LENGTHS.items():
        if scale.is_of(unit):
            return _in_lengths(fault, places, unit, name, trial)
    if not scale.known and scale.unexplained < MISCALIBRATED:  # a current may be as fast
        return None
    nearest = min(_UNITS, key=lambda unit: abs(np.log(factor / unit)))
    truth = "the factor is that of no unit: velocities, positions or the clock are not what their names say"
    if abs(np.log(factor / nearest)) < np.log(1 + MISCALIBRATED):
        truth += f" ({_UNITS[nearest]} with an error of {100 * (nearest / factor - 1):+.2g} %, or another clock)"
    return Finding(trial.path, fault.columns, what, truth, "fault", evidence)


def _in_unit(fault: Finding, wrong: tuple[str, ...], unit: float, name: str, trial: Trial) -> Finding:
    truth = f"{'they are' if len(wrong) > 1 else 'it is'} in {name}"

    def in_si(other: Trial) -> Trial:
        changes = {signal: other.signals[signal] * unit for signal in wrong}
        return with_signals(other, changes, f"{', '.join(wrong)}: {truth}")

    columns = tuple(trial.heading(signal) for signal in wrong)
    return Finding(trial.path, columns, fault.what, truth, "fault", fault.evidence, in_si, safe=True)


def _in_lengths(fault: Finding, places: tuple[str, ...], unit: float, name: str, trial: Trial) -> Finding:
    truth = f"they are in {name}"
    if unit == min(LENGTHS, key=lambda other: abs(other - 1e-3)) and "r_radps" not in trial.signals:
        truth = f"x and y are in {name}, or time is in milliseconds"
        return Finding(trial.path, (*places, trial.heading("t_s")), fault.what, truth, "fault", fault.evidence)

    def in_metres(other: Trial) -> Trial:
        changes = {signal: other.signals[signal] / unit for signal in ("x_m", "y_m")}
        return with_signals(other, changes, f"x_m, y_m: {truth}")

    return Finding(trial.path, places, fault.what, truth, "fault", fault.evidence, in_metres, safe=True)


def _scale(track: AuditedTrack, given: Complex, names: tuple[str, ...]) -> _Scale | None:
    """Scale by regression with a free current, under the reading that leaves least; by the speeds if hardly turning."""
    mean = track.windows.mean(np.abs(given))
    moving = mean > 0
    if not moving.any():
        return None
    ratio = float(np.nanmedian(np.abs(track.ground[moving]) / mean[moving]))
    if not ratio > 0:
        return None
    if names == ("sog_mps",):  # over ground, both: no current
        return _Scale(ratio, 0.0)
    turn = np.exp(1j * track.signals["psi_rad"])
    if len(names) == 1:
        along = track.windows.mean(turn)
        found = fit((track.ground * along.conj()).real, [mean, along.real, along.imag])
        fits = [] if found is None else [(found.residual, float(found.values[0]), float(found.errors[0]))]
    else:
        fits = [_fitted(track, reading.velocity(given, turn), reading.mirrored) for reading in TRACK_READINGS]
    fits = [candidate for candidate in fits if candidate[1] > 0]
    if fits:
        misfit, factor, error = min(fits)
        misfit /= track.speed
        return _Scale(factor, error, misfit) if error < KNOWN * factor else _Scale(ratio, np.inf, misfit)
    return _Scale(ratio, np.inf)


def _fitted(track: AuditedTrack, velocity: Complex, mirrored: bool) -> tuple[float, float, float]:
    ground = track.ground.conj() if mirrored else track.ground
    mean = track.windows.mean(velocity)
    found: WeakFit | None = fit(ground, [mean, np.ones(len(mean))])
    if found is None:
        return np.inf, 0.0, np.inf
    return found.residual, float(np.hypot(*found.values[:2])), float(max(found.errors[:2]))


def _sway_is_right(track: AuditedTrack, given: Complex, factor: float) -> bool:
    """Whether v alone is in m/s, by the velocity across the heading."""
    turn = track.windows.mean(np.exp(1j * track.signals["psi_rad"]))
    sway = track.windows.mean(given.imag)
    found = fit((track.ground * turn.conj()).imag, [sway, np.ones(len(sway))])
    return found is not None and found.differs(0, factor) and abs(found.values[0] - 1) < abs(found.values[0] - factor)
