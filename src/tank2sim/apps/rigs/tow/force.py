"""The towing force: constant, or a polynomial of time as in (1.13) of paper 1."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from tank2sim.arrays import Array
from tank2sim.errors import ArgumentError


def as_force(force: float | Polynomial) -> Polynomial:
    """T(t), N over s from the release; a number is a constant force."""
    return force if isinstance(force, Polynomial) else Polynomial([float(force)])


def parse_force(text: str) -> Polynomial:
    """T(t) from an option's text ``c0,c1,...``: T = c0 + c1 t + ..., N over s.

    Raises
    ------
    InputError
        It is not a list of finite numbers.
    """
    try:
        coefficients = [float(word) for word in text.split(",")]
    except ValueError:
        coefficients = [np.nan]
    if not np.isfinite(coefficients).all():
        raise ArgumentError("force_N", "", f"{text!r} is not a polynomial", "give numbers: 11.6,0.02,-1e-4")
    return Polynomial(coefficients)


def checked_force(force: Polynomial, times_s: Array) -> Polynomial:
    """The force, if it pulls forward from the release to the last reading.

    Raises
    ------
    InputError
        It is negative at some time, or zero throughout.
    """
    end = float(times_s[-1])
    times = np.linspace(0.0, end, 201)
    values = force(times)
    if values.min() < 0 or values.max() == 0:
        at = times[values.argmin()]
        problem = f"is {values.min():.4g} N at {at:.4g} s, and must pull forward from 0 to {end:g} s"
        raise ArgumentError("force_N", "", problem, "check signs and order: c0,c1,... with T = c0 + c1 t + ...")
    return force


def mean_force(force: Polynomial, times_s: Array) -> float:
    """Mean of T(t) from the release to the last reading, N."""
    end = float(times_s[-1])
    return float(force.integ()(end)) / end


def force_words(force: Polynomial) -> str:
    """Text of the force: ``T = 11.63 N``, ``T = 11.6 + 0.02 t N``."""
    powers = [f"{value:+.6g}" + ("" if k == 0 else " t" if k == 1 else f" t^{k}") for k, value in enumerate(force.coef)]
    return "T = " + " ".join(powers).lstrip("+").replace(" +", " + ").replace(" -", " - ") + " N"
