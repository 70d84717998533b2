"""Acceptance of an FMU: its reference result replayed in its own library, and its passport."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.fmu.passport import PASSPORT_FILE, PASSPORT_PAGE, Replay, passport
from tank2sim.fmu.passport_pictures import passport_pictures
from tank2sim.fmu.platforms import host_platform
from tank2sim.fmu.process import Drive, drive_apart
from tank2sim.fmu.provenance import Documents
from tank2sim.fmu.reference import reference_errors
from tank2sim.fmu.reference_run import ReferenceRun, reference_run
from tank2sim.fmu.templates import render
from tank2sim.fmu.unpacking import unpack
from tank2sim.simulation.run import Run
from tank2sim.units import in_words

_WRONG = 1e-3
"""Largest error of an output, relative to its range, of a library that is exported. Project choice: rounding makes
1e-9 at most, and a compiler that calculates wrongly more than this."""

_TITLES = {"zigzag_20_20": "Zigzag 20/20", "turn_35": "Turning circle, rudder 35 deg to starboard"}


@dataclass(frozen=True)
class AcceptanceResult:
    """The model's own answers to standard manoeuvres."""

    model: Model
    reference: ReferenceRun | None  # The reference run; None if the motion leaves all bounds
    manoeuvres: Mapping[str, Run]  # Standard manoeuvres of a ship, by name

    def reference_files(self) -> dict[str, str]:
        """Name in the FMU to text of the reference result."""
        return self.reference.files() if self.reference else {}

    def passport_files(self, documents: Documents, fmu: bytes, fmi: int) -> dict[str, str]:
        """Name in the FMU to text: the passport for machines and as a page, with what the FMU `fmu` itself answered.

        Raises InputError: its library does not run here, or answers with something else than the model.
        """
        replay = replay_in_fmu(fmu, self.reference, self.model, fmi)
        error = replay.max_error or 0.0
        if replay.platform and (replay.problem or not error <= _WRONG):
            wrong = replay.problem or f"{replay.output} differs from the model by {100 * error:.3g} % of its range"
            problem = f"the library that the C compiler made for this machine does not work ({wrong})"
            remedy = "name another compiler in the environment variable CC, and its own flags alone"
            raise InputError(f"binaries/{replay.platform}", "", problem, remedy)
        return passport_files(self.model, documents, self.manoeuvres, replay)


def gather(model: Model) -> AcceptanceResult:
    """Reference run and figures of a model."""
    return AcceptanceResult(model, *reference_run(model))


def replay_in_fmu(fmu: bytes, reference: ReferenceRun | None, model: Model, fmi: int) -> Replay:
    """Answer of the FMU's library to its reference run, if there is a library for this machine."""
    if reference is None:
        return Replay(problem="there is none, because the motion leaves all bounds")
    names: dict[str, tuple[str, ...]] = {"inputs": reference.input_names, "outputs": reference.output_names}
    with tempfile.TemporaryDirectory(prefix="tank2sim-", ignore_cleanup_errors=True) as folder:
        path = Path(folder, "ship.fmu")
        path.write_bytes(fmu)
        try:
            platform = host_platform().folder(fmi)
            unpacked = unpack(path, Path(folder, "unpacked"))
        except InputError as error:
            return Replay(run=reference.title, problem=f"on the machine that wrote the FMU it {error.problem}")
        answer = drive_apart(unpacked, Drive(kind="CoSimulation", run=reference.run, parameters=(), **names))
    if answer.outputs is None:  # `tank2sim check` fails, too
        return Replay(run=reference.title, platform=platform, problem=answer.problem)
    errors = reference_errors(model, reference.outputs, dict(zip(model.outputs, answer.outputs.T, strict=True)))
    worst = max(errors, key=lambda name: errors[name])
    return Replay(run=reference.title, platform=platform, max_error=errors[worst], output=worst)


_CARDS = (("turn_35", "advance_m"), ("turn_35", "tactical_diameter_m"), ("zigzag_20_20", "overshoots_deg"))
"""Figures at the top of the page."""


def _cards(figures: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str, str]]:
    """Label, value and unit of the figures at the top of the page; of the overshoots, the first one alone."""
    cards = []
    for run, name in _CARDS:
        value = figures.get(run, {}).get(name)
        first = value[0] if isinstance(value, list) and value else value
        if isinstance(first, float):
            words, unit = in_words(name)
            label = "first overshoot" if name == "overshoots_deg" else words
            cards.append((f"{_TITLES[run].partition(',')[0]}: {label}", f"{first:.4g}", unit))
    return cards


def passport_files(model: Model, documents: Documents, manoeuvres: Mapping[str, Run], replay: Replay) -> dict[str, str]:
    """Name in the FMU to text: the passport for machines and as a page."""
    made = passport(model, documents, manoeuvres, replay)
    page = {
        "passport": made,
        "version": version("tank2sim"),
        "file": PASSPORT_FILE,
        "titles": _TITLES,
        "pictures": passport_pictures(manoeuvres),
        "cards": _cards(made.figures),
        "words": in_words,
        "shown": _shown,
    }
    return {PASSPORT_FILE: made.as_json(), PASSPORT_PAGE: render("passport.html", page)}


def _shown(figure: object) -> str:
    match figure:
        case None:
            return "not reached"
        case float():
            return f"{figure:.4g}"
        case list() | tuple():
            return ", ".join(_shown(value) for value in figure)
        case _:
            return str(figure)
