"""The loops of the filter over time, in machine code: forward for covariances and for columns, backward for slopes.

Their equations are in :mod:`.kalman_filter`, their loops in ``kalman_kernels.c``: over small, mostly sparse matrices,
for which the overhead of NumPy calls dominates. They are compiled once on a machine for each number of sensors, and
once more with waves, in a second. States are ordered as in :mod:`.kalman_filter`: 6 errors of the motion, 3
accelerations, ny sensor errors, and in waves 3 accelerations of a narrow band, each with its quadrature: nz = 9 + ny or
15 + ny. A row of `known` that is False has zeros for its row of the reading matrix H.
"""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array
from tank2sim.native.lanes import FLAGS_OF_LANES, widest_lanes
from tank2sim.native.library import cached_library

_Truths = NDArray[np.bool_]

MotionArrays = tuple[Array, Array, Array, _Truths]
"""Transition and spreading (R, T - 1, 6, 6), readings by states (R, T, ny, 6), mask of the measurements (R, T, ny)."""

ProcessArrays = tuple[Array, Array, Array, Array, Array]
"""Accelerations and sensor errors over a block: the share that remains (3 + ny,), in waves followed by real and
imaginary part of the band's; the change of speed by each value (3,), in waves also by each value of the band and
its quadrature (9,); what noise adds: variance of the change of speed (3,), its covariance with each value at
the end (3,) or (9,), variance of each value at the end (nz - 6,)."""

FilterArrays = tuple[Array, Array, Array]
"""Gains (R, T, nz, ny), inverse lower Cholesky factors of the innovations' covariances (R, T, ny, ny), and covariances
after each measurement (R, T, nz, nz)."""

_SOURCE = Path(__file__).with_suffix(".c")

# Products and sums in any order, which makes them twice as fast; nan propagates.
_FLAGS = (
    "-O3",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-signed-zeros",
    "-fassociative-math",
)

_FORCES = 3
"""Accelerations that push the motion; with waves, as many of the narrow band and their quadratures come after them."""


def covariances(motion: MotionArrays, process: ProcessArrays, start: Array, white_noise: Array) -> FilterArrays:
    """The filter of one noise; its factors are nan where a covariance is not positive definite, and from there on.

    Parameters
    ----------
    motion, process
    start : array (nz,)
        Variances at the beginning.
    white_noise : array (R, ny)
        Variances of the measurements' white noise.
    """
    runs, blocks, ny, _ = motion[2].shape
    nz = len(start)
    found = np.empty((runs, blocks, nz, ny)), np.empty((runs, blocks, ny, ny)), np.empty((runs, blocks, nz, nz))
    _run("covariances", motion, process, (start,), (white_noise,), found)
    return found


def whiten(motion: MotionArrays, process: ProcessArrays, found: FilterArrays, driving: Array, shown: Array) -> Array:
    """Innovations in units of their standard deviation (R, T, ny, C), 0 where nothing was measured.

    Parameters
    ----------
    motion, process, found
    driving : array (R, T - 1, 6, C)
    shown : array (R, T, ny, S)
        What the first S of C columns show.
    """
    whitened = np.empty((*shown.shape[:3], driving.shape[-1]))
    _run("whiten", motion, process, found, _columns(driving, shown), (whitened,))
    return whitened


def smooth(motion: MotionArrays, process: ProcessArrays, found: FilterArrays, driving: Array, shown: Array) -> Array:
    """States given all measurements (R, T, nz); arguments as of :func:`whiten`, with one column."""
    states = np.empty(found[0].shape[:3])
    _run("smooth", motion, process, found, _columns(driving, shown), (states,))
    return states


def slope_sums(
    motion: MotionArrays, process: ProcessArrays, found: FilterArrays, driving: Array, shown: Array
) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    """Slopes of the cost in the parameters of the noise; arguments as of :func:`whiten`.

    Returns
    -------
    variance, start, fading : arrays (3 + ny,)
        By the variance of each slow process's driving noise, by its variance at the beginning, by its fading.
    way, both, gain : arrays (3,)
        By the variances and the gain of a force over a block.
    white : array (R, ny)
        By the variance of each sensor's white noise in each run.
    """
    runs, _, ny, _ = shown.shape
    variance, start, fading = np.zeros(3 + ny), np.zeros(3 + ny), np.zeros(3 + ny)
    way, both, gain, white = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((runs, ny))
    sums = variance, start, fading, way, both, gain, white
    _run("slope_sums", motion, process, found, _columns(driving, shown), sums)
    return sums


_Values = tuple[Array | _Truths | int, ...]


def _run(loop: str, motion: MotionArrays, process: ProcessArrays, *others: _Values) -> None:
    """Run a loop on structures of arrays and whole numbers."""
    runs, blocks, ny, _ = motion[2].shape
    function = _library(ny, len(process[1]) > _FORCES)[loop]
    if function(*map(_structure, ((runs, blocks, *motion), process, *others))):
        raise MemoryError


def _columns(driving: Array, shown: Array) -> _Values:
    return driving.shape[-1], shown.shape[-1], np.ascontiguousarray(driving), np.ascontiguousarray(shown)


@cache
def _library(ny: int, waves: bool) -> ctypes.CDLL:
    """The compiled loops for a number of sensors."""
    lanes = max(widest_lanes(), 1)
    flags = (*_FLAGS, *FLAGS_OF_LANES.get(lanes, ()), f"-DNY={ny}", f"-DWAVES={int(waves)}", f"-DLANES={lanes}")
    return ctypes.CDLL(str(cached_library({_SOURCE.name: _SOURCE.read_text(encoding="utf-8")}, flags=flags)))


def _structure(values: _Values) -> ctypes.Array[ctypes.c_void_p]:
    """Addresses of arrays, and whole numbers: contiguous arrays alone, for a copy would end too soon."""
    for value in values:
        if not isinstance(value, int) and (not value.flags.c_contiguous or value.dtype not in (np.float64, np.bool_)):
            raise ValueError(f"an array of {value.dtype} with strides {value.strides}")
    return (ctypes.c_void_p * len(values))(*(v if isinstance(v, int) else v.ctypes.data for v in values))
