"""Longer integration steps for the many members of a large ensemble of turns."""

from __future__ import annotations

import numpy as np

from tank2sim.analysis.ensemble.questions import OfManoeuvre, lanes_of, ships_of
from tank2sim.arrays import Array
from tank2sim.dynamics.card_parameters import study_model
from tank2sim.simulation.ensemble import Draws
from tank2sim.simulation.lane_figures import LaneFigures, runs_in_lanes
from tank2sim.simulation.manoeuvres import Turn

STEP_FACTORS = (3, 2)
"""Lengths of steps over the model's that are tried, the longest first. The figures of KVLCC2 are within 1e-5 with up to
5 times its step and wrong by 1e-3 from 6 on: the longest stays at half of that (project choice)."""

STEP_TOLERANCE = 1e-5
"""Largest relative change of a figure by a longer step: at most a unit of its fifth digit, and the sampling error of a
5 % quantile (2.1 standard deviations over the root of the number of members) among a million ships with a standard
deviation of 0.5 % (project choice)."""

TRIED_MEMBERS = 16
"""Members, the first, that are run with both steps: two registers of the widest lanes (project choice)."""


def largest_step_factor(question: OfManoeuvre, draws: Draws) -> int:
    """The longest integration step of turns, over the model's, with which figures are the same.

    The first :data:`TRIED_MEMBERS` members of the ensemble are run with the model's step and with each of
    :data:`STEP_FACTORS`. A step is taken if each of their figures agrees within :data:`STEP_TOLERANCE` or is none with
    both steps, and if fewer than half of them are doubtful, which are run twice. The result depends on the card, the
    manoeuvre and the seed alone. It is 1 for other manoeuvres and for ships without lanes.

    Parameters
    ----------
    question : OfManoeuvre
        The manoeuvre.
    draws : Draws
        Of the members.
    """
    manoeuvre = question.manoeuvre
    if not isinstance(manoeuvre, Turn) or not runs_in_lanes(manoeuvre):
        return 1
    model = study_model(question.ship.card())
    lanes = lanes_of(model)
    if lanes is None:
        return 1
    members = [draws.member(number) for number in range(TRIED_MEMBERS)]
    values = {name: np.array([member[name] for member in members]) for name in draws.names}
    p, troubles = ships_of(model, TRIED_MEMBERS, values)
    p = p[[not trouble for trouble in troubles]]
    if not len(p):
        return 1
    usual = lanes.run(manoeuvre, p, question.duration_s)
    for factor in STEP_FACTORS:
        longer = lanes.run(manoeuvre, p, question.duration_s, step_factor=factor)
        if 2 * int(longer.doubtful.sum()) < len(p) and same_figures(usual, longer):
            return factor
    return 1


def same_figures(usual: LaneFigures, longer: LaneFigures) -> bool:
    """Whether all figures agree within :data:`STEP_TOLERANCE`, and are none for the same ships."""

    def agree(name: str, values: Array) -> bool:
        return np.allclose(longer.figures[name], values, rtol=STEP_TOLERANCE, atol=0.0, equal_nan=True)

    return set(usual.figures) == set(longer.figures) and all(agree(name, usual.figures[name]) for name in usual.figures)
