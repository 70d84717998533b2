"""The study of a gap: what ``gap.json`` holds, in the units of cards and trial files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from tank2sim.arrays import Columns, Number, Unbounded
from tank2sim.gap.result import MisfitPlace, Refitted, Rival
from tank2sim.identification.trials.problem.prepare_trials import RecordDoubt
from tank2sim.identification.trials.study import TrialMotions
from tank2sim.notices import Notice

STATE_COLUMNS = {
    "rudder": "rudder_deg",
    "drift": "drift_deg",
    "yaw rate": "yaw_rate_degps",
    "speed": "speed_mps",
    "heading": "heading_deg",
}
"""State that explains a force to its column."""

MISSING_COLUMNS = {"X": "force_N", "Y": "force_N", "N": "moment_Nm", "turning": "rate_degps"} | dict.fromkeys(
    ("north", "east", "ahead", "starboard"), "velocity_mps"
)
"""Equation or quantity to the column of what is missing."""

Misfits = dict[str, Unbounded]
"""Misfit in noise units ``before`` and ``after``, and of the ``black_box`` where one was fitted; infinite where the
simulation left all bounds (null in JSON)."""


@dataclass(frozen=True, kw_only=True)
class EffectSize:
    """Parameters of an effect and their standard errors, by names with units; a held parameter has no error."""

    parameters: dict[str, Number]
    standard_errors: dict[str, Number]


@dataclass(frozen=True, kw_only=True)
class FoundSurroundings:
    """Wind or current of one trial with standard errors.

    Directions are from 0 to 360 deg: from which a wind comes, towards which a current sets.
    """

    trial: str
    held_out: bool
    speed_mps: Number
    direction_deg: Number
    speed_error_mps: Number
    direction_error_deg: Number


@dataclass(frozen=True, kw_only=True)
class EffectFound:
    """A named effect with its size and the probability that it is present; `by_trial` where a wind or current differs
    from trial to trial."""

    name: str
    parameters: dict[str, Number]
    standard_errors: dict[str, Number]
    confidence: Number
    by_trial: tuple[FoundSurroundings, ...] = ()


@dataclass(frozen=True, kw_only=True)
class ActingInterval:
    """An interval in which the model itself is wrong.

    Parameters
    ----------
    trial : str
        File.
    equation : str
        ``surge``, ``sway``, ``yaw``, ``track`` or ``heading``.
    t_start_s, t_end_s : float
    standard_errors : float
        Root mean square of what is missing, in its standard errors.
    force_N, moment_Nm : float or None
        Root mean square of the missing force or yaw moment; None in other equations.
    """

    trial: str
    equation: str
    t_start_s: Number
    t_end_s: Number
    standard_errors: Number
    force_N: float | None = None
    moment_Nm: float | None = None


@dataclass(frozen=True, kw_only=True)
class MisfitNoise:
    """Standard deviation of a measurement in the unit of its column, and whether it is ``stated`` or ``estimated``."""

    sigma: Number
    origin: Annotated[str, Field(alias="from")]


@dataclass(frozen=True, kw_only=True)
class MisfitBySet:
    """Misfit of the fitting and of the held-out trials, noise units; None without such trials or without bounds."""

    fit: float | None
    holdout: float | None


@dataclass(frozen=True, kw_only=True)
class WaveMotion:
    """Waves found in the fitting trials: their period, and the standard deviation of the motion by column."""

    period_s: Number
    motion: dict[str, Number]


@dataclass(frozen=True, kw_only=True)
class GapMisfit:
    """Misfits of all trials, and the noise in whose units they are.

    Parameters
    ----------
    noise : dict
        By column of a trial file.
    before, after, black_box : MisfitBySet
    in_waves : WaveMotion or None
    effect_alone : MisfitBySet or None
        With the effects and the given coefficients, where coefficients were refitted.
    noise_floor : float
        Misfit of a perfect model.
    """

    noise: dict[str, MisfitNoise]
    before: MisfitBySet
    after: MisfitBySet
    black_box: MisfitBySet
    in_waves: WaveMotion | None
    effect_alone: MisfitBySet | None
    noise_floor: float = 1.0


@dataclass(frozen=True, kw_only=True)
class DecidingTest:
    """The manoeuvre that would decide.

    Parameters
    ----------
    manoeuvre : str
        As ``simulate --manoeuvre`` takes it.
    orders : str
        File of the orders.
    heading_deg : float
        Heading at its beginning.
    needs_instants : bool
        Whether it decides only if the instants of the orders are recorded.
    why : str
    expected : dict
        Manoeuvre to the expected difference of the score between the explanations.
    candidates : dict
        Effects of the explanations that it would distinguish.
    """

    manoeuvre: str
    orders: str
    heading_deg: float
    needs_instants: bool
    why: str
    expected: dict[str, Number]
    candidates: dict[str, EffectSize]


@dataclass(frozen=True, kw_only=True)
class TrialMisfit:
    """Misfit of a trial (empty without a measurement), and of each of its signals by column."""

    trial: str
    held_out: bool
    misfit: Misfits
    signals: dict[str, Misfits]


@dataclass(frozen=True, kw_only=True)
class GapFigure:
    """A figure of a turn or zigzag, measured and simulated; None where a simulation did not reach it."""

    trial: str
    figure: str
    measured: Number
    before: float | None
    after: float | None


@dataclass(frozen=True, kw_only=True)
class TrialEstimate:
    """A parameter by one trial alone."""

    value: Number
    standard_error: Number


@dataclass(frozen=True, eq=False, kw_only=True)
class Lacking:
    """A missing force, or a contradiction of records.

    Parameters
    ----------
    equation, quantity : str or None
        ``X``, ``Y`` or ``N`` of a force; ``north``, ``east``, ``ahead``, ``starboard`` or ``turning`` of records.
    explaining : str
        State that explains most of it, a key of :data:`STATE_COLUMNS`.
    explained : dict
        State to the share of the variance that it explains.
    points : dict
        File of a trial to the state and the missing value at single instants, thinned.
    means : dict
        Means over equal bins of the state: state, value, ``low_95``, ``high_95``, ``trials`` (how many).
    over_time : dict
        File of a trial to means over its parts: ``t_start_s``, ``t_end_s`` and the value.
    """

    equation: str | None
    quantity: str | None
    explaining: str
    explained: dict[str, Number]
    points: dict[str, Columns]
    means: Columns
    over_time: dict[str, Columns]

    @property
    def name(self) -> str:
        """The equation or quantity."""
        return self.equation or self.quantity or ""

    @property
    def state_column(self) -> str:
        """Column of the explaining state."""
        return STATE_COLUMNS[self.explaining]

    @property
    def value_column(self) -> str:
        """Column of the missing value."""
        return MISSING_COLUMNS[self.name]


@dataclass(frozen=True, eq=False, kw_only=True)
class GapReplay(TrialMotions):
    """Motions of a fitting or held-out trial, replayed freely with its recorded inputs."""

    held_out: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class GapStudy:
    """The missing effect of a model.

    Parameters
    ----------
    ship, verdict : str
        The verdict is one of :data:`.result.GAP_VERDICTS`.
    effects : tuple of EffectFound
    coefficients : tuple of Refitted
        Coefficients fitted together with the effects.
    alternatives : tuple of str
        Explanations that these data cannot distinguish from the named one (``current + wind``), or from coefficients
        that explain the gap.
    where : tuple of MisfitPlace
        With the file of each trial and the column of each signal; the largest first.
    acting : tuple of ActingInterval
        The most significant first.
    equation : str
        Surge, sway, yaw, actuator, kinematics or sensor; empty without a gap.
    misfit : GapMisfit
    could_hide : dict
        Effect to {parameter: size} that these data could not show.
    could_hide_in_words : dict
    next_test : DecidingTest or None
    rivals : tuple of Rival
        Explanations compared, the best first.
    trials : tuple of TrialMisfit
    figures : tuple of GapFigure
    agreement : dict
        ``effect.parameter`` to {file of a trial: estimate by it alone}.
    missing_force, missing_signal : Lacking or None
    replays : tuple of GapReplay
        In the order of `trials`.
        Objections to the verdict.
    notices : tuple of Notice
        The cautions, then messages about the trials.
    files : tuple of str
        Files written next to ``gap.json``.
    record_doubts : tuple of RecordDoubt
        Findings of the audit on fitted trials that were left as they are.
    card_objections : tuple of str
        Reasons for which the improved card is not written without force: standard manoeuvres that it cannot do and the
        given card can, and trials held out that it follows clearly worse.
    """

    ship: str
    verdict: str
    effects: tuple[EffectFound, ...]
    coefficients: tuple[Refitted, ...]
    alternatives: tuple[str, ...]
    where: tuple[MisfitPlace, ...]
    acting: tuple[ActingInterval, ...]
    equation: str
    misfit: GapMisfit
    could_hide: dict[str, dict[str, Number]]
    could_hide_in_words: dict[str, str]
    next_test: DecidingTest | None
    rivals: tuple[Rival, ...]
    trials: tuple[TrialMisfit, ...]
    figures: tuple[GapFigure, ...]
    agreement: dict[str, dict[str, TrialEstimate]]
    missing_force: Lacking | None
    missing_signal: Lacking | None
    replays: tuple[GapReplay, ...]
    notices: tuple[Notice, ...]
    files: tuple[str, ...] = ()
    record_doubts: tuple[RecordDoubt, ...] = ()
    card_objections: tuple[str, ...] = ()

    def set_misfit(self, version: str, *, held_out: bool, signal: str | None = None) -> float | None:
        """Root mean square of the misfits of all fitting (or held-out) trials, noise units; None without any.

        Parameters
        ----------
        version : str
            ``before``, ``after`` or ``black_box``.
        held_out : bool
        signal : str, optional
            Column; by default all signals together.
        """
        trials = [trial for trial in self.trials if trial.held_out == held_out]
        sets = [trial.misfit if signal is None else trial.signals.get(signal, {}) for trial in trials]
        return _mean_misfit([misfits for misfits in sets if misfits], version)


def _mean_misfit(sets: Sequence[Misfits], version: str) -> float | None:
    if not sets or not all(version in misfits for misfits in sets):
        return None
    return float(np.sqrt(np.mean([misfits[version] ** 2 for misfits in sets])))
