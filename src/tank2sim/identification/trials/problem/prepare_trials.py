"""Preparation of trials: audit, repair, scaling to the card's ship, and the card's list of fitted trials."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.cards.card import ManoeuvringCard
from tank2sim.cards.form import FittedTrial
from tank2sim.cards.reading import changed_text, parse_card
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError
from tank2sim.notices import Level, Notice, caution
from tank2sim.records.audit import Finding, audit_and_repair
from tank2sim.records.reading import read_trial_file
from tank2sim.records.same_record import refuse_copies, same_record, signature
from tank2sim.records.trials import RUDDERS, Trial, froude_scaled, sampling_step

if TYPE_CHECKING:
    from tank2sim.identification.trials.problem.captive_tests import CaptiveRuns

TYPICAL_SPEED = 95
"""Percentile of the speed that is taken as a trial's approach speed: some begin at rest, and all are slower later."""

SAME_LENGTH = 0.03
"""Lengths that differ by less than this share are of the same ship: definitions of length differ."""

COARSE_ROWS, FINE_ROWS = 0.08, 0.03
"""Steps of the rows over L/u0: above the first estimates are off, below the second they are not, and between them where
the rudder moves within a step. Two zigzags and a turn of the Mariner and KVLCC2, identified from a part of their rows,
with gears of 2 to 40 deg/s: linear derivatives are off by 0.3 to 1 % at 0.05 (3 % where the rudder moves within a
step), by 0.7 to 4 % at 0.1, and by 3 to 18 % at 0.25."""

MOVEMENT_RAD = math.radians(20.0)
"""Movement of the rudder that rows should show, rad: the first of a 20/20 zigzag."""

FARTHEST_FROUDE = 2.5
"""A trial whose approach speed differs from the card's speed by more than this factor is at another scale."""

FARTHEST_REVOLUTIONS = 10.0
"""A trial whose largest revolutions differ from the card's nominal ones by more than this factor, although the ship is
near the card's speed, has them in another unit (project choice; of revolutions a second and a minute it is 60)."""


@dataclass(frozen=True)
class RecordDoubt:
    """A finding of the audit that was left as it is: the trial, the column, and what it likely holds instead."""

    trial: str
    column: str
    likely_truth: str


@dataclass(frozen=True, eq=False)
class Measured:
    """Trials at the size of the ship, and captive tests of a model of it where there are any."""

    trials: tuple[Trial, ...]
    driven_by: str  # ``angle`` if the rudder's angle was measured in all of them, ``order`` if only its order is known
    notices: tuple[Notice, ...]  # Repairs and scalings
    captive: CaptiveRuns | None = None  # Captive tests, at the size of their model
    doubts: tuple[RecordDoubt, ...] = ()


def measured(given: Iterable[Path | Trial], card: ManoeuvringCard, *, report_unused: bool = True) -> Measured:
    """Read trials, make the audit's safe repairs, and scale them to the card's ship.

    `given`: Files, or trials as they were read. `card`: Card of the ship. `report_unused`: Whether a notice says that a
    wind or depth was measured which no effect of the card uses. Raises InputError: A file has an error, the audit finds
    a fault that it cannot repair, two trials share a name or a record, a trial is of another size without stating its
    scale, its revolutions and the card's are of different units, or the rudder's angle is known in some trials and only
    its order in others.
    """
    trials: list[Trial] = []
    notices: list[Notice] = []
    audited: dict[str, list[Finding]] = {}
    remarks: dict[str, list[Notice]] = {}
    for item in given:
        read = item if isinstance(item, Trial) else read_trial_file(item)
        trial, findings = audit_and_repair(read)
        _refuse_faults(trial, findings)
        name = trial.path.name
        remarks[name], audited[name] = list(read.notices), list(findings)
        notices += _unused(trial, card) if report_unused else []
        if empty := int(np.isnan(trial.signals["delta_rad" if "delta_rad" in trial.signals else RUDDERS[1]]).sum()):
            words = "taken as straight between its readings"
            notices.append(Notice(f"{name}: the rudder is empty in {empty} rows: {words}"))
        scaled, factor = at_size_of(trial, card)
        _refuse_other_revolutions(scaled, card)
        if factor != 1:
            notices.append(Notice(f"{name}: scaled by Froude's law to a ship {factor:.4g} times as long"))
        trials.append(scaled)
    _refuse_shared_names(trials)
    alike = refuse_copies(trials)
    driven_by = _driven_by(trials)
    notices = [*alike, *_of_audit(audited), *_of_reading(remarks), *dict.fromkeys(notices)]
    doubts = tuple(
        RecordDoubt(Path(name).stem, finding.column, finding.likely_truth)
        for name, findings in audited.items()
        for finding in findings
        if not finding.repaired
    )
    return Measured(tuple(trials), driven_by, tuple(notices), doubts=doubts)


