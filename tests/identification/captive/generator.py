"""Made-up captive campaigns with known derivatives, written independently of the reduction they test.

Nothing of tank2sim is used: the forces (3.8) and the inertia (3.1) of paper 2 are written out here. A campaign is a
folder with ``campaign.toml`` and one CSV file a run. What makes reality hard is there too: white noise, vibration of
the gauges, slow coloured noise, a zero error of its own for each run, a drift of the zero, fluctuation of the
carriage's speed, frequencies and amplitudes that differ from the sheet, and records of no whole number of periods.
"""

from __future__ import annotations

import copy
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

GRAVITY = 9.81
DENSITY = 1000.0
DEGREE = math.pi / 180.0
NOISE_SHARE = 1.8e-4
"""Noise of Y, relative to 1/2 rho L^2 U^2; that of N is 0.3 L times as large."""
COLUMNS = "t_s,y_m,psi_rad,v_mps,r_radps,speed_mps,delta_rad,X_N,Y_N,N_Nm"


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """What a campaign is to be like.

    Parameters
    ----------
    seed : int
        Of ship, disturbances and noise.
    force_convention : str
        ``on_model``, ``on_gauge`` or ``hydrodynamic``.
    noise, zero_error, zero_drift : float
        Standard deviations relative to a usual one; 0 is none. The zero error is a sixth of the noise, constant over a
        run; the drift changes it linearly by as much.
    vibration : bool
        A third of the noise's variance is a sinusoid of 4 to 8 Hz (40 to 80 % of half the sampling rate at most).
    correlation_time_s : float
        If positive, half of the rest of the variance is AR(1) noise with this correlation time.
    speed_fluctuation : float
        Relative amplitude of slow changes of the carriage's speed.
    sheet_error : float
        Relative difference between true frequencies and amplitudes and those of the sheet.
    part_periods : bool
        Records begin at any phase and end after any part of a period.
    asymmetry : bool
        Y0 and N0 of a single screw.
    surge : str
        ``carriage``: u is the speed column itself; ``resolved``: the speed column is U and u = sqrt(U^2 - v^2).
    size : str
        ``linear`` (small angles and amplitudes, linear forces), ``small`` (third order, few runs) or ``full``.
    frequency_parameters : tuple of float
        omega U/g of the oscillations.
    rate_hz : float
        Readings a second.
    periods : float
        Length of oscillation records, in periods.
    gain_error : float
        Standard deviation of the gauges' relative gain from run to run, each force by itself.
    force_delay_s : float
        By how much the forces lag the motion in the record.
    noise_seed : int
        Of the disturbances, next to `seed`: other noise on the same ship.
    faults : mapping
        Name of a run to what is wrong with it: see :data:`FAULTS`.
    """

    seed: int
    force_convention: str = "on_model"
    noise: float = 1.0
    zero_error: float = 1.0
    zero_drift: float = 0.0
    vibration: bool = True
    correlation_time_s: float = 0.0
    speed_fluctuation: float = 0.0
    sheet_error: float = 0.0
    part_periods: bool = False
    asymmetry: bool = False
    surge: str = "carriage"
    size: str = "small"
    frequency_parameters: tuple[float, ...] = (0.03, 0.05, 0.07, 0.09)
    rate_hz: float = 20.0
    periods: float = 6.0
    gain_error: float = 0.0
    force_delay_s: float = 0.0
    noise_seed: int = 0
    faults: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Ship:
    """A model: SI particulars, and its derivatives (prime, rudder positive to starboard, without inertia terms)."""

    length_m: float
    beam_m: float
    draught_m: float
    mass_kg: float
    yaw_inertia_kgm2: float
    x_G_m: float
    speed_mps: float
    derivatives: Mapping[str, float]

    @property
    def force_N(self) -> float:
        return 0.5 * DENSITY * self.length_m**2 * self.speed_mps**2


@dataclass(frozen=True)
class Run:
    """One run: type, drift and rudder (rad), the oscillation as it truly is, and the length of its record (s; 0: as
    the campaign says)."""

    name: str
    kind: str
    drift: float = 0.0
    rudder: float = 0.0
    frequency: float = 0.0
    amplitude: float = 0.0
    duration: float = 0.0


@dataclass(frozen=True)
class Motion:
    """Motion of the model over time: each (n,) in SI."""

    t: np.ndarray
    y: np.ndarray
    psi: np.ndarray
    v: np.ndarray
    r: np.ndarray
    speed: np.ndarray
    u: np.ndarray
    u_dot: np.ndarray
    v_dot: np.ndarray
    r_dot: np.ndarray
    rudder: np.ndarray


