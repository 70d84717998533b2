"""Controllers of the yaw rig: (4), tuned from run to run, and (6), adaptive, as a digital controller carries them out.

Both are functions of one sample, ``step(memory, angle, angle_ref, rate_ref, gains) -> (memory after, command)``, with
rectangles for integrals and a held value for the filter, at the interval `h` of the sampling.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from tank2sim.apps.rigs.yaw.programme import dissipation_from_work, inertia_from_work


class Law(NamedTuple):
    """A controller: the start of its memory, its gains of the first run, and its step of one sample."""

    start: tuple[float, ...]
    gains: Mapping[str, float]
    step: Callable[[ca.SX, ca.SX, ca.SX, ca.SX, ca.SX], tuple[ca.SX, ca.SX]]


@dataclass(frozen=True, kw_only=True)
class TunedController:
    """(4): u = (K_P + K_I/p) e + K_D (w_ref - p/(T_o p + 1) phi), e = phi_ref - phi.

    Parameters
    ----------
    inertia_kgm2 : float
        a10 = J* + lambda66, from which the first gains are taken, with a20 = 0.1 a10 (N m s) for the friction.
    divisor : float
        n1.
    integral_gain : float
        K_I.
    filter_s : float
        T_o.
    tune : bool
        Take new gains after every pair of intervals.
    as_printed : bool
        Take the first gains as they are printed, with a10 and a20 exchanged, and t4, t5 for the limits of braking where
        t5, t6 are meant.
    """

    inertia_kgm2: float
    divisor: float = 1.0
    integral_gain: float = 1.0
    filter_s: float = 0.1
    tune: bool = True
    as_printed: bool = False

    def first_gains(self, lag_s: float, torque_constant_NmpA: float) -> tuple[float, float]:
        """K_P and K_D of the first run: a20 and a10 over n1 T_c k_t."""
        scale = self.divisor * lag_s * torque_constant_NmpA
        proportional, derivative = 0.1 * self.inertia_kgm2 / scale, self.inertia_kgm2 / scale
        return (derivative, proportional) if self.as_printed else (proportional, derivative)

    def tuned_gains(
        self, works: tuple[float, float], rates: tuple[float, float, float], lag_s: float
    ) -> tuple[float, float]:
        """K_P and K_D from a run: the first fractions of (1) and (2), with the braking limits t5, t6.

        Parameters
        ----------
        works : pair of float
            int w I dt over the accelerating and the braking interval, A rad.
        rates : tuple of float
            w1 and w2 (rad/s) and int w^2 dt over the accelerating interval (rad2/s).
        lag_s : float
            T_c.
        """
        w1, w2, square = rates
        scale = self.divisor * lag_s
        return dissipation_from_work(*works) / (scale * square), inertia_from_work(*works, w1, w2) / scale

    def law(self, h: float, lag_s: float, torque_constant_NmpA: float) -> Law:
        """The controller at the sampling interval `h`, s, for a motor with T_c and k_t."""

        def step(memory: ca.SX, angle: ca.SX, angle_ref: ca.SX, rate_ref: ca.SX, gains: ca.SX) -> tuple[ca.SX, ca.SX]:
            integral, filtered = memory[0], memory[1]
            error = angle_ref - angle
            rate = (angle - filtered) / self.filter_s
            command = gains[0] * error + self.integral_gain * integral + gains[1] * (rate_ref - rate)
            return ca.vertcat(integral + h * error, filtered + h * rate), command

        gains = self.first_gains(lag_s, torque_constant_NmpA)
        return Law((0.0, 0.0), dict(zip(("K_P", "K_D"), gains, strict=True)), step)


@dataclass(frozen=True, kw_only=True)
class AdaptiveController:
    """(5) and (6): u = d(kt xi)/dt + kt xi + gamma1 kt sgn w_ref + gamma2 kt w_ref |w_ref|.

    xi' = sigma0 kt^2 (e - xi), and kt' = lambda0 while |W_f e| > delta0, W_f = 1/(T_f p + 1). With both gammas 0 it is
    (5). The paper does not state the first kt; 20 is a project choice, with which the loop is stable.
    """

    sigma0: float = 0.008
    lambda0: float = 1.0
    delta0_rad: float = 0.006
    gamma1: float = 2e-4
    gamma2: float = 1e-4
    filter_s: float = 0.2
    first_gain: float = 20.0

    def law(self, h: float, lag_s: float, torque_constant_NmpA: float) -> Law:
        """The controller at the sampling interval `h`, s; it knows nothing of the motor."""

        def step(memory: ca.SX, angle: ca.SX, angle_ref: ca.SX, rate_ref: ca.SX, gains: ca.SX) -> tuple[ca.SX, ca.SX]:
            xi, gain, smooth = memory[0], memory[1], memory[2]
            error = angle_ref - angle
            gain_rate = ca.if_else(ca.fabs(smooth) > self.delta0_rad, self.lambda0, 0)
            xi_rate = self.sigma0 * gain**2 * (error - xi)
            feed = self.gamma1 * ca.sign(rate_ref) + self.gamma2 * rate_ref * ca.fabs(rate_ref)
            command = gain_rate * xi + gain * xi_rate + gain * xi + gain * feed
            smooth_rate = (error - smooth) / self.filter_s
            return ca.vertcat(xi + h * xi_rate, gain + h * gain_rate, smooth + h * smooth_rate), command

        return Law((0.0, self.first_gain, 0.0), {}, step)


Controller = TunedController | AdaptiveController
