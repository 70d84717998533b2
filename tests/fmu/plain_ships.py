"""Ships in plain C99, compiled and driven; shared by several tests."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np

from tank2sim.fmu.c99 import PlainShip
from tank2sim.fmu.manoeuvre import InputSequence
from tank2sim.native.library import cached_library

STRICT = (
    *("-std=c99", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-pedantic"),
    *("-Wdouble-promotion", "-Wshadow", "-Wvla"),
)


def macro(made: PlainShip, single: bool) -> list[str]:
    return [f"-D{made.prefix.upper()}_SINGLE"] if single else []


def written(made: PlainShip, folder: Path) -> Path:
    folder.mkdir(exist_ok=True, parents=True)
    for name, text in made.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def call(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)


class CompiledShip:
    """An instance in a library made of the files."""

    def __init__(self, made: PlainShip, *, single: bool = False):
        self.made, self.real = made, ctypes.c_float if single else ctypes.c_double
        flags = ["-fvisibility=default", *macro(made, single)]
        sources = {name: made.files[name] for name in ("ship.h", "ship.c")}
        self.library = ctypes.CDLL(str(cached_library(sources, flags=flags)))
        self.memory = np.zeros(sum(made.counts.values()), np.dtype(self.real))
        self.call("init")

    def call(self, name: str, *arguments: object) -> int:
        return int(self.library[f"{self.made.prefix}_{name}"](ctypes.c_void_p(self.memory.ctypes.data), *arguments))

    def set(self, place: int, value: float) -> int:
        return self.call("set", ctypes.c_uint32(place), self.real(value))

    def set_parameter(self, place: int, value: float) -> int:
        return self.call("set_parameter", ctypes.c_uint32(place), self.real(value))

    def step(self, dt: float) -> int:
        return self.call("step", self.real(dt))

    @property
    def outputs(self) -> np.ndarray:
        begin = self.made.counts["states"] + self.made.counts["inputs"]
        return self.memory[begin : begin + self.made.counts["outputs"]]

    def drive(self, run: InputSequence) -> np.ndarray:
        """Outputs (K, ny) after each step of a run."""
        rows = []
        for dt, inputs in zip(np.diff(run.times), run.inputs, strict=True):
            assert all(self.set(place, value) == 0 for place, value in enumerate(inputs))
            assert self.step(dt) == 0
            rows.append(self.outputs.copy())
        return np.array(rows)
