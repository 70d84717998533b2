"""An ensemble: the same question for many ships, each with parameters drawn from their uncertainty.

Each member has its own random stream, from the seed and its number alone, so that an ensemble is identical to the bit
for any executor, batches and order.
"""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import DTypeLike, NDArray

from tank2sim.arrays import Array
from tank2sim.notices import Level, Notice

Histories = NDArray[np.float32]

BATCH = 32
"""Members of a batch: large against the cost of its transfer, small against the whole (project choice)."""

LARGE_BATCHES, BATCHES = 8, 64
"""Most times the usual number of members in a batch, and the number of batches from which on they are larger: many for
each processor of a machine, so that none waits long for the last, and few against what each costs (project choice)."""

KEPT = 2000
"""Number of members, the first, whose histories are kept for bands of tracks, 4 bytes a sample. The share below a
quantile is known to 0.5 %; figures use all members (project choice)."""


DRAWS = 1000
"""Most draws of a member until it is within all bounds (project choice). Nearly all members need one; with a parameter
at its bound every other draw is within, with ten such parameters one in a thousand."""

_SUMMED = 64
"""Members whose sums are formed together: the terms fit the cache (project choice)."""

NOT_WITHIN = f"not one of {DRAWS} draws is within the bounds of all parameters"

SCARCE = 10
"""Members below which a band is doubted: one of 90 % then ends between the two outermost (project choice)."""

TAIL = 0.05
"""Fraction of the members beyond either end of a 90 % band: with as many lost, the band is of other ships."""


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
    """The stream of a member: NumPy's ``default_rng(SeedSequence(seed, spawn_key=(number,)))``, or ``(round_number,
    number)``, to the bit.

    The seeds of many members are computed at once: NumPy takes 14 us for one, half of what it takes to draw a member of
    45 parameters.

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


@dataclass(frozen=True, eq=False)
class Draws:
    """Normal distribution of the members' parameters about the card's values.

    Parameters
    ----------
    names : tuple of str
        The k uncertain parameters of the model.
    mean : array (k,)
    root : array (k, k)
        A root of their covariance: root @ root.T.
    lowest, highest : array (k,)
        Bounds of the parameters. A member beyond them is drawn again as a whole, from the same stream: this is the
        truncated normal distribution, which preserves correlations. Clipping at the bounds would not.
    seed : int
    samples : array (n, m), optional
        Samples of the joint distribution of m of the parameters: a member has one of its rows instead of normal values.
    sampled : array (m,)
        Places of these parameters.
    assumed : bool
        Whether all standard errors are assumed.
    """

    names: tuple[str, ...]
    mean: Array
    root: Array
    lowest: Array
    highest: Array
    seed: int
    samples: Array | None = None
    sampled: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    assumed: bool = False

    def member(self, number: int) -> dict[str, float]:
        """Parameters of a member, by name."""
        return dict(zip(self.names, self.members(number, 1).values[0].tolist(), strict=True))

    def members(self, first: int, count: int) -> DrawnMembers:
        """The members from `first` on, each from numpy's ``SeedSequence(seed, spawn_key=(number,))``: its first draw
        within the bounds."""
        standard, values = self._drawn(member_stream(self.seed, first + row) for row in range(count))
        outside = self._outside(values)
        again: list[int] = np.flatnonzero(outside.any(axis=1)).tolist()
        troubles = [""] * count
        for row in again:
            stream = member_stream(self.seed, first + row)
            self._drawn([stream])  # the draw that is beyond a bound
            for _ in range(DRAWS - 1):
                standard[[row]], values[[row]] = self._drawn([stream])
                if not self._outside(values[row]).any():
                    break
            else:
                values[row], troubles[row] = np.clip(values[row], self.lowest, self.highest), NOT_WITHIN
        beyond = {first + row: tuple(self.names[place] for place in np.flatnonzero(outside[row])) for row in again}
        return DrawnMembers(values, beyond, troubles, standard)

    def _drawn(self, streams: Iterable[np.random.Generator]) -> tuple[Array, Array]:
        """Standard normal values (n, k) and parameters (n, k) of the next draw of each stream."""
        size, rows = len(self.names), 0 if self.samples is None else len(self.samples)
        drawn = [(stream.standard_normal(size), int(stream.integers(rows)) if rows else 0) for stream in streams]
        standard = np.array([normal for normal, _ in drawn])
        values = self.at(standard)
        if self.samples is not None:
            values[:, self.sampled] = self.samples[[row for _, row in drawn]]
        return standard, values

    def _outside(self, values: Array) -> NDArray[np.bool_]:
        return np.asarray((values < self.lowest) | (values > self.highest), dtype=np.bool_)

    def at(self, standard: Array) -> Array:
        """Parameters (n, k) at standard normal values (n, k)."""
        values = np.empty_like(standard)
        for begin in range(0, len(standard), _SUMMED):
            # Summed by NumPy, row by row: the order of sums in a linear algebra library depends on the processor.
            part = slice(begin, begin + _SUMMED)
            values[part] = self.mean + (self.root * standard[part, None, :]).sum(axis=2)
        return values


class DrawnMembers(NamedTuple):
    """Parameters of n members (n, k); names beyond a bound in the first draw, by the member's number; why each is
    unusable, empty for others (it has the values of the last draw, clipped); and the standard normal values (n, k)."""

    values: Array
    beyond: Mapping[int, tuple[str, ...]]
    troubles: list[str]
    standard: Array


OUT_OF_BOUNDS = "a number is beyond its bounds"


@dataclass(frozen=True, eq=False)
class MixtureDraws(Draws):
    """Members about other centres than the card, for importance sampling: those beyond a bound are not drawn again.

    A member takes a centre with the probability in `shares`, and standard normal values about it.

    Parameters
    ----------
    centres : array (c, k)
        In standard normal values, zero at the card.
    shares : array (c,)
        They sum to 1.
    round : int
        Number of the sample: each has random streams of its own.
    """

    centres: Array = field(default_factory=lambda: np.zeros((1, 0)))
    shares: Array = field(default_factory=lambda: np.ones(1))
    round: int = 0

    def members(self, first: int, count: int) -> DrawnMembers:
        """The members from `first` on, each from numpy's ``SeedSequence(seed, spawn_key=(round, number))``."""
        streams = (member_stream(self.seed, first + row, self.round) for row in range(count))
        drawn = [(stream.random(), stream.standard_normal(len(self.names))) for stream in streams]
        places = np.searchsorted(np.cumsum(self.shares)[:-1], [chosen for chosen, _ in drawn], side="right")
        standard = self.centres[places] + np.array([normal for _, normal in drawn])
        values = self.at(standard)
        troubles = [OUT_OF_BOUNDS if out else "" for out in np.any(self._outside(values), axis=1).tolist()]
        return DrawnMembers(np.clip(values, self.lowest, self.highest), {}, troubles, standard)

    def weights(self, standard: Array) -> Array:
        """Density of the card's distribution over that of this mixture (n,), at standard normal values (n, k)."""
        exponents = standard @ self.centres.T - 0.5 * np.sum(self.centres**2, axis=1)
        largest = exponents.max(axis=1)
        return np.asarray(np.exp(-largest) / (np.exp(exponents - largest[:, None]) @ self.shares))


