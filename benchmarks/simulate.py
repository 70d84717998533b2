"""Simulated seconds per second of wall time, of a 600 s turn of the Mariner after set-up.

Prints the figure for the motion alone (states and all outputs at every step) and for the whole call with its figures,
each the median of many runs; and for CasADi's own evaluation beside it, as a ratio.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable

from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import Running

DURATION = 600.0
TURN = Turn(math.radians(35.0))


def rate(call: Callable[[], object], runs: int) -> float:
    """Median of simulated seconds per second."""
    call()
    seconds = []
    for _ in range(runs):
        begin = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - begin)
    return DURATION / statistics.median(seconds)


def motion(integrator: Integrator) -> Callable[[], object]:
    def run() -> object:
        running = Running(integrator)
        TURN.drive(running, 1.0, DURATION)
        return running.trajectory()

    return run


def main() -> None:
    model = build(read_card("mariner"))
    begin = time.perf_counter()
    compiled = Integrator(model)
    print(f"set-up: {time.perf_counter() - begin:.2f} s ({'machine code' if compiled.compiled else 'CasADi'})")
    moving = rate(motion(compiled), 100)
    whole = rate(lambda: simulate(model, TURN, duration_s=DURATION, integrator=compiled), 100)
    interpreted = rate(motion(Integrator(model, compiled=False)), 5)
    print(f"motion:                 {moving:9.0f} simulated s per s (aim: 200000)")
    print(f"with figures:           {whole:9.0f} simulated s per s")
    print(f"CasADi's own evaluation: {interpreted:8.0f} simulated s per s ({moving / interpreted:.0f} times slower)")


if __name__ == "__main__":
    main()