@dataclass(frozen=True)
class Written:
    """A campaign on disk, and the truth behind it."""

    path: Path
    ship: Ship
    runs: tuple[Run, ...]

    @property
    def derivatives(self) -> Mapping[str, float]:
        return self.ship.derivatives


def ship(campaign: Campaign) -> Ship:
    """A plausible ship model drawn by the seed."""
    draw = np.random.default_rng([campaign.seed, 1]).uniform
    length, block = draw(4.1, 7.0), draw(0.56, 0.82)
    beam = length / draw(5.6, 7.8)
    draught = beam / draw(2.4, 3.2)
    mass = DENSITY * block * length * beam * draught
    x_G = length * draw(-0.025, 0.035)
    inertia = mass * ((length * draw(0.23, 0.26)) ** 2 + x_G**2)
    m = mass / (0.5 * DENSITY * length**3)
    j = inertia / (0.5 * DENSITY * length**5)
    rudder = m * draw(0.2, 0.38)
    d = {
        "Xudot": -0.05 * m, "Yvdot": -m * draw(0.7, 0.95), "Yrdot": m * draw(-0.03, 0.03),
        "Nvdot": m * draw(-0.03, 0.03), "Nrdot": -j * draw(0.7, 1.0),
        "X0": -draw(9e-4, 13e-4), "Xvv": -m * draw(0.2, 0.9), "Xrr": m * draw(-0.05, 0.05),
        "Xvr": m * draw(0.3, 0.8), "Xdd": -m * draw(0.09, 0.14),
        "Y0": 0.0, "Yv": -m * draw(1.05, 1.6), "Yr": m * draw(0.12, 0.38), "Yd": -rudder,
        "N0": 0.0, "Nv": -m * draw(0.25, 0.48), "Nr": -m * draw(0.17, 0.26), "Nd": rudder * draw(0.45, 0.52),
    }  # fmt: skip
    if campaign.size != "linear":
        d |= {
            "Yvvv": -m * draw(4.0, 10.0), "Yvvr": m * draw(2.0, 8.0), "Yvrr": -m * draw(2.0, 6.0),
            "Yrrr": m * draw(-0.3, 0.3), "Yddd": rudder * draw(0.4, 0.8),
            "Nvvv": m * draw(-1.0, 2.0), "Nvvr": -m * draw(3.0, 7.0), "Nvrr": m * draw(-1.0, 2.0),
            "Nrrr": -m * draw(0.0, 0.3), "Nddd": -rudder * draw(0.2, 0.4),
            "Yvvd": -rudder * draw(1.0, 4.0), "Yvdd": -rudder * draw(0.1, 0.5),
            "Nvvd": rudder * draw(0.5, 2.0), "Nvdd": rudder * draw(0.05, 0.3), "Xvd": rudder * draw(-0.4, 0.4),
        }  # fmt: skip
    if campaign.asymmetry:
        d |= {"Y0": m * draw(0.01, 0.03), "N0": -m * draw(0.005, 0.015)}
    speed = draw(0.13, 0.19) * math.sqrt(GRAVITY * length)
    return Ship(length, beam, draught, mass, inertia, x_G, speed, d)


