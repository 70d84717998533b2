"""The demo from end to end: files one after the other, each whole, and a page at the end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tank2sim.answer.page import Page, render_page
from tank2sim.apps.demo import PAGE
from tank2sim.apps.demo.fmu_helpers import Workshop
from tank2sim.apps.demo.mariner import mariner
from tank2sim.apps.demo.towed import towed_vehicle


def write_demo(folder: Path, begin: Callable[[str], None]) -> dict[str, object]:
    """Run the demo into an existing folder, and return its figures.

    `begin` is called at each of :data:`tank2sim.apps.demo.DEMO_STEPS`.

    A demo that is stopped half-way leaves whole files of what it had finished, and a second one replaces them.

    Raises
    ------
    InputError
        There is no C compiler, or a file cannot be written.
    """
    workshop = Workshop(folder, begin)
    towed, ship = towed_vehicle(workshop), mariner(workshop)
    begin("writing the page")
    mass = towed.figures[0]
    diameter = next(figure for figure in ship.figures if figure.label.startswith("Tactical diameter"))
    page = Page(
        title="From tank to simulator",
        subtitle="Five tows of a vehicle and the Mariner: measured, identified, simulated, exported, checked",
        verdict=(
            "Measured tows and a published ship have become FMUs, each checked against an independent solution. "
            f"The vehicle moves as {mass.value} {mass.unit}; the Mariner's tactical diameter at 35 deg of rudder is "
            f"{diameter.value:.4g} {diameter.unit}."
        ),
        figures=[*towed.figures, *ship.figures],
        sections=[*towed.sections, *ship.sections],
    )
    workshop.write(PAGE, render_page(page))
    return {"towed_vehicle": towed.result, "mariner": ship.result, "files": workshop.files}
