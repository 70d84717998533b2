"""Time of a core in which ``serve`` answers a frame of ArduPilot's SITL, by UDP over loopback, in lock-step.

SITL asks for 400 frames a second in real time, or for more if it runs faster. Frames with moving orders are sent by
this process, which waits for each reply as SITL does; the time is that of ``serve``, receiving and sending included.
"""

from __future__ import annotations

import socket
import struct
import time

import tank2sim as t2s
from tank2sim.apps.ardupilot.physics import SitlShip

SHIPS = ("otter", "kvlcc2", "kvlcc2-mmg", "container", "esso-osaka")
RATE_HZ, FRAMES, WARM = 400, 4000, 100
FRAME = struct.Struct("<HHI16H")


def frame(count: int) -> bytes:
    """A frame whose orders change every second."""
    first = 1500 + (300 if count // RATE_HZ % 2 else -200)
    return FRAME.pack(18458, RATE_HZ, count, first, 0, 1800, *([0] * 13))


def seconds_of_answers(name: str) -> float:
    """Time of a core of ``serve`` for a frame."""
    ship = SitlShip(t2s.load(name).model)
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as physics,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sitl,
    ):
        physics.bind(("127.0.0.1", 0))
        used = 0.0
        for count in range(FRAMES + WARM):
            sitl.sendto(frame(count), physics.getsockname())
            begin = time.process_time()
            data, sender = physics.recvfrom(2048)
            reply = ship.answer(data)
            assert reply is not None
            physics.sendto(reply, sender)
            used += (time.process_time() - begin) * (count >= WARM)
            sitl.recvfrom(2048)
    return used / FRAMES


def main() -> None:
    print(f"{'card':14s}{'ms a frame':>12s}{f'core at {RATE_HZ} Hz':>16s}")
    for name in SHIPS:
        found = seconds_of_answers(name)
        print(f"{name:14s}{1e3 * found:12.3f}{found * RATE_HZ:15.1%}")


if __name__ == "__main__":
    main()