def plan(campaign: Campaign, model: Ship) -> list[Run]:
    """The runs of a campaign, as they truly are."""
    linear, full = campaign.size == "linear", campaign.size == "full"
    drifts = (-4, -2, 0, 2, 4) if linear else (-12, -8, -4, 0, 4, 8, 12)
    rudders = (-10, -5, 0, 5, 10) if linear else (-35, -20, -10, 0, 10, 20, 35)
    if full:
        drifts, rudders = (-12, -8, -6, -4, -2, 0, 2, 4, 6, 8, 12), (-35, -25, -15, -10, -5, 0, 5, 10, 15, 25, 35)
    runs = [Run(f"drift_{angle:+03d}", "static_drift", drift=angle * DEGREE) for angle in drifts]
    runs += [Run(f"rudder_{angle:+03d}", "static_rudder", rudder=angle * DEGREE) for angle in rudders]
    if not linear:
        both = [(b, d) for b in (-8, -4, 4, 8) for d in (-20, -10, 10, 20)] if full else [
            (-8, -20), (-8, 20), (8, -20), (8, 20), (-4, 30), (4, -30)]  # fmt: skip
        runs += [
            Run(f"both_{b:+03d}_{d:+03d}", "drift_and_rudder", drift=b * DEGREE, rudder=d * DEGREE) for b, d in both
        ]
    sways = (0.03, 0.06) if linear else (0.03, 0.06, 0.12, 0.2)
    yaws = (0.1, 0.2) if linear else (0.1, 0.2, 0.4, 0.6)
    if not (linear or full):
        sways, yaws = (0.05, 0.12, 0.2), (0.15, 0.35, 0.6)
    for n, parameter in enumerate(campaign.frequency_parameters):
        frequency = parameter * GRAVITY / model.speed_mps
        for k, share in enumerate(sways):
            amplitude = share * model.speed_mps / frequency
            runs.append(Run(f"sway_{n}{k}", "pure_sway", frequency=frequency, amplitude=amplitude))
        for k, share in enumerate(yaws):
            rate = share * model.speed_mps / model.length_m
            runs.append(Run(f"yaw_{n}{k}", "pure_yaw", frequency=frequency, amplitude=rate))
            if full or (n == 0 and not linear and k):
                runs += [
                    Run(f"yawdrift_{n}{k}_{b:+03d}", "yaw_with_drift", b * DEGREE, 0.0, frequency, rate)
                    for b in (-8, 4, 10)
                ]
    draw = np.random.default_rng([campaign.seed, 2]).uniform
    off = [1 + draw(-1, 1, 2) * campaign.sheet_error for _ in runs]
    return [
        replace(run, frequency=run.frequency * float(w), amplitude=run.amplitude * float(a))
        for run, (w, a) in zip(runs, off, strict=True)
    ]


def motion(campaign: Campaign, model: Ship, run: Run, rng: np.random.Generator, before_s: float = 0.0) -> Motion:
    """How the mechanism moves the model, or did a time before; psi turns with the drift angle (psi = beta on a straight
    course)."""
    w = run.frequency
    periods = campaign.periods + (rng.uniform(0.0, 0.9) if campaign.part_periods else 0.0)
    duration = run.duration or (periods * 2 * math.pi / w if w else 12.0)
    t = np.arange(round(duration * campaign.rate_hz)) / campaign.rate_hz - before_s
    phase = w * t + (rng.uniform(0, 2 * math.pi) if campaign.part_periods else 0.0)
    cos, sin, zero = np.cos(phase), np.sin(phase), np.zeros_like(t)
    slow, begin = 2 * math.pi / rng.uniform(6.0, 30.0, 3), rng.uniform(0, 2 * math.pi, 3)
    size = campaign.speed_fluctuation * model.speed_mps / 3
    speed = model.speed_mps + size * np.sin(np.outer(t, slow) + begin).sum(axis=1)
    speed_dot = size * (np.cos(np.outer(t, slow) + begin) * slow).sum(axis=1)
    y, psi, v, v_dot, r, r_dot = zero, zero, zero, zero, zero, zero
    if run.kind == "pure_sway":
        a = run.amplitude
        y, v, v_dot = a * sin, a * w * cos, -a * w * w * sin
        if campaign.surge == "resolved":
            speed_dot = (speed * speed_dot + v * v_dot) / np.hypot(speed, v)
            speed = np.hypot(speed, v)
    else:
        beta = run.drift
        v, v_dot = -speed * math.sin(beta), -speed_dot * math.sin(beta)
        psi = zero + beta
    if run.kind in ("pure_yaw", "yaw_with_drift"):
        r, r_dot = run.amplitude * cos, -run.amplitude * w * sin
        psi = psi + run.amplitude / w * sin
        y = -model.speed_mps * run.amplitude / w**2 * cos
    u, u_dot = speed, speed_dot
    if campaign.surge == "resolved":
        u = np.sqrt(speed**2 - v**2)
        u_dot = (speed * speed_dot - v * v_dot) / u
    return Motion(t, y, psi, v, r, speed, u, u_dot, v_dot, r_dot, zero + run.rudder)


