"""Results of a fleet, ship by ship, read from the results of each ship, of whatever run."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tank2sim.errors import InputError
from tank2sim.gap.fleet.ships import GAP, IMPROVED

REPORT_FILE = "report.html"
"""Page of a ship, next to it ``gap.json``."""


@dataclass(frozen=True)
class ShipSummary:
    """One ship of a fleet.

    Parameters
    ----------
    folder : str
        Name of its folder, and of that of its results.
    name : str
        Name of the ship, as its card has it.
    verdict : str
        One of :data:`.result.GAP_VERDICTS`.
    effects : tuple of mappings
        As in ``gap.json``: ``name``, ``parameters``, ``standard_errors``, ``confidence``; in the units of their names.
    alternatives : tuple of str
        Explanations that its trials cannot distinguish from them.
    misfit : mapping
        ``before`` and ``after`` to {``fit``, ``holdout``}: units of the noise, None without such trials or where a
        simulation exceeded all bounds.
    trials : mapping
        Numbers of trials, by ``fit`` and ``holdout``.
    fault : str
        Reason why it has no result, in one line; all fields except `folder` are then empty.
    """

    folder: str
    name: str = ""
    verdict: str = ""
    effects: tuple[Mapping[str, Any], ...] = ()
    alternatives: tuple[str, ...] = ()
    misfit: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    trials: Mapping[str, int] = field(default_factory=dict)
    fault: str = ""

    @property
    def judged_by(self) -> str:
        """``holdout``, or ``fit`` where no trial was held out."""
        return "holdout" if self.trials.get("holdout") else "fit"

    def misfits(self) -> tuple[float | None, float | None]:
        """Misfit before and after of the trials by which it is judged."""
        before, after = (self.misfit.get(version, {}).get(self.judged_by) for version in ("before", "after"))
        return before, after

    def as_json(self) -> dict[str, object]:
        """In the form of ``fleet.json``."""
        if self.fault:
            return {"folder": self.folder, "fault": self.fault}
        return {
            "folder": self.folder,
            "name": self.name,
            "verdict": self.verdict,
            "effects": list(self.effects),
            "alternatives": list(self.alternatives),
            "misfit": self.misfit,
            "trials": self.trials,
            "report": f"{self.folder}/{REPORT_FILE}",
        }


@dataclass(frozen=True)
class FleetSummary:
    """All ships of a fleet.

    Parameters
    ----------
    name : str
        Name of the folder.
    ships : tuple of ShipSummary
        In the order of their folders' names, those with a fault among them.
    notices : tuple of str
    """

    name: str
    ships: tuple[ShipSummary, ...]
    notices: tuple[str, ...] = ()

    @property
    def verdicts(self) -> dict[str, int]:
        """Verdict to the number of ships that have it."""
        words = [ship.verdict for ship in self.ships if not ship.fault]
        return {word: words.count(word) for word in sorted(set(words))}

    @property
    def faults(self) -> tuple[ShipSummary, ...]:
        """The ships without a result."""
        return tuple(ship for ship in self.ships if ship.fault)

    def as_json(self) -> dict[str, object]:
        """In the form of ``fleet.json``."""
        return {
            "fleet": self.name,
            "verdicts": self.verdicts,
            "ships": [ship.as_json() for ship in self.ships],
            "notices": list(self.notices),
        }


def ship_summary(folder: Path) -> ShipSummary:
    """Summary of the ship whose results are in a folder.

    Raises
    ------
    InputError
        They were changed or taken away while this run went on.
    """
    try:
        results = json.loads((folder / GAP).read_text(encoding="utf-8"))
        card = tomllib.loads((folder / IMPROVED).read_text(encoding="utf-8-sig"))
        held = [bool(trial["held_out"]) for trial in results["trials"]]
        return ShipSummary(
            folder=folder.name,
            name=str(card["ship"]["name"]),
            verdict=results["verdict"],
            effects=tuple(results["effects"]),
            alternatives=tuple(results["alternatives"]),
            misfit={version: results["misfit"][version] for version in ("before", "after")},
            trials={"fit": held.count(False), "holdout": held.count(True)},
        )
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        remedy = "let one run at a time write there, and run it again"
        raise InputError(folder, "", "the results of this ship were changed by another program", remedy) from None
