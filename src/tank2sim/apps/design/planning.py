"""The next captive campaign and the next sea trial of a ship: designs, their numbers and notices."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from tank2sim.analysis.influence.figures import InfluenceFigure, parse_figure
from tank2sim.apps.design.captive_design import CaptiveDesign, CaptiveDesigner, CaptiveDesignSettings, tank_runs
from tank2sim.apps.design.figure_slopes import range_of_figures
from tank2sim.apps.design.plan_files import run_rows, runs_of_campaign, runs_of_matrix
from tank2sim.apps.design.study import (
    CampaignStudy,
    PlannedFigure,
    PlannedKind,
    PlannedManoeuvre,
    PlannedModel,
    TrialStudy,
    UsualMatrix,
    UsualSet,
)
from tank2sim.apps.design.tank_form import GAUGE_UNITS, TankFile
from tank2sim.apps.design.trial_design import SENSORS, TrialDesign, design_of_trial
from tank2sim.apps.programs.conventions import Conventions
from tank2sim.apps.programs.languages import converted as converted_card
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard
from tank2sim.cards.card import MmgCard
from tank2sim.cards.estimates import RELATIVE_ERROR
from tank2sim.cards.examination import doubts
from tank2sim.cards.form import CardSection
from tank2sim.cards.writing import TestedRange
from tank2sim.errors import ArgumentError
from tank2sim.notices import Notice, caution
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS
from tank2sim.units import from_si, to_si

_LISTED = 6
"""Names in a notice at most. Project choice: more are no longer read."""
_HARDLY_CERTAIN = 0.1
"""Standard error of a figure over its value from which the result is marked. Project choice: its 95 % interval is then
a fifth of the value wide in each direction, as wide as the margins of many ships to the limits of IMO."""
_FAR_BEYOND_USE = 100.0
"""Range of a gauge over the largest force of the usual matrix from which it is named. Project choice: its errors are
then more than a tenth of every force, as usual gauges are specified (0.1 % of the range)."""
_SENSOR_BOUNDS = (1e-3, 1e3)
"""Least and largest standard deviation of a sensor, over the assumed one. Project choice: a thousandth is beyond any
sensor aboard, and with much less the sums lose their digits; a thousand times as much shows nothing."""


def planned_campaign(
    card: ManoeuvringCard,
    figures: str | Sequence[str],
    limits: TankFile,
    settings: CaptiveDesignSettings,
    *,
    usual: str | Path | None = None,
    largest: tuple[float, float, float] | None = None,
) -> tuple[CampaignStudy, CaptiveDesign]:
    """The campaign as numbers, and its design. Arguments and errors as in :func:`.design_campaign`.

    `card`, `figures`, `usual`, `largest`: as there; `limits`: the tank's; `settings`: without `usual` and `largest`,
    which are read here.
    """
    polynomial, converted = _polynomial(card)
    asked = _figures_of(figures)
    reach = range_of_figures(polynomial, asked) if largest is None else _tested_range(largest)
    runs = tank_runs(polynomial, limits, reach, settings.source)
    own, assumed = None, list[Notice]()
    if usual is not None and Path(usual).suffix.lower() == ".csv":
        own, assumed = runs_of_matrix(Path(usual), runs)
    elif usual is not None:
        own = runs_of_campaign(Path(usual), runs)
    design = CaptiveDesigner(polynomial, limits, asked, replace(settings, usual=own, largest=reach)).design()
    notices = dict.fromkeys((*doubts(card), *_notices(design, settings.draws), *assumed, *converted))
    return _campaign_study(card.ship.name, design, tuple(notices)), design


def _campaign_study(name: str, design: CaptiveDesign, notices: tuple[Notice, ...]) -> CampaignStudy:
    runs = design.tank_runs
    return CampaignStudy(
        ship=name,
        hours=design.hours,
        hours_used=design.hours_used,
        hours_for_usual_certainty=design.hours_needed,
        usual_matrix=UsualMatrix(
            hours=design.usual_hours,
            runs=sum(map(len, design.usual)),
            repeats=design.compared_hours / design.usual_hours,
        ),
        model=PlannedModel(
            length_m=runs.length_m,
            speed_mps=runs.speed_mps,
            longest_record_s=runs.longest_s,
            drift_deg=math.degrees(runs.drift_rad),
            rudder_deg=math.degrees(runs.rudder_rad),
            yaw_rate_prime=runs.largest.yaw_rate_prime,
        ),
        gauges=dict(design.planned.gauges),
        figures=_planned_figures(design, variance_ratio=design.ratios),
        coefficients=design.coefficients,
        not_excited=design.not_excited,
        certainty=design.curve,
        kinds=_kinds(design),
        runs=run_rows(design),
        notices=notices,
    )


def _planned_figures(design: CaptiveDesign | TrialDesign, **more: Array) -> dict[str, PlannedFigure]:
    """Figures with their errors by the plan and the usual programme; `more` are further fields (figures,)."""
    columns = {"value": design.slopes.values, "design": design.standard_errors, "usual": design.usual_standard_errors}
    return {
        figure.text: PlannedFigure(**{name: float(values[row]) for name, values in {**columns, **more}.items()})
        for row, figure in enumerate(design.slopes.figures)
    }


def _kinds(design: CaptiveDesign) -> tuple[PlannedKind, ...]:
    """Runs by kind, runs for the figures first."""
    found = []
    for test in sorted(design.tests, key=lambda test: (test.check, test.runs[0].type)):
        run = test.runs[0]
        sides = "±" if len(test.runs) > 1 else ""
        opposite = {"±": "∓", "": "-"}[sides] if run.rudder_rad < 0 else sides
        length = 1.0 if run.type == "pure_sway" else design.tank_runs.length_m
        kind = PlannedKind(
            runs=test.repeats * len(test.runs),
            type=run.type.replace("_", " "),
            drift=f"{sides}{math.degrees(run.drift_rad):.3g}" if run.drift_rad else None,
            rudder=f"{opposite}{math.degrees(abs(run.rudder_rad)):.3g}" if run.rudder_rad else None,
            frequency_radps=run.frequency_radps or None,
            amplitude_prime=run.velocity / run.speed_mps * length if run.oscillates else None,
            cycles=run.cycles if run.oscillates else None,
            record_s=run.record_s,
            check=test.check,
        )
        found.append(kind)
    return tuple(found)


def planned_trial(
    card: ManoeuvringCard,
    *,
    figures: str | Sequence[str],
    minutes: float | None,
    sensors: Mapping[str, float] | None,
    one_side: bool,
) -> tuple[TrialStudy, TrialDesign]:
    """The trial as numbers, and its design. `card`, `figures`, `minutes`, `sensors`, `one_side` and errors: as of
    :func:`.design_trial`."""
    polynomial, converted = _polynomial(card)
    found = SENSORS if sensors is None else _sensors(sensors)
    asked = _figures_of(figures)
    design = design_of_trial(polynomial, asked, minutes=minutes, sensors=found, one_side=one_side)
    notices = list(doubts(card))
    if design.unstable:
        notices.append(
            caution(
                f"LINEARISED standard errors: {card.ship.name} is unstable on a straight course, so its manoeuvres are "
                "not linear in the coefficients, and errors after a fit may be many times those predicted here"
            )
        )
    notices += _assumed_of_card(polynomial)
    if sensors is None:
        sizes = ", ".join(f"{column} {size:g}" for column, size in _by_column(found).items())
        notices.append(caution(f"ASSUMED standard errors of the sensors, because none are stated: {sizes}"))
    manoeuvres = tuple(
        PlannedManoeuvre(
            manoeuvre=each.name,
            repeats=repeats,
            duration_s=float(f"{each.duration_s:.6g}"),
            total_min=float(f"{each.total_s / 60:.4g}"),
            orders=f"orders_{number:02d}.csv",
        )
        for number, (each, repeats) in enumerate(design.manoeuvres, start=1)
    )
    study = TrialStudy(
        ship=card.ship.name,
        minutes=design.minutes,
        minutes_used=design.minutes_used,
        minutes_for_usual_certainty=design.minutes_needed,
        usual_set=UsualSet(
            minutes=design.usual_minutes,
            manoeuvres=tuple(each.name for each in design.usual),
            repeats=design.minutes / design.usual_minutes,
        ),
        sensors=_by_column(design.sensors),
        figures=_planned_figures(design, before=design.prior_errors),
        coefficients=design.coefficients,
        certainty=design.curve,
        manoeuvres=manoeuvres,
        notices=tuple(dict.fromkeys((*notices, *design.slopes.notices, *converted))),
    )
    return study, design


def counted(count: int, word: str) -> str:
    """A number of things, `count` and `word`: ``1 run``, ``2 runs``."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


