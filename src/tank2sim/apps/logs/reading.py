"""One door for logs of every known format."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tank2sim.apps.logs.ardupilot import looks_like_tlog, read_ardupilot_bin, read_ardupilot_tlog
from tank2sim.apps.logs.nmea0183 import looks_like_nmea0183, read_nmea0183
from tank2sim.apps.logs.nmea2000 import looks_like_nmea2000, read_nmea2000
from tank2sim.apps.logs.px4 import read_px4_ulog
from tank2sim.apps.logs.ros import read_ros_bag
from tank2sim.apps.logs.streams import VesselLog
from tank2sim.errors import InputError
from tank2sim.files import first_bytes
from tank2sim.plugins import Registry
from tank2sim.records.text_layout import decoded_text

_HEAD_BYTES = 8192


@dataclass(frozen=True)
class LogReader:
    """A format of logs and its reader.

    Parameters
    ----------
    name : str
    description : str
        A few words for messages: ``NMEA 0183``.
    recognises : callable
        ``recognises(beginning) -> bool``: whether a file with these first bytes is such a log. Text in UTF-16 is given
        as Latin-1, and a byte order mark is left out.
    read : callable
        ``read(path) -> VesselLog``. Raises InputError if the file is faulty.
    """

    name: str
    description: str
    recognises: Callable[[bytes], bool]
    read: Callable[[Path], VesselLog]


def _begins(*magic: bytes) -> Callable[[bytes], bool]:
    return lambda head: head.startswith(magic)


def _is_ardupilot(head: bytes) -> bool:
    return head.startswith(b"\xa3\x95\x80") or bool(re.search(rb"(?m)^FMT,\s*\d+,\s*\d+,\s*\w+,", head))


# First bytes of binary formats, from their specifications.
LOG_READERS: Registry[LogReader] = Registry(
    "tank2sim.log_readers",
    (
        LogReader("ros", "ROS bags, MCAP", _begins(b"#ROSBAG", b"\x89MCAP0", b"SQLite format 3"), read_ros_bag),
        LogReader("px4", "ULog", _begins(b"ULog\x01\x12\x35"), read_px4_ulog),
        LogReader("ardupilot", "ArduPilot .bin and .log", _is_ardupilot, read_ardupilot_bin),
        LogReader("mavlink", "ArduPilot .tlog", looks_like_tlog, read_ardupilot_tlog),
        LogReader("nmea2000", "NMEA 2000 (text)", looks_like_nmea2000, read_nmea2000),
        LogReader("nmea0183", "NMEA 0183", looks_like_nmea0183, read_nmea0183),
    ),
    LogReader,
)
"""Built-in readers of logs and readers from installed packages; a text that none of them knows is read as a CSV
table."""


def _known() -> str:
    return f"known are {', '.join(reader.description for reader in LOG_READERS.values())} and CSV"


_RAW = "record the raw frames (candump -L, or the input of the analyzer)"
# Beginnings of files that are no log that is read, what they are, and what to give in their place
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


def read_log(path: Path | str) -> VesselLog:
    """Read a log of any known format; its beginning shows which, not its name.

    Raises
    ------
    InputError
        The file is missing, empty, of no known format or faulty, or its format needs a library that is not installed.
    """
    path = Path(path)
    if path.is_dir():
        if not (path / "metadata.yaml").is_file():
            problem = "is a folder, and neither a log nor a bag of ROS 2 (no metadata.yaml)"
            raise InputError(path, "", problem, "give the log in it")
        return read_ros_bag(path)
    head = first_bytes(path, _HEAD_BYTES)
    if not head.strip():
        raise InputError(path, "", "is empty", "give a log with values")
    plain = _plain(head)
    for reader in LOG_READERS.values():
        if reader.recognises(head) or reader.recognises(plain):
            return reader.read(path)
    _refuse_foreign(path, plain)
    if b"\0" in plain:  # of a .tlog, the first message is cut
        return read_ardupilot_tlog(path)
    from tank2sim.apps.logs.table import read_table_log  # slow to import

    return read_table_log(path)


def _plain(head: bytes) -> bytes:
    """The beginning of a file without a byte order mark; of a text in UTF-16 as Latin-1."""
    text, encoding = decoded_text(head, complete=False)
    plain = text.encode("latin-1", errors="replace") if encoding.startswith("utf-16") else head
    return plain.removeprefix(b"\xef\xbb\xbf")


def _refuse_foreign(path: Path, plain: bytes) -> None:
    """Refuse a file whose beginning is of another format, or of none."""
    for beginning, problem, remedy in _FOREIGN:
        if re.match(beginning, plain):
            raise InputError(path, "", problem, f"{remedy}; {_known()}")
    if b"\0" in plain and path.suffix.lower() != ".tlog":
        raise InputError(path, "", "is of no known format, or its beginning is missing", _known())
