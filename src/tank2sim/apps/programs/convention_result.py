"""Result of ``convention``: readings of a table of derivatives with unstated conventions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from tank2sim.answer.parts import Cell, KeyFigure, Section, table
from tank2sim.answer.result import Result
from tank2sim.cards import Card
from tank2sim.notices import Notice

SURE_READING = 0.9
"""Probability from which the first reading is taken without a mark. Project choice; ``benchmarks/convention.py`` prints
how often a first reading with it is the true one."""

_SHOWN, _LEAST_SHOWN, _MOST_SHOWN = 1e-3, 4, 8

_ALIKE = 0.05
"""Relative difference of figures up to which two readings are one ship in practice (project choice)."""

_WORDS = {
    "rudder_sign": {"starboard": "rudder positive to starboard", "port": "rudder positive to port"},
    "scaling": {"prime": "prime system", "prime_ii": "prime system with L d", "bis": "bis system", "dimensional": "SI"},
    "yaw_rate_terms": {"hydrodynamic": "yaw-rate terms without inertia", "total": "yaw-rate terms with inertia"},
    "origin": {"midships": "origin midships", "centre_of_gravity": "origin in the centre of gravity"},
}


@dataclass(frozen=True, kw_only=True)
class ReadingFound:
    """A reading of a table."""

    # `rudder_sign`, `scaling`, `yaw_rate_terms`, `origin`: Conventions, as a card states them
    rudder_sign: str
    scaling: str
    yaw_rate_terms: str
    origin: str
    probability: float  # Among all readings
    C_prime: float  # C' of straight-line stability, positive if stable
    turning_index: float | None  # Norrbin's P: heading by rudder after one ship's length; None without rudder forces
    # `advance_lengths`, `tactical_diameter_lengths`: Turn with 35 deg (or the gear's largest rudder), over L; None
    # where it was not simulated or not reached
    advance_lengths: float | None
    tactical_diameter_lengths: float | None
    overshoot_1_deg: float | None  # First overshoot of the 10/10 zigzag
    vanished: tuple[str, ...]  # Terms that vanish to the printed digits
    against: tuple[str, ...]  # What speaks against the reading, the strongest first


@dataclass(frozen=True, kw_only=True)
class ConventionStudy:
    """Readings of a table."""

    source: str  # The table
    stated: dict[str, str]  # Conventions that the table states
    readings: tuple[ReadingFound, ...]  # The most probable first
    assumed: dict[str, float]  # Sizes that the table lacks, by key, and the values taken
    left_out: tuple[str, ...]  # Numbers that were not read
    scaled_with_nominal_speed: bool | None  # Whether terms by the speed count it once; None if the table lacks them
    speed_scale: str | None  # As the table states it
    notices: tuple[Notice, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class ConventionResult(Result[ConventionStudy]):
    """Readings of a table, the most probable first.

    Parameters
    ----------
    study : ConventionStudy
    card : Card, optional
        The card of the first reading, with estimates of the accelerations that the table lacks; None if the result was
        read from its JSON.
    """

    study: ConventionStudy
    card: Card | None = None
    command: ClassVar[str] = "convention"

    @property
    def readings(self) -> tuple[ReadingFound, ...]:
        """Readings of the table, the most probable first."""
        return self.study.readings

    @property
    def title(self) -> str:
        """The file."""
        return f"{Path(self.study.source).name}: conventions"

    @property
    def headline(self) -> tuple[str, ...]:
        """The first reading with its probability, and the conventions that the numbers do not settle."""
        first, name = self.readings[0], Path(self.study.source).name
        if len(self.readings) == 1:
            return (f"{name}: every convention is stated",)
        read = ", ".join(_WORDS[key][getattr(first, key)] for key in _WORDS)
        mark = "" if first.probability >= SURE_READING else "UNCERTAIN: "
        lines = [f"{mark}{name}: {read}: probability {first.probability:.2g}"]
        if doubtful := [key for key in _WORDS if self._share(key) < SURE_READING]:
            shares = [f"{_WORDS[key][getattr(first, key)]} by {100 * self._share(key):.0f} %" for key in doubtful]
            lines.append(f"Not settled by the numbers: {', '.join(shares)}")
        return tuple(lines)

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Assumed sizes, doubts about the first reading, and what was not read."""
        study, first = self.study, self.readings[0]
        sizes = ", ".join(f"{key} = {value:.4g}" for key, value in study.assumed.items())
        nominal = study.scaled_with_nominal_speed
        unsure = len(self.readings) > 1 and first.probability < SURE_READING
        said = {
            f"ASSUMED, because the table lacks them: {sizes}": study.assumed,
            f"even the first reading is unlike a ship of these dimensions: {'; '.join(first.against)}": first.against,
            f"not read, and not on the card of a reading: {', '.join(study.left_out)}": study.left_out,
            "terms by Du' are forces by u v, u r and u^2 delta scaled with u0 (Yvu = Yv, Ydu = 2 Yd): "
            'speed_scale = "nominal", by which speed counts once': nominal,
            'the file states speed_scale = "instantaneous", by which speed counts twice': nominal
            and study.speed_scale == "instantaneous",
            "the first two readings are one ship in practice: their figures differ by less than 5 %": unsure
            and same_in_practice(first, self.readings[1]),
            f"by the first reading {', '.join(first.vanished)} vanish to the printed digits": first.vanished,
        }
        return tuple(Notice(words) for words, holds in said.items() if holds)

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """Probability of the first reading."""
        return [KeyFigure("First reading", 100 * self.readings[0].probability, "%")]

    @property
    def sections(self) -> Sequence[Section]:
        """Readings with probability and figures, and what speaks against each."""
        shown = [
            (number, entry)
            for number, entry in enumerate(self.readings[:_MOST_SHOWN], start=1)
            if entry.probability >= _SHOWN or number <= _LEAST_SHOWN
        ]
        rows: list[list[Cell]] = [
            [
                number,
                100 * entry.probability,
                ", ".join(getattr(entry, key).replace("_", " ") for key in _WORDS),
                entry.C_prime > 0,
                entry.turning_index,
                entry.tactical_diameter_lengths,
                entry.overshoot_1_deg,
            ]
            for number, entry in shown
        ]
        heads = ("no.", "probability (%)", "rudder, scaling, yaw-rate terms, origin", "stable", "P", "DT/L")
        note = (
            "P: heading by rudder after one length (Norrbin); DT: tactical diameter at 35 deg; 10/10: first overshoot"
        )
        tables = [table("Readings", (*heads, "10/10 (deg)"), rows, note, digits=3)]
        against: list[list[Cell]] = [[number, "; ".join(entry.against)] for number, entry in shown if entry.against]
        if against:
            tables.append(table("Evidence against them", ("no.", "unlike a ship of these dimensions"), against))
        return [Section("Readings", tables=tables)]

    def files(self, path: str | Path) -> dict[Path, str | bytes]:
        """The card of the first reading, at `path`."""
        assert self.card is not None, "a result that was read from its JSON has no card"
        return {Path(path): self.card.text}

    def _share(self, key: str) -> float:
        first = getattr(self.readings[0], key)
        return math.fsum(entry.probability for entry in self.readings if getattr(entry, key) == first)


def same_in_practice(first: ReadingFound, second: ReadingFound) -> bool:
    """Whether two readings are one ship in practice: both stable or neither, and every simulated figure within 5 %."""
    if (first.C_prime > 0) != (second.C_prime > 0):
        return False
    names = ("advance_lengths", "tactical_diameter_lengths", "overshoot_1_deg")
    pairs = [(getattr(first, name), getattr(second, name)) for name in names]
    known = [(a, b) for a, b in pairs if a is not None and b is not None]
    return bool(known) and all(abs(a - b) <= _ALIKE * max(abs(a), abs(b)) for a, b in known)
