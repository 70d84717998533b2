"""From records of a sea trial to corrected figures, the ship at full load, and a verdict with its probability."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from tank2sim.analysis.ensemble.results import DrawnShips, EnsembleRequest, named_bands
from tank2sim.analysis.stability.imo import SHORTEST_SHIP_M
from tank2sim.analysis.validation.standard_trials import SEED, drawn_ships
from tank2sim.apps.guess.study import OVERSHOOT_ERROR_DEG, TRIAL_ERROR
from tank2sim.apps.trial_office.conditions import Met, TrialCondition, TrialState, trial_conditions
from tank2sim.apps.trial_office.drift import LEAST_ARC, STEADY_FROM, CircleDrift, circle_drift
from tank2sim.apps.trial_office.full_load import (
    SMALLEST,
    Prediction,
    TriedShips,
    loading_validity,
    prediction,
    tried_ships,
)
from tank2sim.apps.trial_office.notes import REPORTED, FormWords, TrialNotes
from tank2sim.apps.trial_office.tried import Tried, current_removed, tried
from tank2sim.apps.trial_office.verdict import EXTRAPOLATED, LOADING_HOLDS, CriterionVerdict, judge_criteria
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.dynamics import build
from tank2sim.dynamics.effects.particulars import model_particular
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.identification.trials.assessment.model_selection import hard_rudder
from tank2sim.identification.trials.assessment.other_ship import evidence_of_other_ship
from tank2sim.identification.trials.problem.prepare_trials import Measured, measured
from tank2sim.notices import Notice, caution
from tank2sim.records.trials import Trial, mean_wind
from tank2sim.simulation.card_range import Numbers
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Stop, Turn, Zigzag, parse_manoeuvre
from tank2sim.simulation.recorded import repeat, steerable

WIND_SHOWS = 0.04
"""Half the difference of the drifts of both sides, m/s, from which a wind must have acted; 10 m/s of wind give 0.18 for
a Mariner. Project choice: above the error of the drift of two turns."""

CURRENT_CHANGES = 0.01
"""Spread of the pairs of a turn, m/s, from which the first lines say it. Project choice: noise gives 0.004."""

_TRACK_POINTS = 400
"""Points of a track in the JSON."""


@dataclass(frozen=True, kw_only=True)
class TurnDrift:
    """Drift of a turn over the ground, as measured and by the model in the measured wind alone; to north and east."""

    trial: str
    side: str
    measured: CircleDrift
    by_wind_north_mps: float | None
    by_wind_east_mps: float | None

    @property
    def by_wind(self) -> tuple[float, float]:
        """Drift by the model in the wind, north and east, m/s; 0 without a measured wind."""
        return self.by_wind_north_mps or 0.0, self.by_wind_east_mps or 0.0


@dataclass(frozen=True, kw_only=True)
class SiteCurrent:
    """The current of the site.

    `error_mps`: standard error of each component; `spread_mps`: largest root mean square of the pairs of a turn (a
    current that changes); `wind_share_mps`: half the measured difference of the two sides, by the wind, None with one
    side; `separated`: how the wind was separated (``by both sides and the model``, ``by both sides``, ``by the
    model``), empty where it was not.
    """

    speed_mps: float
    towards_deg: float
    error_mps: float
    spread_mps: float | None
    wind_share_mps: float | None
    separated: str

    @property
    def words(self) -> str:
        """Speed and direction."""
        return f"{self.speed_mps:.2f} m/s towards {self.towards_deg:.0f} deg"

    @property
    def vector(self) -> Array:
        """North and east (2,), m/s."""
        towards = math.radians(self.towards_deg)
        return self.speed_mps * np.array([math.cos(towards), math.sin(towards)])


@dataclass(frozen=True, kw_only=True)
class OfficeFigure:
    """A figure of a trial.

    `without_current`: T, as the track is in water that rests; `error`: standard error of the reading and of the
    current; `calm`: also without the wind, by the model (times its figure in calm water over its figure in the wind);
    `full_load`: R = T F/B, on even keel, in calm water; `low`, `high`: 95 % interval of R; `model_as_tried`,
    `model_full_load`: B and F; `model_agrees`: whether T is within the 95 % interval of B, None without members.
    """

    trial: str
    manoeuvre: str
    side: str
    name: str
    as_run: float
    without_current: float
    error: float
    calm: float | None = None
    full_load: float | None = None
    low: float | None = None
    high: float | None = None
    model_as_tried: float | None = None
    model_full_load: float | None = None
    model_agrees: bool | None = None


@dataclass(frozen=True, kw_only=True)
class FormParticulars:
    """Numbers of the form's first block, full load; None where the card does not state what they need."""

    length_over_speed_s: float
    length_over_beam: float | None
    beam_over_draught: float | None
    block_coefficient: float | None
    rudder_area_share: float | None