def hydrodynamic_forces(model: Ship, m: Motion) -> np.ndarray:
    """X, Y (N) and N (N m) of the water on the hull, (3, n): (3.8) in SI, with what goes with acceleration."""
    d, L, V = dict.fromkeys(_TERMS, 0.0) | dict(model.derivatives), model.length_m, m.speed
    v, r, e = m.v / V, m.r * L / V, m.rudder
    vd, rd, ud = m.v_dot * L / V**2, m.r_dot * L**2 / V**2, m.u_dot * L / V**2
    X = d["X0"] + d["Xvv"] * v**2 + d["Xrr"] * r**2 + d["Xvr"] * v * r + d["Xdd"] * e**2 + d["Xvd"] * v * e
    Y = d["Y0"] + d["Yv"] * v + d["Yr"] * r + d["Yd"] * e
    Y = Y + d["Yvvv"] * v**3 + d["Yvvr"] * v**2 * r + d["Yvrr"] * v * r**2 + d["Yrrr"] * r**3
    Y = Y + d["Yddd"] * e**3 + d["Yvvd"] * v**2 * e + d["Yvdd"] * v * e**2
    N = d["N0"] + d["Nv"] * v + d["Nr"] * r + d["Nd"] * e
    N = N + d["Nvvv"] * v**3 + d["Nvvr"] * v**2 * r + d["Nvrr"] * v * r**2 + d["Nrrr"] * r**3
    N = N + d["Nddd"] * e**3 + d["Nvvd"] * v**2 * e + d["Nvdd"] * v * e**2
    q = 0.5 * DENSITY * L**2 * V**2
    return np.array(
        [
            q * (X + d["Xudot"] * ud),
            q * (Y + d["Yvdot"] * vd + d["Yrdot"] * rd),
            q * L * (N + d["Nvdot"] * vd + d["Nrdot"] * rd),
        ]
    )


_TERMS = (
    "X0 Xvv Xrr Xvr Xdd Xvd Xudot Y0 Yv Yr Yd Yvvv Yvvr Yvrr Yrrr Yddd Yvvd Yvdd Yvdot Yrdot "
    "N0 Nv Nr Nd Nvvv Nvvr Nvrr Nrrr Nddd Nvvd Nvdd Nvdot Nrdot"
).split()


def inertial_forces(model: Ship, m: Motion) -> np.ndarray:
    """Left sides of (3.1), (3, n): what it takes to move the mass that the gauges carry."""
    mass, x_G = model.mass_kg, model.x_G_m
    return np.array(
        [
            mass * (m.u_dot - m.v * m.r - x_G * m.r**2),
            mass * (m.v_dot + m.u * m.r + x_G * m.r_dot),
            model.yaw_inertia_kgm2 * m.r_dot + mass * x_G * (m.v_dot + m.u * m.r),
        ]
    )


def gauge_forces(campaign: Campaign, model: Ship, m: Motion) -> np.ndarray:
    """What the gauges would show without noise, (3, n). The mechanism's force and the water's make up (3.1)."""
    water, inertia = hydrodynamic_forces(model, m), inertial_forces(model, m)
    return {"on_model": inertia - water, "on_gauge": water - inertia, "hydrodynamic": water}[campaign.force_convention]


