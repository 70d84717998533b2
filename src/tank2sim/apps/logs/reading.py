"""One door for logs of every known format."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from tank2sim.apps.logs.ardupilot import looks_like_tlog, read_ardupilot_bin, read_ardupilot_tlog
from tank2sim.apps.logs.nmea0183 import looks_like_nmea0183, read_nmea0183
from tank2sim.apps.logs.nmea2000 import looks_like_nmea2000, read_nmea2000
from tank2sim.apps.logs.px4 import read_px4_ulog
from tank2sim.apps.logs.ros import read_ros_bag
from tank2sim.apps.logs.streams import VesselLog
from tank2sim.apps.logs.table import read_table_log
from tank2sim.errors import InputError
from tank2sim.records.text_layout import decoded_text

_HEAD_BYTES = 8192

_MAGIC: tuple[tuple[bytes, Callable[[Path], VesselLog]], ...] = (
    (b"#ROSBAG", read_ros_bag),
    (b"\x89MCAP0", read_ros_bag),
    (b"SQLite format 3", read_ros_bag),
    (b"ULog\x01\x12\x35", read_px4_ulog),
    (b"\xa3\x95\x80", read_ardupilot_bin),
)
"""First bytes of binary formats (their specifications), and the reader."""

_KNOWN = "ROS bags, MCAP, ULog, ArduPilot .bin, .log and .tlog, NMEA 0183, NMEA 2000 (text) and CSV"

_RAW = "record the raw frames (candump -L, or the input of the analyzer)"
_FOREIGN: tuple[tuple[bytes, str, str], ...] = (
    (rb"\x1f\x8b", "is compressed (gzip)", "unpack it"),
    (rb"PK\x03\x04", "is a ZIP archive or a spreadsheet", "unpack it, or save it as CSV"),
    (rb'\s*\{(?=.*"pgn")', "is JSON of NMEA 2000 (canboat analyzer)", _RAW),
    (rb"\d{4}-\d\d-\d\d[-T ][\d:.]+Z?\s+\d\s+\d+\s+\d+\s+\d{5,6}\s+\w", "is text of the canboat analyzer", _RAW),
    (
        rb'(\d{13};[^;]*;)?\s*\{(?=.*"(updates|values|context)")',
        "is JSON of Signal K",
        "record its raw input, or save CSV",
    ),
    (rb"\d{13};[^;]*;\s*\{", "is a log of Signal K with JSON", "record NMEA 0183 or raw frames of NMEA 2000"),
    (rb"\s*[{\[]", "is JSON", "save it as CSV, a row a sample"),
    (rb"\s*<(\?xml|gpx|kml|!DOCTYPE|html)", "is XML or HTML", "save it as CSV, a row a sample"),
)
"""Beginnings of files that are no log that is read, what they are, and what to give in their place."""


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
    if looks_like_tlog(head):
        return read_ardupilot_tlog(path)
    return _read_text(path, head)


def _read_text(path: Path, head: bytes) -> VesselLog:
    """Read a log of text, whatever its encoding, or refuse it by what it is."""
    text, encoding = decoded_text(head, complete=False)
    plain = text.encode("latin-1", errors="replace") if encoding.startswith("utf-16") else head
    plain = plain.removeprefix(b"\xef\xbb\xbf")
    for fits, reader in (
        (re.compile(rb"^FMT,\s*\d+,\s*\d+,\s*\w+,", re.MULTILINE).search, read_ardupilot_bin),
        (looks_like_nmea2000, read_nmea2000),
        (looks_like_nmea0183, read_nmea0183),
    ):
        if fits(plain):
            return reader(path)
    for beginning, problem, remedy in _FOREIGN:
        if re.match(beginning, plain):
            raise InputError(path, "", problem, f"{remedy}; known are {_KNOWN}")
    if b"\0" in plain and path.suffix.lower() == ".tlog":  # its first message is cut
        return read_ardupilot_tlog(path)
    if b"\0" in plain:
        raise InputError(path, "", "is of no known format, or its beginning is missing", f"known are {_KNOWN}")
    return read_table_log(path)