@dataclass(frozen=True, eq=False, kw_only=True)
class OfficeTrack:
    """Track of a turn from its execute, m: as run, and in water that rests."""

    trial: str
    x_m: Array
    y_m: Array
    x_without_current_m: Array
    y_without_current_m: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialOffice:
    """The report of a sea trial.

    `loading_validity`: 1 where the formulas that take the ship from the trial to full load hold, 0 where they do not;
    `stable_as_tried`, `stable_at_full_load`: probability that a straight course is stable, by the members, None without
    them; `drawn`: members with their figures as tried and at full load, not part of the JSON; `applies`: whether
    MSC.137(76) is for a ship of this length.
    """

    ship: str
    source: str
    conditions: tuple[TrialCondition, ...]
    state: TrialState
    drifts: tuple[TurnDrift, ...]
    current: SiteCurrent | None
    figures: tuple[OfficeFigure, ...]
    criteria: tuple[CriterionVerdict, ...]
    tested_at_full_load: bool
    loading_validity: float
    stable_as_tried: float | None
    stable_at_full_load: float | None
    particulars: FormParticulars
    form: FormWords
    tracks: tuple[OfficeTrack, ...]
    members: int
    place: str
    date: str
    depth_m: float | None
    sea_state: int | None
    applies: bool
    notices: tuple[Notice, ...]
    drawn: Annotated[Any, Field(exclude=True)] = None

    @property
    def tried(self) -> tuple[CriterionVerdict, ...]:
        """Criteria for which a trial was made."""
        return tuple(one for one in self.criteria if one.as_run is not None)

    @property
    def not_certified(self) -> tuple[CriterionVerdict, ...]:
        """Criteria that were tried in a loading condition from which full load is extrapolated."""
        return tuple(one for one in self.tried if one.verdict.endswith(EXTRAPOLATED))

    @property
    def conditions_not_met(self) -> str:
        """The conditions that were not met, with the values found."""
        broken = [one for one in self.conditions if one.met is Met.NOT_MET]
        return ", ".join(one.name if one.found == "no" else f"{one.name} ({one.found})" for one in broken)


def study_trials(
    card: ManoeuvringCard, trials: Sequence[Trial], notes: TrialNotes, count: int
) -> tuple[TrialOffice, ManoeuvringCard, ManoeuvringCard]:
    """The report of the records of a sea trial by `count` members, and the ship's cards as tried and at full load.

    Raises InputError: There is nothing to report, or the card lacks something that a loading condition needs.
    """
    plain = build(steerable(card))
    given, as_run, messages = _manoeuvres(card, trials, notes, plain)
    state = _state(card, given.trials, notes)
    ships, more = tried_ships(card, state, count)
    winds = [_wind(one, state, ships.tried) for one in as_run]
    drifts = tuple(filter(None, (_drift(*pair, ships.tried) for pair in zip(as_run, winds, strict=True))))
    current = site_current(drifts) if drifts else None
    still = [current_removed(one, current.vector, current.error_mps, plain) for one in as_run] if current else as_run
    predicted = [
        prediction(one, ships, wind, at_full_load=state.at_full_load) for one, wind in zip(still, winds, strict=True)
    ]
    conditions = trial_conditions(state, notes, still)
    validity = 1.0 if state.at_full_load else loading_validity(ships)
    stable = [stability_chance(one, count) for one in (ships.as_tried, ships.full_load)]
    unstable = _of_stability(*stable)
    if evidence := evidence_of_other_ship(ships.as_tried, given) if given.trials else ():
        messages.append(caution(f"these look like trials of another ship: {'; '.join(evidence)}"))
    doubts = [*_of_records(given), *messages, *more, *_cautions(state, current, as_run, validity, count), *unstable]
    study = TrialOffice(
        ship=card.ship.name,
        source=card.source,
        conditions=conditions,
        state=state,
        drifts=drifts,
        current=current,
        figures=tuple(figure for group in zip(as_run, still, predicted, strict=True) for figure in _figures(*group)),
        criteria=judge_criteria(card, as_run, still, predicted, validity, overshoots_hold=not unstable),
        tested_at_full_load=state.at_full_load,
        loading_validity=validity,
        stable_as_tried=stable[0],
        stable_at_full_load=stable[1],
        particulars=_particulars(card, state),
        form=notes.form,
        tracks=tuple(_track(*pair) for pair in zip(as_run, still, strict=True) if pair[0].drawn),
        members=count,
        place=notes.place,
        date=notes.date,
        depth_m=notes.depth_m,
        sea_state=notes.sea_state,
        applies=card.ship.length_m >= SHORTEST_SHIP_M,
        notices=tuple(dict.fromkeys(doubts)),
        drawn=_drawn(ships, still, predicted),
    )
    return study, ships.as_tried, ships.full_load


