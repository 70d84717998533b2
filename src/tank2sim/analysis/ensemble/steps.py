"""Longer integration steps and single precision for the many members of a large ensemble."""

from __future__ import annotations

import numpy as np

from tank2sim.analysis.ensemble.questions import OfManoeuvre, lanes_of, ships_of
from tank2sim.arrays import Array
from tank2sim.dynamics.card_parameters import study_model
from tank2sim.simulation.ensemble import Draws
from tank2sim.simulation.lane_figures import USUAL_PACE, LaneFigures, Pace, runs_in_lanes
from tank2sim.simulation.manoeuvres import SpiralManoeuvre, Zigzag

STEP_FACTORS = (6, 4, 3, 2)
"""Lengths of steps of turns and stops over the model's that are tried, the longest first (project choice)."""

STEP_TOLERANCE = 1e-5
"""Largest relative change of a figure by another pace: at most a unit of its fifth digit, and the sampling error of a
5 % quantile (2.1 standard deviations over the root of the number of members) among a million ships with a standard
deviation of 0.5 % (project choice)."""

EDGE_TOLERANCE = 1e-4
"""The same for a step that is longer by one step of the model: beyond the stable steps of the steering gear figures
change by 1e-3 and more, and a step next to that edge is not taken (project choice)."""

TRIED_MEMBERS = 64
"""Members, the first, that are run at each pace: eight registers of the widest lanes (project choice)."""


def fastest_pace(question: OfManoeuvre, draws: Draws) -> Pace:
    """The fastest pace with which figures of a turn, zigzag or stop are the same.

    The first :data:`TRIED_MEMBERS` members of the ensemble are run with the model's step in double precision, and at
    other paces: in single precision with each of :data:`STEP_FACTORS`, longest first, and with the model's step, then
    in double precision with each of them; zigzags, whose overshoots need it, keep the model's step. A pace is taken if
    each of their figures agrees within :data:`STEP_TOLERANCE` or is none at both, if fewer than half of them are
    doubtful, which are run twice, and if with the next longer step figures still agree within :data:`EDGE_TOLERANCE`.
    The result depends on the card, the manoeuvre and the seed alone. It is the usual pace for other manoeuvres and for
    ships without lanes.

    Parameters
    ----------
    question : OfManoeuvre
        The manoeuvre.
    draws : Draws
        Draws of the members.
    """
    manoeuvre = question.manoeuvre
    if isinstance(manoeuvre, SpiralManoeuvre) or not runs_in_lanes(manoeuvre, question.duration_s):
        return USUAL_PACE
    model = study_model(question.ship.card())
    lanes = lanes_of(model)
    if lanes is None:
        return USUAL_PACE
    p, troubles = ships_of(
        model, TRIED_MEMBERS, dict(zip(draws.names, draws.members(0, TRIED_MEMBERS).values.T, strict=True))
    )
    p = p[[not trouble for trouble in troubles]]
    usual = lanes.run(manoeuvre, p, question.duration_s)
    if 2 * int(usual.doubtful.sum()) >= len(p):
        return USUAL_PACE

    def same(pace: Pace, tolerance: float) -> bool:
        runs = lanes.run(manoeuvre, p, question.duration_s, pace=pace)
        return 2 * int(runs.doubtful.sum()) < len(p) and same_figures(usual, runs, tolerance)

    factors = () if isinstance(manoeuvre, Zigzag) else STEP_FACTORS
    for pace in (*(Pace(factor, single=True) for factor in (*factors, 1)), *map(Pace, factors)):
        edge = Pace(pace.step_factor + 1, pace.single)
        if same(pace, STEP_TOLERANCE) and (pace.step_factor == 1 or same(edge, EDGE_TOLERANCE)):
            return pace
    return USUAL_PACE


def same_figures(usual: LaneFigures, others: LaneFigures, tolerance: float) -> bool:
    """Whether all figures agree within `tolerance` of themselves, and are none for the same ships."""

    def agree(name: str, values: Array) -> bool:
        return np.allclose(others.figures[name], values, rtol=tolerance, atol=0.0, equal_nan=True)

    return set(usual.figures) == set(others.figures) and all(agree(name, usual.figures[name]) for name in usual.figures)
