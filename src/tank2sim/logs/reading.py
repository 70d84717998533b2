"""One door for logs of every known format."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from tank2sim.errors import InputError
from tank2sim.logs.ardupilot import read_ardupilot_bin, read_ardupilot_tlog
from tank2sim.logs.nmea0183 import looks_like_nmea0183, read_nmea0183
from tank2sim.logs.nmea2000 import looks_like_nmea2000, read_nmea2000
from tank2sim.logs.px4 import read_px4_ulog
from tank2sim.logs.ros import read_ros_bag
from tank2sim.logs.streams import VesselLog
from tank2sim.logs.table import read_table_log

_HEAD_BYTES = 8192

_MAGIC: tuple[tuple[bytes, Callable[[Path], VesselLog]], ...] = (
    (b"#ROSBAG", read_ros_bag),
    (b"\x89MCAP0", read_ros_bag),
    (b"SQLite format 3", read_ros_bag),
    (b"ULog\x01\x12\x35", read_px4_ulog),
    (b"\xa3\x95\x80", read_ardupilot_bin),
)
"""First bytes of binary formats (their specifications), and the reader."""


def read_log(path: Path | str) -> VesselLog:
    """Read a log of any known format; its beginning shows which, not its name.

    Raises
    ------
    InputError
        The file is missing, empty, of no known format or faulty, or its format needs a library that is not installed.
    """
    path = Path(path)
    if path.is_dir():
        return read_ros_bag(path)
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except FileNotFoundError:
        raise InputError(path, "", "the file does not exist", "check the name") from None
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None
    if not head.strip():
        raise InputError(path, "", "is empty", "give a log with values")
    for magic, reader in _MAGIC:
        if head.startswith(magic):
            return reader(path)
    if path.suffix.lower() == ".tlog":
        return read_ardupilot_tlog(path)
    if path.suffix.lower() == ".log" and re.match(rb"FMT,\s*128", head):
        return read_ardupilot_bin(path)
    if looks_like_nmea2000(head):
        return read_nmea2000(path)
    if looks_like_nmea0183(head):
        return read_nmea0183(path)
    if b"\0" in head and head[:2] not in (b"\xff\xfe", b"\xfe\xff"):  # the marks of UTF-16, as spreadsheets export
        known = "ROS bags, MCAP, ULog, ArduPilot .bin and .tlog, NMEA 0183, NMEA 2000 (text) and CSV"
        raise InputError(path, "", "is of no known format, or its beginning is missing", f"known are {known}")
    return read_table_log(path)
