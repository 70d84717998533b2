"""Choice between output error and the Kalman filter by the residuals of output error.

Output error takes the model's motion as exact: what it leaves is noise of the sensors. Gusts and waves push the ship
off that motion, and leave residuals far above the noise that hang together over many samples; output error would take
them for coefficients, and the filter-error method is the right one (Maine and Iliff 1981, SIAM J. Appl. Math. 41; Klein
and Morelli 2006, Aircraft System Identification, chapter 6; Jategaonkar 2015, Flight Vehicle System Identification,
chapter 5). Errors of the model leave such residuals as well. What distinguishes the two is where the trials are from:
a basin has no weather.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tank2sim.identification.trials.assessment.evaluation import replay_error
from tank2sim.identification.trials.methods.coloured_noise import ColouredNoise
from tank2sim.identification.trials.problem.estimation_problem import Estimate, Problem
from tank2sim.identification.trials.problem.measured_motion import sensor_noise
from tank2sim.records.signals.columns import SignalName
from tank2sim.simulation.motion_record import OBSERVED_SIGNALS

ABOVE_NOISE = 2.0
"""Residuals of whole runs of this many times the sensor's white noise are not that noise (project choice: on made-up
voyages those of the heading are 1.1 times without wind or drift of the sensors, 1.9 times with their drift, 2.3 to 8
times in wind; the filter nests output error, so that it is the smaller mistake)."""

MANY_SAMPLES = 3.0
"""Samples over which residuals of pieces hang together, if they are not white (project choice)."""

_SIGNALS = {variable: signal for signal, variable in OBSERVED_SIGNALS.items()}


@dataclass(frozen=True)
class MethodChoice:
    """A chosen method: ``output_error`` or ``kalman``, and why, in a sentence."""

    method: str
    reason: str


@dataclass(frozen=True)
class SignalResidual:
    """Residuals of output error in one signal.

    Parameters
    ----------
    name : str
        Variable of the model.
    above_noise : float
        Root mean square over whole runs, over the standard deviation of the sensor's white noise.
    samples : float
        Samples after which the autocorrelation in pieces of the runs has fallen to 1/e; 0 for white residuals.
    """

    name: str
    above_noise: float
    samples: float

    @property
    def of_process(self) -> bool:
        """Whether they are above the sensor's noise and hang together."""
        return self.above_noise > ABOVE_NOISE and self.samples > MANY_SAMPLES


def signal_residuals(problem: Problem, estimate: Estimate) -> tuple[SignalResidual, ...]:
    """Residuals of output error in each seen signal, of runs simulated from their first state.

    Parameters
    ----------
    problem : Problem
    estimate : Estimate
        By output error, with its `motion`.
    """
    assert estimate.motion is not None
    white = np.sqrt(np.mean([sensor_noise(problem, run) ** 2 for run in problem.runs], axis=0))
    runs = replay_error(problem, estimate.values, estimate.noise)
    found = []
    for name, sensor, noise in zip(problem.seen, white, estimate.motion.noise, strict=True):
        errors = [run.whole[name] for run in runs if name in run.whole]
        error = float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0
        above = error / sensor if sensor > 0 else (np.inf if error else 0.0)
        found.append(SignalResidual(name, float(above), correlated_samples(noise)))
    return tuple(found)


def correlated_samples(noise: ColouredNoise) -> float:
    """Samples after which the autocorrelation of a coloured residual has fallen to 1/e of that at a lag of one."""
    return float(-1 / np.log(noise.phi)) if noise.phi > 0 else 0.0


def choose_method(residuals: Sequence[SignalResidual]) -> MethodChoice:
    """The Kalman filter where residuals of output error at sea are of the process, else output error.

    Examples
    --------
    >>> choose_method([SignalResidual("motion.r", 1.1, 40.0), SignalResidual("motion.psi", 6.0, 40.0)]).method
    'kalman'
    >>> choose_method([SignalResidual("motion.psi", 6.0, 0.0)]).method
    'output_error'
    """
    process = [residual for residual in residuals if residual.of_process]
    if not process:
        return MethodChoice("output_error", "its residuals are the noise of the sensors")
    worst = max(process, key=lambda residual: residual.above_noise)
    size, name = f"{worst.above_noise:.2g}", SignalName(_SIGNALS[worst.name]).words
    return MethodChoice(
        "kalman",
        f"what output error leaves in the {name} is {size} times the sensor's noise and hangs together over "
        f"{worst.samples:.0f} samples, as gusts and waves leave it",
    )
