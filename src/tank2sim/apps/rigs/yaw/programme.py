"""The programmed yaw motion of paper 3: humps of yaw rate that rise, hold, fall and rest, with mirror images in them.

One hump has seven segments and a rest. With t1 = t3/6, t2 = 5 t3/6, t4 = 2 t3 and t5 = t4 + t1, t6 = t4 + t2, t7 = t4 +
t3 it takes 4 t3; between t1 and t2 the acceleration is constant, between t5 and t6 it is as large the other way, and
w(t4 + x) = w_m - w(x): the braking is the accelerating run backwards.

The energy method: W = int M w dt is the work of the motor, without any known part (walls, differences between the
two intervals). In an accelerating interval 1-2 and its mirror image 5-6

    W12 = (J + lambda)/2 (w2^2 - w1^2) + (B + D),   W56 = -(J + lambda)/2 (w2^2 - w1^2) + (B + D)

so that half their difference is kinetic energy, and half their sum is dissipated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from scipy.interpolate import PPoly

from tank2sim.apps.rigs.yaw.card import YawRigCard
from tank2sim.arrays import Array

PROGRAMME_KINDS = ("unidirectional", "reversing")

ProgrammeKind = Literal["unidirectional", "reversing"]

_REST = 4.0
"""Length of a hump with its rest, in rise times: t8 = t7 + t4 - t3."""


class Reference(NamedTuple):
    """Programmed angle (rad), rate (rad/s) and acceleration (rad/s2), each (times,)."""

    angle_rad: Array
    rate_radps: Array
    acceleration_radps2: Array


class MirrorPair(NamedTuple):
    """Beginning and end, s, of an accelerating interval and of the braking one that is its mirror image."""

    accelerating_s: tuple[float, float]
    braking_s: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class YawProgramme:
    """A programme of humps.

    Parameters
    ----------
    max_rate_radps : float
        w_m, the rate that is held; negative turns to port.
    rise_s : float
        t3, the time from rest to it.
    settle_s : float
        t_Delta, left out at both ends of the intervals, where the controller still settles.
    kind : str
        ``unidirectional``, or ``reversing``: every second hump turns the other way, and brakes through the very angles
        through which the one before accelerated, so that what depends on the angle is the same in both.
    humps : int
        How many.
    start_s : float
        When the first begins.

    Raises
    ------
    ValueError
        A time is not positive, nothing is left of the intervals, or a reversing programme has an odd number of humps.
    """

    max_rate_radps: float
    rise_s: float
    settle_s: float = 0.5
    kind: ProgrammeKind = "unidirectional"
    humps: int = 5
    start_s: float = 0.0

    def __post_init__(self) -> None:
        if not (self.rise_s > 0 and self.settle_s >= 0 and self.humps >= 1 and self.max_rate_radps):
            raise ValueError("the programme has no rate, no rise time or no humps")
        if 2 * self.settle_s >= 2 / 3 * self.rise_s:
            raise ValueError(
                f"settling for {self.settle_s:g} s at both ends leaves nothing of an interval of "
                f"{2 / 3 * self.rise_s:g} s; take a longer rise or a shorter settling"
            )
        if self.kind == "reversing" and self.humps % 2:
            raise ValueError(f"a reversing programme has pairs of humps, and {self.humps} is odd")

    @property
    def period_s(self) -> float:
        """t8, from one hump to the next."""
        return _REST * self.rise_s

    @property
    def end_s(self) -> float:
        """When the rest after the last hump ends."""
        return self.start_s + self.humps * self.period_s

    @property
    def steepness(self) -> float:
        """k = w_m / (t2^2 + t3^2 - t1^2 - 2 t2 t3 + 2 t1 t2), rad/s3."""
        t1, t2, t3 = self.rise_s / 6, 5 * self.rise_s / 6, self.rise_s
        return self.max_rate_radps / (t2**2 + t3**2 - t1**2 - 2 * t2 * t3 + 2 * t1 * t2)

    @property
    def max_acceleration_radps2(self) -> float:
        """2 k t1 = 1.2 w_m/t3. (The print's pi/160 is w_m/t_m, a third and less of it.)"""
        return abs(2 * self.steepness * self.rise_s / 6)

    @property
    def turn_per_interval_rad(self) -> float:
        """Angle swept from t1 + t_Delta to t2 - t_Delta: the mean rate there is half of w_m."""
        return abs(self.max_rate_radps) / 2 * (2 / 3 * self.rise_s - 2 * self.settle_s)

    def at(self, time_s: Array) -> Reference:
        """The programmed motion at times (n,); at rest before the start and after the end."""
        programme_time = np.clip(np.asarray(time_s, dtype=float), self.start_s, self.end_s) - self.start_s
        hump = np.minimum(np.floor(programme_time / self.period_s), self.humps - 1)
        phase = programme_time - hump * self.period_s
        sign = 1.0 - 2.0 * (hump % 2) if self.kind == "reversing" else np.ones_like(hump)
        before = hump % 2 if self.kind == "reversing" else hump
        rate, angle = self._hump, self._hump_angle
        swept = float(angle(self.period_s))
        return Reference(before * swept + sign * angle(phase), sign * rate(phase), sign * rate(phase, nu=1))

    def pairs(self) -> tuple[MirrorPair, ...]:
        """The intervals in which it is measured, each accelerating one with its mirror image."""
        low, high = self.rise_s / 6 + self.settle_s, 5 * self.rise_s / 6 - self.settle_s
        later = 2 * self.rise_s

        def interval(hump: int, braking: bool) -> tuple[float, float]:
            begin = self.start_s + hump * self.period_s + later * braking
            return begin + low, begin + high

        other = [hump ^ 1 if self.kind == "reversing" else hump for hump in range(self.humps)]
        return tuple(MirrorPair(interval(hump, False), interval(other[hump], True)) for hump in range(self.humps))

    @cached_property
    def _hump(self) -> PPoly:
        """Rate over one hump, from the printed seven segments, each in the time since its own beginning."""
        k, top, t3 = self.steepness, self.max_rate_radps, self.rise_s
        t1, t2 = t3 / 6, 5 * t3 / 6
        slope = 2 * k * t1
        joints = np.array([0, t1, t2, t3, 2 * t3, 2 * t3 + t1, 2 * t3 + t2, 3 * t3, _REST * t3])
        rising = [(k, 0, 0), (0, slope, k * t1**2), (-k, 2 * k * (t3 - t2), top - k * (t3 - t2) ** 2), (0, 0, top)]
        falling = [(-k, 0, top), (0, -slope, top - k * t1**2), (k, -2 * k * (t3 - t2), k * (t3 - t2) ** 2), (0, 0, 0)]
        return PPoly(np.array(rising + falling, dtype=float).T, joints)

    @cached_property
    def _hump_angle(self) -> PPoly:
        return self._hump.antiderivative()


PAPER_PROGRAMME = YawProgramme(max_rate_radps=math.pi / 12, rise_s=40 / 9)
"""The paper's programme: 15 deg/s, t3 = 13.33 s / 3."""


def programme_of(card: YawRigCard) -> YawProgramme:
    """The programme of a card; the paper's if it has none. InputError if it cannot be run."""
    stated = card.programme
    if stated is None:
        return PAPER_PROGRAMME
    kind: ProgrammeKind = "reversing" if stated.kind == "reversing" else "unidirectional"
    try:
        programme = YawProgramme(kind=kind, **stated.model_dump(exclude={"kind"}))
    except ValueError as error:
        raise card.fault("programme", str(error), "correct its keys") from None
    return full_turns(programme) if stated.kind == "full_turn" else programme


def full_turns(programme: YawProgramme) -> YawProgramme:
    """The programme with a rise so slow that every interval is one full turn.

    The weight of a body mounted off centre, or of a shaft that is not upright, does no work over a full turn.
    """
    interval = 4 * math.pi / abs(programme.max_rate_radps) + 2 * programme.settle_s
    return replace(programme, rise_s=1.5 * interval)


@dataclass(frozen=True, kw_only=True)
class Similarity:
    """A ship's turning motion at model size, by the Froude number over the beam and the Strouhal number of turning.

    Lengths and beams of ship and model are at the waterline.
    """

    ship_length_m: float
    ship_beam_m: float
    length_m: float
    beam_m: float

    @property
    def rate_ratio(self) -> float:
        """Model rate over ship rate, (L*/L) sqrt(B/B*): the paper's sqrt(lambda), no scale of lengths."""
        return self.ship_length_m / self.length_m * math.sqrt(self.beam_m / self.ship_beam_m)

    def programme(
        self, ship_rate_radps: float, ship_time_s: float, like: YawProgramme = PAPER_PROGRAMME
    ) -> YawProgramme:
        """The programme whose humps (t7) are the ship's motion of `ship_time_s` with the rate `ship_rate_radps`.

        Kind, number and settling are taken from the programme `like`; raises as :class:`YawProgramme`.
        """
        rise_s = ship_time_s / self.rate_ratio / 3
        return replace(like, max_rate_radps=ship_rate_radps * self.rate_ratio, rise_s=rise_s)


def inertia_from_work(work_12_J: float, work_56_J: float, w1_radps: float, w2_radps: float) -> float:
    """J + lambda661 in kg m2, (1): (W12 - W56) / (w2^2 - w1^2)."""
    return (work_12_J - work_56_J) / (w2_radps**2 - w1_radps**2)


def dissipation_from_work(work_12_J: float, work_56_J: float) -> float:
    """B + D in J, (2): (W12 + W56) / 2.

    The print divides the corrections for accelerating and braking and for the walls by (w2^2 - w1^2), which is not
    energy; here they are part of the work, without a divisor.
    """
    return (work_12_J + work_56_J) / 2
