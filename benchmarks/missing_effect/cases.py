"""Write the cases of the public benchmark of missing effects: trials of ships, and the truth in a file of its own.

    python benchmarks/missing_effect/cases.py FOLDER [--cases N] [--seed S] [--harder]

Each case is a folder: ``ship.toml`` (the model that the analyst has), ``fit/*.csv`` and ``holdout/*.csv``. What was
hidden is in ``truth.csv`` next to the folders, and in nothing else. A case is drawn at random: one of four ships, 10, 2
or 1 rows a second, nothing, one or two effects of the catalogue or one thing that the catalogue does not hold, at full
or a quarter strength, and in one of four with each coefficient 2 % off the card's. The catalogue is ``catalogue.csv``.

The cases of ``--harder`` are in turn of four groups: three effects at once; one effect and a card whose derivatives are
10 % off and say so; one effect and records of position and heading alone; a wind or current that differs from trial to
trial.
"""

from __future__ import annotations

import argparse
import csv
import json
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gap_truth import EFFECTS, FIT, HULLS, OUTSIDERS, SENSORS, Setting, make, sampled, write, wrong_card

HERTZ = (10, 2, 1)
GROUPS = {"single": 0.4, "weak": 0.15, "pair": 0.2, "none": 0.15, "outside": 0.1}
"""Share of each group of cases: a choice of this benchmark."""

HARDER = ("triple", "wrong card", "positions", "by trial")
CARD_ERROR = 0.1
"""Relative standard error of the derivatives of a wrong card: a choice of this benchmark."""

OF_THE_SHIP = [name for name in EFFECTS if name not in SENSORS]
VELOCITIES = ("u_mps", "v_mps", "r_degps")
TRUTH_COLUMNS = ("case", "group", "ship", "hertz", "verdict", "effects", "parameters")
VERDICTS = {"no missing effect": "none", "missing effect": "missing", "outside the library": "outside"}


@dataclass(frozen=True)
class Case:
    """One case: its name, group and rows a second, and how it is made."""

    name: str
    group: str
    hertz: int
    setting: Setting


def draw_cases(count: int, seed: int) -> list[Case]:
    """`count` cases, the same for the same seed; of a larger number the first are the same."""
    cases = []
    for number in range(1, count + 1):
        generator = np.random.default_rng([seed, number])
        group = str(generator.choice(list(GROUPS), p=list(GROUPS.values())))
        ship, hertz = str(generator.choice(list(HULLS))), int(generator.choice(HERTZ))
        chosen = {"none": 0, "pair": 2}.get(group, 1)
        effects = generator.choice(OUTSIDERS if group == "outside" else EFFECTS, chosen, replace=False)
        weak = group == "weak"
        setting = Setting(
            tuple(map(str, effects)),
            seed=int(generator.integers(2**31)),
            strength=0.25 if weak else 1.0,
            coefficients="independent" if generator.random() < 0.25 else "exact",
            ship=ship,
        )
        cases.append(Case(f"case_{number:04d}", group, hertz, setting))
    return cases


def draw_harder_cases(count: int, seed: int) -> list[Case]:
    """`count` cases of the harder groups in turn, the same for the same seed."""
    cases = []
    for number in range(1, count + 1):
        generator = np.random.default_rng([seed, number, 77])  # not the numbers of the other draw
        group = HARDER[(number - 1) % len(HARDER)]
        ship, hertz = str(generator.choice(list(HULLS))), int(generator.choice(HERTZ))
        possible = ("wind", "current") if group == "by trial" else OF_THE_SHIP
        effects = generator.choice(possible, 3 if group == "triple" else 1, replace=False)
        setting = Setting(
            tuple(map(str, effects)), seed=int(generator.integers(2**31)), ship=ship, by_trial=group == "by trial"
        )
        cases.append(Case(f"case_{number:04d}", group, hertz, setting))
    return cases


def write_case(case: Case, folder: Path) -> dict[str, str]:
    """Write one case into `folder`, and return its row of the truth."""
    (made,) = make([case.setting])
    made = sampled(made, case.hertz)
    place = folder / case.name
    shutil.rmtree(place, ignore_errors=True)
    write(made, place)
    (place / "truth.json").unlink()
    if case.group == "wrong card":
        (place / "ship.toml").write_text(wrong_card(made, CARD_ERROR), encoding="utf-8")
    for file in sorted(place.glob("*.csv")):
        part = place / ("fit" if file.stem in FIT else "holdout")
        part.mkdir(exist_ok=True)
        if case.group == "positions":
            table = pd.read_csv(file, dtype=str)
            table.drop(columns=list(VELOCITIES)).to_csv(file, index=False)
        file.rename(part / file.name)
    return {
        "case": case.name,
        "group": case.group,
        "ship": case.setting.ship,
        "hertz": str(case.hertz),
        "verdict": VERDICTS[made.verdict],
        "effects": "+".join(name for name in case.setting.effects if name not in OUTSIDERS),
        "parameters": json.dumps(made.parameters),
    }


def write_rows(path: Path, columns: tuple[str, ...], rows: list[dict[str, str]]) -> None:
    """A CSV file of rows."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=int, default=120, metavar="N", help="number of cases (120)")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of the draw (1: the published set)")
    parser.add_argument("--harder", action="store_true", help="three effects, wrong cards, positions alone, by trial")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    draw = draw_harder_cases if args.harder else draw_cases
    rows = [write_case(case, args.folder) for case in draw(args.cases, args.seed)]
    write_rows(args.folder / "truth.csv", TRUTH_COLUMNS, rows)
    write_rows(args.folder / "catalogue.csv", ("effect",), [{"effect": name} for name in EFFECTS])
    print(f"{len(rows)} cases in {args.folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
