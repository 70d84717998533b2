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


def covariances(
    start: Array, transition: Array, push: Array, fading: Array, added: Array, seeing: tuple[Array, _Truths, Array]
) -> tuple[Array, Array, Array]:
    """Gains, inverse roots of the innovations' covariances, and covariances after each measurement.

    Parameters
    ----------
    start : array (nz,)
        Variances at the beginning.
    transition : array (R, T - 1, 6, 6)
    push : array (R, T - 1, 6, 3) or, in waves, (R, T - 1, 6, 9)
        Errors of the motion by accelerations a step before.
    fading : array (3 + ny,) or (5 + ny,)
        Share of accelerations and sensor errors that remains a step later; real and imaginary part for the band.
    added : array (R, T - 1, nz, nz)
        Covariance of the process noise.
    seeing : arrays (R, T, ny, 6), (R, T, ny), (R, ny)
        Readings by states, mask of the measurements, variances of their white noise.

    Returns
    -------
    gain : array (R, T, nz, ny)
    white : array (R, T, ny, ny)
        Lower; nan where the covariance is not positive definite, and from there on.
    filtered : array (R, T, nz, nz)
    """
    reading, known, white_noise = seeing
    runs, blocks, ny, _ = reading.shape
    nz = len(start)
    gain, white = np.empty((runs, blocks, nz, ny)), np.empty((runs, blocks, ny, ny))
    filtered = np.empty((runs, blocks, nz, nz))
    given = start, transition, push, fading, added, reading, known, white_noise
    _library(ny, _waves(push)).covariances(*_sizes(runs, blocks), *_places(*given, gain, white, filtered))
    return gain, white, filtered


def run_filter(
    seeing: tuple[Array, _Truths],
    moving: tuple[Array, Array, Array, Array],
    filtering: tuple[Array, Array],
    columns: tuple[Array, Array],
    keep: bool,
) -> tuple[Array, Array]:
    """Innovations in units of their standard deviation (R, T, ny, C), and states after each measurement.

    Parameters
    ----------
    seeing : arrays (R, T, ny, 6), (R, T, ny)
    moving : arrays (R, T - 1, 6, 6), (R, T - 1, 6, 6), (R, T - 1, 6, 3 or 9), (3 + ny or 5 + ny,)
        Transition, spreading, push and fading.
    filtering : arrays (R, T, nz, ny), (R, T, ny, ny)
        Gains and inverse roots.
    columns : arrays (R, T - 1, 6, C), (R, T, ny, S)
        Driving, and what the first S of C columns show.
    keep : bool
        Whether the states are wanted, (R, T, nz, C); else they are (0, 0, nz, C).
    """
    runs, blocks, ny, shown = columns[1].shape
    count = columns[0].shape[-1]
    whitened = np.empty((runs, blocks, ny, count))
    after = np.empty((runs if keep else 0, blocks if keep else 0, filtering[0].shape[2], count))
    given = _places(*seeing, *moving, *filtering, *columns)
    run = _library(ny, _waves(moving[2])).run_filter
    _need_memory(run(*_sizes(runs, blocks), count, shown, *given, int(keep), *_places(whitened, after)))
    return whitened, after


def smooth_backward(
    seeing: tuple[Array, _Truths],
    moving: tuple[Array, Array, Array, Array],
    filtering: tuple[Array, Array, Array],
    whitened: Array,
    after: Array,
) -> Array:
    """States given all measurements (R, T, nz, C); arguments as of :func:`run_filter`, and the covariances after each
    measurement. r carries the information of later measurements about a state."""
    runs, blocks, ny, count = whitened.shape
    transition, _, push, fading = moving
    states = np.empty(after.shape)
    given = _places(*seeing, transition, push, fading, *filtering, whitened, after, states)
    _need_memory(_library(ny, _waves(push)).smooth_backward(*_sizes(runs, blocks), count, *given))
    return states


def backward(
    seeing: tuple[Array, _Truths],
    moving: tuple[Array, Array, Array, Array],
    filtering: tuple[Array, Array, Array],
    whitened: Array,
    after: Array,
) -> tuple[Array, Array, Array, Array, Array, Array, Array]:
    """Slopes of the cost in the parameters of the noise; arguments as of :func:`smooth_backward`.

    Returns
    -------
    variance, start, fading : arrays (3 + ny,)
        By the variance of each slow process's driving noise, by its variance at the beginning, by its fading.
    way, both, gain : arrays (3,)
        By the variances and the gain of a force over a block.
    white : array (R, ny)
        By the variance of each sensor's white noise in each run.
    """
    runs, blocks, ny, count = whitened.shape
    variance, start, fading = np.zeros(3 + ny), np.zeros(3 + ny), np.zeros(3 + ny)
    way, both, gain, white = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((runs, ny))
    sums = variance, start, fading, way, both, gain, white
    given = _places(*seeing, *moving, *filtering, whitened, after, *sums)
    _need_memory(_library(ny, _waves(moving[2])).backward(*_sizes(runs, blocks), count, *given))
    return sums


def _waves(push: Array) -> bool:
    """Whether the states hold accelerations of waves."""
    return bool(push.shape[-1] > _FORCES)


@cache
def _library(ny: int, waves: bool) -> ctypes.CDLL:
    """The compiled loops for a number of sensors."""
    flags = (*_FLAGS, *FLAGS_OF_LANES.get(widest_lanes(), ()), f"-DNY={ny}", f"-DWAVES={int(waves)}")
    return ctypes.CDLL(str(cached_library({_SOURCE.name: _SOURCE.read_text(encoding="utf-8")}, flags=flags)))


def _sizes(runs: int, blocks: int) -> tuple[ctypes.c_long, ctypes.c_long]:
    return ctypes.c_long(runs), ctypes.c_long(blocks)


def _places(*arrays: Array | _Truths) -> list[ctypes.c_void_p]:
    """Where arrays are in memory: contiguous ones, for a copy would end too soon."""
    for array in arrays:
        if not array.flags.c_contiguous or array.dtype not in (np.float64, np.bool_):
            raise ValueError(f"an array of {array.dtype} with strides {array.strides}")
    return [ctypes.c_void_p(array.ctypes.data) for array in arrays]


def _need_memory(failed: int) -> None:
    if failed:
        raise MemoryError
