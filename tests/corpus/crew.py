"""Workers that run jobs of the corpus, each in a process of its own."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue

from tests.corpus.inputs import RESULTS, plain, shortened, thinned
from tests.corpus.worker import Job, Outcome, Worker


class Crew:
    """Workers side by side, and the inputs that the program itself has to make, each made once."""

    def __init__(self) -> None:
        self._free: SimpleQueue[Worker] = SimpleQueue()
        self._workers = [Worker() for _ in range(os.cpu_count() or 1)]
        self._made: dict[str, bytes] = {}
        for worker in self._workers:
            self._free.put(worker)

    def run(self, each: Job) -> Outcome:
        worker = self._free.get()
        try:
            return worker.run(each)
        finally:
            self._free.put(worker)

    def all(self, jobs: list[Job]) -> list[Outcome]:
        with ThreadPoolExecutor(len(self._workers)) as pool:
            return list(pool.map(self.run, jobs))

    def made(self, name: str) -> bytes:
        if name not in self._made:
            self._made[name] = self._make(name)
        return self._made[name]

    def _make(self, name: str) -> bytes:
        if name == "water.csv":
            return thinned(self._written(["yaw", name, "--simulate", "rig.toml"], name), 20)
        if name == "ship.fmu":
            return self._written(["export", "card.toml", "-o", name], name)
        return shortened(self._written([*RESULTS[name], "--json", name], name))

    def _written(self, command: list[str], name: str) -> bytes:
        outcome = self.run(Job(command[0], -1, command[1:], plain(), "", "", keeps=name))
        assert outcome.code == 0 and outcome.kept is not None, f"{command}: {outcome}"
        return outcome.kept

    def close(self) -> None:
        for worker in self._workers:
            worker.close()