def disturbances(campaign: Campaign, model: Ship, t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Noise and zero errors of X, Y and N, (3, n)."""
    usual = NOISE_SHARE * model.force_N * np.array([1.0, 1.0, 0.3 * model.length_m])
    shares = {"vibration": 0.35 * campaign.vibration, "coloured": 0.0}
    if campaign.correlation_time_s > 0:
        shares["coloured"] = 0.5 * (1 - shares["vibration"])
    noise = math.sqrt(1 - sum(shares.values())) * rng.standard_normal((3, t.size))
    highest = 0.4 * campaign.rate_hz
    tone = 2 * math.pi * rng.uniform(0.5 * highest, highest, (3, 1)) * t + rng.uniform(0, 2 * math.pi, (3, 1))
    noise += math.sqrt(2 * shares["vibration"]) * np.sin(tone)
    if shares["coloured"]:
        keep = math.exp(-1 / (campaign.correlation_time_s * campaign.rate_hz))
        noise += math.sqrt(shares["coloured"]) * _first_order(keep, rng.standard_normal((3, t.size)))
    zero = rng.standard_normal((3, 1)) / 6
    drift = rng.standard_normal((3, 1)) / 6 * (t / t[-1] - 0.5)
    return usual[:, None] * (campaign.noise * noise + campaign.zero_error * zero + campaign.zero_drift * drift)


def _first_order(keep: float, white: np.ndarray) -> np.ndarray:
    """AR(1) noise of variance 1 that begins in its steady state."""
    out = np.empty_like(white)
    out[:, 0] = white[:, 0]
    step = math.sqrt(1 - keep**2)
    for n in range(1, white.shape[1]):
        out[:, n] = keep * out[:, n - 1] + step * white[:, n]
    return out


def _saturated(table: np.ndarray) -> None:
    limit = 0.7 * np.abs(table[:, 8]).max()
    table[:, 8] = np.clip(table[:, 8], -limit, limit)


def _step(table: np.ndarray) -> None:
    table[len(table) // 2 :, 8] += 0.5 * np.ptp(table[:, 8])


def _in_degrees(table: np.ndarray) -> None:
    table[:, 4] /= DEGREE


FAULTS = {"saturated": _saturated, "step": _step, "degrees": _in_degrees}
"""Faults of the readings; next to them ``short`` (0.7 periods), ``wrong type`` and ``missing``."""


def write(campaign: Campaign, folder: Path, planned: list[Run] | None = None) -> Written:
    """Write the campaign to a folder (made if need be); its runs, or those of another plan."""
    folder.mkdir(parents=True, exist_ok=True)
    model = ship(campaign)
    runs = plan(campaign, model) if planned is None else planned
    sheet = plan(replace(campaign, sheet_error=0.0), model) if planned is None else planned
    rng = np.random.default_rng([campaign.seed, 3, campaign.noise_seed] if campaign.noise_seed else [campaign.seed, 3])
    for run in runs:
        fault = campaign.faults.get(run.name, "")
        table = _table(campaign, model, run, rng)
        if fault in FAULTS:
            FAULTS[fault](table)
        if fault == "short":
            table = table[: int(0.7 * len(table) / campaign.periods)]
        if fault != "missing":
            row = ",".join(["%.7g"] * table.shape[1]) + "\n"  # as numpy.savetxt writes, in a third of its time
            text = f"{COLUMNS}\n" + row * len(table) % tuple(table.ravel().tolist())
            (folder / f"{run.name}.csv").write_text(text, encoding="utf-8")
    path = folder / "campaign.toml"
    path.write_text(_sheet(campaign, model, sheet), encoding="utf-8")
    return Written(path, model, tuple(runs))


def _table(campaign: Campaign, model: Ship, run: Run, rng: np.random.Generator) -> np.ndarray:
    before = motion(campaign, model, run, copy.deepcopy(rng), campaign.force_delay_s)
    m = motion(campaign, model, run, rng)
    number = zlib.crc32(run.name.encode())
    draw = np.random.default_rng([campaign.seed, 4, number, *([campaign.noise_seed] if campaign.noise_seed else [])])
    gains = 1 + campaign.gain_error * draw.standard_normal((3, 1))
    forces = gains * gauge_forces(campaign, model, before) + disturbances(campaign, model, m.t, rng)
    shown_speed = m.speed + 5e-4 * campaign.noise * rng.standard_normal(m.t.size)
    return np.column_stack([m.t, m.y, m.psi, m.v, m.r, shown_speed, m.rudder, *forces])


def _sheet(campaign: Campaign, model: Ship, runs: list[Run]) -> str:
    lines = [
        "[model]", f'name = "made up {campaign.seed}"',
        f"length_m = {model.length_m!r}", f"beam_m = {model.beam_m!r}", f"draught_m = {model.draught_m!r}",
        f"mass_kg = {model.mass_kg!r}", f"yaw_inertia_kgm2 = {model.yaw_inertia_kgm2!r}", f"x_G_m = {model.x_G_m!r}",
        "[test]", f"water_density_kgpm3 = {DENSITY}", f"gravity_mps2 = {GRAVITY}",
        f"speed_mps = {model.speed_mps!r}", f'force_convention = "{campaign.force_convention}"',
    ]  # fmt: skip
    for run in runs:
        wrong = campaign.faults.get(run.name) == "wrong type"
        kind = {"pure_sway": "pure_yaw", "pure_yaw": "pure_sway"}[run.kind] if wrong else run.kind
        lines += ["", "[[runs]]", f'file = "{run.name}.csv"', f'type = "{kind}"']
        if run.frequency:
            lines.append(f"frequency_radps = {run.frequency!r}")
            name = "amplitude_m" if kind == "pure_sway" else "yaw_rate_amplitude_radps"
            lines.append(f"{name} = {run.amplitude!r}")
        else:
            lines.append(f"rudder_rad = {run.rudder!r}")
        if run.kind not in ("pure_sway", "pure_yaw"):
            lines.append(f"drift_rad = {run.drift!r}")
    return "\n".join(lines) + "\n"
