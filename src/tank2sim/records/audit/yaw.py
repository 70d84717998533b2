"""Rate of turn against heading: unit, sign, factor, bias and clock."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from tank2sim.arrays import Array
from tank2sim.records.audit.finding import Finding, Repair, changed, found_in, negated, noted_in
from tank2sim.records.audit.noise import record_noise, rounding
from tank2sim.records.audit.rudder import rudder_response
from tank2sim.records.audit.time_base import MISCALIBRATED
from tank2sim.records.audit.track import audited_track
from tank2sim.records.audit.weak import AuditWindows, WeakFit, fit, on_uniform_time, windows_of
from tank2sim.records.trials import Trial, unwrapped

_DEGREE = np.pi / 180
_YAW = ("r_radps", "psi_rad")
UNIT_TOLERANCE = 0.023
"""How far a factor may be from the factor of a unit to be taken for it: half the way from 57.3 to the 60 of
a time in minutes or of a rate per minute. Project choice."""
COARSE = 0.3
"""The same for the course of a track over the heading, for the drift angle turns as well."""
_FACTOR = 0.02
"""Scale error of a rate of turn worth a word: above what rate gyros are usually calibrated to. Project choice."""
_ROUNDED = 1.5
"""Times what rounding is expected to leave that is put down to it: errors of rounding are not quite so random (project
choice)."""
_ALIKE = 0.9  # correlation from which two signals are taken for the same motion

_BY_CHANCE = 4.0
"""Standard errors of a correlation (Fisher's z) up to which chance makes it at one of the lags that are tried (project
choice: p = 6e-5; slow drifts of a straight run reach 3.5, turns and zigzags 3.7 to 15)."""

UNLIKE = 0.44
"""Share of a signal's spread that another record of the same motion leaves unexplained: a correlation of 0.9."""


def heading_unit_findings(trial: Trial) -> list[Finding]:
    """Unit of the heading, by the course of the track: whatever the unit of the positions, it turns as the heading."""
    slope = _course_slope(trial)
    if slope is None:
        return []
    degrees = "deg" in trial.heading("psi_rad")
    factor = 1 / _DEGREE if degrees else _DEGREE
    if abs(np.log(abs(slope) / factor)) > COARSE:
        return []
    truth = "psi is in radians" if degrees else "psi is in degrees"
    what = f"the course over ground turns {abs(slope):.3g} times as far as psi"
    return [found_in(trial, ["psi_rad"], what, truth, {"factor": slope}, _scaled("psi_rad", factor, truth))]


def rate_unit_findings(trial: Trial) -> list[Finding]:
    """Unit of the rate of turn and of the heading, by each other."""
    found = _alike(trial)
    wrong = None if found is None else _unit(trial, found)
    return [] if wrong is None else [wrong]


def yaw_findings(trial: Trial) -> list[Finding]:
    """Sign, factor, bias and clock of rate of turn and heading, whose units are right."""
    if "psi_rad" not in trial.signals:
        return []
    if "r_radps" not in trial.signals:
        return _against_track(trial)
    found = _alike(trial)
    if found is not None:
        return _judged(trial, found)
    step, signals = on_uniform_time(trial)
    rate, heading = signals["r_radps"], signals["psi_rad"]
    noise = record_noise(trial)
    windows = windows_of(heading, noise["psi_rad"], step)
    found = _comparison(windows, rate, heading, step)
    if found is None:
        return []
    expected = np.hypot(windows.noise_of_rate(noise["psi_rad"]), windows.noise_of_mean(noise["r_radps"]))
    if found.fit.residual < 3 * expected:
        return _without_turn(trial, windows.rate(heading) - windows.mean(rate))
    if _hidden_by_rounding(trial, rate, heading, step):
        return []
    what = f"r and dpsi/dt are not the same motion (correlation {found.correlation:.2f})"
    truth = "one of the two is not a yaw motion of this ship"
    return [found_in(trial, _YAW, what, truth, {"correlation": found.correlation})]