class BatchResult(NamedTuple):
    """Results of n members: figures by name (n,), nan where absent; histories (kept, signals, times) of the first, if
    any; why a member is unusable, empty for others; and the parameters for which members were drawn again, by their
    number."""

    figures: Mapping[str, Array]
    histories: Histories | None
    troubles: Sequence[str]
    beyond: Mapping[int, tuple[str, ...]] = {}


class MemberResult(NamedTuple):
    """Result of a member: figures by name, histories (signals, times), nan where absent; the reason of an unusable
    member."""

    figures: Mapping[str, float]
    histories: Histories | None = None
    trouble: str = ""


Ask = Callable[[int, Mapping[str, Array], int], BatchResult]
"""Evaluation of a batch: from the number n of members, their parameters by name, (n,) each, and of how many of them,
the first, histories are kept."""


class Question(Protocol):
    """Evaluation of every member; it is sent to other processes.

    It may have an attribute ``batch``, the number of members of a batch if not :data:`BATCH`; of a large ensemble there
    are more, up to :data:`LARGE_BATCHES` times as many.
    """

    def prepared(self) -> Ask:
        """Return the evaluating function, once in each process."""


def each_alone(ask: Callable[[Mapping[str, float]], MemberResult]) -> Ask:
    """The members of a batch one after the other, by their parameters."""

    def all_of(count: int, values: Mapping[str, Array], kept: int) -> BatchResult:
        rows = zip(*(column.tolist() for column in values.values()), strict=True) if values else count * [()]
        answers = [ask(dict(zip(values, row, strict=True))) for row in rows]
        names = dict.fromkeys(name for answer in answers for name in answer.figures)
        figures = {name: np.array([answer.figures.get(name, np.nan) for answer in answers]) for name in names}
        histories: Histories | None = None
        for number, answer in enumerate(answers[:kept]):
            if answer.histories is not None:
                if histories is None:
                    histories = np.full((kept, *answer.histories.shape), np.nan, dtype=np.float32)
                histories[number] = answer.histories
        return BatchResult(figures, histories, [answer.trouble for answer in answers])

    return all_of