_SENSOR_COLUMNS = ("u_mps", "v_mps", "r_degps", "psi_deg", "x_m", "y_m")


def _by_column(sensors: Mapping[str, float]) -> dict[str, float]:
    """Column of a trial to the standard deviation of a reading, in the unit of its name."""
    keys = {to_si(column, 1.0)[0]: column for column in _SENSOR_COLUMNS}
    signals = {variable: keys.get(signal, signal) for signal, variable in OBSERVED_SIGNALS.items()}
    return {signals[name]: float(f"{from_si(signals[name], size):.6g}") for name, size in sensors.items()}


def _sensors(given: Mapping[str, float]) -> dict[str, float]:
    """Variable to standard deviation, SI, from columns of a trial."""
    found: dict[str, float] = {}
    for column, size in given.items():
        signal, value = to_si(column, size)
        if signal not in OBSERVED_SIGNALS:
            raise ArgumentError("sensors", column, "is not measured", f"there are: {', '.join(_SENSOR_COLUMNS)}")
        variable = OBSERVED_SIGNALS[signal]
        least, most = (SENSORS[variable] * factor for factor in _SENSOR_BOUNDS)
        if not least <= value <= most:
            low, high = (from_si(column, bound) for bound in (least, most))
            remedy = f"give {low:.3g} to {high:.3g}"
            raise ArgumentError(
                "sensors", f"{column}={size:g}", "is not a standard deviation that a sensor has", remedy
            )
        if variable in found:
            raise ArgumentError("sensors", column, "is given twice", "give each sensor once")
        found[variable] = value
    if not found:
        raise ArgumentError("sensors", "", "has no sensor", "give at least one, as r_degps=0.02")
    return found


