"""The study of a fleet: the findings of all its ships, of whatever run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from tank2sim.gap.outcome.study import EffectFound, GapStudy, MisfitBySet
from tank2sim.notices import Notice

REPORT_FILE = "report.html"
"""Page of a ship, next to its ``gap.json``."""


@dataclass(frozen=True, kw_only=True)
class BeforeAfter:
    """Misfits by the card as given and by the card found."""

    before: MisfitBySet
    after: MisfitBySet


@dataclass(frozen=True, kw_only=True)
class TrialCounts:
    """Numbers of fitting and held-out trials."""

    fit: int
    holdout: int


@dataclass(frozen=True, kw_only=True)
class ShipSummary:
    """One ship of a fleet.

    Parameters
    ----------
    folder : str
        Name of its folder, and of the folder of its results.
    fault : str
        Reason why it has no result, in one line; other fields except `folder` are then empty.
    name : str
        Name of the ship on its card.
    verdict : str
        One of :data:`.result.GAP_VERDICTS`.
    effects : tuple of EffectFound
    alternatives : tuple of str
        Explanations that its trials cannot distinguish from them.
    misfit : BeforeAfter or None
    trials : TrialCounts or None
    report : str
        Path of its page from the folder of the fleet's results.
    """

    folder: str
    fault: str = ""
    name: str = ""
    verdict: str = ""
    effects: tuple[EffectFound, ...] = ()
    alternatives: tuple[str, ...] = ()
    misfit: BeforeAfter | None = None
    trials: TrialCounts | None = None
    report: str = ""

    @property
    def held_out(self) -> bool:
        """Whether held-out trials judge it; else the fitted ones do."""
        return self.trials is not None and self.trials.holdout > 0

    @property
    def misfits(self) -> tuple[float | None, float | None]:
        """Misfit before and after of the trials that judge it."""
        if self.misfit is None:
            return None, None
        before, after = self.misfit.before, self.misfit.after
        return (before.holdout, after.holdout) if self.held_out else (before.fit, after.fit)


@dataclass(frozen=True, kw_only=True)
class FleetStudy:
    """All ships of a fleet.

    Parameters
    ----------
    fleet : str
        Name of the folder.
    verdicts : dict
        Verdict to the number of ships that have it.
    ships : tuple of ShipSummary
        In the order of their folders' names, those with a fault among them.
    notices : tuple of Notice
    """

    fleet: str
    verdicts: dict[str, int]
    ships: tuple[ShipSummary, ...]
    notices: tuple[Notice, ...] = ()


def fleet_study(fleet: str, ships: Iterable[ShipSummary], notices: Iterable[Notice] = ()) -> FleetStudy:
    """Return the study of a fleet.

    Parameters
    ----------
    fleet : str
        Name of the folder.
    ships : iterable of ShipSummary
        In any order.
    notices : iterable of Notice
    """
    ordered = tuple(sorted(ships, key=lambda ship: ship.folder))
    words = [ship.verdict for ship in ordered if not ship.fault]
    verdicts = {word: words.count(word) for word in sorted(set(words))}
    return FleetStudy(fleet=fleet, verdicts=verdicts, ships=ordered, notices=tuple(notices))


def ship_summary(folder: str, study: GapStudy) -> ShipSummary:
    """Return the summary of a ship.

    Parameters
    ----------
    folder : str
        Name of the folder of its results.
    study : GapStudy
    """
    held = [trial.held_out for trial in study.trials]
    return ShipSummary(
        folder=folder,
        name=study.ship,
        verdict=study.verdict,
        effects=study.effects,
        alternatives=study.alternatives,
        misfit=BeforeAfter(before=study.misfit.before, after=study.misfit.after),
        trials=TrialCounts(fit=held.count(False), holdout=held.count(True)),
        report=f"{folder}/{REPORT_FILE}",
    )
