"""Logs of two made-up voyages in seven formats: manoeuvres found against the truth, and a turn that was not fitted.

First a log of 24 h at 10 Hz is written, read and cut. Then for each format: how many manoeuvres of the truth file are
found with their kind, and the largest error of a begin. Last, the bundled Mariner is fitted to the zigzag and the turn
of 20 deg of the ship's log, by default and by output error, and the tactical diameter of the turn of -35 deg, which is
held out, is predicted; nothing is given of the current.

Before these, logs that others recorded: boats' NMEA 2000 (clocks, headings, steering gear) and two ROS bags, by
themselves and with their topics named.

    python benchmarks/logs.py [--recorded]   # with --recorded these alone
"""

from __future__ import annotations

import json
import os
import resource
import struct
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd

import tank2sim as t2s

LOGS = Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared")) / "data" / "logs"
FORMATS = ("voyage.nmea", "voyage.bag", "voyage.mcap", "voyage.bin", "voyage.ulg", "voyage.csv", "voyage_eu.csv")
KINDS = {
    "ship_21": {"zigzag", "turn", "stop"},
    "usv_22": {"zigzag", "turn", "steps", "pivot", "coast", "astern", "accelerate"},
}


def manoeuvres_found(vessel: str, name: str) -> tuple[int, int, float]:
    """Manoeuvres found, those of the truth, and the largest error of a begin among those found, s."""
    truth = json.loads((LOGS / f"{vessel}-truth.json").read_text(encoding="utf-8"))["manoeuvres"]
    wanted = [entry for entry in truth if entry["kind"] in KINDS[vessel]]
    found = t2s.log(LOGS / vessel / name).found
    errors = []
    for entry in wanted:
        begin = pd.Timestamp(entry["utc_start"]).timestamp()
        near = [abs(stretch.begin_s - begin) for stretch in found if stretch.kind.value == entry["kind"]]
        if near and min(near) < 5.0:
            errors.append(min(near))
    return len(errors), len(wanted), max(errors, default=float("nan"))


def held_out_turn(name: str, folder: Path) -> str:
    """Tactical diameter of the turn that was not fitted: measured, and its error by the bundled and the fitted card."""
    result = t2s.log(LOGS / "ship_21" / name)
    paths = {path.stem: path for path in result.save(folder / name)}
    fitted = [path for stem, path in paths.items() if "zigzag" in stem or "turn_+20" in stem]
    (held,) = (path for stem, path in paths.items() if "turn_-35" in stem)
    said = []
    for method in ("residuals", "output_error"):
        fit = t2s.identify("mariner", fitted, holdout=held, method=method, members=0).to_dict()
        (figure,) = (entry for entry in fit["figures"]["holdout"] if entry["figure"] == "tactical_diameter_m")
        before, now = (100 * (figure[key] / figure["measured"] - 1) for key in ("before", "predicted"))
        current = fit["current"]
        water = f"current {current['speed_mps']:.2f} m/s to {current['direction_deg']:.0f} deg"
        said.append(f"by {fit['method']} {now:+.1f} % ({water})")
    return f"{figure['measured']:.0f} m; bundled card {before:+.1f} %, fitted by default {', '.join(said)}"


def day(folder: Path) -> str:
    """Time and memory of a day at 10 Hz with two turns an hour."""
    count = 864_000
    seconds = np.arange(count) * 0.1
    rudder = np.where(seconds % 1800 >= 1500, np.radians(20.0), 0.0) * np.where(seconds % 3600 < 1800, 1, -1)
    rate = 0.02 * rudder
    heading = np.cumsum(rate) * 0.1
    north, east = (np.cumsum(0.7 * part) for part in (np.cos(heading), np.sin(heading)))
    table = {
        "utc": 1_700_000_000 + seconds,
        "latitude": 50 + north / 111_200,
        "longitude": east / 71_500,
        "heading_deg": np.degrees(heading) % 360,
        "rot_deg_min": np.degrees(rate) * 60,
        "rudder_deg": np.degrees(rudder),
        "sog_kn": np.full(count, 13.61),
        "rpm": np.full(count, 84.0),
    }
    path = folder / "day.csv"
    pd.DataFrame(table).to_csv(path, index=False, float_format="%.7f")
    begin, used = time.perf_counter(), time.process_time()
    result = t2s.log(path)
    result.save(folder / "day")
    result.to_json(folder / "day.json")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    spent = f"{time.perf_counter() - begin:.0f} s, {time.process_time() - used:.0f} s of processors"
    return f"{spent}, {memory:.2f} GB at most, {len(result.cuts)} trials of 48"