def _figures_of(figures: str | Sequence[str]) -> list[InfluenceFigure]:
    texts = [figures] if isinstance(figures, str) else list(figures)
    asked = [parse_figure(text) for given in texts for text in given.split(",") if text.strip()]
    if not asked:
        raise ArgumentError("figures", "", "has no figure", "give at least one, as advance_m@35")
    return list(dict.fromkeys(asked))


def _tested_range(largest: tuple[float, float, float]) -> TestedRange:
    drift, rudder, rate = largest
    if not (0 < drift < 90 and 0 < rudder < 90 and 0 < rate < 10):
        remedy = "give drift and rudder between 0 and 90 deg, and r' between 0 and 10"
        raise ArgumentError("largest", "/".join(f"{value:g}" for value in largest), "is out of bounds", remedy)
    return TestedRange(math.radians(drift), math.radians(rudder), rate)


def _polynomial(card: ManoeuvringCard) -> tuple[ManoeuvringCard, tuple[Notice, ...]]:
    if not isinstance(card, MmgCard):
        return card, ()
    made = converted_card(card, "abkowitz", Conventions(None, None, 0.0), None)
    assert made.card is not None
    words = "the card is of the MMG method: the plan is for the polynomial that is fitted to it"
    return made.card.manoeuvring(), (Notice(words), *map(Notice, made.losses))


def _notices(design: CaptiveDesign, draws: int) -> tuple[Notice, ...]:
    notices = list(design.slopes.notices)
    if design.not_excited:
        unseen = ", ".join(design.not_excited)
        notices.append(Notice(f"no run of this tank shows {unseen}: the standard errors leave out their errors"))
    if design.too_strong:
        left_out = counted(design.too_strong, "candidate run")
        notices.append(Notice(f"left out: {left_out} with a force that exceeds the range of its gauge"))
    asked, runs = design.tank_runs.largest, design.tank_runs
    for word, size, most in (
        ("drift", asked.drift_rad, runs.drift_rad),
        ("rudder", asked.rudder_rad, runs.rudder_rad),
    ):
        if size > most + 1e-12:
            reached = f"{math.degrees(most):.3g} deg, not {math.degrees(size):.3g}"
            notices.append(Notice(f"{word} goes to {reached}, by [mechanism] of the tank"))
    body = design.tank_runs.tank.mechanism.model_dump()
    missing = [key for key in ("sway_amplitude_m", "heading_amplitude_rad", "drift_rad") if body[key] is None]
    if missing:
        notices.append(Notice(f"not limited, for the tank does not state it: {', '.join(missing)} of [mechanism]"))
    return tuple(dict.fromkeys([*_checks(design), *_assumptions(design, draws), *notices]))


