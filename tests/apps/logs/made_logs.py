"""A made-up voyage, and writers of small logs of it in several formats; the sentences and frames are written here."""

from __future__ import annotations

import functools
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from operator import xor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

T0 = 1_700_000_000.0
"""2023-11-14T22:13:20Z."""
ORIGIN = (54.3, 10.2)
KNOT = 1852 / 3600


@dataclass(frozen=True)
class MadeVoyage:
    """Straight, a 20/20 zigzag, straight, a turn of 25 deg to starboard, straight; Nomoto's first order; 2 Hz."""

    time: np.ndarray
    rudder: np.ndarray
    rate: np.ndarray
    heading: np.ndarray
    speed: np.ndarray
    x: np.ndarray
    y: np.ndarray
    zigzag: tuple[float, float]
    turn: tuple[float, float]


@functools.cache
def voyage() -> MadeVoyage:
    step, n = 0.5, 1800
    gain, constant, speed = 0.05, 12.0, 6.0
    psi, rate, delta, order, phase, start = np.radians(40.0), 0.0, 0.0, 0.0, "wait", np.radians(40.0)
    rows, reversals, marks = [], 0, {}
    for k in range(n):
        t = k * step
        if t == 120.0:
            phase, order, marks["zigzag"] = "zigzag", np.radians(20), t
        if phase == "zigzag" and (psi - start) * np.sign(order) > np.radians(20):
            reversals += 1
            if reversals == 4:
                phase, marks["zigzag end"] = "steady", t
            else:
                order = -order
        if phase == "steady":
            order = float(np.clip(-6 * rate, -0.05, 0.05))
        if t == 600.0:
            phase, order, marks["turn"] = "turn", np.radians(25), t
        if t == 800.0:
            phase = "steady"
        delta += float(np.clip(order - delta, -np.radians(2.5), np.radians(2.5)))
        before = rate
        rate += step * (gain * delta - rate) / constant
        psi += step * 0.5 * (before + rate)
        rows.append((t, delta, rate, psi))
    time, rudder, rates, heading = np.array(rows).T
    drift = heading - 3.0 * rates  # a ship turns about its pivot point, and drifts outwards
    x, y = (np.cumsum(step * speed * part) for part in (np.cos(drift), np.sin(drift)))
    spans = (marks["zigzag"], marks["zigzag end"]), (marks["turn"], 800.0)
    return MadeVoyage(time, rudder, rates, heading, np.full(n, speed), x, y, *spans)


def degrees() -> tuple[np.ndarray, np.ndarray]:
    made = voyage()
    metres = 111_194.9
    return ORIGIN[0] + made.x / metres, ORIGIN[1] + made.y / metres / np.cos(np.radians(ORIGIN[0]))


def frame() -> pd.DataFrame:
    """A table with names that say what they are; UTC."""
    made = voyage()
    rng = np.random.default_rng(5)
    latitude, longitude = degrees()
    course = np.unwrap(np.arctan2(np.gradient(made.y), np.gradient(made.x)))
    return pd.DataFrame(
        {
            "utc": [stamp(t) for t in made.time],
            "latitude": latitude,
            "longitude": longitude,
            "sog_kn": made.speed / KNOT + rng.normal(0, 0.05, len(made.time)),
            "cog_deg": np.degrees(course) % 360,
            "heading_deg": (np.degrees(made.heading) + rng.normal(0, 0.1, len(made.time))) % 360,
            "rot_deg_min": np.degrees(made.rate) * 60 + rng.normal(0, 1.0, len(made.time)),
            "rudder_deg": np.degrees(made.rudder) + rng.normal(0, 0.1, len(made.time)),
            "shaft_rpm": 90.0 + rng.normal(0, 0.2, len(made.time)),
        }
    )


Manoeuvres = Sequence[tuple[str, float, float]]
"""("leg", seconds, 0), ("turn", rudder in deg, change of heading in deg), ("zigzag", rudder and heading, legs)."""