def _movement_s(card: ManoeuvringCard) -> float:
    """Time in which the gear of a card moves its rudder by :data:`MOVEMENT_RAD`, s."""
    gear = card.steering_gear
    if gear is None:
        return 0.0
    moving = MOVEMENT_RAD / gear.max_rate_radps if gear.max_rate_radps else 0.0
    return moving + (gear.time_constant_s or 0.0)


def coarse_rows(trials: Sequence[Trial], card: ManoeuvringCard) -> Iterator[Notice]:
    """Cautions on trials whose rows are too far apart for the motion of the ship; one for each step."""
    ship_time = card.ship.length_m / card.model.speed_mps
    finest = min(COARSE_ROWS * ship_time, max(FINE_ROWS * ship_time, _movement_s(card)))
    names: dict[float, list[str]] = {}
    for trial in trials:
        step = float(f"{sampling_step(trial):.3g}")
        if step > finest:
            names.setdefault(step, []).append(trial.path.name)
    for step, files in names.items():
        text = (
            f"rows are {step:g} s apart, {step / ship_time:.2g} of L/u0 ({ship_time:.3g} s): rudder and motion between "
            "them are taken as straight, and estimates may be off by far more than their standard errors; give rows at "
            f"most {finest:.2g} s apart, of the rudder at least (empty cells where the motion was not measured)"
        )
        yield caution(text).of(", ".join(files))


def _refuse_shared_names(trials: Sequence[Trial]) -> None:
    names = [trial.name for trial in trials]
    for trial in trials:
        if names.count(trial.name) > 1:
            raise trial.fault("", "has the name of another trial", "give each file once, under its own name")


def _driven_by(trials: Sequence[Trial]) -> str:
    """``angle`` or ``order``; trials that do not have the same are refused."""
    by_order = [trial for trial in trials if "delta_rad" not in trial.signals]
    if 0 < len(by_order) < len(trials):
        remedy = "give trials that all have delta_deg, or all only delta_order_deg"
        raise by_order[0].fault("header", "has no delta_deg, but other trials have", remedy)
    return "order" if by_order else "angle"


def _refuse_faults(trial: Trial, findings: Iterable[Finding]) -> None:
    """Refuse a trial with a column that is not the quantity of its name, or without a rudder."""
    wrong = next((finding for finding in findings if finding.open), None)
    if wrong is not None:
        place = f"column{'s' * (len(wrong.columns) > 1)} {wrong.column}"
        remedy = f"probably {wrong.likely_truth}: correct the file, or leave the column out"
        raise InputError(wrong.source, place, wrong.what, remedy)
    if not set(RUDDERS) & set(trial.signals):
        raise trial.fault("column of the rudder", "has no usable reading", "give the rudder in more rows")


def _of_reading(remarks: Mapping[str, Sequence[Notice]]) -> list[Notice]:
    """Notices of the readers by file names, each once with all its files."""
    files: dict[Notice, list[str]] = {}
    for name, notices in remarks.items():
        for notice in notices:
            files.setdefault(notice, []).append(name)
    return [notice.of(", ".join(names)) for notice, names in files.items()]


def _of_audit(audited: Mapping[str, Sequence[Finding]]) -> list[Notice]:
    """Notices of an audit's findings by file names; faults of one column that were repaired alike are one."""
    groups: dict[tuple[Level, str, str, str], list[tuple[str, str]]] = {}
    for name, findings in audited.items():
        for finding in findings:
            done = "taken so" if finding.repaired else "left as it is"
            level = Level.CAUTION if finding.kind == "fault" else Level.INFO
            key = level, finding.column, finding.what, done
            groups.setdefault(key, []).append((name, finding.likely_truth))
    notices = []
    for (level, column, what, done), places in groups.items():
        (name, truth), others = places[0], [other for other, _ in places[1:]]
        again = f"; the same in {', '.join(others)}, each with its own values" if others else ""
        notices.append(Notice(f"{name}: {column}: {what}; {done}: {truth}{again}", level))
    return notices


def _unused(trial: Trial, card: ManoeuvringCard) -> Iterator[Notice]:
    """Notices of the signals of a trial that are not used."""
    for name, effect in EFFECTS.items():
        signals = set(effect.measured_as.values())
        if signals and signals <= set(trial.signals) and all(entry.name != name for entry in card.effects):
            text = f"{trial.path.name}: {name} was measured, and the card has no effect {name!r} that would use it"
            yield Notice(text)


