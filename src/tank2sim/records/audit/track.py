"""Velocities against positions: unit, frame, sign and axes, then current, scale, heading offset, antenna and clock."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tank2sim.arrays import Array
from tank2sim.records.audit.finding import Finding, Repair, changed, found_in, negated, noted_in
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.audit.time_base import MISCALIBRATED
from tank2sim.records.audit.weak import AuditWindows, Complex, WeakFit, fit, on_uniform_time, windows_of
from tank2sim.records.trials import Trial, with_signals
from tank2sim.units import KNOT_MPS

CLEARER = 1.5
"""Factor by which the misfit as labelled must exceed the misfit of another reading: more than an error of the fit's own
scale."""
EVIDENCE = 20.0
"""Gain in twice the log likelihood from which another reading is taken: 10 is "very strong" (Kass & Raftery 1995), and
some readings are compared."""
SCALE, OFFSET, CURRENT = 0.01, np.deg2rad(0.3), 0.01
"""Smallest errors worth reporting: a log or a current of 1 % of the speed, a compass by 0.3 deg. Project choices."""
FASTEST = 0.5
"""Current, as a share of the speed over ground, from which it is none. Project choice: no trial is run in such."""

PAIRS = (("u_mps", "v_mps"), ("u_ground_mps", "v_ground_mps"))


@dataclass(frozen=True)
class TrackReading:
    """One way to read the columns.

    Velocity over ground follows from w = u + iv and e = exp(i psi), for x + iy is north + i east; ``mirrored`` if y is
    positive to west. A rotation by a quarter of a turn, found with it, makes it ``quarter_truth`` about
    ``quarter_wrong``. A name is a signal's; u and v name the pair of velocities.
    """

    truth: str
    wrong: tuple[str, ...]
    velocity: Callable[[Complex, Complex], Complex]
    mirrored: bool = False
    earth: bool = False
    quarter_truth: str = ""
    quarter_wrong: tuple[str, ...] = ()


_AS_LABELLED = TrackReading("", (), lambda w, e: w * e)
_PLACES = ("x_m", "y_m")
OTHERWISE = (
    TrackReading(
        "v is positive to port",
        ("v",),
        lambda w, e: w.conj() * e,
        quarter_truth="u and v are interchanged",
        quarter_wrong=("u", "v"),
    ),
    TrackReading("they are earth-fixed velocities, along x and y", ("u", "v"), lambda w, e: w, earth=True),
    TrackReading(
        "they are earth-fixed velocities, along x and against y",
        ("u", "v"),
        lambda w, e: w.conj(),
        earth=True,
        quarter_truth="they are earth-fixed velocities, along y and x",
        quarter_wrong=("u", "v"),
    ),
    TrackReading(
        "y is positive to west",
        _PLACES,
        lambda w, e: w * e,
        mirrored=True,
        quarter_truth="x and y are interchanged: x is east and y north",
        quarter_wrong=_PLACES,
    ),
    TrackReading(
        "psi is counted anticlockwise",
        ("psi_rad", "r_radps"),
        lambda w, e: w * e.conj(),
        quarter_truth="psi is counted anticlockwise from east",
        quarter_wrong=("psi_rad", "r_radps"),
    ),
)


TRACK_READINGS = (_AS_LABELLED, *OTHERWISE)

_EARTH = {truth for reading in OTHERWISE if reading.earth for truth in (reading.truth, reading.quarter_truth)}


def track_findings(trial: Trial) -> list[Finding]:
    """Findings from velocities against positions, each in its unit; none without positions and heading."""
    if not {"x_m", "y_m", "psi_rad"} <= set(trial.signals):
        return []
    findings: list[Finding] = []
    for pair in PAIRS:
        if set(pair) <= set(trial.signals):
            findings += _of_pair(trial, pair)
    return findings


@dataclass(frozen=True, eq=False)
class AuditedTrack:
    """Signals on a uniform time base, and the velocity over ground in windows, (windows,) complex, north + i east."""

    signals: dict[str, Array]
    windows: AuditWindows
    ground: Complex

    @property
    def speed(self) -> float:
        """Root mean square of the speed over ground, m/s."""
        return float(np.sqrt(np.nanmean(np.abs(self.ground) ** 2)))


def audited_track(trial: Trial) -> AuditedTrack:
    """The track of a trial that has x_m and y_m."""
    step, signals = on_uniform_time(trial)
    place = signals["x_m"] + 1j * signals["y_m"]
    noise = record_noise(trial)
    windows = windows_of(place, max(noise["x_m"], noise["y_m"]), step)
    return AuditedTrack(signals, windows, windows.rate(place))


def _of_pair(trial: Trial, pair: tuple[str, str]) -> list[Finding]:
    track, given = _track_and_given(trial, pair)
    if np.count_nonzero(np.isfinite(track.windows.mean(given) + track.ground)) < 10:
        return []
    frame = _frame(trial, track, pair, given)
    if frame is None or frame.repair is None:
        return _lesser(trial, track, pair, given)
    trial = frame.repair(trial)
    track, given = _track_and_given(trial, pair)
    lesser = _lesser(trial, track, pair, given)
    # velocities along the axes of the track have been turned with psi and back: they do not show it
    of_psi = (trial.heading("psi_rad"),) if frame.likely_truth in _EARTH else None
    return [frame, *(item for item in lesser if item.columns != of_psi)]


def _track_and_given(trial: Trial, names: Sequence[str]) -> tuple[AuditedTrack, Complex]:
    """The track, and the velocities given, u + iv, or the only one."""
    track = audited_track(trial)
    u, *v = (track.signals[name] for name in names)
    return track, np.asarray(u + 1j * (v[0] if v else 0.0), dtype=np.complex128)


def _frame(trial: Trial, track: AuditedTrack, pair: tuple[str, str], given: Complex) -> Finding | None:
    """Another reading than the labelled one, where it explains the track clearly better."""
    turn = np.exp(1j * track.signals["psi_rad"])
    labelled, _ = _misfit(track, _AS_LABELLED, given, turn)
    misfits = {reading: _misfit(track, reading, given, turn) for reading in OTHERWISE}
    best = min(OTHERWISE, key=lambda reading: misfits[reading][0])
    misfit, rotation = misfits[best]
    independent = np.count_nonzero(np.isfinite(track.ground)) / 2
    least = 1e-9 * track.speed  # no misfit is less than the rounding of the numbers
    gain = 4 * independent * float(np.log(max(labelled, least, 1e-300) / max(misfit, least, 1e-300)))
    if gain < EVIDENCE or labelled < CLEARER * misfit:
        return None
    quarters = round(rotation / (np.pi / 2))
    turned = quarters % 2 == 1 and best.quarter_truth
    truth, wrong = (best.quarter_truth, best.quarter_wrong) if turned else (best.truth, best.wrong)
    # a rate of turn agrees with the heading by now, or there is none
    named = [{"u": pair[0], "v": pair[1]}.get(item, item) for item in wrong]
    names = [name for name in named if name in trial.signals]
    what = (
        f"({', '.join(trial.heading(name) for name in pair)}) as body velocities, turned by psi, miss d(x, y)/dt "
        f"by {labelled:.2g} m/s rms, and by {misfit:.2g} m/s if read otherwise"
    )
    evidence = {"misfit_as_labelled_mps": labelled, "misfit_mps": misfit, "speed_mps": track.speed}
    repair = _repaired_by(best, pair, f"{', '.join(names)}: {truth}", 1j**quarters)
    found = found_in(trial, names, what, truth, evidence, repair)
    return replace(found, safe=misfit < MISCALIBRATED * track.speed)  # else more is wrong than the frame


def _misfit(track: AuditedTrack, reading: TrackReading, given: Complex, turn: Complex) -> tuple[float, float]:
    """Root mean square misfit of a reading, m/s, with a constant current and a constant rotation left free; this."""
    ground = track.ground.conj() if reading.mirrored else track.ground
    velocity = track.windows.mean(reading.velocity(given, turn))
    whole = np.isfinite(ground) & np.isfinite(velocity)
    ground, velocity = ground[whole], velocity[whole]
    # with the mean, or a straight course would leave the rotation to the noise
    factor = np.vdot(velocity, ground)
    rotation = factor / abs(factor) if abs(factor) > 0 else 1.0
    remainder = ground - rotation * velocity
    return float(np.sqrt(np.mean(np.abs(remainder - remainder.mean()) ** 2))), float(np.angle(rotation))


def _repaired_by(reading: TrackReading, pair: tuple[str, str], notice: str, quarter: complex) -> Repair:
    if reading.earth:
        notice += "; turned to body axes by psi (those through the water are the same if there is no current)"

    def read(trial: Trial) -> Trial:
        signals = trial.signals
        if reading.mirrored:
            place = np.conj(signals["x_m"] + 1j * signals["y_m"]) / quarter
            return with_signals(trial, {"x_m": place.real, "y_m": place.imag}, notice)
        if "psi_rad" in reading.wrong:
            rate = {name: negated(signals[name]) for name in ("r_radps",) if name in signals}
            return with_signals(trial, {"psi_rad": np.angle(quarter) - signals["psi_rad"], **rate}, notice)
        turn = np.exp(1j * signals["psi_rad"])
        body = quarter * reading.velocity(signals[pair[0]] + 1j * signals[pair[1]], turn) * turn.conj()
        return with_signals(trial, {pair[0]: body.real, pair[1]: body.imag}, notice)

    return read


def _lesser(trial: Trial, track: AuditedTrack, pair: tuple[str, str], given: Complex) -> list[Finding]:
    """Current c, scale and turn a, antenna l or clock tau: d(x + iy)/dt = a w e + c + d(l e)/dt, or + tau d(w e)/dt."""
    turn = np.exp(1j * track.signals["psi_rad"])
    velocity = given * turn
    windows, ground = track.windows, track.ground
    mean = windows.mean(velocity)
    base = [mean, np.ones(len(mean))]
    best = fit(ground, base)
    lever = fit(ground, [*base, windows.rate(turn)])
    clock = fit(ground, [*base, windows.rate(velocity)])
    # what half a step of the clock would do cannot be distinguished from the stamping of the times
    least = track.speed * windows.step_s / 2
    if lever is not None and any(map(lever.differs, (4, 5))) and np.hypot(*lever.values[4:6]) > least:
        best, antenna = lever, [_antenna(trial, lever, clock)]
    else:
        antenna = []
    if best is None:
        return antenna
    found = _scale(trial, pair, best), _offset(trial, best), _current(trial, pair, best, track.speed)
    return [*antenna, *(finding for finding in found if finding is not None)]


def _current(trial: Trial, pair: tuple[str, str], found: WeakFit, speed: float) -> Finding | None:
    """A constant difference, m/s, in earth axes of the velocity over ground and the velocities."""
    current = complex(found.values[2], found.values[3])
    size, towards = abs(current), float(np.rad2deg(np.angle(current)) % 360)
    if not any(map(found.differs, (2, 3))) or size <= CURRENT * speed:
        return None
    evidence = {"speed_mps": size, "direction_deg": towards, "standard_error_mps": float(found.errors[2])}
    what = "velocity over ground and the velocities differ by a constant in earth axes"
    if size > FASTEST * speed:
        truth = "x, y or the velocities are not what their names say: no current is as fast"
        return found_in(trial, (*pair, *_PLACES), f"{what} of {size:.3g} m/s", truth, evidence)
    if pair == PAIRS[1]:  # velocities that say they are over ground, and are not, would be used as such
        truth = f"they are through the water, in a current of {size:.3g} m/s towards {towards:.0f} deg"
        return found_in(trial, pair, what, truth, evidence)
    truth = f"a current of {size:.3g} m/s towards {towards:.0f} deg, if the velocities are through the water"
    return noted_in(trial, pair, what, truth, evidence)


def _antenna(trial: Trial, lever: WeakFit, clock: WeakFit | None) -> Finding:
    forward, starboard = (float(value) for value in lever.values[4:6])
    along, across = "before" if forward >= 0 else "abaft", "starboard" if starboard >= 0 else "port"
    truth = f"the antenna is {abs(forward):.3g} m {along} and {abs(starboard):.3g} m to {across} of the origin"
    evidence = {
        "forward_m": forward,
        "starboard_m": starboard,
        "standard_error_m": float(max(lever.errors[4:6])),
    }
    if clock is not None and clock.differs(4):
        delay = -float(clock.values[4])
        evidence["delay_s"] = delay
        rival = f"{'x and y' if delay > 0 else 'the velocities'} are late by {abs(delay):.3g} s"
        better = clock.residual < 0.99 * lever.residual
        truth = f"{rival}; or {truth}" if better else f"{truth}; or {rival}"
    what = "x and y move with the heading, or before or after the velocities"
    return noted_in(trial, _PLACES, what, truth, evidence)


def _scale(trial: Trial, pair: tuple[str, str], found: WeakFit) -> Finding | None:
    factor = float(found.values[0])
    if not found.differs(0, 1.0) or abs(factor - 1) <= SCALE:
        return None
    evidence = {"factor": factor, "standard_error": float(found.errors[0])}
    what = f"velocity over ground is {factor:.4g} times the velocities"
    notice = f"{', '.join(pair)} multiplied by {factor:.4g}, by the track"
    scaled = changed(pair, lambda values: factor * values, notice)
    if factor < 0:  # no log reads backwards
        return replace(found_in(trial, pair, what, "both are of the opposite sign", evidence, scaled), safe=False)
    if abs(np.log(factor)) > np.log(1 + MISCALIBRATED):
        return found_in(trial, pair, what, _NO_UNIT, evidence)
    return noted_in(trial, pair, what, f"the log reads {100 * (1 / factor - 1):+.2g} %", evidence, scaled)


def _offset(trial: Trial, found: WeakFit) -> Finding | None:
    """The track is turned against heading and velocities: psi + offset is the heading in the axes of x and y."""
    if not found.differs(1) or abs(found.values[1]) <= OFFSET:
        return None
    offset = float(np.arctan2(found.values[1], found.values[0]))
    evidence = {"angle_deg": float(np.rad2deg(-offset)), "standard_error_deg": float(np.rad2deg(found.errors[1]))}
    size = f"{np.rad2deg(abs(offset)):.3g} deg too {'much' if offset < 0 else 'little'}"
    truth = f"psi reads {size} (heading offset, or the log's misalignment)"
    turned = changed(["psi_rad"], lambda values: values + offset, f"psi: offset {offset:.3g} rad added")
    what = "the track is turned by a constant angle against heading and velocities"
    return noted_in(trial, ["psi_rad"], what, truth, evidence, turned)


_NO_UNIT = "no unit has this factor: velocities, positions or the clock are not what their names say"
FOOT_M = 0.3048
# Factor between speed over ground and speed as given, to the unit of the velocities that it indicates
_UNITS = {KNOT_MPS: "knots", 1 / 3.6: "km/h", FOOT_M: "ft/s"}
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
    """Share of the velocity over ground that a current and this factor leave unexplained."""

    @property
    def known(self) -> bool:
        return self.error < KNOWN * self.factor

    def unit_among(self, units: Iterable[float]) -> float | None:
        """The unit that has this factor, if any."""
        near = (unit for unit in units if abs(np.log(self.factor / unit)) < CERTAIN)
        return next(near, None) if self.unexplained < MISCALIBRATED else None

    @property
    def evidence(self) -> dict[str, float]:
        return {"factor": self.factor} | ({"standard_error": self.error} if self.known else {})

    @property
    def usual(self) -> bool:
        return bool(abs(np.log(self.factor)) < np.log(1 + MISCALIBRATED))


def speed_unit_findings(trial: Trial) -> list[Finding]:
    """A unit of velocities or positions, or a factor between them that is none of a unit.

    A unit is repaired if the factor is its own to :data:`CERTAIN` and nothing else explains it.
    """
    if not {"x_m", "y_m", "psi_rad"} <= set(trial.signals):
        return []
    present = [names for names in (*PAIRS, ("u_mps",), ("sog_mps",)) if set(names) <= set(trial.signals)]
    findings: list[Finding] = []
    for names in present:
        part_of_pair = any(set(names) < set(pair) for pair in present)
        found = None if part_of_pair else _of(trial, names)
        if found is None:
            continue
        findings.append(found)
        if found.open:
            break
        if found.repair is not None:
            trial = found.repair(trial)
    return findings


def _of(trial: Trial, names: tuple[str, ...]) -> Finding | None:
    track, given = _track_and_given(trial, names)
    if np.count_nonzero(np.isfinite(track.windows.mean(given) + track.ground)) < 10:
        return None
    scale = _scale_by_windows(track, given, names)
    if scale is None or scale.usual:
        return None
    evidence = scale.evidence
    what = f"speed over ground is {scale.factor:.3g} times the speed given"
    if (unit := scale.unit_among(_UNITS)) is not None:
        wrong = names[:1] if _sway_is_right(track, given, unit) else names
        truth = f"{'they are' if len(wrong) > 1 else 'it is'} in {_UNITS[unit]}"
        in_si = changed(wrong, partial(np.multiply, unit), f"{', '.join(wrong)}: {truth}")
        return found_in(trial, wrong, what, truth, evidence, in_si)
    if (unit := scale.unit_among(LENGTHS)) is not None:
        return _length_unit(trial, unit, what, evidence)
    if not scale.known and scale.unexplained < MISCALIBRATED:  # a current may be as fast
        return None
    return found_in(trial, (*names, *_PLACES), what, _no_unit(scale.factor), evidence)


def _length_unit(trial: Trial, unit: float, what: str, evidence: Mapping[str, float]) -> Finding:
    """Positions in another unit of length; without a rate of turn the clock may be wrong in place of kilometres."""
    if LENGTHS[unit] == "kilometres" and "r_radps" not in trial.signals:
        truth = "x and y are in kilometres, or time is in milliseconds"
        return found_in(trial, (*_PLACES, "t_s"), what, truth, evidence)
    truth = f"they are in {LENGTHS[unit]}"
    in_metres = changed(_PLACES, lambda values: values / unit, f"x_m, y_m: {truth}")
    return found_in(trial, _PLACES, what, truth, evidence, in_metres)


def _no_unit(factor: float) -> str:
    """What a factor of no unit may be."""
    nearest = min(_UNITS, key=lambda unit: abs(np.log(factor / unit)))
    if abs(np.log(factor / nearest)) >= np.log(1 + MISCALIBRATED):
        return _NO_UNIT
    return f"{_NO_UNIT} ({_UNITS[nearest]} with an error of {100 * (nearest / factor - 1):+.2g} %, or another clock)"


def _scale_by_windows(track: AuditedTrack, given: Complex, names: tuple[str, ...]) -> _Scale | None:
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
        fits = [_fitted_ahead(track, mean, track.windows.mean(turn))]
    else:
        fits = [_fitted(track, reading.velocity(given, turn), reading.mirrored) for reading in TRACK_READINGS]
    fits = [candidate for candidate in fits if candidate[1] > 0]
    if fits:
        misfit, factor, error = min(fits)
        misfit /= track.speed
        return _Scale(factor, error, misfit) if error < KNOWN * factor else _Scale(ratio, np.inf, misfit)
    return _Scale(ratio, np.inf)


def _fitted_ahead(track: AuditedTrack, mean: Array, along: Complex) -> tuple[float, float, float]:
    """As :func:`_fitted`, of a speed ahead alone."""
    found: WeakFit | None = fit((track.ground * along.conj()).real, [mean, along.real, along.imag])
    if found is None:
        return np.inf, 0.0, np.inf
    return found.residual, float(found.values[0]), float(found.errors[0])


def _fitted(track: AuditedTrack, velocity: Complex, mirrored: bool) -> tuple[float, float, float]:
    """Misfit, factor and its standard error of velocities as a reading has them; a factor of 0 if they fit none."""
    ground = track.ground.conj() if mirrored else track.ground
    mean = track.windows.mean(velocity)
    found: WeakFit | None = fit(ground, [mean, np.ones(len(mean))])
    if found is None:
        return np.inf, 0.0, np.inf
    return found.residual, float(np.hypot(*found.values[:2])), float(max(found.errors[:2]))


def _sway_is_right(track: AuditedTrack, given: Complex, factor: float) -> bool:
    """Whether v, if it is given, is in m/s in spite of u, by the velocity across the heading."""
    if not given.imag.any():
        return False
    turn = track.windows.mean(np.exp(1j * track.signals["psi_rad"]))
    sway = track.windows.mean(given.imag)
    found = fit((track.ground * turn.conj()).imag, [sway, np.ones(len(sway))])
    return found is not None and found.differs(0, factor) and abs(found.values[0] - 1) < abs(found.values[0] - factor)
