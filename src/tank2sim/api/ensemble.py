"""Ensembles: how many members, from which seed, computed where."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass

from tank2sim.arguments import ENSEMBLE
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES, check_executor, executing
from tank2sim.memory import refuse_beyond_memory

FEW = 64
"""Members that are computed in this process: fewer are done before others have started. Project choice."""

FEW_IN_LANES = 4000
"""The same of members that run in lanes, a millisecond each. Project choice."""


_BYTES = 400
"""Bytes of a member: some 25 figures, and as many again where quantiles are taken. Project choice, four times what a
turning circle of 20 s takes."""


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
        The executor cannot be used, there are fewer than 2 members, or an executor but no members.
    """

    members: int = 0
    seed: int = 0
    executor: str = PROCESSES

    def __post_init__(self) -> None:
        ENSEMBLE.checked("members", self.members)
        if check_executor(self.executor) != PROCESSES and not self.members:
            raise InputError("--executor", "", "has nothing to do without --ensemble", "give --ensemble N, too")
        if self.members and self.members < 2:
            raise InputError("--ensemble", "", f"is {self.members}", "2 members or more, or 0 for no ensemble")
        refuse_beyond_memory("members", self.members, _BYTES)

    @contextmanager
    def computing(self, few: int = FEW) -> Iterator[Executor | None]:
        """The executor; None for at most `few` members, which are computed here."""
        if self.executor == PROCESSES and self.members <= few:
            yield None
            return
        with executing(self.executor) as found:
            yield found
