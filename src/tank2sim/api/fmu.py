"""FMUs of ships: written, and checked against their cards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.bounds import checked
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.fmu.check import compare_with_model as check_against_model
from tank2sim.fmu.export import make_fmu, without_coefficients
from tank2sim.fmu.osp import osp_notices, osp_system
from tank2sim.fmu.platforms import named_platforms
from tank2sim.fmu.provenance import documents_of, documents_without_card
from tank2sim.fmu.unpacking import embedded_card
from tank2sim.marks import marked
from tank2sim.results.fmu import CheckResult, ExportResult, ExportStudy

if TYPE_CHECKING:
    from tank2sim.api.ship import Ship


def make_fmu_file(
    ship: Ship,
    path: Path,
    *,
    fmi: int = 3,
    platforms: str = "host",
    ssp: Path | None = None,
    ssp_inputs: bool = False,
    sources: bool = True,
    osp: bool = False,
    report: Callable[[str], None] = lambda _: None,
) -> ExportResult:
    """Make the FMU of a ship, without writing it: its bytes are in ``files``. Raises as :meth:`.Ship.to_fmu`.

    Parameters
    ----------
    ship : Ship
    path : Path
    fmi, platforms, sources
        As in :meth:`.Ship.to_fmu`.
    ssp : Path, optional
        Also an SSP package in which a heading autopilot steers the ship.
    ssp_inputs : bool
        Every input in that package is a connector: see :func:`tank2sim.fmu.ssp.ship_with_autopilot`.
    osp : bool
        Also the files of :func:`tank2sim.fmu.osp.osp_system`, next to the FMU.
    report : callable
        Called with the stage that begins.
    """
    chosen = named_platforms(platforms)
    model = with_simulator_interface(ship.model)
    if sources:
        made = make_fmu(model, fmi=fmi, documents=documents_of(ship.card), platforms=chosen, report=report)
    else:
        bare, documents = without_coefficients(model), documents_without_card(ship.card)
        made = make_fmu(bare, fmi=fmi, documents=documents, platforms=chosen, report=report, sources=False)
    files: dict[Path, str | bytes] = {path: made.content}
    if ssp:
        from tank2sim.fmu.ssp import ship_with_autopilot

        files[ssp] = ship_with_autopilot(model, made, every_input=ssp_inputs, platforms=chosen, report=report)
    if osp:
        files |= {path.parent / name: text for name, text in osp_system(model, path.name).items()}
    study = ExportStudy(
        ship=ship.name,
        fmu=str(path),
        ssp=str(ssp) if ssp else None,
        fmi=made.fmi,
        model_identifier=made.model_identifier,
        token=made.token,
        platforms=made.platforms,
        size_bytes=len(made.content),
        notices=(*ship.model.notices, *(osp_notices(model) if osp else ())),
    )
    return ExportResult(study, made, files)


@checked
def check_fmu(path: str | Path, card: Ship | None = None) -> CheckResult:
    """Validate an FMU and compare its outputs with the model of its card, in every kind of FMI it offers.

    It runs the FMU's own code with your rights: check only files from sources that you trust.

    Parameters
    ----------
    path : path
        FMI 2.0 or 3.0, with a library for this machine.
    card : Ship, optional
        What the FMU should be; by default the card inside it.

    Raises
    ------
    InputError
        The file is missing, not an FMU, of another version of FMI, or has no library for this machine.
    """
    text = embedded_card(Path(path)) if card is None else None
    inside = build(parse_card(text, f"{path}: resources/ship.toml")) if text is not None else None
    model = inside if card is None else card.model
    report = check_against_model(Path(path), model=model and with_simulator_interface(model))
    lacking = "the FMU carries no card: only its description was validated; give --card to compare"
    doubts = marked(model.notices) if model else ()
    return CheckResult(replace(report, notices=(*doubts, *(() if report.compared else (lacking,)))))
