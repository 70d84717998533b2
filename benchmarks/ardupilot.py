"""Frames of ArduPilot's SITL answered by `serve` in lock-step over loopback, by the processor of the server.

A process of its own serves the bundled craft; this script sends the frames of SITL, waits for each reply and sends the
next. Printed: seconds of a core of the server for a second of the craft, at frames of 50 to 1200 Hz (1 is real time).

    python benchmarks/ardupilot.py
"""

from __future__ import annotations

import multiprocessing
import resource
import socket
import struct

import tank2sim as t2s

INSTANCE = 77
PORT = 9002 + 10 * INSTANCE
SIMULATED_S = 10.0
RATES_HZ = (50, 400, 1200)


def serving(spent: multiprocessing.Queue) -> None:
    """Serve until SITL falls silent; the seconds of a core are put into the queue, without those of the start."""
    first = resource.getrusage(resource.RUSAGE_SELF)
    t2s.serve("otter", instance=INSTANCE, silence_s=1.0)
    last = resource.getrusage(resource.RUSAGE_SELF)
    spent.put(last.ru_utime + last.ru_stime - first.ru_utime - first.ru_stime)


def frames(rate_hz: int, seconds: float) -> None:
    """Send the frames of so many seconds, each when the one before is answered."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sitl:
        sitl.settimeout(0.5)
        count = 0
        while count < rate_hz * seconds:
            pulses = [1700, 0, 1600, *[0] * 13]
            sitl.sendto(struct.pack("<HHI16H", 18458, rate_hz, count, *pulses), ("127.0.0.1", PORT))
            try:
                sitl.recvfrom(2048)
            except TimeoutError:
                continue
            count += 1


def main() -> None:
    """Print the figures."""
    for rate_hz in RATES_HZ:
        needed = []
        for seconds in (1.0, SIMULATED_S):
            spent: multiprocessing.Queue = multiprocessing.get_context("spawn").Queue()
            server = multiprocessing.get_context("spawn").Process(target=serving, args=(spent,))
            server.start()
            frames(rate_hz, seconds)
            needed.append(spent.get())
            server.join()
        share = (needed[1] - needed[0]) / (SIMULATED_S - 1.0)
        print(f"{rate_hz} Hz: {share:.2f} s of a core for each second of the craft")


if __name__ == "__main__":
    main()
