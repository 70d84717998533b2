"""How far the exported FMUs are from the CasADi model they were made from, in all four kinds, through fmpy.

Co-Simulation against the same Runge-Kutta steps in CasADi, Model Exchange against an adaptive solution; the error of an
output is relative to the larger of its range in the run and its nominal value.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from tank2sim.cards import linear_card, read_card
from tank2sim.dynamics import build
from tank2sim.fmu.check import compare_with_model
from tank2sim.fmu.export import write_fmu


def main() -> None:
    mariner = read_card("mariner")
    cards = {
        "Mariner, third order": mariner,
        "Mariner, linear": linear_card(mariner),
        "vehicle": read_card("wilinski-zellman"),
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "ship.fmu")
        for name, card in cards.items():
            model = build(card)
            for fmi in (2, 3):
                begin = time.perf_counter()
                write_fmu(model, path, fmi=fmi)
                exported = time.perf_counter()
                report = compare_with_model(path, model=model)
                worst = {kind: max(errors.values()) for kind, errors in report.errors.items()}
                print(
                    f"{name}, FMI {fmi}: Co-Simulation {worst['CoSimulation']:.1e} (limit 1e-9), "
                    f"Model Exchange {worst['ModelExchange']:.1e} (limit 1e-6), "
                    f"validation: {len(report.validation)} findings; "
                    f"export {exported - begin:.1f} s, check {time.perf_counter() - exported:.1f} s"
                )


if __name__ == "__main__":
    main()
