"""Second half of the demo: the Mariner, linear and third order, as four FMUs that manoeuvre like the CasADi model."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import control
import numpy as np

from tank2sim.analysis.linearisation import state_space, straight_course
from tank2sim.analysis.stability.imo import ImoCriterion, imo_criteria
from tank2sim.analysis.stability.straight_line import Stability, stability
from tank2sim.answer.charts.analysis import FrequencyResponse, bode_chart, error_chart
from tank2sim.answer.charts.motion import History, Signal, TrackData, history_chart, track_chart
from tank2sim.answer.charts.picture import chart_png
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Cell, Column, Illustration, KeyFigure, Section, Table, Verdict
from tank2sim.answer.study import study_values
from tank2sim.apps.demo.fmu_helpers import DemoOutcome, Workshop, demo_output_errors, error_words, largest_error
from tank2sim.arrays import Array
from tank2sim.cards import linear_card, read_card
from tank2sim.dynamics import Model, build
from tank2sim.fmu.check import CheckReport
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.fmu.running import replay
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import Run, simulate
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.simulation.trial_file import trial_csv
from tank2sim.units import in_words

MANOEUVRES = {"turn-35": "turn:35", "zigzag-20-20": "zigzag:20/20"}
IN_WORDS = {"turn:35": "turning circle, 35 deg of rudder", "zigzag:20/20": "20/20 zigzag"}
THIRD, FIRST, IN_FMU = "third order", "linear", "third order, FMU"
_SIGNALS = {
    "rudder.angle": "rudder, + to starboard",
    "motion.psi": "heading",
    "motion.r": "yaw rate",
    "motion.u": "surge velocity",
    "motion.v": "sway velocity, + to starboard",
}


def mariner(workshop: Workshop) -> DemoOutcome:
    """Export and check four FMUs, simulate two manoeuvres on the desk and in the FMU, judge stability."""
    card = read_card("mariner")
    cards = {THIRD: card, FIRST: linear_card(card)}
    models = {name: build(card) for name, card in cards.items()}
    names = {THIRD: "mariner", FIRST: "mariner-linear"}
    checked = [workshop.checked_fmu(cards[kind], models[kind], names[kind], fmi) for kind in names for fmi in (2, 3)]
    path, reports = checked[0][0], [report for _, report in checked]
    runs, sections = {}, []
    for name, text in MANOEUVRES.items():
        workshop.begin(f"Mariner: {text}, on the desk and in the FMU")
        run = {kind: simulate(model, parse_manoeuvre(text)) for kind, model in models.items()}
        runs[name] = run
        fmu = _in_fmu(models[THIRD], path, run[THIRD])
        workshop.write(
            f"mariner-{name}.csv", trial_csv(run[THIRD].trajectory, f"tank2sim simulation of the Mariner: {text}")
        )
        sections.append(_manoeuvre_section(workshop, name, text, run, fmu))
    workshop.begin("Mariner: stability")
    judged = {kind: stability(model) for kind, model in models.items()}
    criteria = imo_criteria(models[THIRD])
    sections = [*sections, _stability_section(models, judged, criteria), _fmu_section(reports)]
    figures = _figures(reports, runs["turn-35"][THIRD], runs["zigzag-20-20"][THIRD], judged[THIRD])
    result: dict[str, object] = {
        "figures": {name: {kind: entry.figures for kind, entry in run.items()} for name, run in runs.items()},
        "stability": {kind: study_values(entry) for kind, entry in judged.items()},
        "imo": [study_values(criterion) for criterion in criteria],
        "checks": [asdict(report) for report in reports],
    }
    return DemoOutcome(figures, sections, result)


def _in_fmu(model: Model, path: Path, run: Run) -> dict[str, Array]:
    """The same orders through the FMU; communication points are the samples of the run, its switches among them."""
    motion = run.trajectory
    return replay(path, InputSequence(motion.t, motion.u[:-1]), model)


def _manoeuvre_section(workshop: Workshop, name: str, text: str, run: dict[str, Run], fmu: dict[str, Array]) -> Section:
    third, first = run[THIRD].trajectory, run[FIRST].trajectory
    motions: dict[str, Trajectory | dict[str, Array]] = {THIRD: third, IN_FMU: fmu, FIRST: first}
    tracks = track_chart(
        [
            TrackData(label, x_m=motion["motion.x"], y_m=motion["motion.y"], time_s=third.t)
            for label, motion in motions.items()
        ],
        title=f"{IN_WORDS[text]}: tracks".capitalize(),
    )
    histories = history_chart(
        [
            History(label, time_s=third.t, values={name: motion[name] for name in _SIGNALS})
            for label, motion in motions.items()
        ],
        [Signal(name, title, third.model[name].unit) for name, title in _SIGNALS.items()],
        title=f"{IN_WORDS[text]}: time histories".capitalize(),
    )
    workshop.write(f"mariner-{name}-track.png", chart_png(tracks))
    workshop.write(f"mariner-{name}-history.png", chart_png(histories))
    apart = np.hypot(fmu["motion.x"] - third["motion.x"], fmu["motion.y"] - third["motion.y"])
    return Section(
        f"Mariner: {IN_WORDS[text]}",
        text=f"The FMU, given the same orders by FMPy, stays within {apart.max():.1e} m of the model.",
        tables=[_figure_table(run)],
        charts=[
            Illustration(tracks, caption="North is up. The FMU's track lies on the track of its model.", half=True),
            Illustration(histories, caption="Rudder and yaw rate are positive to starboard.", half=True),
        ],
        notes=[notice.of(str(kind)) for kind, result in run.items() for notice in result.notices],
    )


def _figure_table(run: dict[str, Run]) -> Table:
    rows: list[list[Cell]] = []
    for name, value in run[THIRD].figures.items():
        words, unit = in_words(name)
        both = [result.figures[name] for result in run.values()]
        if isinstance(value, list):
            lists = [each if isinstance(each, list) else [] for each in both]
            for k in range(max(len(each) for each in lists)):
                rows.append([f"{words}, {k + 1}", *(each[k] if k < len(each) else None for each in lists), unit])
        else:
            rows.append([words, *(_cell(each) for each in both), unit])
    columns = [Column("figure"), *(Column(kind) for kind in run), Column("unit")]
    return Table(caption="Manoeuvring figures", columns=columns, rows=rows)


def _fmu_section(reports: list[CheckReport]) -> Section:
    rows: list[list[Cell]] = [
        [
            report.path.rpartition("/")[2],
            f"FMI {report.fmi}",
            kind,
            max(errors.values()),
            report.limits[kind],
            Verdict.PASSED if report.passed else Verdict.FAILED,
        ]
        for report in reports
        for kind, errors in report.errors.items()
    ]
    heads = ("file", "standard", "kind", "largest error", "limit", "verdict")
    table = Table(
        caption="Largest error of any output, relative to its range in the run",
        columns=[Column(head, digits=2) for head in heads],
        rows=rows,
    )
    return Section(
        "Four FMUs of the Mariner, checked",
        text=(
            "Each file was validated by FMPy and driven through steps of rudder and a failure of the steering gear. "
            "Co-Simulation is held against the same Runge-Kutta steps in CasADi, "
            "Model Exchange against the exact solution."
        ),
        folded=True,
        tables=[table],
        charts=[
            Illustration(error_chart(demo_output_errors(reports[:2]), title="Errors of the third-order FMUs by output"))
        ],
    )


def _stability_section(
    models: dict[str, Model], judged: dict[str, Stability], criteria: tuple[ImoCriterion, ...]
) -> Section:
    point = straight_course(models[THIRD])
    channel = {"inputs": ["rudder.command"], "outputs": ["motion.r"]}
    system = state_space(models[THIRD], point, states=["motion.v", "motion.r", "rudder.angle"], **channel)
    omega = np.logspace(-4, 0.5, 400)
    response = control.frequency_response(system, omega)
    nomoto = judged[THIRD].nomoto.dimensional
    first_order = nomoto.K_per_s / (1 + 1j * omega * nomoto.T_s)
    chart = bode_chart(
        [
            FrequencyResponse("linearised, with gear", omega_radps=omega, response=response.frdata[0, 0]),
            FrequencyResponse("Nomoto, first order", omega_radps=omega, response=first_order),
        ],
        title="Yaw rate by rudder order",
    )
    verdicts = {True: Verdict.PASSED, False: Verdict.FAILED, None: Verdict.NONE}
    rows = [
        [criterion.name, criterion.found, criterion.allowed, criterion.unit, verdicts[criterion.passed]]
        for criterion in criteria
    ]
    imo = Table(
        caption="IMO MSC.137(76), the worse of the two sides",
        columns=[Column(head) for head in ("criterion", "found", "allowed", "unit", "verdict")],
        rows=rows,
    )
    return Section(
        "Mariner: stability",
        text=f"C′ = {format_number(judged[THIRD].stability_criterion.C_prime, 3)}: {_verdict(judged[THIRD])} on a "
        "straight course.",
        tables=[_nomoto_table(judged), imo],
        charts=[Illustration(chart)],
    )


def _verdict(judged: Stability) -> str:
    return "stable" if judged.stability_criterion.stable else "unstable"


def _nomoto_table(judged: dict[str, Stability]) -> Table:
    times = [Column(name, "s") for name in ("T", "T1", "T2", "T3")]
    columns = [Column("model"), Column("K", "1/s"), *times]
    rows = [[kind, *vars(result.nomoto.dimensional).values()] for kind, result in judged.items()]
    return Table(caption="Nomoto's coefficients at the speed of expansion", columns=columns, rows=rows)


def _figures(reports: list[CheckReport], turn: Run, zigzag: Run, judged: Stability) -> list[KeyFigure]:
    overshoots = zigzag.figures["overshoots_deg"]
    assert isinstance(overshoots, list)
    same, exact = (largest_error(reports, kind) for kind in ("CoSimulation", "ModelExchange"))
    return [
        KeyFigure(
            "Mariner's FMUs, Co-Simulation",
            error_words(same),
            verdict=Verdict.PASSED,
            note="largest difference from the model, relative",
        ),
        KeyFigure(
            "Mariner's FMUs, Model Exchange",
            error_words(exact),
            verdict=Verdict.PASSED,
            note="largest difference from the exact solution, relative",
        ),
        KeyFigure("Tactical diameter, 35 deg", _number(turn.figures["tactical_diameter_m"]), "m"),
        KeyFigure("First overshoot, 20/20", overshoots[0], "deg"),
        KeyFigure(
            "Straight-line stability",
            _verdict(judged),
            verdict=Verdict.PASSED if judged.stability_criterion.stable else Verdict.CAUTION,
            note=f"C′ = {format_number(judged.stability_criterion.C_prime, 3)}",
        ),
    ]


def _cell(figure: object) -> Cell:
    return figure if isinstance(figure, float | str) else None


def _number(figure: object) -> float:
    assert isinstance(figure, float)
    return figure