def steered(
    manoeuvres: Manoeuvres, restless_deg: float = 0.0, seed: int = 1
) -> tuple[pd.DataFrame, list[tuple[str, float, float]]]:
    """A table at 1 Hz of a ship that is steered so, and (kind, begin, end in s after T0) of its manoeuvres.

    A restless helm adds corrections of so many degrees (rms) to its orders every 2 to 6 s.
    """
    rng = np.random.default_rng(seed)
    step, gain, constant, speed = 0.1, 0.05, 12.0, 6.0
    psi, rate, delta, t, correction, until = 0.7, 0.0, 0.0, 0.0, 0.0, 0.0
    rows, spans = [], []
    for kind, first, second in manoeuvres:
        begin, base, order, reversals = t, psi, np.radians(first), 0
        while True:
            if kind == "leg":
                done, order = t - begin > first, float(np.clip(-6 * rate, -0.1, 0.1))
            elif kind == "turn":
                done = abs(psi - base) > np.radians(second)
            else:
                if (psi - base) * np.sign(order) > np.radians(abs(first)):
                    order, reversals = -order, reversals + 1
                done = reversals == second
            if done:
                break
            if restless_deg and t >= until:
                correction, until = np.radians(restless_deg) * rng.normal(), t + rng.uniform(2, 6)
            delta += float(np.clip(order + correction - delta, -np.radians(0.25), np.radians(0.25)))
            rate += step * (gain * delta - rate) / constant
            psi, t = psi + step * rate, t + step
            rows.append((t, delta, rate, psi))
        if kind != "leg":
            spans.append((kind, begin, t))
    time, rudder, rates, heading = np.array(rows[::10]).T
    course = heading - 3 * rates
    north, east = (np.cumsum(speed * part) for part in (np.cos(course), np.sin(course)))
    metres, n = 111_194.9, len(time)
    columns = {
        "utc": [stamp(t) for t in time],
        "latitude": ORIGIN[0] + north / metres,
        "longitude": ORIGIN[1] + east / metres / np.cos(np.radians(ORIGIN[0])),
        "sog_kn": speed / KNOT + rng.normal(0, 0.05, n),
        "heading_deg": (np.degrees(heading) + rng.normal(0, 0.1, n)) % 360,
        "rot_deg_min": np.degrees(rates) * 60 + rng.normal(0, 1.0, n),
        "rudder_deg": np.degrees(rudder) + rng.normal(0, 0.1, n),
        "shaft_rpm": 90.0 + rng.normal(0, 0.2, n),
    }
    return pd.DataFrame(columns), spans


def stamp(time_s: float) -> str:
    return pd.Timestamp(T0 + time_s, unit="s").strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def sentence(body: str) -> str:
    return f"${body}*{functools.reduce(xor, body.encode(), 0):02X}"


def nmea_angle(value: float, digits: int, letters: str) -> str:
    size = abs(value)
    minutes = (size - int(size)) * 60
    return f"{int(size):0{digits}d}{minutes:09.6f},{letters[0] if value >= 0 else letters[1]}"


def rmc(time_s: float, latitude: float, longitude: float, talker: str = "GP") -> str:
    moment = pd.Timestamp(T0 + time_s, unit="s")
    clock, date = moment.strftime("%H%M%S.%f")[:9], moment.strftime("%d%m%y")
    place = f"{nmea_angle(latitude, 2, 'NS')},{nmea_angle(longitude, 3, 'EW')}"
    return sentence(f"{talker}RMC,{clock},A,{place},11.66,,{date},,,A")


def nmea_lines() -> list[str]:
    """RMC at 1 Hz; heading, rate of turn and rudder at 2 Hz; revolutions."""
    table, made = frame(), voyage()
    lines = []
    for k, t in enumerate(made.time):
        if k % 2 == 0:
            lines.append(rmc(t, table.latitude[k], table.longitude[k]))
        lines.append(sentence(f"HEHDT,{table.heading_deg[k]:.2f},T"))
        lines.append(sentence(f"TIROT,{table.rot_deg_min[k]:.1f},A"))
        lines.append(sentence(f"AGRSA,{table.rudder_deg[k]:.1f},A,,V"))
        if k % 2 == 1:
            lines.append(sentence(f"IIRPM,S,0,{table.shaft_rpm[k]:.1f},,A"))
    return lines


def can_frame(time_s: float, pgn: int, payload: bytes) -> str:
    return f"({T0 + time_s:.6f}) can0 {(2 << 26) | (pgn << 8) | 35:08X}#{payload.hex().upper()}"


