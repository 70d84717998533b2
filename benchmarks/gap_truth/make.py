"""Sets of trials with a known hidden effect, made and written."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gap_truth.draws import OUTSIDERS
from gap_truth.integrate import integrate
from gap_truth.lane import Lane, Setting, lanes_of, parameters_of
from gap_truth.manoeuvres import FIT, HOLDOUT
from gap_truth.record import COLUMNS, recorded
from gap_truth.ship import MARINER, Array, ship_toml

SHIP_TOML = ship_toml(MARINER)
SETS_AT_ONCE = 64
"""Histories of so many sets of thirteen trials take 300 MB; the result does not depend on it."""

_DECIMALS = dict(zip(COLUMNS, (2, 3, 2, 5, 5, 5, 4, 3, 3), strict=True))


@dataclass(frozen=True)
class Made:
    """A set: its setting, the truth in file units, and trials by name, columns by name (10 Hz, not rounded)."""

    setting: Setting
    parameters: dict[str, dict[str, float]]
    trials: dict[str, dict[str, Array]]

    @property
    def verdict(self) -> str:
        """What an analyst should say."""
        if not self.setting.effects:
            return "no missing effect"
        outside = any(name in OUTSIDERS for name in self.setting.effects)
        return "outside the library" if outside else "missing effect"


def make(settings: Sequence[Setting]) -> list[Made]:
    """All sets, in batches of lanes; a set is the same to the bit whatever others are made beside it."""
    made: list[Made] = []
    for start in range(0, len(settings), SETS_AT_ONCE):
        chosen = settings[start : start + SETS_AT_ONCE]
        trials: dict[str, Iterator[dict[str, Array]]] = {}
        for ship in dict.fromkeys(setting.ship for setting in chosen):
            lanes: list[Lane] = [lane for setting in chosen if setting.ship == ship for lane in lanes_of(setting)]
            trials[ship] = _recorded(lanes)
        for setting in chosen:
            found = trials[setting.ship]
            made.append(Made(setting, parameters_of(setting), {name: next(found) for name in setting.trials}))
    return made


def _recorded(lanes: list[Lane]) -> Iterator[dict[str, Array]]:
    history = integrate(lanes)
    return (recorded(lane, history, column) for column, lane in enumerate(lanes))


def sampled(made: Made, hertz: int) -> Made:
    """The same set as recorded at 1, 2, 5 or 10 Hz: every n-th row, from a random one of the first n."""
    every = round(10 / hertz)
    generator = made.setting.generator(f"sampling at {hertz} Hz")
    trials = {}
    for name, trial in made.trials.items():
        first = int(generator.integers(every))
        trials[name] = {column: values[first::every] for column, values in trial.items()}
    return replace(made, trials=trials)


def wrong_card(made: Made, share: float) -> str:
    """The card with each hydrodynamic derivative off by a normal error of `share` of its value, and stating so."""
    generator = made.setting.generator(f"card wrong by {share}")
    lines, errors, inside = [], [], False
    for line in ship_toml(made.setting.hull).splitlines():
        inside = line == "[derivatives]" if line.startswith("[") else inside
        name, equals, value = line.partition(" = ")
        if inside and equals and not name.endswith("dot") and float(value.split("#")[0]):
            stated = float(value.split("#")[0])
            errors.append(f"{name} = {share * abs(stated):.6g}")
            lines.append(f"{name} = {stated * (1 + share * generator.standard_normal()):.8g}")
        else:
            lines.append(line)
    return "\n".join([*lines, "", "[uncertainty]", *errors, ""])


def truth(made: Made) -> dict[str, object]:
    """What `truth.json` says."""
    inside = [name for name in made.setting.effects if name not in OUTSIDERS]
    return {
        "verdict": made.verdict,
        "effects": inside,
        "parameters": made.parameters,
        "fit": [name for name in FIT if name in made.trials],
        "holdout": [name for name in HOLDOUT if name in made.trials],
        "setting": {
            "ship": made.setting.ship,
            "seed": made.setting.seed,
            "strength": made.setting.strength,
            "noise": made.setting.noise,
            "process": made.setting.process,
            "coefficients": made.setting.coefficients,
        },
    }


def write(made: Made, folder: Path) -> None:
    """Trials as CSV rounded like the worked cases, `ship.toml` and `truth.json` into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "ship.toml").write_text(ship_toml(made.setting.hull), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(truth(made), indent=1) + "\n", encoding="utf-8")
    formats = [f"%.{_DECIMALS[name]}f" for name in COLUMNS]
    for name, trial in made.trials.items():
        table = np.column_stack([trial[column] for column in COLUMNS])
        np.savetxt(folder / f"{name}.csv", table, formats, delimiter=",", header=",".join(COLUMNS), comments="")