def _checks(design: CaptiveDesign) -> list[Notice]:
    """Points that need a second look: too few hours, figures that are hardly certain, gauges far beyond their
    forces."""
    found = []
    if design.hours < design.usual_hours * (1 - 1e-9):
        found.append(
            caution(
                f"the hours, {design.hours:.3g} h, are too few for one usual matrix: the plan is compared with it "
                f"in its own {design.usual_hours:.3g} h"
            )
        )
    for row, figure in enumerate(design.slopes.figures):
        error, value = float(design.standard_errors[row]), abs(float(design.slopes.values[row]))
        if error > _HARDLY_CERTAIN * value:
            force = max(design.gauge_shares, key=lambda each: float(design.gauge_shares[each][row]))
            part = 100 * float(design.gauge_shares[force][row])
            found.append(
                caution(
                    f"the standard error of {figure.text} by the plan, {error:.3g}, is more than "
                    f"{100 * _HARDLY_CERTAIN:g} % of its value, {value:.4g}; "
                    f"{part:.0f} % of the variance is by gauge {force}"
                )
            )
    found += [
        caution(f"the range of gauge {force} is {times:.3g} times the largest force of the usual matrix")
        for force, times in design.beyond_use.items()
        if times > _FAR_BEYOND_USE
    ]
    return found


def _assumptions(design: CaptiveDesign, draws: int) -> list[Notice]:
    """Data stated neither by the tank's file, nor an option, nor the card."""
    tank, runs = design.tank_runs.tank, design.tank_runs
    gauges, of_gauges = tank.gauges, {}
    for kind, share in (("noise", gauges.noise_share), ("zero", gauges.zero_share)):
        if forces := [force for force in GAUGE_UNITS if gauges.stated(kind, force) is None]:
            of_gauges[f"{kind}_share"] = f"{kind} of {', '.join(forces)} {100 * share:g} % of the range"
    of_gauges["gain_relative"] = f"gain {100 * gauges.gain_relative:g} %"
    of_gauges["rate_hz"] = f"{gauges.rate_hz:g} independent readings a second"
    lacking, found = _unstated(gauges, of_gauges), []
    if lacking:
        found.append(
            caution(f"ASSUMED standard errors of the gauges ([gauges] of the tank states none): {', '.join(lacking)}")
        )
    found += _assumed_of_card(design.card) if draws else ()
    carriage = tank.carriage
    of_carriage = {
        "length_m": f"carriage way {carriage.length_m:g} m",
        "acceleration_mps2": f"acceleration {carriage.acceleration_mps2:g} m/s2",
        "waiting_s": f"waiting time {carriage.waiting_s:g} s",
    }
    of_model = {"length_m": f"model of {runs.length_m:.3g} m"}
    if missing := [*_unstated(tank.model, of_model), *_unstated(carriage, of_carriage)]:
        found.append(caution(f"ASSUMED of the tank, because it is not stated: {', '.join(missing)}"))
    return found


def _unstated(section: CardSection, words: Mapping[str, str]) -> list[str]:
    """The words of the keys that a section of the tank's file does not state."""
    return [text for key, text in words.items() if key not in section.model_fields_set]


def _assumed_of_card(card: ManoeuvringCard) -> list[Notice]:
    """A caution on derivatives without a stated standard error: a share of the value is assumed."""
    names = [name for name, value in card.derivatives.items() if value and name not in card.uncertainty]
    which = ", ".join(names) if len(names) <= _LISTED else f"{len(names)} derivatives"
    text = f"ASSUMED standard errors: the card states none of {which}, and {100 * RELATIVE_ERROR:g} % of each is taken"
    return [caution(text)] if names else []
