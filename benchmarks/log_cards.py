"""The card of one voyage from each format of its log, and what the digits of the format imply.

The two made-up voyages of `shared/data/logs` are cut from all seven formats, the trials are brought to the same
columns, and a card is fitted to each: the craft's from position, heading and revolutions, the Mariner's from a zigzag
and a turn of 20 deg, by output error. Printed for each format: rms and largest difference of the coefficients from
those of the ROS bag, which rounds nothing, over their standard errors; and the same for the bag's trials rounded to the
digits of the format. What is beyond that are other rates and times of the samples, with other noise in them.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from craft_log import LOGS, first_card, shared_craft_numbers

import tank2sim as t2s
from tank2sim.cards import parse_card

FORMATS = ("voyage.bag", "voyage.mcap", "voyage.nmea", "voyage.bin", "voyage.ulg", "voyage.csv", "voyage_eu.csv")
DEGREE_M, KNOT_MPS = 111_200.0, 1852 / 3600
SHIP_COLUMNS = ("t_s", "delta_deg", "n_rpm", "u_mps", "r_degps", "psi_deg", "x_m", "y_m")
CRAFT_COLUMNS = ("t_s", "psi_deg", "x_m", "y_m", "n_port_rpm", "n_starboard_rpm")
DIGITS: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    # last digit of each column, in its unit, as the files are written
    "ship_21": {
        "voyage.nmea": {"xy": 1e-5 / 60, "psi": 0.01, "r": 0.1 / 60, "delta": 0.1, "n": 0.1, "u": 0.01 * KNOT_MPS},
        "voyage.csv": {"xy": 1e-7, "psi": 0.01, "r": 0.01 / 60, "delta": 0.01, "n": 0.1, "u": 0.001 * KNOT_MPS},
        "voyage_eu.csv": {"xy": 1e-6, "psi": 0.1, "r": 0.1 / 60, "delta": 0.1, "n": 0.1, "u": 0.01 * KNOT_MPS},
    },
    "usv_22": {
        "voyage.nmea": {"xy": 1e-5 / 60, "psi": 0.01, "n": 1.0},
        "voyage.bin": {"xy": 1e-7, "psi": 0.01, "n": 0.0},
        "voyage.ulg": {"xy": 1e-7, "psi": 0.0, "n": 0.0},
        "voyage.csv": {"xy": 1e-7, "psi": 0.01, "n": 1.0},
        "voyage_eu.csv": {"xy": 1e-6, "psi": 0.1, "n": 1.0},
    },
}


def trials_of(vessel: str, name: str, folder: Path) -> list[Path]:
    """The trials that are fitted, with the same columns for all formats."""
    columns = SHIP_COLUMNS if vessel == "ship_21" else CRAFT_COLUMNS
    folder.mkdir(parents=True)
    kept = []
    for path in sorted(t2s.log(LOGS / vessel / name).save(folder / "all")):
        if path.suffix != ".csv" or (
            vessel == "ship_21" and not {"zigzag", "turn_+20"} & {path.stem[3:9], path.stem[3:]}
        ):
            continue
        remarks = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
        table = pd.read_csv(path, comment="#")[list(columns)]
        kept.append(folder / path.name)
        write(kept[-1], remarks, table)
    return kept


def write(path: Path, remarks: list[str], table: pd.DataFrame) -> None:
    """Write a trial."""
    path.write_text("\n".join(remarks) + "\n" + table.to_csv(index=False), encoding="utf-8")


def rounded(paths: list[Path], digits: Mapping[str, float], folder: Path) -> list[Path]:
    """The same trials rounded."""
    folder.mkdir()
    for path in paths:
        remarks = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
        table = pd.read_csv(path, comment="#")
        for column in table.columns.drop("t_s"):
            key = "xy" if column in ("x_m", "y_m") else column.split("_")[0]
            digit = digits[key] * (DEGREE_M if key == "xy" else 1.0)
            if digit:
                table[column] = (table[column] / digit).round() * digit
        write(folder / path.name, remarks, table)
    return [folder / path.name for path in paths]


def fitted(vessel: str, paths: list[Path]) -> dict[str, tuple[float, float]]:
    """Coefficient to its value and standard error."""
    if vessel == "usv_22":
        card = first_card(shared_craft_numbers(), np.random.default_rng(0))
        fit = t2s.identify(card, paths).fit
        return {
            name: (value, error)
            for name, value, error in zip(
                fit.problem.free, fit.estimate.values, fit.estimate.standard_errors, strict=True
            )
        }
    text = t2s.load("mariner").card.text
    text += '\n[[effects]]\nname = "current"\nparameters = { speed_mps = 0.384, direction_deg = 24.0 }\n'
    ship = t2s.Ship(parse_card(text, "mariner with current"))
    found = t2s.identify(ship, paths, method="output_error", structure="card", members=0).to_dict()["derivatives"]
    return {name: (entry["value"], entry["standard_error"]) for name, entry in found.items() if entry["standard_error"]}


def apart(first: dict[str, tuple[float, float]], second: dict[str, tuple[float, float]]) -> str:
    """Rms and largest difference over the standard error, and the name of the latter."""
    names = sorted(first.keys() & second.keys())
    over = np.array([(second[name][0] - first[name][0]) / first[name][1] for name in names])
    worst = int(np.argmax(np.abs(over)))
    return f"rms {np.sqrt(np.mean(over**2)):.2g}, largest {abs(over[worst]):.2g} ({names[worst].rpartition('.')[2]})"


def main() -> None:
    """Print the differences."""
    for vessel in sys.argv[1:] or ("usv_22", "ship_21"):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            bag = trials_of(vessel, FORMATS[0], folder / FORMATS[0])
            reference = fitted(vessel, bag)
            for number, file in enumerate(FORMATS[1:]):
                digits = DIGITS[vessel].get(file)
                if vessel == "ship_21" and digits is None and file != "voyage.mcap":
                    print(f"{vessel} {file}: orders of the rudder alone, no speed through the water")
                    continue
                try:
                    found = apart(reference, fitted(vessel, trials_of(vessel, file, folder / file)))
                except KeyError as missing:
                    found = f"not compared: {missing}"
                implied = "nothing"
                if digits:
                    implied = apart(reference, fitted(vessel, rounded(bag, digits, folder / f"rounded{number}")))
                print(f"{vessel} {file}: {found}; implied by its digits: {implied}", flush=True)


if __name__ == "__main__":
    main()
