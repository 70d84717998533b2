"""An ensemble: one question asked of many ships, each with parameters drawn from what is uncertain.

Each member draws from a stream of its own, made of the seed and its number alone, so that an ensemble is the same
to the bit whoever computes it, in whatever batches and order. Batches are handed to any executor.
"""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tank2sim.arrays import Array

Histories = NDArray[np.float32]

BATCH = 32
"""Members of a batch: long against what handing one over takes, short against the whole (project choice)."""

KEPT = 10_000
"""Members whose histories are kept for the bands of tracks, 4 bytes a sample: the first ones. The share below a
quantile is known from them to 0.2 %; figures are those of all members (project choice)."""


DRAWS = 1000
"""Times that a member is drawn until it is within all bounds (project choice). Nearly all are at once; of parameters
on their bound every other draw is, of ten such still one of a thousand."""

NOT_WITHIN = f"not one of {DRAWS} draws is within the bounds of all parameters"


@dataclass(frozen=True, eq=False)
class Draws:
    """How the parameters of members are drawn: normal, about the card's values.

    Parameters
    ----------
    names : tuple of str
        The k parameters of the model that are uncertain.
    mean : array (k,)
    root : array (k, k)
        A root of their covariance: root @ root.T.
    lowest, highest : array (k,)
        Values that the parameters cannot leave. What is drawn beyond is drawn again as a whole, from the same stream:
        the normal distribution cut off there, in which numbers still go together. Put at the bound they would not.
    seed : int
    """

    names: tuple[str, ...]
    mean: Array
    root: Array
    lowest: Array
    highest: Array
    seed: int

    def member(self, number: int) -> dict[str, float]:
        """Parameters of a member, by name."""
        return self.drawn(number).values

    def drawn(self, number: int) -> Drawn:
        """A member, from numpy's ``SeedSequence(seed, spawn_key=(number,))``: the first draw within the bounds."""
        stream = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(number,)))
        beyond: tuple[str, ...] = ()
        for draw in range(DRAWS):
            # Summed by NumPy, row by row: a library of linear algebra sums in an order of each processor's own.
            values = self.mean + (self.root * stream.standard_normal(len(self.names))).sum(axis=1)
            outside = (values < self.lowest) | (values > self.highest)
            if not outside.any():
                return Drawn(dict(zip(self.names, values.tolist(), strict=True)), beyond)
            if draw == 0:
                beyond = tuple(name for name, out in zip(self.names, outside, strict=True) if out)
        held = np.clip(values, self.lowest, self.highest)
        return Drawn(dict(zip(self.names, held.tolist(), strict=True)), beyond, trouble=NOT_WITHIN)


class Drawn(NamedTuple):
    """Parameters of a member by name; those that were beyond a bound in the first draw; and, if every draw was, why it
    cannot be used (the values then are those of the last, at the bounds)."""

    values: dict[str, float]
    beyond: tuple[str, ...] = ()
    trouble: str = ""


class MemberResult(NamedTuple):
    """What one member answers: figures by name, histories (signals, times), nan where it shows none; why a member
    cannot be used, if so; and, put in by :func:`ensemble`, the parameters for which it was drawn again."""

    figures: Mapping[str, float]
    histories: Histories | None = None
    trouble: str = ""
    beyond: tuple[str, ...] = ()


Ask = Callable[[Sequence[Mapping[str, float]]], Sequence[MemberResult]]
"""From the parameters of members, all of the same names, to the answer of each, which does not depend on the others."""


class Question(Protocol):
    """What is asked of every member; it is sent to other processes."""

    def prepared(self) -> Ask:
        """What answers it, made once in each process."""


