"""A ship as one file of C99: the files, and what single precision loses, measured where there is a compiler."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from tank2sim.apps.programs.program_files import FigureChange, ProgramFiles, figure_changes
from tank2sim.arrays import Array
from tank2sim.cards import Card, SteeredBy, SteeredCard
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.fmu.c99 import TOLERANCES, PlainShip, plain_ship
from tank2sim.native.compiler import find_compiler
from tank2sim.native.library import cached_library
from tank2sim.simulation.integrator import Integrator

# Half a unit in the last place of an angle of 2 to 4 rad, on the radius of the earth
_GEODETIC = "position.latitude and position.longitude in float are rounded to 0.8 m: take motion.x and motion.y"


def c99_files(card: Card) -> ProgramFiles:
    """A card as ``ship.h``, ``ship.c`` and ``self_test.c``.

    The figures of standard manoeuvres by the compiled files in double precision are the changes; what float changes of
    them is among the losses. Without a C compiler, or for a card without standard manoeuvres, there are neither.

    Raises InputError: The card names what no model knows.
    """
    made = plain_ship(card)
    model = with_simulator_interface(build(card))
    geodetic = (_GEODETIC,) if "position.latitude" in model.outputs else ()
    if not isinstance(card, SteeredCard) or find_compiler() is None:
        why = "the card has no standard manoeuvres" if find_compiler() else "no C compiler was found"
        sentence = f"how far float changes manoeuvres was not measured ({why}); self_test.c allows {TOLERANCES[1]:g}"
        return ProgramFiles(files=made.files, use=made.use, losses=(sentence, *geodetic))
    before = model if card.steered_by is SteeredBy.RUDDER else build(card)
    changes, in_float = (
        figure_changes(card, before, model, PlainIntegrator(model, made, single=single)) for single in (False, True)
    )
    return ProgramFiles(files=made.files, use=made.use, losses=(_loss_of_float(in_float), *geodetic), changes=changes)


def _loss_of_float(changes: Sequence[FigureChange]) -> str:
    """The figures that float changes most, in percent and, of angles, in degrees."""
    worst: dict[str, tuple[float, FigureChange]] = {}
    for one in changes:
        if one.before is None or one.after is None:
            continue
        unit = "deg" if one.figure.endswith("_deg") else "percent"
        size = abs(one.after - one.before) * (1.0 if unit == "deg" else 100 / max(abs(one.before), 1e-9))
        if size >= worst.get(unit, (0.0, one))[0]:
            worst[unit] = size, one
    parts = [
        f"by {size:.2g} {'deg' if unit == 'deg' else '%'} ({one.figure} of {one.manoeuvre})"
        for unit, (size, one) in worst.items()
    ]
    return f"in single precision figures of standard manoeuvres change at most {' and '.join(parts)}"


class PlainIntegrator(Integrator):
    """Takes the steps of a model with a simulator's interface by its files of C99, compiled here, in `single` precision
    or double; outputs are evaluated by the model. Raises InputError: There is no C compiler that works.
    """

    def __init__(self, model: Model, made: PlainShip, *, single: bool = False):
        super().__init__(model)
        self._real = np.float32 if single else np.float64
        flags = ["-fvisibility=default", *([f"-D{made.prefix.upper()}_SINGLE"] if single else [])]
        sources = {name: made.files[name] for name in ("ship.h", "ship.c")}
        library = ctypes.CDLL(str(cached_library(sources, flags=flags)))
        number = ctypes.c_float if single else ctypes.c_double
        self._step, self._parameter = library[f"{made.prefix}_step"], library[f"{made.prefix}_set_parameter"]
        self._step.argtypes = [ctypes.c_void_p, number]
        self._parameter.argtypes = [ctypes.c_void_p, ctypes.c_uint32, number]
        self._instance = np.zeros(sum(made.counts.values()), self._real)
        ends = np.cumsum([made.counts[name] for name in ("states", "inputs", "outputs", "parameters")])
        self._x, self._u, _, self._p = np.split(self._instance, ends)[:4]

    def rollout(self, x: Array, u: Array, p: Array, h: float, n: int) -> Array:
        """As of any integrator.

        Raises InputError: The states leave all bounds.
        """
        self._x[:], self._u[:], self._p[:] = x, u, p
        place = self._instance.ctypes.data
        self._parameter(place, 0, p[0])  # which computes the constants
        states = np.empty((n + 1, len(x)))
        states[0] = x
        for k in range(n):
            if self._step(place, h) != 0 and h > 0:
                raise self.model.fault("", "the motion leaves all bounds in ship.c", "check the card")
            states[k + 1] = self._x
        return states
