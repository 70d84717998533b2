"""Ensembles: how many members, from which seed, computed where."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TypeVar

from tank2sim.analysis.ensemble.results import EnsembleRequest
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


_T = TypeVar("_T")


@dataclass(frozen=True)
class EnsembleOptions(EnsembleRequest):
    """An ensemble drawn from the standard errors of a card (none with 0 members), and its executor.

    Raises InputError: the executor cannot be used, there is one member, or an executor or a seed without members.
    """

    executor: str = PROCESSES

    def __post_init__(self) -> None:
        ENSEMBLE.checked("members", self.members)
        for name, given in (("executor", check_executor(self.executor) != PROCESSES), ("seed", self.seed != 0)):
            if given and not self.members:
                raise ArgumentError(name, "", "has no effect without members", "give members, too, or leave it out")
        if self.members == 1:
            raise ArgumentError("members", "", "is 1", "give 2 or more, or 0 for no ensemble")
        refuse_beyond_memory("members", self.members, _BYTES)

    def drawn(self, bands: Callable[[EnsembleRequest, Executor | None], _T], few: int = FEW) -> _T | None:
        """Return the bands of the ensemble, None without one; at most `few` members are computed in this process."""
        if not self.members:
            return None
        if self.executor == PROCESSES and self.members <= few:
            return bands(self, None)
        with executing(self.executor) as computing:
            return bands(self, computing)