@dataclass(frozen=True)
class Redrawn:
    """How many members were drawn again, and the parameters that had been beyond their bounds, to how many times."""

    members: int
    beyond: Mapping[str, int]

    @staticmethod
    def of(beyond: Sequence[tuple[str, ...]]) -> Redrawn:
        """From the parameters that were beyond in the first draw of each member."""
        counted = Counter(name for names in beyond for name in names)
        return Redrawn(sum(map(bool, beyond)), dict(counted.most_common()))

    def in_words(self, members: int) -> list[str]:
        """What the user should know of it, of so many members."""
        if not self.members:
            return []
        which = ", ".join(f"{name} {count}" for name, count in self.beyond.items())
        share = 100 * self.members / members
        return [
            f"{self.members} of {members} members ({share:.2g} %) were drawn again, being beyond what numbers can be "
            f"({which}): their distribution is normal, cut off there"
        ]


@dataclass(frozen=True, eq=False)
class Ensemble:
    """What the members of an ensemble answer.

    Parameters
    ----------
    members, seed : int
    figures : mapping
        Name to the figures of all members (members,); nan where one does not show it.
    histories : array (kept, signals, times), or None
        Of the first members, at most :data:`KEPT`.
    unusable : mapping
        Why members cannot be used, to how many.
    redrawn : Redrawn
    """

    members: int
    seed: int
    figures: Mapping[str, Array]
    histories: Histories | None = None
    unusable: Mapping[str, int] = field(default_factory=dict)
    redrawn: Redrawn = field(default_factory=lambda: Redrawn(0, {}))

    @property
    def usable(self) -> int:
        """Members that can be used."""
        return self.members - sum(self.unusable.values())

    @property
    def notices(self) -> list[str]:
        """What the user should know: members that were drawn again, or that cannot be used."""
        messages = [f"{count} of {self.members} members cannot be used: {why}" for why, count in self.unusable.items()]
        return [*self.redrawn.in_words(self.members), *messages]


def ensemble(
    question: Question, draws: Draws, members: int, executor: Executor | None = None, *, batch: int = BATCH
) -> Ensemble:
    """Ask `members` ships, in batches of `batch`, here or by an executor; the result depends on neither."""
    sent = pickle.dumps(question)
    tasks = [_Task(sent, draws, first, min(batch, members - first)) for first in range(0, members, batch)]
    figures: dict[str, Array] = {}
    histories: Histories | None = None
    unusable: Counter[str] = Counter()
    beyond: list[tuple[str, ...]] = []
    for number, answer in enumerate(_in_order(tasks, executor)):
        beyond.append(answer.beyond)
        if answer.trouble:
            unusable[answer.trouble] += 1
        for name, value in answer.figures.items():
            if name not in figures:
                figures[name] = np.full(members, np.nan)
            figures[name][number] = value
        if answer.histories is not None and number < KEPT:
            if histories is None:
                histories = np.full((min(members, KEPT), *answer.histories.shape), np.nan, dtype=np.float32)
            histories[number] = answer.histories
    return Ensemble(members, draws.seed, figures, histories, dict(sorted(unusable.items())), Redrawn.of(beyond))


@dataclass(frozen=True, eq=False)
class _Task:
    """A batch of members, and what another process needs to know of them."""

    question: bytes
    draws: Draws
    first: int
    count: int


def _in_order(tasks: list[_Task], executor: Executor | None) -> Iterator[MemberResult]:
    batches = map(_answers, tasks) if executor is None else executor.map(_answers, tasks)
    for batch in batches:
        yield from batch


def _answers(task: _Task) -> list[MemberResult]:
    ask = _prepared(task.question)
    numbers = range(task.first, task.first + task.count)
    drawn = [task.draws.drawn(number) for number in numbers]
    found = []
    for number, one, answer in zip(numbers, drawn, ask([one.values for one in drawn]), strict=True):
        told = MemberResult({}, trouble=one.trouble) if one.trouble else answer
        histories = told.histories if number < KEPT else None
        found.append(told._replace(histories=histories, beyond=one.beyond))
    return found


@lru_cache(maxsize=2)
def _prepared(question: bytes) -> Ask:
    made: Question = pickle.loads(question)
    return made.prepared()
