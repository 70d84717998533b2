"""Random streams of the members of an ensemble: NumPy's, with the seeds of many members computed at once.

A stream is ``default_rng(SeedSequence(seed, spawn_key=(..., number)))`` to the bit. NumPy computes its seed in 14 us,
half of what it takes to draw a member of 45 parameters.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import DTypeLike, NDArray

_BLOCK = 256
"""Members whose seeds are computed together (project choice)."""

# Constants of SeedSequence (numpy/random/bit_generator.pyx), after O'Neill (2015), Developing a seed_seq alternative.
_INIT_A, _MULT_A, _INIT_B, _MULT_B = 0x43B0D7E5, 0x931E8875, 0x8B51F9DD, 0x58F38DED
_MIX_LEFT, _MIX_RIGHT = np.uint32(0xCA01F9DD), np.uint32(0x4973F715)
_POOL, _HASHES_OF_POOL, _WORD, _WORDS_OF_STATE = 4, 16, 1 << 32, 8


class _Seed(ISeedSequence):
    """A seed that is known."""

    def __init__(self, words: NDArray[np.uint64]):
        self._words = words

    def generate_state(self, n_words: int, dtype: DTypeLike = np.uint32) -> NDArray[np.uint64]:
        """The words of a PCG64: four of 64 bits."""
        return self._words


def member_stream(seed: int, number: int, round_number: int | None = None) -> np.random.Generator:
    """The stream of a member, with the spawn key ``(number,)`` or ``(round_number, number)``.

    `number`: Below 2^32. `round_number`, optional: Below 2^32.

    Examples
    --------
    >>> member_stream(1, 5).random() == np.random.default_rng(np.random.SeedSequence(1, spawn_key=(5,))).random()
    True
    """
    block, place = divmod(number, _BLOCK)
    words: Any = _Seed(_seeds(seed, block, round_number)[place])  # NumPy's types do not know its interface of seeds
    return np.random.Generator(np.random.PCG64(words))


@lru_cache(maxsize=4)
def _seeds(seed: int, block: int, round_number: int | None) -> NDArray[np.uint64]:
    """Seeds (:data:`_BLOCK`, 4) of the members of a block."""
    before = () if round_number is None else (round_number,)
    pool = [np.full(_BLOCK, word) for word in np.random.SeedSequence(seed, spawn_key=before).pool]
    words = max(_POOL, -(-seed.bit_length() // 32)) + len(before)
    number = np.arange(block * _BLOCK, (block + 1) * _BLOCK).astype(np.uint32)
    constant = _INIT_A * pow(_MULT_A, _HASHES_OF_POOL + _POOL * (words - _POOL), _WORD) % _WORD
    for place in range(_POOL):
        hashed, constant = _hashed(number, constant, _MULT_A)
        mixed = _MIX_LEFT * pool[place] - _MIX_RIGHT * hashed
        pool[place] = mixed ^ (mixed >> np.uint32(16))
    state, constant = [], _INIT_B
    for place in range(_WORDS_OF_STATE):
        hashed, constant = _hashed(pool[place % _POOL], constant, _MULT_B)
        state.append(hashed.astype(np.uint64))
    pairs = [low | high << np.uint64(32) for low, high in zip(state[::2], state[1::2], strict=True)]
    return np.column_stack(pairs)


def _hashed(values: NDArray[np.uint32], constant: int, factor: int) -> tuple[NDArray[np.uint32], int]:
    following = constant * factor % _WORD
    hashed = (values ^ np.uint32(constant)) * np.uint32(following)
    return hashed ^ (hashed >> np.uint32(16)), following
