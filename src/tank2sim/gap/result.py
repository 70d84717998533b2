"""Results of the gap workflow: the values that the JSON, the screen and the page show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from tank2sim.arrays import Array, Number, Unbounded
from tank2sim.cards.card import SteeredCard
from tank2sim.gap.inference.wave_band import WaveBand
from tank2sim.identification.trials.assessment.evaluation import FigureComparison
from tank2sim.identification.trials.problem.prepare_trials import RecordDoubt
from tank2sim.notices import Notice

MISSING = "missing effect"
NO_EFFECT_MISSING = "no missing effect"
AMBIGUOUS = "ambiguous"
COEFFICIENTS = "the coefficients explain it"
OUTSIDE_LIBRARY = "outside the library"
GAP_VERDICTS = (MISSING, NO_EFFECT_MISSING, COEFFICIENTS, AMBIGUOUS, OUTSIDE_LIBRARY)


@dataclass(frozen=True)
class Surroundings:
    """Wind or current of one trial.

    Parameters
    ----------
    speed_mps, direction_rad : float
        Direction as the effect counts it: from which a wind comes, towards which a current sets; -pi to pi.
    speed_error_mps, direction_error_rad : float
        Standard errors; pi where the direction is not determined.
    """

    speed_mps: float
    direction_rad: float
    speed_error_mps: float
    direction_error_rad: float

    @classmethod
    def of_parts(cls, parts: Array, errors: Array) -> Surroundings:
        """From the parts along north and east (2,), m/s, and their standard errors, taken as independent."""
        speed = float(np.hypot(*parts))
        if speed == 0.0:
            return cls(0.0, 0.0, float(np.max(errors)), math.pi)
        along, across = parts / speed, np.array([-parts[1], parts[0]]) / speed
        return cls(
            speed,
            float(np.arctan2(parts[1], parts[0])),
            float(np.hypot(*(along * errors))),
            min(float(np.hypot(*(across * errors))) / speed, math.pi),
        )


@dataclass(frozen=True)
class Named:
    """An effect that was named.

    Parameters
    ----------
    name : str
        Key of :data:`tank2sim.dynamics.effects.EFFECTS`.
    parameters : mapping
        Estimates by the names of the effect's parameters (SI).
    standard_errors : mapping
        Standard errors of the estimated values, SI.
    confidence : float
        Calibrated probability that this effect is present.
    by_trial : mapping
        Name of a trial to its wind or current, where that differs from trial to trial; it is none of `parameters` then.
    """

    name: str
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    confidence: float
    by_trial: Mapping[str, Surroundings] = field(default_factory=dict)


@dataclass(frozen=True)
class Refitted:
    """A coefficient of the card that was fitted together with the effects.

    Parameters
    ----------
    name : str
        Derivative (``Yv``), or ``effect.parameter``.
    value, standard_error : float
        Prime, or SI for a parameter of an effect; rudder positive to starboard.
    before, standard_error_before : float
        Value and standard error of the given card.
    """

    name: str
    value: Number
    standard_error: Number
    before: Number
    standard_error_before: Number

    @property
    def moved(self) -> float:
        """Change in standard errors of the given card."""
        return abs(self.value - self.before) / self.standard_error_before


@dataclass(frozen=True)
class Rival:
    """One of the compared explanations.

    Parameters
    ----------
    effects : tuple of str
        Empty for "none".
    loss : float
        Score (-2 log likelihood, penalised) above the best explanation's; 0 for the best.
    probability : float
        Posterior of just these effects; 0 where one of them is within three standard errors of its absence.
    """

    effects: tuple[str, ...]
    loss: Unbounded
    probability: Number


@dataclass(frozen=True)
class MisfitPlace:
    """Location of a part of the misfit.

    Parameters
    ----------
    trial, signal : str
        Trial's name and variable of the model (``motion.x``); in the study of a gap its file and column.
    t_start_s, t_end_s : float
        When, in the trial's own time, s.
    share_of_misfit : float
        Of the whole (sum of squares of simulated less measured, in noise units, beyond the noise; of positions
        and headings that of its growth).
    """

    trial: str
    signal: str
    t_start_s: float
    t_end_s: float
    share_of_misfit: Number


@dataclass(frozen=True)
class Acting:
    """An interval in which the model itself is wrong, and not only the integral of earlier errors.

    Parameters
    ----------
    trial : str
    equation : str
        ``surge``, ``sway``, ``yaw`` (a force is missing), ``track`` (positions do not follow from the velocities) or
        ``heading`` (it does not follow from the yaw rate).
    t_start_s, t_end_s : float
        In the trial's own time, s.
    size : float
        Root mean square of the missing quantity, in its standard errors.
    force : float, optional
        Root mean square of a force, N, or of a moment, N m; None of ``track`` and ``heading``.
    """

    trial: str
    equation: str
    t_start_s: float
    t_end_s: float
    size: float
    force: float | None = None


@dataclass(frozen=True, eq=False)
class Passed:
    """One trial as measured and as simulated, free running with the recorded inputs, before and after.

    Parameters
    ----------
    name : str
        Name of the trial.
    held_out : bool
        It was not used for naming the effect.
    time_s : array (n,)
        In the trial's own time.
    noise : mapping
        Variable (``motion.u``, ``motion.psi``, ...) to the standard deviation of its measurement, SI.
    measured, before, after : mapping
        Variable to the measurements (nan where nothing was measured), the simulation by the given card's model, and
        that by the improved one's; (n,) each, SI, rad. `after` is `before` where no effect was added; a simulation out
        of bounds is nan from there. Sensor faults that were found are in `after` as the sensor would show them.
    black_box : mapping
        The simulation by a linear model with as many coefficients as the effect has parameters; may be empty.
    """

    name: str
    held_out: bool
    time_s: Array
    noise: Mapping[str, float]
    measured: Mapping[str, Array]
    before: Mapping[str, Array]
    after: Mapping[str, Array]
    black_box: Mapping[str, Array] = field(default_factory=dict)

    @property
    def seen(self) -> tuple[str, ...]:
        """The variables of which at least one reading was measured."""
        return tuple(name for name in self.noise if np.isfinite(self.measured[name]).any())

    def misfit(self, version: str, variable: str | None = None) -> float:
        """Root mean square of (simulated - measured)/noise of one variable, or of all: 1 is noise.

        `version` is ``before``, ``after`` or ``black_box``; inf where the simulation exceeded all bounds.
        """
        simulated: Mapping[str, Array] = getattr(self, version)
        names = list(self.noise) if variable is None else [variable]
        squares = [
            ((simulated[name] - self.measured[name]) / self.noise[name])[np.isfinite(self.measured[name])] ** 2
            for name in names
        ]
        mean = float(np.mean(np.concatenate(squares)))
        return float(np.sqrt(mean)) if np.isfinite(mean) else np.inf


@dataclass(frozen=True, eq=False)
class MissingForce:
    """The force that the given card lacks: the smoother's, with which it follows the measurements.

    Parameters
    ----------
    equation : str
        ``X`` (N), ``Y`` (N) or ``N`` (N m): the equation that lacks most, in units of its standard error.
    trials : tuple of str
        Name of the trial of each row.
    time_s, force : array (n,)
        Rows of all trials together.
    states : mapping
        ``rudder``, ``drift``, ``yaw rate``, ``speed``, ``heading`` to values (n,), SI, rad.
    explaining : str
        The one of `states` that explains most of the force.
    explained : mapping
        Each of `states` to the share of the force's variance that its bins explain.
    passages : tuple of Acting
        Intervals in which the forces of the three equations act, the most significant first.
    """

    equation: str
    trials: tuple[str, ...]
    time_s: Array
    force: Array
    states: Mapping[str, Array]
    explaining: str
    explained: Mapping[str, float]
    passages: tuple[Acting, ...] = ()


@dataclass(frozen=True, eq=False)
class MissingSignal:
    """Difference by which records contradict each other, independent of the hull: the part of a sensor or of the water.

    Parameters
    ----------
    quantity : str
        ``north``, ``east``, ``ahead``, ``starboard`` (velocity over the ground less the log's, m/s) or
        ``turning`` (rate of the heading less the yaw rate, rad/s).
    trials : tuple of str
        Name of the trial of each row.
    time_s, values, errors : array (n,)
        Rows of all trials together: s, and the difference with its standard error.
    states, explaining, explained
        As in :class:`MissingForce`; shares are of the mean square.
    """

    quantity: str
    trials: tuple[str, ...]
    time_s: Array
    values: Array
    errors: Array
    states: Mapping[str, Array]
    explaining: str
    explained: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class NextTest:
    """The manoeuvre that would decide.

    Parameters
    ----------
    manoeuvre : str
        As `simulate --manoeuvre` takes it, or ``file:next_test.csv``.
    orders : str
        CSV text ``t_s,delta_order_deg,n_rpm`` that `simulate --manoeuvre file:` runs.
    heading_rad : float
        Heading on which it begins, rad from north, which orders cannot state.
    needs_instants : bool
        True where it would decide with the instants of the orders known, and not as the order was recorded: the order
        is to be recorded ten times as often, or the rudder's angle.
    why : str
        A sentence: the explanations that it would distinguish, and how clearly (expected gain of the score).
    expected : mapping
        Each manoeuvre that was compared to the score by which it would distinguish the explanations, for known instants
        of the orders where it needs them.
    sizes : mapping
        Each effect of the explanations that are to be distinguished to (parameters, standard errors), SI, as the first
        explanation that has it estimates it.
    """

    manoeuvre: str
    orders: str
    heading_rad: float
    needs_instants: bool
    why: str
    expected: Mapping[str, float]
    sizes: Mapping[str, tuple[Mapping[str, float], Mapping[str, float]]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Gap:
    """All results of the workflow.

    Parameters
    ----------
    card : SteeredCard
        As given.
    improved : SteeredCard
        With the effect, and with the coefficients fitted together with it where the trials are then followed better;
        the given card where no effect of the ship was named (nothing, or a sensor's fault) and none was refitted.
    base : SteeredCard
        The card with the refitted coefficients and their covariance, before the effects were added; the given card
        where none was refitted.
    verdict : str
        One of :data:`GAP_VERDICTS`.
    effects : tuple of Named
    coefficients : tuple of Refitted
        Coefficients fitted together with the effects; empty where the given ones were kept.
    effect_alone : mapping
        ``fit`` and ``holdout`` to the misfit with the effects alone, noise units; empty where the given coefficients
        were kept.
    alternatives : tuple of tuples of str
        Explanations that these data cannot distinguish from the named one, or from the coefficients where these explain
        the gap.
    rivals : tuple of Rival
        Best first; "none" is among them.
    where : tuple of MisfitPlace
        Largest first.
    equation : str
        Equation of the gap: surge, sway, yaw, actuator, kinematics or sensor.
    noise : mapping
        Variable to (standard deviation, ``stated`` or ``estimated``), SI; with the motion in waves, if any.
    waves : WaveBand or None
        Accelerations by waves that were found in the fitted trials.
    passed : tuple of Passed
        Results of all trials.
    figures_before, figures_after : tuple of FigureComparison
        Figures of turns and zigzags.
    missing_force : MissingForce or None
    at_work : tuple of Acting
        Intervals in which the forces of the named effects act, the most significant first.
    could_hide : mapping
        Effect to {parameter: size (SI)} below which these data could not show it.
    agreement : mapping
        Effect parameter's model name to {trial: (value, standard error)}: its estimate by each trial alone.
    next_test : NextTest or None
    notices : tuple of Notice
    doubts : tuple of RecordDoubt
        Findings of the audit on fitted trials that were left as they are.
    objections : tuple of str
        Reasons for which the improved card should not replace the given one (:func:`.improvement_objections`).
    """

    card: SteeredCard
    improved: SteeredCard
    base: SteeredCard
    verdict: str
    effects: tuple[Named, ...]
    coefficients: tuple[Refitted, ...]
    effect_alone: Mapping[str, float]
    alternatives: tuple[tuple[str, ...], ...]
    rivals: tuple[Rival, ...]
    where: tuple[MisfitPlace, ...]
    equation: str
    noise: Mapping[str, tuple[float, str]]
    waves: WaveBand | None
    passed: tuple[Passed, ...]
    figures_before: tuple[FigureComparison, ...]
    figures_after: tuple[FigureComparison, ...]
    missing_force: MissingForce | None
    at_work: tuple[Acting, ...]
    could_hide: Mapping[str, Mapping[str, float]]
    agreement: Mapping[str, Mapping[str, tuple[float, float]]]
    next_test: NextTest | None
    notices: tuple[Notice, ...] = ()
    doubts: tuple[RecordDoubt, ...] = ()
    objections: tuple[str, ...] = ()

    def misfit(self, version: str, *, held_out: bool) -> float | None:
        """Root mean square over all fitting (or held-out) trials of (simulated - measured)/noise; None without any.

        `version` is ``before``, ``after`` or ``black_box``.
        """
        trials = [replay for replay in self.passed if replay.held_out == held_out]
        if not trials or (version == "black_box" and not all(trial.black_box for trial in trials)):
            return None
        return misfit_of(trials, version)


def misfit_of(results: Sequence[Passed], version: str, *, held_out: bool | None = None) -> float:
    """Root mean square of the misfits of trials, noise units.

    Parameters
    ----------
    results : sequence of Passed
    version : str
        As in :meth:`Passed.misfit`.
    held_out : bool, optional
        True for the trials held out, False for the fitted ones; by default all.
    """
    chosen = [result.misfit(version) for result in results if held_out is None or result.held_out == held_out]
    return float(np.sqrt(np.mean(np.square(chosen))))