def _drawn(ships: TriedShips, still: Sequence[Tried], predicted: Sequence[Prediction]) -> DrawnShips | None:
    """The members with their figures as tried and at full load."""
    runs: dict[str, list[Numbers]] = {}
    for one, found in zip(still, predicted, strict=True):
        for place, condition in enumerate(("as tried", "at full load")):
            runs[f"{one.name}, {condition}"] = [run[place] for run in found.runs]
    return drawn_ships(ships.as_tried, runs)


def _manoeuvres(
    card: ManoeuvringCard, trials: Sequence[Trial], notes: TrialNotes, plain: Model
) -> tuple[Measured, list[Tried], list[Notice]]:
    """Audited records at the size of the ship, manoeuvres of these and of the notes, and notices on other records."""
    given = measured(trials, card, report_unused=False) if trials else Measured((), "angle", ())
    as_run, unknown = _recognised(given.trials, notes, plain)
    if not as_run:
        remedy = "give records of turns, zigzags or stops with heading and positions, or their figures in the notes"
        problem = ": ".join(["holds no manoeuvre of a sea trial", *list(unknown.values())[:1]])
        raise InputError(trials[0].path if trials else "trials", "", problem, remedy)
    messages = [caution(f"left out, for it holds no turn, zigzag or stop: {why}").of(n) for n, why in unknown.items()]
    return given, as_run, messages


def _recognised(trials: Sequence[Trial], notes: TrialNotes, model: Model) -> tuple[list[Tried], dict[str, str]]:
    """The manoeuvres of records and of notes, and by name why other records hold none."""
    recognised = {trial.name: tried(trial, model) for trial in trials}
    found = [one for one in recognised.values() if isinstance(one, Tried)]
    unknown = {name: reason for name, reason in recognised.items() if isinstance(reason, str)}
    speed = model.defaults["ship.speed"]
    for words, figures in notes.figures.items():
        manoeuvre = parse_manoeuvre(words)
        assert isinstance(manoeuvre, Turn | Zigzag | Stop)
        errors = {
            name: OVERSHOOT_ERROR_DEG if name.endswith("_deg") else TRIAL_ERROR * abs(value)
            for name, value in figures.items()
        }
        found.append(Tried(None, manoeuvre, None, 0.0, speed, dict(figures), errors))
    return found, unknown


def _state(card: ManoeuvringCard, trials: Sequence[Trial], notes: TrialNotes) -> TrialState:
    own = model_particular(card, "draught_m")
    fore, aft = notes.draught_fore_m, notes.draught_aft_m
    draughts = (own, own) if fore is None or aft is None else (fore, aft)
    direction = None if notes.wind_from_deg is None else math.radians(notes.wind_from_deg)
    speed, direction = mean_wind(trials) or (notes.wind_speed_mps, direction)
    return TrialState(
        draught_m=sum(draughts) / 2,
        trim_m=draughts[1] - draughts[0],
        full_load_draught_m=own if notes.full_load_draught_m is None else notes.full_load_draught_m,
        length_m=card.ship.length_m,
        largest_rudder_rad=hard_rudder(card),
        draughts_recorded=fore is not None and aft is not None,
        wind_speed_mps=speed,
        wind_from_rad=direction,
    )


def _wind(one: Tried, state: TrialState, integrator: Integrator) -> dict[str, float]:
    """Inputs of the wind in a trial, by its record or else the mean of all; empty without one."""
    if "wind.speed" not in integrator.model.input_names:
        return {}
    wind = (mean_wind([one.trial]) if one.trial is not None else None) or state.wind
    return {} if wind is None else dict(zip(("wind.speed", "wind.direction"), wind, strict=True))


