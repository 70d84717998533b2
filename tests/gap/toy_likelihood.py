"""The likelihood of the linear toy, with known noise."""

from __future__ import annotations

import numpy as np

from tank2sim.gap.inference.fit import Belief, NuisanceParameters
from tank2sim.gap.inference.form_error import Forms
from tank2sim.gap.inference.kalman_filter import NoiseLevels
from tank2sim.gap.inference.likelihood import Likelihood
from tests.gap.toy import WHITE, Toy, toy_motion

NOISE = NoiseLevels(WHITE, 0.5 * WHITE, np.full(6, 4.0), np.array([0.02, 0.02, 0.01]), np.full(3, 2.0))


WIDTH = 0.8


LOGS = np.append(NOISE.logs, np.log(WIDTH))


def judge(motion=None, *, names=("0", "1"), errors=(0.5, 0.3), spread=0.5, mixing=None) -> Likelihood:
    beliefs = Belief(LOGS + 0.1, np.full(len(LOGS), spread))
    mixing = np.diag(errors[: len(names)]) if mixing is None else mixing
    return Likelihood(motion or toy_motion(), Toy(), NuisanceParameters(names, mixing, len(mixing.T)), beliefs)


def forms_of(of: Likelihood, toy: Toy, theta) -> np.ndarray:
    """By how much the effects may differ from their formula at some parameters."""
    return Forms(of.motion, of.motion.block_inputs[..., 0]).columns(of.added(toy, theta)[0], directed=toy.directed)