def _int(value: float, resolution: float, size: int) -> bytes:
    return round(value / resolution).to_bytes(size, "little", signed=True)


def candump_lines() -> Iterable[str]:
    """PGN 129025 position, 127250 heading, 127251 rate of turn, 127245 rudder (canboat's resolutions)."""
    table, made = frame(), voyage()
    for k, t in enumerate(made.time):
        if k % 2 == 0:
            yield can_frame(t, 129025, _int(table.latitude[k], 1e-7, 4) + _int(table.longitude[k], 1e-7, 4))
        heading = round(np.radians(table.heading_deg[k]) / 1e-4).to_bytes(2, "little")
        yield can_frame(t, 127250, b"\xff" + heading + b"\xff\x7f\xff\x7f\xfc")
        yield can_frame(t, 127251, b"\xff" + _int(made.rate[k], 3.125e-8, 4) + b"\xff\xff\xff")
        yield can_frame(t, 127245, b"\x00\xf8\xff\x7f" + _int(made.rudder[k], 1e-4, 2) + b"\xff\xff")


def truth_manoeuvres(data: Path, vessel: str, name: str) -> tuple[list[dict], Path]:
    """Manoeuvres of a made-up voyage by its truth file, and the log; a skip where they or a library are missing."""
    folder = data / "data" / "logs"
    path = folder / vessel / name
    if not path.is_file():
        pytest.skip(f"made-up logs are missing: no {path}")
    library = {".nmea": "pynmea2", ".bag": "rosbags", ".mcap": "rosbags", ".bin": "pymavlink", ".ulg": "pyulog"}
    if path.suffix in library:
        pytest.importorskip(library[path.suffix])
    known = json.loads((folder / f"{vessel}-truth.json").read_text(encoding="utf-8"))
    return known["manoeuvres"], path


CRAFT_STEP = 0.2
"""Time between samples of the craft, s."""


def craft() -> dict[str, np.ndarray]:
    """Ten minutes of a craft that the difference of its orders (shares) turns, a first-order lag behind."""
    rng = np.random.default_rng(3)
    count = 3000
    time = CRAFT_STEP * np.arange(count)
    legs = np.repeat(rng.uniform(-0.2, 0.9, (count // 50, 2)), 50, axis=0)
    port, starboard = np.where(np.abs(legs) < 0.1, 0.0, legs).T
    rate, speed, psi = np.zeros(count), np.zeros(count), np.full(count, 0.5)
    for k in range(1, count):
        rate[k] = rate[k - 1] + CRAFT_STEP * (0.4 * (port[k - 1] - starboard[k - 1]) - rate[k - 1]) / 2.0
        speed[k] = speed[k - 1] + CRAFT_STEP * (1.2 * (port[k - 1] + starboard[k - 1]) - speed[k - 1]) / 4.0
        psi[k] = psi[k - 1] + CRAFT_STEP * rate[k]
    x, y = np.cumsum(CRAFT_STEP * speed * np.cos(psi)), np.cumsum(CRAFT_STEP * speed * np.sin(psi))
    return {"time": time, "port": port, "starboard": starboard, "rate": rate, "psi": psi, "x": x, "y": y}


def motion(made: dict[str, np.ndarray]) -> pd.DataFrame:
    metres = 111_194.9
    return pd.DataFrame(
        {
            "utc": [stamp(t) for t in made["time"]],
            "latitude": ORIGIN[0] + made["x"] / metres,
            "longitude": ORIGIN[1] + made["y"] / metres / np.cos(np.radians(ORIGIN[0])),
            "heading_deg": np.degrees(made["psi"]) % 360,
        }
    )


def stream_of(found, name: str):
    """The only stream of a name."""
    (stream,) = (stream for stream in found.streams if stream.name == name)
    return stream


def texts(found, kind: str = "") -> str:
    """Texts of the findings of a kind, or of all."""
    return "\n".join(finding.text for finding in found.findings if kind in ("", finding.kind))


def used(result) -> dict[str, str]:
    """Quantity to stream of the channels in use."""
    return {channel.quantity: channel.stream for channel in result.voyage.channels.channels if channel.use}