def _alike(trial: Trial) -> _Comparison | None:
    """The comparison of the two, read so that they are one motion; None if they are not, or one was not measured."""
    if not {"psi_rad", "r_radps"} <= set(trial.signals):
        return None
    step, signals = on_uniform_time(trial)
    rate, noise = signals["r_radps"], record_noise(trial)["psi_rad"]
    for candidate in _headings(trial, signals["psi_rad"]):
        windows = windows_of(candidate, noise, step)
        found = _comparison(windows, rate, candidate, step)
        if found is not None and not found.alike:
            # noise that the estimate does not see (digits lost, waves) shows as what is left: wider windows take it
            residual_noise = found.fit.residual / windows.noise_of_rate(1.0)
            found = _comparison(windows_of(candidate, max(residual_noise, noise), step), rate, candidate, step)
        if found is not None and found.alike:
            return found
    return None


@dataclass(frozen=True)
class _Comparison:
    """dpsi/dt = factor r(t + lag) + bias in windows, factor and lag by regression."""

    fit: WeakFit
    lag_s: float
    lag_error_s: float
    correlation: float
    independent: float
    step_s: float
    shift: int

    @property
    def alike(self) -> bool:
        return abs(self.correlation) > _ALIKE

    @property
    def beyond_chance(self) -> bool:
        """Whether so few independent values have this correlation at none of many lags by chance: Fisher's z."""
        z = np.arctanh(min(abs(self.correlation), 1 - 1e-9)) * np.sqrt(max(self.independent - 3, 0.0))
        return bool(z > _BY_CHANCE)

    @property
    def factor(self) -> float:
        return float(self.fit.values[0])


def _hidden_by_rounding(trial: Trial, rate: Array, heading: Array, step: float) -> bool:
    """Whether r and dpsi/dt differ by at most sqrt(2/12) unit 4/(3/2 width), as rounding may leave."""
    unit = rounding(trial.signals["psi_rad"])
    if not unit:
        return False
    windows = windows_of(heading, unit, step)
    found = _comparison(windows, rate, heading, step)
    return (
        found is None or found.alike or found.fit.residual < _ROUNDED * np.sqrt(2 / 12) * unit * 8 / 3 / windows.width_s
    )


def _headings(trial: Trial, heading: Array) -> list[Array]:
    """The heading, and as it is if it is in rad, wrapped at 2 pi, under the name of degrees."""
    turn = 2 * np.pi * _DEGREE
    if (
        not np.isfinite(heading).any()
        or "deg" not in trial.heading("psi_rad")
        or np.nanmax(np.abs(heading)) > 1.01 * turn
    ):
        return [heading]
    return [unwrapped(heading, turn), heading]


def _comparison(windows: AuditWindows, rate: Array, heading: Array, step: float) -> _Comparison | None:
    """The comparison of both unchanged, or at the lag that makes them alike; None if there is too little to judge."""
    first = _at(windows, rate, heading, step, 0)
    if first is None:
        return None
    found = first if first.alike else _at(windows, rate, heading, step, _coarse_lag(windows, rate, heading))
    for _ in range(3):  # the regression's lag is of first order: repeated from where it leads
        if found is None or not found.alike or not (found is first or found.beyond_chance):
            return first
        shift = round(found.lag_s / step)
        if abs(shift - found.shift) <= 1:
            break
        found = _at(windows, rate, heading, step, shift)
    return found


def _at(windows: AuditWindows, rate: Array, heading: Array, step: float, shift: int) -> _Comparison | None:
    """The comparison with r taken `shift` rows later, and the lag left over from regression on dr/dt."""
    moved = ndimage.shift(rate, -shift, order=0, cval=np.nan)
    r, target = windows.mean(moved), windows.rate(heading)
    found = fit(target, [r, np.ones(len(r)), windows.rate(moved)])
    if found is None or found.values[0] == 0:
        return None
    whole = np.isfinite(r) & np.isfinite(target)
    correlation = float(np.corrcoef(r[whole], target[whole])[0, 1])
    independent = _independent(r[whole], target[whole])
    lag, error = (float(value[2] / found.values[0]) for value in (found.values, found.errors))
    return _Comparison(found, shift * step + lag, abs(error), correlation, independent, step, shift)


def _independent(a: Array, b: Array) -> float:
    """How many independent pairs the correlation of two series (n,) is of: Bartlett (1946), J. R. Stat. Soc. 8."""
    from scipy.signal import correlate  # slow to import

    n = len(a)
    away = (values - values.mean() for values in (a, b))
    of_each = [correlate(values, values, mode="full", method="fft")[n - 1 :] for values in away]
    lags = np.prod([values / max(values[0], np.finfo(float).tiny) for values in of_each], axis=0)[1:]
    return float(n / max(1 + 2 * np.sum((1 - np.arange(1, n) / n) * lags), 1.0))


