"""Smoothing and correlation of series.

They are those of ``scipy.signal``, which takes a third of a second to import, in each process.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft, ifft, irfft, next_fast_len, rfft
from scipy.ndimage import correlate1d

from tank2sim.arrays import Array

_Number = TypeVar("_Number", np.float64, np.complex128)


def smooth_by_windows(values: Array, window: int, degree: int, derivative: int = 0, step: float = 1.0) -> Array:
    """Series (n,) or columns (n, k) smoothed by polynomials through windows (Savitzky and Golay 1964).

    The values within half a window of an end are those of the polynomial through the first or last window.

    Parameters
    ----------
    values : array
        At least as long as the window.
    window : int
        Odd number of values in a window, more than `degree`.
    degree : int
    derivative : int
        Order of the derivative that is returned.
    step : float
        Distance of the values, for derivatives.
    """
    half = window // 2
    weights = _weights(window, degree, derivative) / step**derivative
    smooth: Array = correlate1d(values, weights[half], axis=0, mode="constant")
    smooth[:half] = weights[:half] @ values[:window]
    smooth[len(values) - half :] = weights[half + 1 :] @ values[len(values) - window :]
    return smooth


def central_weight(window: int, degree: int) -> float:
    """The weight of a value in its own smoothed one: variance of white noise after smoothing over that before.

    Examples
    --------
    >>> round(central_weight(5, 2), 4)
    0.4857
    """
    half = window // 2
    return float(_weights(window, degree, 0)[half, half])


def _weights(window: int, degree: int, derivative: int) -> Array:
    """Derivative of the polynomial at each place of a window, by the values there (window, window)."""
    half = window // 2
    places = np.arange(-half, half + 1) / half
    powers = np.vander(places, degree + 1, increasing=True)
    of_power = [math.perm(power, derivative) for power in range(derivative, degree + 1)]
    derived = np.zeros_like(powers)
    derived[:, derivative:] = powers[:, : degree + 1 - derivative] * of_power
    weights: Array = derived @ np.linalg.pinv(powers) / half**derivative
    return weights


def correlated(first: Array, second: Array) -> Array:
    """Sums of products (n + m - 1,) of a series (n,) and another (m,), which is moved by -(m - 1) to n - 1 places."""
    return convolved(first, second[::-1])


def convolved(values: NDArray[_Number], weights: Array) -> NDArray[_Number]:
    """Convolution (n + m - 1,) of a series (n,), which may be complex, with weights (m,); by Fourier transforms."""
    count = len(values) + len(weights) - 1
    there, back = (fft, ifft) if np.iscomplexobj(values) else (rfft, irfft)
    size = next_fast_len(count, real=there is rfft)
    result: NDArray[_Number] = back(there(values, size) * there(weights, size), size)[:count]
    return result