def _refuse_other_revolutions(trial: Trial, card: ManoeuvringCard) -> None:
    """Refuse a trial whose revolutions are of another unit than the card's, at a speed near the card's."""
    nominal = card.propulsion.nominal_radps if card.propulsion else None
    revolutions, speed = trial.signals.get("n_radps"), approach_speed(trial)
    if not nominal or revolutions is None or speed is None or np.isnan(revolutions).all():
        return
    largest = float(np.nanmax(np.abs(revolutions)))
    near = 0.5 < speed / card.model.speed_mps < 2.0
    if near and largest > 0 and abs(math.log(largest / nominal)) > math.log(FARTHEST_REVOLUTIONS):
        rpm = 30 / math.pi
        problem = (
            f"reaches {largest * rpm:.3g} rpm at {speed:.3g} m/s, and the card's nominal_rpm is {nominal * rpm:.3g}"
        )
        raise trial.fault("column of the revolutions", problem, "give both in revolutions a minute")


def at_size_of(trial: Trial, card: ManoeuvringCard) -> tuple[Trial, float]:
    """The trial at the size of the card's ship, and the factor on its lengths.

    A trial that states its scale may hold numbers of the model or of the ship, and the card may be of either: the
    factor is the scale, one over it, or 1, whichever brings its stated length, else the approach speed, nearest to the
    card's. Raises InputError: No factor brings it near.
    """
    speed, scale = approach_speed(trial), trial.scale or 1.0
    if trial.length_m is not None:
        factor, off = _nearest_scale(card.ship.length_m / trial.length_m, scale)
        if off > SAME_LENGTH:
            problem = f"is of a ship or model of {trial.length_m:g} m, and the card of one of {card.ship.length_m:g} m"
            raise trial.fault("", problem, f"neither is the other at 1:{scale:g}; give the card of that ship")
        return (trial if factor == 1 else froude_scaled(trial, factor)), factor
    if speed is None:
        return trial, 1.0
    if speed == 0:
        raise trial.fault("", "the ship does not move in it", "leave it out: it holds no motion")
    factor, off = _nearest_scale((card.model.speed_mps / speed) ** 2, scale)
    if trial.scale is None and off > 2 * math.log(FARTHEST_FROUDE):
        problem = f"reaches {speed:.3g} m/s, and the card is of {card.model.speed_mps:.3g} m/s"
        remedy = "if one of the two is a model, add the comment '# scale: LAMBDA' (ship length over model length)"
        raise trial.fault("", problem, remedy)
    return (trial if factor == 1 else froude_scaled(trial, factor)), factor


def _nearest_scale(ratio: float, scale: float) -> tuple[float, float]:
    """The factor that brings a ratio of lengths nearest to 1, and the logarithm of what remains."""
    factor = min((1.0, scale, 1 / scale), key=lambda candidate: abs(math.log(ratio / candidate)))
    return factor, abs(math.log(ratio / factor))


def approach_speed(trial: Trial) -> float | None:
    """Speed at which a trial was approached, m/s; None if neither speed nor position was measured."""
    signals = trial.signals
    for name in ("u_mps", "u_ground_mps", "sog_mps"):
        if name in signals and not np.isnan(signals[name]).all():
            return float(np.nanpercentile(np.abs(signals[name]), TYPICAL_SPEED))
    if "x_m" in signals and "y_m" in signals:
        known = ~np.isnan(signals["x_m"] + signals["y_m"])
        t, x, y = (values[known] for values in (trial.time_s, signals["x_m"], signals["y_m"]))
        if len(t) > 1:
            stride = max(1, len(t) // 100)  # over a hundredth of the trial, so that noise of positions is negligible
            way = np.hypot(np.diff(x[::stride]), np.diff(y[::stride])) / np.diff(t[::stride])
            return float(np.percentile(way, TYPICAL_SPEED))
    return None


def with_fitted_trials(text: str, source: str, trials: Sequence[Trial]) -> str:
    """A card's text with trials, at the size of its ship, added to its ``[[fitted_trials]]``; each once."""
    card = parse_card(text, source)
    assert isinstance(card, ManoeuvringCard)
    new = []
    for trial in trials:
        if fitted_as(card, trial) is None:
            time, signals = signature(trial)
            new.append(FittedTrial(name=trial.name, t_s=time, signals=signals))
    if not new:
        return text
    return changed_text(text, source, {"fitted_trials": [trial.model_dump() for trial in (*card.fitted_trials, *new)]})


def fitted_as(card: ManoeuvringCard, trial: Trial) -> str | None:
    """Name on the card of the fitted trial with the same record, whatever the name of its file; None if there is none.

    `trial` is at the size of the card's ship. :func:`tank2sim.records.same_record.same_record` states the tolerance.
    """
    return next(
        (fitted.name for fitted in card.fitted_trials if fitted.t_s and same_record(_record(fitted), trial)), None
    )


def _record(fitted: FittedTrial) -> Trial:
    signals = {name: np.array(values) for name, values in fitted.signals.items()}
    return Trial(Path(fitted.name), np.array(fitted.t_s), signals)