def _coarse_lag(windows: AuditWindows, rate: Array, heading: Array) -> int:
    """Rows by which r is late, from the largest cross-correlation with dpsi/dt, within a tenth of the record."""
    from scipy.signal import correlate, correlation_lags  # slow to import

    every = replace(windows, hop=1)
    r, target = every.mean(rate), every.rate(heading)
    r, target = (np.nan_to_num(values - np.nanmean(values)) for values in (r, target))
    likeness = correlate(r, target, mode="full", method="fft")
    lags = correlation_lags(len(r), len(target))
    near = np.abs(lags) <= len(rate) // 10
    return int(lags[near][np.argmax(np.abs(likeness[near]))])


def _judged(trial: Trial, found: _Comparison) -> list[Finding]:
    findings = []
    if found.factor < 0:
        findings.append(_sign(trial, found))
    factor = abs(found.factor)
    if abs(factor - 1) > _FACTOR and found.fit.differs(0, float(np.sign(found.factor))):
        findings.append(_factor(trial, found))
    if found.fit.differs(1):
        findings.append(_bias(trial, -float(found.fit.values[1]) / found.factor, float(found.fit.errors[1]) / factor))
    # 4.5 errors: 1e-5 of normal ones
    if found.beyond_chance and abs(found.lag_s) > max(found.step_s, 4.5 * found.lag_error_s):
        late = "r is late" if found.lag_s > 0 else "psi is late"
        truth = f"{late} by {abs(found.lag_s):.3g} s (its clock, or a filter in the sensor)"
        what = "r and dpsi/dt are alike when one of them is shifted in time"
        evidence = {"lag_s": found.lag_s, "standard_error_s": found.lag_error_s}
        findings.append(noted_in(trial, ["r_radps"], what, truth, evidence))
    return findings


def _without_turn(trial: Trial, difference: Array) -> list[Finding]:
    """A bias, where noise hides the turn: dpsi/dt less r is constant."""
    found = fit(difference, [np.ones(len(difference))])
    if found is None or not found.differs(0):
        return []
    return [_bias(trial, -float(found.values[0]), float(found.errors[0]))]


def _bias(trial: Trial, bias: float, error: float) -> Finding:
    in_degrees = {"bias_degps": bias / _DEGREE, "standard_error_degps": error / _DEGREE}
    truth = f"the gyro reads {bias / _DEGREE:+.3g} deg/s when the ship does not turn (bias)"

    unbiased = changed(["r_radps"], lambda values: values - bias, f"r: bias of {bias:.3g} rad/s removed")
    return noted_in(trial, ["r_radps"], "r differs from dpsi/dt by a constant", truth, in_degrees, unbiased)


def _factor(trial: Trial, found: _Comparison) -> Finding:
    """A scale between the two that is none of a unit: a note, or a fault where no sensor is so far out."""
    factor = abs(found.factor)
    evidence = {"factor": factor, "standard_error": float(found.fit.errors[0])}
    what = f"dpsi/dt is {factor:.4g} times r"
    # noise of r makes the factor of a regression too small, and makes this one, of the reverse regression, too large
    largest = factor / found.correlation**2
    if largest < 1 / (1 + MISCALIBRATED) or factor > 1 + MISCALIBRATED:
        truth = "one of them is not what its name says, and the factor belongs to no unit"
        return found_in(trial, _YAW, what, truth, evidence)
    truth = f"r is to be multiplied by {factor:.4g} if the heading is right"
    return noted_in(trial, ["r_radps"], what, truth, evidence, _scaled("r_radps", factor, truth))


