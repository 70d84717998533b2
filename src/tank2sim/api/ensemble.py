"""Ensembles: how many members, from which seed, computed where."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass

from tank2sim.arguments import ENSEMBLE, PROCESSES
from tank2sim.errors import ArgumentError
from tank2sim.executors import check_executor, executing
from tank2sim.memory import refuse_beyond_memory

FEW = 64
"""Members that are computed in this process: fewer are done before others have started. Project choice."""

FEW_IN_LANES = 4000
"""The same number for members that run in lanes, which take a millisecond each. Project choice."""

_BYTES = 400
"""Bytes of a member: about 25 figures, twice where quantiles are taken. Project choice: four times the need of a
turning circle of 20 s."""


@dataclass(frozen=True)
class EnsembleOptions:
    """An ensemble drawn from the standard errors of a card.

    Parameters
    ----------
    members : int
        Ships drawn; 0 for no ensemble.
    seed : int
        The same seed gives the same members everywhere.
    executor : str
        ``processes`` or ``dask://host:port``.

    Raises
    ------
    InputError
        The executor cannot be used, there is one member, or an executor or a seed without members.
    """

    members: int = 0
    seed: int = 0
    executor: str = PROCESSES

    def __post_init__(self) -> None:
        ENSEMBLE.checked("members", self.members)
        for name, given in (("executor", check_executor(self.executor) != PROCESSES), ("seed", self.seed != 0)):
            if given and not self.members:
                raise ArgumentError(name, "", "has no effect without members", "give members, too, or leave it out")
        if self.members == 1:
            raise ArgumentError("members", "", "is 1", "give 2 or more, or 0 for no ensemble")
        refuse_beyond_memory("members", self.members, _BYTES)

    @contextmanager
    def computing(self, few: int = FEW) -> Iterator[Executor | None]:
        """The executor; None for at most `few` members, which are computed here."""
        if self.executor == PROCESSES and self.members <= few:
            yield None
            return
        with executing(self.executor) as found:
            yield found
