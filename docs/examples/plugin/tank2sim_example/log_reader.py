"""The log of a recorder: a line ``RECORDER 1``, then in each line UTC in s since 1970, a name and a number."""

import numpy as np

from tank2sim.apps.logs.reading import LogReader
from tank2sim.apps.logs.streams import LogStream, VesselLog
from tank2sim.errors import InputError

# Name in the log: unit, and the quantity as tank2sim calls it (tank2sim.apps.logs.quantities).
SENSORS = {
    "heading": ("deg", "heading"),
    "rot": ("deg/min", "yaw_rate"),
    "speed": ("kn", "u_water"),
    "rudder": ("deg", "rudder_angle"),
}


def read(path):
    """One stream for each name."""
    samples = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines()[1:], start=2):
        try:
            time, name, value = line.split()
            samples.setdefault(name, []).append((float(time), float(value)))
        except ValueError:
            raise InputError(path, f"line {number}", "is not a time, a name and a number", "correct the line") from None
    streams = []
    for name, rows in samples.items():
        time_s, values = np.array(rows).T
        unit, quantity = SENSORS.get(name, ("", ""))
        streams.append(LogStream(name, time_s, values, unit, quantity, "format" if quantity else ""))
    return VesselLog(path, "recorder", tuple(streams))


RECORDER = LogReader("recorder", "logs of the recorder", lambda head: head.startswith(b"RECORDER 1"), read)
