"""Charts of a simulated manoeuvre: track, heading, yaw rates or spiral with its figures, and the time histories."""

from __future__ import annotations

import numpy as np

from tank2sim.analysis.ensemble.results import ManoeuvreBands
from tank2sim.analysis.manoeuvre import ManoeuvreStudy
from tank2sim.answer.charts.columns import varying_histories
from tank2sim.answer.charts.manoeuvre import (
    Motion,
    along_course,
    motion_of,
    pull_out_chart,
    stop_dimensions,
    stop_speed_chart,
    turn_chart,
    way_chart,
    zigzag_chart,
)
from tank2sim.answer.charts.motion import SpiralData, spiral_chart
from tank2sim.answer.numbers import format_number
from tank2sim.answer.parts import Illustration
from tank2sim.arrays import Array
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.figures import zero_rate_rudders

SIDE_NAMES = {1: "starboard", -1: "port"}


def manoeuvre_title(study: ManoeuvreStudy) -> str:
    """Return the manoeuvre in words: ``turning circle, 35° of rudder to starboard``.

    Parameters
    ----------
    study : ManoeuvreStudy
    """
    argument = study.argument
    side, size = SIDE_NAMES[-1 if argument.startswith("-") else 1], argument.lstrip("+-")
    titles = {
        "turn": f"turning circle, {size}° of rudder to {side}",
        "zigzag": f"zigzag {size}, first to {side}",
        "pullout": f"pull-out from {size}° of rudder",
        "spiral": "direct spiral",
        "difference": f"turning circle to {side}, {size} rpm between the sides",
        "spin": f"turn on the spot to {side}, {size} rpm",
        "straight": f"straight course from rest, {argument} rpm",
        "stop": f"stop with {argument} rpm" if argument else "full astern stop",
    }
    return titles.get(study.kind, study.manoeuvre)


def members_text(ensemble: ManoeuvreBands) -> str:
    """Return the members in words: how many ships, and with which errors.

    Parameters
    ----------
    ensemble : ManoeuvreBands
    """
    errors = "assumed errors" if ensemble.assumed_errors else "the errors of the card"
    return f"{ensemble.usable} ships within {errors}"


def manoeuvre_charts(study: ManoeuvreStudy) -> list[Illustration]:
    """Return the charts special to the manoeuvre, empty without a position or a yaw rate.

    Parameters
    ----------
    study : ManoeuvreStudy
    """
    try:
        motion = motion_of(study.histories, study.length_m, study.beam_m)
    except KeyError:  # a craft or a file without a position or a yaw rate
        return []
    figures = single_figures(study.figures)
    title = manoeuvre_title(study)
    title = title[:1].upper() + title[1:]
    bands, shaded = {}, ""
    if study.ensemble:
        title += ", standard errors assumed" * study.ensemble.assumed_errors
        bands = study.ensemble.figures
        shaded = f"Shaded: nine of ten of {members_text(study.ensemble)}. Bars: nine of ten of each figure."
    match study.kind:
        case "turn" | "difference":
            chart = turn_chart(motion, figures, bands=bands, edges_m=_track_edges(study), title=title)
            return [Illustration(chart=chart, caption=shaded)]
        case "zigzag":
            heading = float(study.argument.partition("/")[2])
            overshoots = {name: value for name, value in study.figures.items() if isinstance(value, list)}
            edges = _heading_edges(study)
            chart = zigzag_chart(motion, overshoots, heading, bands=bands, edges_deg=edges, title=title)
            return [Illustration(chart=chart, caption=f"Red: the overshoots. {shaded}".strip())]
        case "pullout":
            return [_pull_out(study, motion, title)]
        case "spiral":
            return [_spiral(study, title)]
        case "stop":
            revolutions, held = motion.revolutions_rpm, ""
            if revolutions is not None and np.ptp(revolutions) == 0:
                held = f"Revolutions: {format_number(float(revolutions[-1]), 4)} rpm from the order on."
            way = way_chart(motion, stop_dimensions(motion, figures), title="Track of the stop")
            return [
                Illustration(chart=stop_speed_chart(motion, title="Speed over distance"), caption=held),
                Illustration(chart=way, caption=shaded),
            ]
    return [Illustration(chart=way_chart(motion, [], title="Track"), caption=shaded)]


def history_charts(study: ManoeuvreStudy) -> list[Illustration]:
    """Return the chart of the signals that change over time, with the bands of an ensemble; empty without any.

    Parameters
    ----------
    study : ManoeuvreStudy
    """
    bands = study.ensemble.histories if study.ensemble else {}
    drawn = varying_histories(study.histories, bands, study.ensemble.t_s if study.ensemble else np.zeros(0))
    return [drawn] if drawn else []


def _pull_out(study: ManoeuvreStudy, motion: Motion, title: str) -> Illustration:
    neutral = study.figures["neutral_rudder_deg"]
    assert isinstance(neutral, float)
    sides = {1 if motion.rudder_deg[1] > neutral else -1: motion}
    if study.other_side:
        sides[-next(iter(sides))] = motion_of(study.other_side.histories)
    named = {f"from a turn to {SIDE_NAMES[side]}": sides[side] for side in sorted(sides, reverse=True)}
    return Illustration(chart=pull_out_chart(named, neutral, title=title))


def _spiral(study: ManoeuvreStudy, title: str) -> Illustration:
    figures = study.figures
    rudder, rate = (np.radians(np.asarray(figures[name], dtype=float)) for name in ("rudder_deg", "rate_degps"))
    spiral = SpiralData(label="spiral", rudder_rad=rudder, yaw_rate_radps=rate)
    loop = zero_rate_rudders(rudder, rate) if figures.get("loop_width_deg") else None
    return Illustration(chart=spiral_chart([spiral], loop_rad=loop, title=title))


def _track_edges(study: ManoeuvreStudy) -> tuple[Array, Array] | None:
    track = study.ensemble.track if study.ensemble else None
    if track is None:
        return None
    return along_course(study.histories, track.low_m), along_course(study.histories, track.high_m)


def _heading_edges(study: ManoeuvreStudy) -> tuple[Array, Array, Array] | None:
    heading = study.ensemble.histories.get("psi_deg") if study.ensemble else None
    if study.ensemble is None or heading is None:
        return None
    course = study.histories["psi_deg"][0]
    return study.ensemble.t_s, heading.p5 - course, heading.p95 - course
