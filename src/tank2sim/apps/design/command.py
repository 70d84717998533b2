"""The next captive campaign, and the next sea trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tank2sim.api.verbs import Output, verb
from tank2sim.arguments import ArgumentBounds, DrawsArgument, Seed
from tank2sim.errors import ArgumentError
from tank2sim.files import CARD, TABLE
from tank2sim.quantities import TankModelLength, TankSize

if TYPE_CHECKING:
    from tank2sim.apps.design.result import CampaignDesignResult, TrialDesignResult
    from tank2sim.apps.design.tank_form import TankFile
    from tank2sim.dynamics.vessel import Vessel

DESIGN_FIGURES = ("advance_m@35", "tactical_diameter_m@35", "overshoot_1_deg@10/10", "overshoot_1_deg@20/20")
"""Figures where none is given: figures of IMO MSC.137(76) that have slopes."""

Hours = Annotated[float, ArgumentBounds(0, 1000, above=True)]
Minutes = Annotated[float, ArgumentBounds(0, 60_000, above=True)]


def _parsed_range(text: str) -> tuple[float, float, float]:
    try:
        drift, rudder, rate = map(float, text.split("/"))
    except ValueError:
        raise ArgumentError("largest", text, "cannot be read", "give DRIFT/RUDDER/RATE, as 12/35/0.6") from None
    return drift, rudder, rate


def _parsed_sensors(given: Sequence[str]) -> dict[str, float]:
    found: dict[str, float] = {}
    for text in (part for each in given for part in each.split(",") if part.strip()):
        column, _, number = text.partition("=")
        column = column.strip()
        try:
            size = float(number)
        except ValueError:
            raise ArgumentError("sensors", text, "cannot be read", "give COLUMN=SD, as r_degps=0.02") from None
        if found.setdefault(column, size) != size:
            raise ArgumentError("sensors", text, f"is given before as {found[column]:g}", "give each sensor once")
    return found


_PLAN = Output("-o", TABLE, "Write the plan.", lambda result, path: {path: result.plan}, "PLAN.csv")


@verb(
    "the next sea trial, for the certainty of chosen figures",
    _PLAN,
    Output(
        "--orders",
        (),
        "Write the orders of each manoeuvre, for simulate --manoeuvre file:.",
        lambda result, path: {path / name: text for name, text in result.orders.items()},
        "DIR",
    ),
    texts={"sensors": _parsed_sensors},
    results=("tank2sim.apps.design.result:TrialDesignResult",),
)
def design_trial(
    ship: Vessel,
    *,
    figures: str | Sequence[str] = DESIGN_FIGURES,
    minutes: Minutes | None = None,
    sensors: Mapping[str, float] | None = None,
    one_side: bool = False,
) -> TrialDesignResult:
    """Design the next sea trial of a ship: the manoeuvres that make its figures most certain.

    Among turns, zigzags, pull-outs, straight runs, random steps and changes of revolutions of several lengths, those
    are chosen, with repeats, that make the worst variance of the figures smallest, measured by what the usual set
    (turns with 35 deg to both sides, zigzags 10/10 and 20/20) leaves in the same time.

    Parameters
    ----------
    ship : Vessel, Card, str or path
        Its errors are the prior, as of :func:`.identify`. An MMG ship is converted to a polynomial.
    figures : str or sequence of str
        As of :func:`design_campaign`.
    minutes : float, optional
        Time of the trial with all approaches; by default as long as the usual set.
    sensors : mapping, optional
        Column of a trial to the standard deviation of one reading a second: ``{"r_degps": 0.02, "x_m": 1.0}``, on the
        command line ``r_degps=0.02 x_m=1``; columns that are not listed are not measured.
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
    >>> trial.study.minutes_used <= 15
    True
    """
    from tank2sim.apps.design.planning import planned_trial
    from tank2sim.apps.design.result import TrialDesignResult

    study, design = planned_trial(
        ship.manoeuvring(), figures=figures, minutes=minutes, sensors=sensors, one_side=one_side
    )
    return TrialDesignResult(study, design)


@verb(
    "the next captive campaign or sea trial, for the certainty of chosen figures",
    _PLAN,
    Output(
        "--campaign",
        CARD,
        "Write the campaign's file for tank2sim reduce, which then lacks only the files of the runs.",
        lambda result, path: {path: result.template},
        "CAMPAIGN.toml",
    ),
    texts={"largest": _parsed_range},
    variants={"trial": design_trial},
    name="design",
    results=("tank2sim.apps.design.result:CampaignDesignResult",),
)
def design_campaign(
    ship: Vessel,
    *,
    figures: str | Sequence[str] = DESIGN_FIGURES,
    hours: Hours | None = None,
    tank: str | Path | TankFile | None = None,
    carriage_length_m: TankSize | None = None,
    model_length_m: TankModelLength | None = None,
    usual: str | Path | None = None,
    largest: tuple[float, float, float] | None = None,
    check_runs: bool = True,
    one_side: bool = False,
    members: DrawsArgument | None = None,
    seed: Seed = 0,
) -> CampaignDesignResult:
    """Design the next captive campaign of a ship: the runs that make its figures most certain.

    Among static drift and rudder, both, pure sway, pure yaw and yaw with drift, at the levels, frequencies and lengths
    that the tank allows, those are chosen, with repeats, that make the worst variance of the figures smallest, measured
    by what the usual matrix leaves in the same hours: a c-optimal design for several figures. The information of a run
    is as in the regression of :func:`.reduce` with the stated errors of the gauges.

    Parameters
    ----------
    ship : Vessel, Card, str or path
        Its coefficients are the prior mean, their errors the spread of ships for which the plan is to be good. An MMG
        ship is converted to a polynomial.
    figures : str or sequence of str
        As of :meth:`.Ship.influence`.
    hours : float, optional
        Time in the tank; by default as long as the usual matrix once.
    tank : path or TankFile, optional
        ``tank.toml``.
    carriage_length_m : float, optional
        Length of the carriage's way, m, in place of the file's.
    model_length_m : float, optional
        Length of the model, m, in place of the file's.
    usual : path, optional
        A ``campaign.toml`` whose runs are compared, in place of the usual matrix; or a tank's own matrix as a CSV table
        with columns of drift (``beta_deg``), rudder (``delta_deg``), ``v_prime`` and ``r_prime``, a row for each run.
    largest : tuple, optional
        Largest drift (deg), rudder (deg) and r'; by default as in the manoeuvres of the figures. On the command line
        ``12/35/0.6``.
    check_runs : bool
        Also plan runs that could contradict the polynomial.
    one_side : bool
        Figures to the side of the given rudder, in place of the mean over both sides, as trials are reported: a single
        side depends on Y0 and N0, which every run shows equally well.
    members : int
        Ships drawn from the errors of the card, for which the plan is to be good as well.
    seed : int
        Seed of the drawn ships.

    Raises
    ------
    InputError
        A file is at fault, a figure does not exist or is not shown by the ship, or the tank cannot make the runs.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> plan = t2s.design_campaign("mariner", figures="overshoot_1_deg@10/10", hours=2, members=0)
    >>> float(plan.runs["tank_min"].sum()) < 2 * 60
    True
    """
    from tank2sim.apps.design.captive_design import DRAWN_SHIPS, CaptiveDesignSettings
    from tank2sim.apps.design.planning import planned_campaign
    from tank2sim.apps.design.result import CampaignDesignResult
    from tank2sim.apps.design.tank_form import TankFile, read_tank, with_tank_values

    limits = tank if isinstance(tank, TankFile) else read_tank(tank) if tank is not None else TankFile()
    limits = with_tank_values(limits, "carriage", length_m=carriage_length_m)
    limits = with_tank_values(limits, "model", length_m=model_length_m)
    settings = CaptiveDesignSettings(
        hours=hours,
        check_runs=check_runs,
        one_side=one_side,
        draws=DRAWN_SHIPS if members is None else members,
        seed=seed,
        source="tank" if tank is None or isinstance(tank, TankFile) else str(tank),
    )
    study, design = planned_campaign(ship.manoeuvring(), figures, limits, settings, usual=usual, largest=largest)
    return CampaignDesignResult(study, design)