@dataclass(frozen=True)
class Redrawn:
    """Number of members drawn again, and the number of times that each parameter was beyond its bounds."""

    members: int
    beyond: Mapping[str, int]

    @staticmethod
    def of(beyond: Sequence[tuple[str, ...]]) -> Redrawn:
        """Counts from the names beyond their bounds in the first draw of each member."""
        counted = Counter(name for names in beyond for name in names)
        return Redrawn(sum(map(bool, beyond)), dict(counted.most_common()))

    def in_words(self, members: int) -> list[Notice]:
        """Notices for an ensemble of `members`."""
        if not self.members:
            return []
        counts = ", ".join(f"{name} {count}" for name, count in self.beyond.items())
        share = 100 * self.members / members
        return [
            Notice(
                f"{self.members} of {members} members ({share:.2g} %) were drawn again, because numbers were beyond "
                f"their bounds ({counts}): the distribution is normal, cut off there"
            )
        ]


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Results of the members of an ensemble.

    Parameters
    ----------
    members, seed : int
    figures : mapping
        Name to the figures of all members (members,); nan where a member does not show it.
    histories : array (kept, signals, times), or None
        Histories of the first members, at most :data:`KEPT`.
    unusable : mapping
        Reason of unusable members, to their number.
    redrawn : Redrawn
    bad : array (members,)
        True for unusable members.
    """

    members: int
    seed: int
    figures: Mapping[str, Array]
    histories: Histories | None = None
    unusable: Mapping[str, int] = field(default_factory=dict)
    redrawn: Redrawn = field(default_factory=lambda: Redrawn(0, {}))
    bad: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))

    @property
    def usable(self) -> int:
        """Number of usable members."""
        return self.members - sum(self.unusable.values())

    @property
    def notices(self) -> list[Notice]:
        """Notices on members that are few, that were drawn again, or that are unusable."""
        few = f"a band of {self.members} ships is as wide as these few happen to lie; take 200 members or more"
        doubt = [Notice(few, Level.CAUTION)] if self.members < SCARCE else []
        return [*doubt, *self.redrawn.in_words(self.members), *self.of_unusable]

    @property
    def of_unusable(self) -> list[Notice]:
        """Notices on members that are unusable."""
        level = Level.CAUTION if self.members - self.usable > TAIL * self.members else Level.INFO
        return [
            Notice(f"{count} of {self.members} members cannot be used: {why}", level)
            for why, count in self.unusable.items()
        ]


def ensemble(
    question: Question, draws: Draws, members: int, executor: Executor | None = None, *, batch: int | None = None
) -> Ensemble:
    """Evaluate `members` ships in batches of `batch`, in this process or by an executor, with the same result."""
    sent = pickle.dumps(question)
    size = batch or _batch(int(getattr(question, "batch", BATCH)), members)
    tasks = [_Task(sent, draws, first, min(size, members - first)) for first in range(0, members, size)]
    figures: dict[str, Array] = {}
    histories: Histories | None = None
    unusable: Counter[str] = Counter()
    beyond: list[tuple[str, ...]] = []
    bad = np.zeros(members, dtype=np.bool_)
    for task, answer in zip(tasks, _in_order(tasks, executor), strict=True):
        rows = slice(task.first, task.first + task.count)
        beyond += answer.beyond.values()
        unusable.update(filter(None, answer.troubles))
        bad[rows] = [bool(trouble) for trouble in answer.troubles]
        for name, values in answer.figures.items():
            if name not in figures:
                figures[name] = np.full(members, np.nan)
            figures[name][rows] = values
        if answer.histories is not None and task.first < KEPT:
            if histories is None:
                histories = np.full((min(members, KEPT), *answer.histories.shape[1:]), np.nan, dtype=np.float32)
            histories[rows] = answer.histories[: KEPT - task.first]
    redrawn = Redrawn.of(beyond)
    return Ensemble(members, draws.seed, figures, histories, dict(sorted(unusable.items())), redrawn, bad)


def _batch(usual: int, members: int) -> int:
    """Members of a batch: the usual number, more if there were more than :data:`BATCHES` of them."""
    return max(usual, min(-(-members // BATCHES), LARGE_BATCHES * usual))


@dataclass(frozen=True, eq=False)
class _Task:
    """A batch of members, with the data for another process."""

    question: bytes
    draws: Draws
    first: int
    count: int


def _in_order(tasks: list[_Task], executor: Executor | None) -> Iterable[BatchResult]:
    return map(_answers, tasks) if executor is None else executor.map(_answers, tasks)


def _answers(task: _Task) -> BatchResult:
    kept, drawn = min(max(KEPT - task.first, 0), task.count), task.draws.members(task.first, task.count)
    columns = dict(zip(task.draws.names, drawn.values.T, strict=True))
    answer = _prepared(task.question)(task.count, columns, kept)
    outside = np.array([bool(trouble) for trouble in drawn.troubles])
    troubles = [first or other for first, other in zip(drawn.troubles, answer.troubles, strict=True)]
    for figure in answer.figures.values():
        figure[outside] = np.nan
    if answer.histories is not None:
        answer.histories[outside[: len(answer.histories)]] = np.nan
    return answer._replace(troubles=troubles, beyond=drawn.beyond)


@lru_cache(maxsize=2)
def _prepared(question: bytes) -> Ask:
    made: Question = pickle.loads(question)
    return made.prepared()
