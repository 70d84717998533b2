"""A lane: one trial of one set, and what is true in it."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field

import numpy as np

from gap_truth.changed import CHANGES
from gap_truth.draws import DRAWS, OUTSIDERS, TRIALS_STRUCK
from gap_truth.manoeuvres import FIT, MANOEUVRES, Manoeuvre, at_size_of
from gap_truth.ship import HULLS, Hull, perturbed

SURROUNDINGS = ("wind", "current")
PROCESSES = ("none", "gusts", "waves")


@dataclass(frozen=True)
class Setting:
    """One set to make: hidden effects by name (none, one, two, or an outsider), and everything that disturbs."""

    effects: tuple[str, ...]
    seed: int
    strength: float = 1.0
    noise: float = 1.0  # factor on the sensors' noise
    process: str = "none"  # none | gusts | waves
    coefficients: str = "exact"  # exact | independent | correlated
    manoeuvres: tuple[str, ...] | None = None  # None: all
    by_trial: bool = False  # wind and current are drawn for each trial
    ship: str = "mariner"

    def __post_init__(self) -> None:
        unknown = [name for name in self.effects if name not in DRAWS]
        unknown += [name for name in self.manoeuvres or () if name not in MANOEUVRES]
        if unknown or self.process not in PROCESSES or self.ship not in HULLS:
            raise ValueError(f"unknown in this setting: {unknown or self.process}")

    @property
    def hull(self) -> Hull:
        """The ship."""
        return HULLS[self.ship]

    @property
    def trials(self) -> tuple[str, ...]:
        """The manoeuvres made."""
        return self.manoeuvres or tuple(MANOEUVRES)

    def generator(self, purpose: str) -> np.random.Generator:
        """Random numbers of one purpose in this set, the same in whatever batch, at whatever strength and noise."""
        words = ("+".join(self.effects) or "none", purpose, *([] if self.ship == "mariner" else [self.ship]))
        return np.random.default_rng(np.random.SeedSequence([self.seed, *(zlib.crc32(w.encode()) for w in words)]))


@dataclass(frozen=True)
class Lane:
    """One trial of a set: its manoeuvre, true coefficients, and parameters of the effects at work in it."""

    setting: Setting
    trial: str
    manoeuvre: Manoeuvre
    coefficients: dict[str, float]
    effects: dict[str, dict[str, float]] = field(default_factory=dict)

    def value(self, effect: str, parameter: str, otherwise: float) -> float:
        """A parameter of an effect in file units, or the healthy value."""
        return self.effects.get(effect, {}).get(parameter, otherwise)


def parameters_of(setting: Setting) -> dict[str, dict[str, float]]:
    """The truth of a set in file units; for an outsider that strikes some trials only, 1 at `in_<trial>`."""
    truth: dict[str, dict[str, float]] = {}
    for name in setting.effects:
        if setting.by_trial and name in SURROUNDINGS:
            each = {trial: _drawn(setting, name, f" in {trial}") for trial in setting.trials}
            truth[name] = {f"{key} in {trial}": value for trial, found in each.items() for key, value in found.items()}
            continue
        generator = setting.generator(f"parameters of {name}")
        truth[name] = _at_size(setting, DRAWS[name](generator, setting.strength))
        if name in TRIALS_STRUCK:
            possible = [trial for trial in setting.trials if trial in FIT] or list(setting.trials)
            if name in ("out_rudder_stuck", "out_clock_freeze"):  # shows only where the rudder moves
                possible = [trial for trial in possible if not MANOEUVRES[trial].keeps_course] or possible
            count = min(TRIALS_STRUCK[name], len(possible))
            truth[name] |= {f"in_{trial}": 1.0 for trial in sorted(generator.choice(possible, count, replace=False))}
    return truth


def _drawn(setting: Setting, name: str, where: str) -> dict[str, float]:
    generator = setting.generator(f"parameters of {name}{where}")
    return _at_size(setting, DRAWS[name](generator, setting.strength))


def _at_size(setting: Setting, drawn: dict[str, float]) -> dict[str, float]:
    return {key: float(setting.hull.scaled(key, value)) for key, value in drawn.items()}


def lanes_of(setting: Setting) -> list[Lane]:
    """All trials of a set."""
    truth = parameters_of(setting)
    coefficients = perturbed(setting.hull, setting.coefficients, setting.generator("coefficients"))
    for name in setting.effects:
        if name in CHANGES:
            coefficients = CHANGES[name](setting.hull, coefficients, truth[name])
    lanes = []
    for trial in setting.trials:
        here = {
            name: _drawn(setting, name, f" in {trial}") if setting.by_trial and name in SURROUNDINGS else values
            for name, values in truth.items()
            if name not in OUTSIDERS or name not in TRIALS_STRUCK or f"in_{trial}" in values
        }
        lanes.append(Lane(setting, trial, at_size_of(setting.hull, MANOEUVRES[trial]), coefficients, here))
    return lanes