def _drift(one: Tried, wind: Mapping[str, float], integrator: Integrator) -> TurnDrift | None:
    """The drift of a turn, and the drift of the model in the wind alone."""
    measured, record, by_wind = one.drift, one.record, None
    if measured is None or record is None:
        return None
    if wind:
        run = repeat(replace(record, figures={}, inputs={**record.inputs, **wind}), integrator).trajectory
        by_wind = circle_drift(run.t, run["motion.x"], run["motion.y"], run["motion.psi"])
    return TurnDrift(
        trial=one.name,
        side=one.side,
        measured=measured,
        by_wind_north_mps=by_wind.north_mps if by_wind else None,
        by_wind_east_mps=by_wind.east_mps if by_wind else None,
    )


_WAYS = {
    (True, True): "by both sides and the model",
    (True, False): "by both sides",
    (False, True): "by the model",
    (False, False): "",
}
"""Whether turns go to both sides, and whether the model's drift in the wind is known, to how the wind was separated."""


def site_current(drifts: Sequence[TurnDrift]) -> SiteCurrent:
    """The current from the drifts of turns: their mean over both sides, without the wind's part.

    A constant wind drifts the circles of the two sides apart, to opposite sides across itself: half their difference
    is its part. With a measured wind the model's drift is taken off first, which is small against the mean of both.
    """
    modelled = all(drift.by_wind_north_mps is not None for drift in drifts)
    measured = np.array([drift.measured.vector for drift in drifts])
    left = measured - modelled * np.array([drift.by_wind for drift in drifts])
    sides = np.array([drift.side for drift in drifts])
    # Means of each side, in the order of the drifts: as measured, and less the model's.
    means = [[part[sides == side].mean(axis=0) for part in (measured, left)] for side in dict.fromkeys(sides)]
    both = len(means) > 1
    found = np.mean([rest for _, rest in means], axis=0)
    spreads = [drift.measured.spread_mps for drift in drifts if drift.measured.spread_mps is not None]
    # What is left is not understood: the scatter of turns to one side, and the difference of the sides after the part
    # of the model. Without a model the two sides differ by the wind, which the mean does not hold.
    unexplained = 0.0
    if len(drifts) > 1 and (modelled or not both):
        unexplained = float(np.sqrt(np.mean((left - found) ** 2) / (len(drifts) - 1)))
    return SiteCurrent(
        speed_mps=float(np.hypot(*found)),
        towards_deg=math.degrees(math.atan2(found[1], found[0])) % 360.0,
        error_mps=math.hypot(max(spreads, default=0.0) / math.sqrt(2), unexplained),
        spread_mps=max(spreads, default=None),
        wind_share_mps=float(np.hypot(*(means[0][0] - means[-1][0])) / 2) if both else None,
        separated=_WAYS[both, modelled],
    )


def _figures(raw: Tried, still: Tried, found: Prediction) -> list[OfficeFigure]:
    rows = []
    for name in REPORTED:
        if name not in raw.figures or name not in still.figures:
            continue
        value = still.figures[name]
        shown: dict[str, float] = {}
        if found.is_full_load:
            shown["calm"] = value
        elif name in found.tried and name in found.calm and abs(found.tried[name]) > SMALLEST:
            shown["calm"] = value * found.calm[name] / found.tried[name]
        if (at_load := found.at_full_load(still, name)) is not None:
            centre, error = at_load
            low, high = (centre * math.exp(side * 1.96 * error) for side in (-1, 1))
            shown |= {"full_load": centre, "low": low, "high": high}
        rows.append(
            OfficeFigure(
                trial=raw.name,
                manoeuvre=_words(raw.manoeuvre),
                side=raw.side,
                name=name,
                as_run=raw.figures[name],
                without_current=value,
                error=still.errors.get(name, 0.0),
                model_as_tried=found.tried.get(name),
                model_full_load=found.full.get(name),
                model_agrees=found.model_agrees(still, name),
                **shown,
            )
        )
    return rows


def _words(manoeuvre: Turn | Zigzag | Stop) -> str:
    if isinstance(manoeuvre, Turn):
        return f"turn {abs(math.degrees(manoeuvre.rudder)):.3g} deg"
    if isinstance(manoeuvre, Zigzag):
        return f"zigzag {abs(math.degrees(manoeuvre.rudder)):.2g}/{math.degrees(manoeuvre.heading):.2g}"
    return "stop"


