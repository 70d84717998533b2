"""Design of the next captive campaign, and of the next sea trial, as results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.analysis.influence.figures import InfluenceFigure
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import DrawsArgument, NumberArgument, PositiveArgument, Seed, checked
from tank2sim.api.conversion import convert
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.ship import Ship, as_ship
from tank2sim.cards import Card, ManoeuvringCard
from tank2sim.cards.card import MmgCard
from tank2sim.cards.estimates import RELATIVE_ERROR
from tank2sim.cards.examination import doubts
from tank2sim.cards.writing import TestedRange
from tank2sim.design.captive_design import DRAWN_SHIPS, CaptiveDesign, CaptiveDesigner, CaptiveDesignSettings, tank_runs
from tank2sim.design.figure_slopes import FIGURES_OPTION, figure_of_text, range_of_figures
from tank2sim.design.plan_files import campaign_template, plan_csv, run_rows, runs_of_campaign
from tank2sim.design.tank_form import TankFile, read_tank, with_tank_values
from tank2sim.design.trial_design import SENSORS, TrialDesign, design_of_trial
from tank2sim.errors import InputError
from tank2sim.identification.trials.problem.sampled_runs import OBSERVED_SIGNALS
from tank2sim.marks import ASSUMED, ASSUMED_TANK, CHECK, LINEARISED
from tank2sim.units import from_si, to_si

if TYPE_CHECKING:
    import pandas as pd

DESIGN_FIGURES = ("advance_m@35", "tactical_diameter_m@35", "overshoot1_deg@10/10", "overshoot1_deg@20/20")
"""Figures where none is given: those of IMO MSC.137(76) that have slopes."""

_MOST_HOURS = 1000.0
_LISTED = 6
"""Names in a notice at most. Project choice: more are no longer read."""
_HARDLY_CERTAIN = 0.1
"""Standard error of a figure over its value from which the result is marked. Project choice: its 95 % interval is then
a fifth of the value wide in each direction, as wide as the margins of many ships to the limits of IMO."""
_FAR_BEYOND_USE = 100.0
"""Range of a gauge over the largest force of the usual matrix from which it is named. Project choice: its errors are
then more than a tenth of every force, as those of a usual gauge are stated (0.1 % of the range)."""
_SENSOR_BOUNDS = (1e-3, 1e3)
"""Least and largest standard deviation of a sensor, over the assumed one. Project choice: a thousandth is beyond any
sensor aboard, and with much less the sums lose their digits; a thousand times as much shows nothing."""
_TABLE_ROWS = 12
"""Coefficients in the printed table. Project choice: the page and JSON have all."""


class CampaignDesignResult(PagedResult):
    """A captive campaign that makes figures most certain, and the usual matrix in the same hours.

    Parameters
    ----------
    ship : Ship
        As it was given.
    design : CaptiveDesign
    notices : tuple of str

    Examples
    --------
    >>> import tank2sim as t2s
    >>> plan = t2s.design_campaign("mariner", figures="K_prime", draws=0)
    >>> bool((plan.figures["design"] < plan.figures["usual"]).all())
    True
    """

    command = "design"

    def __init__(self, ship: Ship, design: CaptiveDesign, notices: tuple[str, ...]) -> None:
        self.ship, self.design = ship, design
        self.notices = tuple(dict.fromkeys((*doubts(ship.card), *notices)))

    @cached_property
    def _rows(self) -> list[dict[str, object]]:
        return run_rows(self.design)

    @property
    def runs(self) -> pd.DataFrame:
        """The runs in their order: type, speed, angles, frequency, amplitudes, length of the record, time in the
        tank."""
        import pandas as pd

        return pd.DataFrame(self._rows).set_index("run")

    @property
    def figures(self) -> pd.DataFrame:
        """Figures by name: value of the card's ship, standard errors by the design and by the usual matrix in the same
        hours."""
        import pandas as pd

        return pd.DataFrame.from_dict(self._figures(), orient="index").rename_axis("figure")

    @property
    def plan(self) -> str:
        """The runs as CSV."""
        return plan_csv(self._rows)

    @property
    def template(self) -> str:
        """``campaign.toml`` for :func:`.reduce`, which lacks the files of the runs."""
        return campaign_template(self.design, self._rows)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        design = self.design
        runs, gauges = design.tank_runs, design.planned.gauges
        return {
            "ship": self.ship.name,
            "kind": "campaign",
            "hours": design.hours,
            "hours_used": design.hours_used,
            "hours_for_usual_certainty": design.hours_needed,
            "usual_matrix": {
                "hours": design.usual_hours,
                "runs": sum(map(len, design.usual)),
                "repeats": design.compared_hours / design.usual_hours,
            },
            "model": {"length_m": runs.length_m, "speed_mps": runs.speed_mps, "longest_record_s": runs.longest_s},
            "range": {
                "drift_deg": math.degrees(runs.drift_rad),
                "rudder_deg": math.degrees(runs.rudder_rad),
                "yaw_rate_prime": runs.largest.yaw_rate_prime,
            },
            "gauges": {
                force: {"noise": gauge.noise, "zero": gauge.zero, "range": gauge.largest}
                for force, gauge in gauges.items()
            },
            "figures": self._figures(),
            "coefficients": design.coefficients,
            "not_excited": list(design.not_excited),
            "certainty": design.curve,
            "runs": self._rows,
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """How many runs in how many hours, and in how many hours a plan is as good as the usual matrix."""
        design = self.design
        line = f"{self.ship.name}: {_counted(len(design.runs), 'run')} in {design.hours_used:.3g} h"
        if design.hours_needed is None:
            return line, "no plan was found that has every figure as certain as the usual matrix"
        share = design.hours_needed / design.compared_hours
        return (
            line,
            f"as certain as the usual matrix in {design.compared_hours:.3g} h: a plan of {design.hours_needed:.3g} h "
            f"({100 * share:.0f} %)",
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Figures, kinds of runs, and the coefficients that matter."""
        figures: list[list[object]] = [
            [name, row["value"], row["design"], row["usual"], row["design"] / row["usual"]]
            for name, row in self._figures().items()
        ]
        tests: list[list[object]] = []
        for test in sorted(self.design.tests, key=lambda test: (test.check, test.runs[0].type)):
            run = test.runs[0]
            sides = "±" if len(test.runs) > 1 else ""
            opposite = {"±": "∓", "": "-"}[sides] if run.rudder_rad < 0 else sides
            tests.append(
                [
                    test.repeats * len(test.runs),
                    run.type.replace("_", " "),
                    f"{sides}{math.degrees(run.drift_rad):.3g}" if run.drift_rad else "",
                    f"{opposite}{math.degrees(abs(run.rudder_rad)):.3g}" if run.rudder_rad else "",
                    run.frequency_radps or None,
                    run.velocity / run.speed_mps * (1.0 if run.type == "pure_sway" else self.design.tank_runs.length_m)
                    if run.oscillates
                    else None,
                    run.cycles if run.oscillates else None,
                    run.record_s,
                    "check" if test.check else "",
                ]
            )
        largest = sorted(
            self.design.coefficients.items(), key=lambda item: -max(_shares(item[1]).values(), default=0.0)
        )
        coefficients: list[list[object]] = [
            [name, row["value"], row["design"], row["usual"], 100 * max(_shares(row).values(), default=0.0)]
            for name, row in largest[:_TABLE_ROWS]
        ]
        return (
            screen_table(
                "Figures and their standard errors from the campaign alone",
                ("figure", "value", "design", "usual", "ratio"),
                figures,
            ),
            screen_table(
                "Runs (v' or r': amplitude of v/U or r L/U)",
                ("runs", "type", "drift (deg)", "rudder (deg)", "rad/s", "v' or r'", "cycles", "record (s)", ""),
                tests,
            ),
            screen_table(
                "Coefficients that matter (prime)",
                ("", "value", "design", "usual", "largest share of a variance (%)"),
                coefficients,
            ),
        )

    def _figures(self) -> dict[str, dict[str, float]]:
        design = self.design
        return {
            figure.text: {
                "value": float(design.slopes.values[row]),
                "design": float(design.standard_errors[row]),
                "usual": float(design.usual_standard_errors[row]),
                "variance_ratio": float(design.ratios[row]),
            }
            for row, figure in enumerate(design.slopes.figures)
        }