BUS = LOGS.parent / "canboat_n2k"
BAG_CHANNELS = {
    "x": ("position.x", "m"),
    "y": ("position.y", "m"),
    "heading": ("position.theta", "rad"),
    "yaw_rate": ("y_heading", "rad/s"),
    "u_water": ("y_speed", "m/s"),
}
"""Quantity to stream and unit in the bags; all are positive to starboard, or ahead."""


def print_boats() -> None:
    """What is found in each recording of a boat's bus: length, doubts about clocks and headings, steering gear."""
    for path in sorted([*BUS.glob("*.raw"), *BUS.glob("*.all")]):
        study = t2s.log(path).study
        print(f"{path.name}: {study.duration_s:.0f} s by the clock in use, stretches: {len(study.stretches)}")
        for finding in study.findings:
            if finding.evidence.keys() & {"behind_s", "apart_deg", "apart", "delay_s"}:
                print(f"  {finding.text}")
        print_clocks(path)
        print(f"  {study.gear.words if study.gear else 'no orders of the rudder to judge its gear by'}")


def print_clocks(path: Path) -> None:
    """Time of day of each source by PGN 126992 less the recorder's, s, at the beginning and at the end: decoded
    here from the bytes."""
    readings: dict[str, list[float]] = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        fields = line.strip().split(",")
        if len(fields) < 14 or fields[2] != "126992":
            continue
        _, _, _, clock = struct.unpack("<BBHI", bytes(int(byte, 16) for byte in fields[6:14]))
        stamp = pd.Timestamp(fields[0]).tz_localize(None)
        readings.setdefault(fields[3], []).append(clock * 1e-4 - (stamp - stamp.normalize()).total_seconds())
    for source, ahead in readings.items():
        print(
            f"  by its bytes: source {source} ahead of the recorder by {ahead[0]:+.2f} s, at the end {ahead[-1]:+.2f} s"
        )


def print_bags(folder: Path) -> None:
    """What is found in the ROS bags of others, by themselves and with their topics named."""
    entries = [
        f'[[channels]]\nquantity = "{quantity}"\nstream = "{stream}"\nunit = "{unit}"\nsign = 1\nuse = true'
        for quantity, (stream, unit) in BAG_CHANNELS.items()
    ]
    channels = folder / "bag_channels.toml"
    channels.write_text("\n".join(['format = "tank2sim-channels/1"', *entries]) + "\n", encoding="utf-8")
    for path in sorted((LOGS / "real").glob("*.bag")):
        try:
            t2s.log(path)
        except t2s.InputError as error:
            print(f"{path.name}: by itself: {str(error).partition(': ')[2].partition(';')[0]}")
        study = t2s.log(path, channels=channels).study
        kinds = ", ".join(f"{stretch.kind.value} {stretch.duration_s:.1f} s" for stretch in study.stretches)
        found = f"{kinds or 'no stretch'}; findings: {len(study.findings)}"
        print(f"  with its topics named: {study.duration_s:.1f} s; {found}")


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name:
        if BUS.is_dir():
            print_boats()
            print_bags(Path(name))
    if "--recorded" in sys.argv:
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"24 h at 10 Hz as CSV: {day(folder)}")
        if not LOGS.is_dir():
            sys.exit(f"the made-up logs are missing: no folder {LOGS} (set TANK2SIM_DATA)")
        for vessel in KINDS:
            for file in FORMATS:
                found, wanted, error = manoeuvres_found(vessel, file)
                print(f"{vessel} {file}: {found} of {wanted} manoeuvres, begins within {error:.1f} s")
        for file in FORMATS:
            print(f"held-out turn, {file}: tactical diameter {held_out_turn(file, folder)}")


if __name__ == "__main__":
    main()
