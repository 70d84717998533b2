"""One small result of every command, made from bundled ships and data that the tests generate; of ``gap``, whose search
takes long, from made-up findings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

import tank2sim as t2s
from tank2sim.answer.result import Result
from tank2sim.api.bundled_ships import list_ships
from tank2sim.bundled import bundled
from tank2sim.gap.result import Gap
from tank2sim.results.gap import NO_TRIALS, gap_result
from tests.gap import made_up
from tests.identification.captive.made_runs import oscillation
from tests.identification.captive_mmg.tank import KVLCC2, write_campaign
from tests.yaw_truth import Truth, record, written


def _trials(folder: Path) -> Path:
    t2s.load("mariner").zigzag(20, 20).to_csv(folder / "zigzag.csv")
    return folder / "zigzag.csv"


def _yaw(folder: Path, **options: str) -> Result:
    truth = Truth(humps=1)
    return t2s.yaw(written(folder / "water.csv", truth, record(truth)), inertia_kgm2=0.0204, **options)


def _tow(**options: object) -> Result:
    return t2s.tow(bundled("models", "wilinski-zellman", "tows.csv"), **options)


def _glide_programme(folder: Path) -> Result:
    path = folder / "programme.csv"
    path.write_text("duration_s,path_angle_deg,roll_deg\n20,-30,0\n20,30,10\n", encoding="utf-8")
    options = {"programme": path, "budget_kg": 10.0, "depth_m": 100.0, "views": True}
    return t2s.load("kulikovsky-velikanov").glide([-30, -45], as_printed=True, **options)


def _convention(folder: Path) -> Result:
    rows = "length_m,175\nbeam_m,25.4\ndraught_m,8.5\nblock_coefficient,0.57\nspeed_mps,7\n"
    rows += "Yv,-0.012\nYr,-0.0052\nNv,-0.0038\nNr,-0.0024\nYd,0.0026\nNd,-0.0013\n"
    (folder / "table.csv").write_text(rows, encoding="utf-8")
    return t2s.convention(folder / "table.csv")


def _check(folder: Path) -> Result:
    return t2s.check_fmu(t2s.load("mariner").to_fmu(folder / "m.fmu", fmi=2).path)


def _tune(_: Path) -> Result:
    return t2s.load("mariner").tune("steady_radius_m@20=460", figures="criterion_C", members=2)


def _identify(folder: Path) -> Result:
    t2s.load("mariner").turn(35, duration_s=400.0).to_csv(folder / "turn.csv")
    return t2s.identify("mariner", _trials(folder), holdout=folder / "turn.csv", method="equation_error", members=3)


def _sea_trial(folder: Path) -> Result:
    for rudder in (35, -35):
        t2s.load("mariner").turn(rudder, duration_s=700.0).to_csv(folder / f"turn{rudder}.csv")
    records = sorted(folder.glob("turn*.csv"))
    return t2s.trial_office(records, ship="mariner", members=2, draught_fore_m=5.0, draught_aft_m=6.0)


def _gap(found: Callable[[], Gap]) -> Result:
    return gap_result(found(), NO_TRIALS, NO_TRIALS)


RESULTS: dict[str, Callable[[Path], Result]] = {
    "audit": lambda folder: t2s.audit(_trials(folder)),
    "autopilot": lambda _: t2s.load("mariner").autopilot(),
    "autopilot of a craft": lambda _: t2s.load("otter").autopilot(),
    "autopilot along a track": lambda _: t2s.load("mariner").autopilot(track=[[0, 0], [3000, 0], [6000, 1500]]),
    "check": _check,
    "compare": lambda _: t2s.compare(["mariner", "kvlcc2-captive"], members=2),
    "convention": _convention,
    "convert": lambda _: t2s.convert("kvlcc2-l7-mmg"),
    "convert to another scaling": lambda _: t2s.convert("mariner", scaling="dimensional"),
    "design": lambda _: t2s.design_campaign("esso-osaka", figures="steady_radius_m@20", hours=1.0, members=0),
    "design of a sea trial": lambda _: t2s.design_trial("mariner", figures="steady_radius_m@20", minutes=10.0),
    "export": lambda folder: t2s.load("mariner").to_fmu(folder / "m.fmu", fmi=2),
    "gap": lambda _: _gap(made_up.missing),
    "gap with an unnamed effect": lambda _: _gap(made_up.outside),
    "gap without an effect": lambda _: _gap(made_up.nothing),
    "glide": lambda _: t2s.load("kulikovsky-velikanov").glide([-30, -45], views=False),
    "glide of a programme": _glide_programme,
    "identify": _identify,
    "influence": lambda _: t2s.load("mariner").influence(
        ["criterion_C", "K_per_s"], joint_variation={"Yv": 1.0}, members=2
    ),
    "influence of a steering card": lambda _: t2s.steering_models("poznyakov-yudin"),
    "influence with targets": _tune,
    "influence through two points": lambda _: t2s.load("mariner").tune_through(["35@35", "1400m@3"]),
    "guess": lambda _: t2s.guess(
        length_m=160.0,
        beam_m=23.2,
        draught_m=7.5,
        block=0.6,
        speed_kn=15.0,
        turn35="advance_m=560",
        members=120,
    ),
    "log": lambda folder: t2s.log(_trials(folder)),
    "pilotcard": lambda _: t2s.load("mariner").pilot_card(),
    "poster": lambda _: t2s.load("mariner").poster(),
    "run": lambda folder: t2s.reduce_runs(oscillation(folder), type="pure_yaw"),
    "run and repeat": lambda folder: t2s.reduce_runs(
        [oscillation(folder, name) for name in ("a.csv", "b.csv")], type="pure_yaw"
    ),
    "reduce to MMG": lambda folder: t2s.reduce_to_mmg(write_campaign(folder, KVLCC2)),
    "ships": lambda _: list_ships(),
    "serve": lambda _: t2s.serve("otter", instance=7, silence_s=0.1),
    "signals": lambda folder: t2s.signals(_trials(folder)),
    "signals with a filter": lambda folder: t2s.signals(_trials(folder), "r_degps", filter="lowpass:0.1"),
    "simulate": lambda _: t2s.load("mariner").zigzag(20, 20),
    "simulate an ensemble": lambda _: t2s.load("mariner").turn(35, duration_s=60.0, members=3),
    "simulate a short run": lambda _: t2s.load("mariner").turn(35, duration_s=20.0),
    "stability": lambda _: t2s.load("esso-osaka-estimated").stability(),
    "stability of an ensemble": lambda _: t2s.load("kvlcc2-captive").stability(spirals=False, members=3),
    "stability with small probabilities": lambda _: t2s.load("mariner").stability(spirals=False, members=200),
    "steer": lambda _: t2s.load("mariner").steering_page(),
    "trials": _sea_trial,
    "tow": lambda _: _tow(),
    "tow of one term": lambda _: _tow(terms="B3", length_m=3.8, start_delay=True),
    "validate": lambda folder: t2s.validate("mariner", _trials(folder), members=3),
    "yaw": _yaw,
}
"""Name, of which the first word is the command, to a function that makes the result in a folder."""

OWN_DOCUMENTS = ("pilotcard", "poster", "steer")
"""Commands whose result is a document of its own, which is no page of tables and charts."""

SLOW = (
    *("autopilot", "autopilot along a track", "autopilot of a craft", "check", "compare", "convert", "design"),
    *("design of a sea trial", "export", "gap with an unnamed effect", "gap without an effect", "glide of a programme"),
    *("guess", "identify", "influence of a steering card", "run and repeat", "signals", "signals with a filter"),
    *("simulate an ensemble", "stability", "stability of an ensemble", "stability with small probabilities", "steer"),
    *("tow of one term", "validate", "influence with targets", "influence through two points", "gap", "run", "tow"),
    "trials",
)
"""Names whose result and page take 2 s or more."""


def marked(names: Iterable[str]) -> list[ParameterSet]:
    """Parameters of a test, those of slow results marked."""
    return [pytest.param(name, marks=[pytest.mark.slow] if name in SLOW else []) for name in names]