def _counted(count: int, word: str) -> str:
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def _shares(row: Mapping[str, object]) -> Mapping[str, float]:
    found = row["share_of_variance"]
    assert isinstance(found, dict)
    return found


@checked
def design_campaign(
    card: Ship | Card | str | Path,
    *,
    figures: str | Sequence[str] = DESIGN_FIGURES,
    hours: NumberArgument | None = None,
    tank: str | Path | TankFile | None = None,
    carriage_length_m: PositiveArgument | None = None,
    model_length_m: PositiveArgument | None = None,
    usual: str | Path | None = None,
    largest: tuple[float, float, float] | None = None,
    check_runs: bool = True,
    one_side: bool = False,
    draws: DrawsArgument = DRAWN_SHIPS,
    seed: Seed = 0,
) -> CampaignDesignResult:
    """Design the next captive campaign of a ship: the runs that make its figures most certain.

    Among static drift and rudder, both, pure sway, pure yaw and yaw with drift, at the levels, frequencies and lengths
    that the tank allows, those are chosen, with repeats, that make the worst variance of the figures smallest, measured
    by what the usual matrix leaves in the same hours: a c-optimal design for several figures. The information of a run
    is that of the regression of :func:`.reduce` with the stated errors of the gauges.

    Parameters
    ----------
    card : Ship, Card, str or path
        Its coefficients are the prior mean, their errors the spread of ships for which the plan is to be good. An MMG
        ship is converted to a polynomial.
    figures : str or sequence of str
        As of :meth:`.Ship.influence`; units may be left out (``advance@35``).
    hours : float, optional
        Time in the tank; by default that of the usual matrix once.
    tank : path or TankFile, optional
        ``tank.toml``.
    carriage_length_m, model_length_m : float, optional
        In place of those of the tank's file, m.
    usual : path, optional
        A ``campaign.toml`` whose runs are compared, in place of the usual matrix.
    largest : tuple, optional
        Largest drift (deg), rudder (deg) and r'; by default those of the manoeuvres of the figures.
    check_runs : bool
        Whether the plan has runs that could contradict the polynomial.
    one_side : bool
        Figures to the side of the given rudder, in place of the mean over both sides, as trials are reported: a single
        side depends on Y0 and N0, of which every run shows as much as any other.
    draws, seed : int
        Ships drawn from the errors of the card.

    Raises
    ------
    InputError
        A file is at fault, a figure does not exist or is not shown by the ship, or the tank cannot make the runs.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> plan = t2s.design_campaign("mariner", figures="overshoot1_deg@10/10", hours=2, draws=0)
    >>> float(plan.runs["tank_min"].sum()) < 2 * 60
    True
    """
    if hours is not None and not 0 < hours <= _MOST_HOURS:
        raise InputError("--hours", f"{hours:g}", "is out of bounds", f"give hours above 0 and up to {_MOST_HOURS:g}")
    ship = as_ship(card)
    polynomial, converted = _polynomial(ship)
    asked = _figures_of(figures)
    limits = tank if isinstance(tank, TankFile) else read_tank(tank) if tank is not None else TankFile()
    limits = with_tank_values(limits, "carriage", length_m=carriage_length_m)
    limits = with_tank_values(limits, "model", length_m=model_length_m)
    reach = range_of_figures(polynomial, asked) if largest is None else _tested_range(largest)
    source = "tank" if tank is None or isinstance(tank, TankFile) else str(tank)
    runs = tank_runs(polynomial, limits, reach, source)
    own = None if usual is None else runs_of_campaign(Path(usual), runs)
    settings = CaptiveDesignSettings(
        hours=hours,
        usual=own,
        largest=reach,
        check_runs=check_runs,
        one_side=one_side,
        draws=draws,
        seed=seed,
        source=source,
    )
    design = CaptiveDesigner(polynomial, limits, asked, settings).design()
    return CampaignDesignResult(ship, design, (*_notices(design, draws), *converted))


