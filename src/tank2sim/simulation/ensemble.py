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

from tank2sim.dynamics.model import Vector

Array = NDArray[np.float64]
Histories = NDArray[np.float32]

BATCH = 32
"""Members of a batch: long against what handing one over takes, short against the whole (ours)."""

KEPT = 10_000
"""Members whose histories are kept for the bands of tracks, 4 bytes a sample: the first ones. The share below a
quantile is known from them to 0.2 %; figures are those of all members (ours)."""


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
        What is drawn beyond these is taken to be there.
    seed : int
    """

    names: tuple[str, ...]
    mean: Vector
    root: Array
    lowest: Vector
    highest: Vector
    seed: int

    def member(self, number: int) -> dict[str, float]:
        """Parameters of a member, by name, from numpy's ``SeedSequence(seed, spawn_key=(number,))``."""
        stream = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(number,)))
        normal = stream.standard_normal(len(self.names))
        # Summed by NumPy, row by row: a library of linear algebra sums in an order of each processor's own.
        values = self.mean + (self.root * normal).sum(axis=1)
        return dict(zip(self.names, np.clip(values, self.lowest, self.highest).tolist(), strict=True))


class Answer(NamedTuple):
    """What one member answers: figures by name, histories (signals, times), nan where it shows none; and why a member
    cannot be used, if so."""

    figures: Mapping[str, float]
    histories: Histories | None = None
    trouble: str = ""


Ask = Callable[[Sequence[Mapping[str, float]]], Sequence[Answer]]
"""From the parameters of members, all of the same names, to the answer of each, which does not depend on the others."""


class Question(Protocol):
    """What is asked of every member; it is sent to other processes."""

    def prepared(self) -> Ask:
        """What answers it, made once in each process."""


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
    """

    members: int
    seed: int
    figures: Mapping[str, Array]
    histories: Histories | None = None
    unusable: Mapping[str, int] = field(default_factory=dict)

    @property
    def usable(self) -> int:
        """Members that can be used."""
        return self.members - sum(self.unusable.values())

    @property
    def notices(self) -> list[str]:
        """What the user should be told: members that cannot be used."""
        return [f"{count} of {self.members} members cannot be used: {why}" for why, count in self.unusable.items()]


def ensemble(
    question: Question, draws: Draws, members: int, executor: Executor | None = None, *, batch: int = BATCH
) -> Ensemble:
    """Ask `members` ships, in batches of `batch`, here or by an executor; the result depends on neither."""
    sent = pickle.dumps(question)
    tasks = [_Task(sent, draws, first, min(batch, members - first)) for first in range(0, members, batch)]
    figures: dict[str, Array] = {}
    histories: Histories | None = None
    unusable: Counter[str] = Counter()
    for number, answer in enumerate(_in_order(tasks, executor)):
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
    return Ensemble(members, draws.seed, figures, histories, dict(sorted(unusable.items())))


@dataclass(frozen=True, eq=False)
class _Task:
    """A batch of members, and what another process needs to know of them."""

    question: bytes
    draws: Draws
    first: int
    count: int


def _in_order(tasks: list[_Task], executor: Executor | None) -> Iterator[Answer]:
    batches = map(_answers, tasks) if executor is None else executor.map(_answers, tasks)
    for batch in batches:
        yield from batch


def _answers(task: _Task) -> list[Answer]:
    ask = _prepared(task.question)
    numbers = range(task.first, task.first + task.count)
    found = ask([task.draws.member(number) for number in numbers])
    return [one if number < KEPT else one._replace(histories=None) for number, one in zip(numbers, found, strict=True)]


@lru_cache(maxsize=2)
def _prepared(question: bytes) -> Ask:
    made: Question = pickle.loads(question)
    return made.prepared()
