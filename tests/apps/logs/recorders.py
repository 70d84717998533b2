"""Logs as recorders write them, of the made-up voyage."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.apps.logs.made_logs import frame, voyage

GPS_COLUMNS = "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"
GPS_FORMAT = "QBBIHBcLLeffffB"


def dataflash(path: Path, *, statuses: tuple[int | None, ...] = (3,), escs: int = 1, reversed_servo: int = 1) -> Path:
    """A dataflash log as text; a receiver for each of `statuses`, None for a message without an instance."""
    columns, letters = GPS_COLUMNS.split(","), GPS_FORMAT
    if statuses == (None,):
        columns, letters = [name for name in columns if name != "I"], "QBIHBcLLeffffB"
    lines = [
        "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns",
        f"FMT, 130, 50, GPS, {letters}, {','.join(columns)}",
        "FMT, 131, 20, ATT, Qffffff, TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw",
        "FMT, 132, 20, ESC, QBf, TimeUS,Instance,RPM",
        "FMT, 133, 20, PARM, QNff, TimeUS,Name,Value,Default",
        "FMT, 134, 20, RCOU, QHHHH, TimeUS,C1,C2,C3,C4",
        "PARM, 1000, SERVO1_FUNCTION, 26, 0",
        "PARM, 1000, SERVO1_MIN, 1000, 0",
        "PARM, 1000, SERVO1_TRIM, 1500, 0",
        "PARM, 1000, SERVO1_MAX, 2000, 0",
        f"PARM, 1000, SERVO1_REVERSED, {reversed_servo}, 0",
    ]
    table, made = frame(), voyage()
    pulses = 1500 + (-1 if reversed_servo else 1) * np.degrees(made.rudder) * 500 / 35
    for k, time in enumerate(made.time):
        at = int((time + 20) * 1e6)
        for instance, status in enumerate(statuses):
            values = {"TimeUS": at, "I": instance, "Status": 3 if status is None else status}
            values |= {"GMS": int((time + 100000) * 1000), "GWk": 2300 if status is None or status >= 2 else 0}
            values |= {"Lat": f"{table.latitude[k]:.7f}", "Lng": f"{table.longitude[k]:.7f}"}
            values |= {"Spd": f"{table.sog_kn[k] * 1852 / 3600:.3f}", "GCrs": f"{table.cog_deg[k]:.2f}"}
            lines.append("GPS, " + ", ".join(str(values.get(name, 0)) for name in columns))
        lines.append(f"ATT, {at}, 0, 0, 0, 0, 0, {table.heading_deg[k]:.2f}")
        lines += [f"ESC, {at}, {instance}, {table.shaft_rpm[k]:.1f}" for instance in range(escs)]
        lines.append(f"RCOU, {at}, {pulses[k]:.0f}, 0, 1500, 0")
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path