class TrialDesignResult(PagedResult):
    """A sea trial that makes figures most certain, and the usual set of manoeuvres in the same time.

    Parameters
    ----------
    ship : Ship
    design : TrialDesign
    notices : tuple of str

    Examples
    --------
    >>> import tank2sim as t2s
    >>> trial = t2s.design_trial("mariner", figures="advance_m@35")
    >>> bool((trial.figures["design"] < trial.figures["before"]).all())
    True
    """

    command = "design"

    def __init__(self, ship: Ship, design: TrialDesign, notices: tuple[str, ...]) -> None:
        self.ship, self.design = ship, design
        self.notices = tuple(dict.fromkeys((*doubts(ship.card), *notices)))

    @property
    def manoeuvres(self) -> pd.DataFrame:
        """The manoeuvres in their order: repeats, length (s), time with approach (min), file of the orders."""
        import pandas as pd

        return pd.DataFrame(self._rows()).set_index("manoeuvre")

    @property
    def figures(self) -> pd.DataFrame:
        """Figures by name: value of the card's ship, standard errors before, by the design and by the usual set."""
        import pandas as pd

        return pd.DataFrame.from_dict(self._figures(), orient="index").rename_axis("figure")

    @property
    def plan(self) -> str:
        """The manoeuvres as CSV."""
        rows = self._rows()
        lines = [",".join(rows[0]), *(",".join(f"{value}" for value in row.values()) for row in rows)]
        return "\n".join(lines) + "\n"

    @property
    def orders(self) -> dict[str, str]:
        """Name of a file to the orders of a manoeuvre, for ``simulate --manoeuvre file:``; zigzags are switched at the
        headings of the card's ship."""
        pairs = zip(self._rows(), self.design.manoeuvres, strict=True)
        return {str(row["orders"]): manoeuvre.orders for row, (manoeuvre, _) in pairs}

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        design = self.design
        return {
            "ship": self.ship.name,
            "kind": "trial",
            "minutes": design.minutes,
            "minutes_used": design.minutes_used,
            "minutes_for_usual_certainty": design.minutes_needed,
            "usual_set": {
                "minutes": design.usual_minutes,
                "manoeuvres": [each.name for each in design.usual],
                "repeats": design.minutes / design.usual_minutes,
            },
            "sensors": _by_column(design.sensors),
            "figures": self._figures(),
            "coefficients": design.coefficients,
            "certainty": design.curve,
            "manoeuvres": self._rows(),
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """How many manoeuvres in what time, and in what time a plan is as good as the usual set."""
        design = self.design
        count = sum(repeats for _, repeats in design.manoeuvres)
        line = f"{self.ship.name}: {_counted(count, 'manoeuvre')} in {design.minutes_used:.3g} min"
        if design.minutes_needed is None:
            return line, "no plan was found that has every figure as certain as the usual set in the same time"
        return (
            line,
            f"as certain as the usual set in {design.minutes:.3g} min: a plan of {design.minutes_needed:.3g} min "
            f"({100 * design.minutes_needed / design.minutes:.0f} %)",
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Figures, manoeuvres, and the coefficients that become known."""
        largest = sorted(self.design.coefficients.items(), key=lambda item: item[1]["design"])
        return (
            screen_table(
                "Figures and their standard errors: before, by the plan, by the usual set",
                ("figure", "value", "before", "design", "usual", "ratio"),
                [
                    [name, row["value"], row["before"], row["design"], row["usual"], row["design"] / row["usual"]]
                    for name, row in self._figures().items()
                ],
            ),
            screen_table(
                "Manoeuvres",
                ("manoeuvre", "repeats", "length (s)", "with approach (min)", "orders"),
                [list(row.values()) for row in self._rows()],
            ),
            screen_table(
                "Coefficients: standard error over that before",
                ("", "before (prime)", "design", "usual"),
                [[name, *row.values()] for name, row in largest[:_TABLE_ROWS]],
            ),
        )

    def _rows(self) -> list[dict[str, object]]:
        return [
            {
                "manoeuvre": each.name,
                "repeats": repeats,
                "duration_s": float(f"{each.duration_s:.6g}"),
                "total_min": float(f"{each.total_s / 60:.4g}"),
                "orders": f"orders_{number:02d}.csv",
            }
            for number, (each, repeats) in enumerate(self.design.manoeuvres, start=1)
        ]

    def _figures(self) -> dict[str, dict[str, float]]:
        design = self.design
        return {
            figure.text: {
                "value": float(design.slopes.values[row]),
                "before": float(design.prior_errors[row]),
                "design": float(design.standard_errors[row]),
                "usual": float(design.usual_standard_errors[row]),
            }
            for row, figure in enumerate(design.slopes.figures)
        }


@checked
def design_trial(
    card: Ship | Card | str | Path,
    *,
    figures: str | Sequence[str] = DESIGN_FIGURES,
    minutes: NumberArgument | None = None,
    sensors: Mapping[str, float] | None = None,
    one_side: bool = False,
) -> TrialDesignResult:
    """Design the next sea trial of a ship: the manoeuvres that make its figures most certain.

    Among turns, zigzags, pull-outs, straight runs, random steps and changes of revolutions of several lengths, those
    are chosen, with repeats, that make the worst variance of the figures smallest, measured by what the usual set
    (turns with 35 deg to both sides, zigzags 10/10 and 20/20) leaves in the same time.

    Parameters
    ----------
    card : Ship, Card, str or path
        Its errors are the prior, as of :func:`.identify`. An MMG ship is converted to a polynomial.
    figures : str or sequence of str
        As of :func:`design_campaign`.
    minutes : float, optional
        Time of the trial with all approaches; by default that of the usual set.
    sensors : mapping, optional
        Column of a trial to the standard deviation of one reading a second: ``{"r_degps": 0.02, "x_m": 1.0}``; what is
        not listed is not measured.
    one_side : bool
        Figures to the side of the given rudder, in place of the mean over both sides.

    Raises
    ------
    InputError
        A figure does not exist or is not shown by the ship, or the time is too short.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> trial = t2s.design_trial("mariner", figures="advance_m@35", minutes=15)
    >>> trial.design.minutes_used <= 15
    True
    """
    if minutes is not None and not 0 < minutes <= 60 * _MOST_HOURS:
        remedy = f"give minutes above 0 and up to {60 * _MOST_HOURS:g}"
        raise InputError("--minutes", f"{minutes:g}", "is out of bounds", remedy)
    ship = as_ship(card)
    polynomial, converted = _polynomial(ship)
    found = SENSORS if sensors is None else _sensors(sensors)
    asked = _figures_of(figures)
    design = design_of_trial(polynomial, asked, minutes=minutes, sensors=found, one_side=one_side)
    notices = list(design.slopes.notices)
    if sensors is None:
        notices.insert(
            0,
            f"{ASSUMED} of the sensors, for none are stated: "
            + ", ".join(f"{column} {size:g}" for column, size in _by_column(found).items()),
        )
    assumed = _assumed_of_card(polynomial)
    if assumed:
        notices.insert(0, assumed)
    if design.unstable:
        notices.insert(
            0,
            f"{LINEARISED} of {ship.name}, which is unstable on a straight course: its manoeuvres are not linear in "
            "the coefficients, and errors after a fit may be many times those predicted here",
        )
    return TrialDesignResult(ship, design, tuple(dict.fromkeys([*notices, *converted])))


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
            raise InputError("--sensors", column, "is not measured", f"there are: {', '.join(_SENSOR_COLUMNS)}")
        variable = OBSERVED_SIGNALS[signal]
        least, most = (SENSORS[variable] * factor for factor in _SENSOR_BOUNDS)
        if not least <= value <= most:
            low, high = (from_si(column, bound) for bound in (least, most))
            remedy = f"give {low:.3g} to {high:.3g}"
            raise InputError("--sensors", f"{column}={size:g}", "is not a standard deviation that a sensor has", remedy)
        if variable in found:
            raise InputError("--sensors", column, "is given twice", "give each sensor once")
        found[variable] = value
    if not found:
        raise InputError("--sensors", "", "has no sensor", "give at least one, as r_degps=0.02")
    return found


def _figures_of(figures: str | Sequence[str]) -> list[InfluenceFigure]:
    texts = [figures] if isinstance(figures, str) else list(figures)
    asked = [figure_of_text(text) for given in texts for text in given.split(",") if text.strip()]
    if not asked:
        raise InputError(FIGURES_OPTION, "", "has no figure", "give at least one, as advance_m@35")
    return list(dict.fromkeys(asked))


def _tested_range(largest: tuple[float, float, float]) -> TestedRange:
    drift, rudder, rate = largest
    if not (0 < drift < 90 and 0 < rudder < 90 and 0 < rate < 10):
        remedy = "give drift and rudder between 0 and 90 deg, and r' between 0 and 10"
        raise InputError("--largest", "/".join(f"{value:g}" for value in largest), "is out of bounds", remedy)
    return TestedRange(math.radians(drift), math.radians(rudder), rate)


def _polynomial(ship: Ship) -> tuple[ManoeuvringCard, tuple[str, ...]]:
    card = ship.manoeuvring()
    if not isinstance(card, MmgCard):
        return card, ()
    made = convert(ship)
    return made.ship.manoeuvring(), (
        "the card is of the MMG method: the plan is for the polynomial that is fitted to it",
        *made.notices,
    )


def _notices(design: CaptiveDesign, draws: int) -> tuple[str, ...]:
    notices = list(design.slopes.notices)
    if design.not_excited:
        notices.append(
            f"no run of this tank shows {', '.join(design.not_excited)}: their errors are not in the standard errors"
        )
    if design.too_strong:
        left_out = _counted(design.too_strong, "candidate run")
        notices.append(f"left out: {left_out} with a force that exceeds the range of its gauge")
    asked, runs = design.tank_runs.largest, design.tank_runs
    for word, size, most in (
        ("drift", asked.drift_rad, runs.drift_rad),
        ("rudder", asked.rudder_rad, runs.rudder_rad),
    ):
        if size > most + 1e-12:
            notices.append(
                f"{word} goes to {math.degrees(most):.3g} deg, not {math.degrees(size):.3g}, by [mechanism] of the tank"
            )
    body = design.tank_runs.tank.mechanism.model_dump()
    missing = [key for key in ("sway_amplitude_m", "heading_amplitude_rad", "drift_rad") if body[key] is None]
    if missing:
        notices.append(f"not limited, for the tank does not state it: {', '.join(missing)} of [mechanism]")
    return tuple(dict.fromkeys([*_checks(design), *_assumptions(design, draws), *notices]))


def _checks(design: CaptiveDesign) -> list[str]:
    """What needs a second look: too few hours, figures that are hardly certain, gauges far beyond their forces."""
    found = []
    if design.hours < design.usual_hours * (1 - 1e-9):
        found.append(
            f"{CHECK} the hours, {design.hours:.3g} h, are too few for one usual matrix: the plan is compared with it "
            f"in its own {design.usual_hours:.3g} h"
        )
    for row, figure in enumerate(design.slopes.figures):
        error, value = float(design.standard_errors[row]), abs(float(design.slopes.values[row]))
        if error > _HARDLY_CERTAIN * value:
            force = max(design.gauge_shares, key=lambda each: float(design.gauge_shares[each][row]))
            part = 100 * float(design.gauge_shares[force][row])
            found.append(
                f"{CHECK} the standard error of {figure.text} by the plan, {error:.3g}, is more than "
                f"{100 * _HARDLY_CERTAIN:g} % of its value, {value:.4g}; "
                f"{part:.0f} % of the variance is by gauge {force}"
            )
    found += [
        f"{CHECK} the range of gauge {force} is {times:.3g} times the largest force of the usual matrix"
        for force, times in design.beyond_use.items()
        if times > _FAR_BEYOND_USE
    ]
    return found


def _assumptions(design: CaptiveDesign, draws: int) -> list[str]:
    """What neither the tank's file, nor an option, nor the card states."""
    tank, runs = design.tank_runs.tank, design.tank_runs
    gauges, stated = tank.gauges, tank.gauges.model_fields_set
    lacking = []
    for kind, share in (("noise", gauges.noise_share), ("zero", gauges.zero_share)):
        forces = [
            force for force, unit in (("X", "N"), ("Y", "N"), ("N", "Nm")) if f"{force}_{kind}_{unit}" not in stated
        ]
        if forces and f"{kind}_share" not in stated:
            lacking.append(f"{kind} of {', '.join(forces)} {100 * share:g} % of the range")
    if "gain_relative" not in stated:
        lacking.append(f"gain {100 * gauges.gain_relative:g} %")
    if "rate_hz" not in stated:
        lacking.append(f"{gauges.rate_hz:g} independent readings a second")
    found = [f"{ASSUMED} of the gauges, as [gauges] of the tank does not state them: {', '.join(lacking)}"]
    if not lacking:
        found = []
    card = _assumed_of_card(design.card) if draws else None
    if card:
        found.append(card)
    carriage, model = tank.carriage.model_fields_set, tank.model.model_fields_set
    body = tank.carriage
    lengths = {
        "model": None if "length_m" in model else f"model of {runs.length_m:.3g} m",
        "way": None if "length_m" in carriage else f"carriage way {body.length_m:g} m",
        "acceleration": None if "acceleration_mps2" in carriage else f"acceleration {body.acceleration_mps2:g} m/s2",
        "waiting": None if "waiting_s" in carriage else f"waiting time {body.waiting_s:g} s",
    }
    missing = [text for text in lengths.values() if text]
    if missing:
        found.append(f"{ASSUMED_TANK}, for it is not stated: {', '.join(missing)}")
    return found


def _assumed_of_card(card: ManoeuvringCard) -> str | None:
    """The derivatives without a stated standard error, which are taken to be known to a share of their values."""
    names = [name for name, value in card.derivatives.items() if value and name not in card.uncertainty]
    if not names:
        return None
    which = ", ".join(names) if len(names) <= _LISTED else f"{len(names)} derivatives"
    return f"{ASSUMED} of the card, which states none for {which}: {100 * RELATIVE_ERROR:g} % of each"