def _unit(trial: Trial, found: _Comparison) -> Finding | None:
    """The unit that a factor between dpsi/dt and r indicates, and whose unit it is, if that can be determined."""
    factor, nearest = abs(found.factor), _nearest_unit(found)
    if nearest is None:
        return None
    what = f"dpsi/dt is {factor:.4g} times r"
    slope = _course_slope(trial)
    psi_right = slope is not None and abs(np.log(abs(slope))) < 1.0  # the course turns as it does
    wrong = {
        name: truth
        for unit, name, in_degrees, truth in _UNIT_READINGS
        if unit == nearest and in_degrees == ("deg" in trial.heading(name)) and (name, psi_right) != ("psi_rad", True)
    }
    if len(wrong) != 1:
        truth = ", or ".join(wrong.values()) or "one of them is not in the unit of its name"
        return found_in(trial, _YAW, what, truth, {"factor": factor})
    ((name, truth),) = wrong.items()
    scale = nearest if name == "r_radps" else 1 / nearest
    return found_in(trial, [name], what, truth, {"factor": factor}, _scaled(name, scale, truth))


_UNIT_READINGS = (
    (1 / 60, "r_radps", True, "r is in deg/min"),
    (1 / _DEGREE, "r_radps", True, "r is in rad/s"),
    (1 / _DEGREE, "psi_rad", False, "psi is in degrees"),
    (_DEGREE, "r_radps", False, "r is in deg/s"),
    (_DEGREE, "psi_rad", True, "psi is in radians"),
)
"""Factor between dpsi/dt and r, the signal that may have another unit, whether its name says degrees, and the unit."""


def _nearest_unit(found: _Comparison) -> float | None:
    """Factor between two units of angle or time that a factor agrees with; None if with none, or with 1."""
    factor = abs(found.factor)
    nearest = min((1.0, 1 / _DEGREE, _DEGREE, 1 / 60), key=lambda unit: abs(np.log(factor / unit)))
    # few or noisy windows determine a factor less well
    tolerance = max(UNIT_TOLERANCE, min(0.1, 4.5 * float(found.fit.errors[0]) / factor))
    return None if nearest == 1.0 or abs(np.log(factor / nearest)) > tolerance else nearest


def _scaled(name: str, factor: float, notice: str) -> Repair:
    continuous = unwrapped if name == "psi_rad" else np.asarray
    return changed([name], lambda values: continuous(values * factor), notice)


def _sign(trial: Trial, found: _Comparison) -> Finding:
    """Which of r and psi has the wrong sign: the one against the track; without one, against the rudder."""
    slope = _course_slope(trial)
    # of the heading, by the track; or of r, by the rudder
    response = 0.0 if slope is not None else rudder_response(trial)
    what = "r and dpsi/dt have opposite signs"
    evidence = {"factor": found.factor, "correlation": found.correlation}
    if slope is None and response == 0:
        return found_in(trial, _YAW, what, "one of the two is positive to port", evidence)
    psi_right = slope > 0 if slope is not None else response < 0
    wrong, truth = ("r_radps", "r is positive to port") if psi_right else ("psi_rad", "psi is positive to port")
    return found_in(trial, [wrong], what, truth, evidence, changed([wrong], negated, f"{truth} in the file"))


def _against_track(trial: Trial) -> list[Finding]:
    """A course that turns against the heading, where no velocities show which of them is mirrored."""
    slope = _course_slope(trial)
    if slope is None or abs(np.log(abs(slope))) > 1.0 or slope > 0 or {"u_mps", "v_mps"} <= set(trial.signals):
        return []
    truth = "psi is positive to port, or y to west, or x and y interchanged"
    what, names = "the track turns against the heading", ("psi_rad", "x_m", "y_m")
    return [found_in(trial, names, what, truth, {"factor": slope})]


def _course_slope(trial: Trial) -> float | None:
    """Change of the course of the track for one of the heading, or None if there is no track or no turn."""
    if not {"x_m", "y_m", "psi_rad"} <= set(trial.signals):
        return None
    track = audited_track(trial)
    velocity = track.ground
    if not np.isfinite(velocity).any():
        return None
    going = np.abs(velocity) > 0.3 * np.nanmedian(np.abs(velocity))
    course = unwrapped(np.where(going, np.angle(velocity), np.nan))
    if np.isnan(course).all():
        return None
    if not np.nanmax(course) - np.nanmin(course) > 10 * _DEGREE:  # beyond any drift of a straight run
        return None
    spread = float(np.nanstd(course))
    for candidate in _headings(trial, track.signals["psi_rad"]):
        found = fit(course, [track.windows.mean(candidate), np.ones(len(course))])
        if found is not None and found.differs(0) and found.residual < UNLIKE * spread:
            return float(found.values[0])
    return None