def stability_chance(card: ManoeuvringCard, count: int) -> float | None:
    """Probability that a straight course is stable (C' > 0), by `count` members drawn within the errors of a card.

    None without members, and for a ship that cannot be linearised.
    """
    if not count:
        return None
    try:
        found = named_bands(card, ["criterion_C"], EnsembleRequest(count, SEED)).drawn.figures["criterion_C"]
    except (InputError, KeyError):
        return None
    known = found[np.isfinite(found)]
    return float(np.mean(known > 0)) if len(known) else None


def _of_stability(as_tried: float | None, at_full_load: float | None) -> list[Notice]:
    """A caution where the ship is probably stable in one condition and unstable in the other."""
    if as_tried is None or at_full_load is None or (as_tried > 0.5) == (at_full_load > 0.5):
        return []
    words = [f"{'stable' if one > 0.5 else 'unstable'} (P stable = {one:.2f})" for one in (as_tried, at_full_load)]
    return [
        caution(
            f"EXTRAPOLATED to full load: a straight course is {words[0]} as tried and {words[1]} at full load, and "
            "overshoots of the trial certify nothing"
        )
    ]


def _particulars(card: ManoeuvringCard, state: TrialState) -> FormParticulars:
    ship, draught = card.ship, state.full_load_draught_m
    return FormParticulars(
        length_over_speed_s=ship.length_m / card.model.speed_mps,
        length_over_beam=ship.length_m / ship.beam_m if ship.beam_m else None,
        beam_over_draught=ship.beam_m / draught if ship.beam_m else None,
        block_coefficient=ship.block_coefficient,
        rudder_area_share=ship.rudder_area_m2 / (ship.length_m * draught) if ship.rudder_area_m2 else None,
    )


def _track(raw: Tried, still: Tried) -> OfficeTrack:
    parts = []
    for one in (raw, still):
        assert one.trial is not None
        rows = one.trial.time_s >= one.begin_s
        rows[np.flatnonzero(rows)[:: max(1, int(rows.sum()) // _TRACK_POINTS)]] = True
        parts += [one.trial.signals[name][rows] for name in ("x_m", "y_m")]
    return OfficeTrack(
        trial=raw.name, x_m=parts[0], y_m=parts[1], x_without_current_m=parts[2], y_without_current_m=parts[3]
    )


def _of_records(given: Measured) -> list[Notice]:
    """Notices on the records, without a current that the audit suspects: the report finds it itself."""
    currents = [one.likely_truth for one in given.doubts if one.likely_truth.startswith("a current")]
    return [notice for notice in given.notices if not any(words in notice for words in currents)]


def _cautions(
    state: TrialState, current: SiteCurrent | None, trials: Sequence[Tried], validity: float, count: int
) -> list[Notice]:
    found = []
    if not state.draughts_recorded:
        taken = f"the trial is taken to be at the draught of the card, {state.draught_m:.3g} m on even keel"
        found.append(caution(f"DRAUGHTS ARE NOT RECORDED: {taken}; give draught_fore_m and draught_aft_m"))
    if not count and not state.at_full_load:
        found.append(caution("without members, intervals and probabilities hold the errors of reading alone"))
    found += _of_current(current) if current is not None else []
    if current is None and any(one.trial is not None for one in trials):
        least = math.degrees(STEADY_FROM + LEAST_ARC)
        reason = f"no record is of a turn of {least:.0f} deg or more, which would show it"
        found.append(caution(f"NO CURRENT IS TAKEN OFF: {reason}; figures hold any current and wind of the trial"))
    if validity < LOADING_HOLDS:
        found.append(
            caution(
                f"EXTRAPOLATED to full load: the formulas for the loading do not hold from {state.draught_m:.3g} m to "
                f"{state.full_load_draught_m:.3g} m ({validity:.2f} of 1), and no criterion is certified"
            )
        )
    return found


def _of_current(current: SiteCurrent) -> list[Notice]:
    """Cautions on a wind that is taken off with the current, or is not taken off."""
    found = []
    if not current.separated:
        found.append(
            caution(
                "CURRENT AND WIND ARE NOT SEPARATED: the turns go to one side and no wind is known; the drift that is "
                "taken off holds both"
            )
        )
    if (apart := current.wind_share_mps or 0.0) > WIND_SHOWS and "model" not in current.separated:
        found.append(
            caution(
                f"WIND IS NOT TAKEN OFF: turns to port and starboard drift apart by {2 * apart:.2f} m/s, which a wind "
                "does that nobody recorded; figures hold its effect: give wind_speed_mps and wind_from_deg"
            )
        )
    return found
