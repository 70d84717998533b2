"""FMUs of ships: written, and checked against their cards."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tank2sim.api.verbs import Output, Progress, Written, verb
from tank2sim.errors import ArgumentError
from tank2sim.files import FMU, SYSTEM
from tank2sim.notices import Notice, foremost

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.results.fmu import CheckResult, ExportResult

HOSTS = {
    "unity": "Unity with CATIA-Systems' add-on",
    "unreal": "Unreal Engine with ORNL's plugin",
    "osp": "the engine of the Open Simulation Platform",
}
"""Programs whose conditions ``check`` knows."""


@verb(
    "the FMU, Model Exchange and Co-Simulation",
    Output("--c", (), "Write the ship as plain C99, too.", lambda result, path: result.c_files(path), "DIR"),
    name="export",
    results=("tank2sim.results.fmu:ExportResult",),
    charts=False,
)
def make_fmu_file(
    ship: Vessel,
    output: Annotated[Path, Written(FMU, "SHIP.fmu")],
    *,
    fmi: Literal[2, 3] = 2,
    platforms: str = "host",
    sources: bool = True,
    ssp: Annotated[Path, Written(SYSTEM, "SYSTEM.ssp")] | None = None,
    ssp_inputs: bool = False,
    osp: bool = False,
    lean: bool = False,
    report: Progress = lambda _: None,
) -> ExportResult:
    """Make the FMU (Model Exchange and Co-Simulation) of a ship.

    Parameters
    ----------
    ship : Vessel
    output : path
        The FMU.
    fmi : int
        Version of FMI.
    platforms : str
        Platforms of the libraries: ``host``, ``all``, or names with commas between, of x86_64-linux, aarch64-linux,
        x86_64-windows, x86_64-darwin, aarch64-darwin.
    sources : bool
        With the C sources and the ship card, or without them and with coefficients that cannot be read or tuned.
    ssp : path, optional
        Also an SSP package in which a heading autopilot steers the ship.
    ssp_inputs : bool
        Make every input in that package a connector, also those that nothing is joined to.
    osp : bool
        Also OspSystemStructure.xml and the OSP model description, next to the FMU (FMI 2).
    lean : bool
        With few variables, for game engines: inputs without ``external.*`` and failures, the states, speed, heading,
        revolutions and validity, and where and how fast the ship starts.
    report : callable
        Called with the stage that begins.

    Raises
    ------
    InputError
        No compiler is found, or a platform is not known.
    """
    from tank2sim.dynamics.simulator_interface import with_simulator_interface
    from tank2sim.fmu.export import make_fmu, named_after, without_coefficients
    from tank2sim.fmu.hosts import lean_model
    from tank2sim.fmu.osp import osp_system
    from tank2sim.fmu.platforms import named_platforms
    from tank2sim.fmu.provenance import documents_of, documents_without_card
    from tank2sim.results.fmu import ExportResult, ExportStudy

    _refuse_without_package(ssp, ssp_inputs, lean)
    chosen = named_platforms(platforms)
    model = with_simulator_interface(ship.model)
    if lean:
        model = lean_model(model)
    documents = named_after(documents_of(ship.card) if sources else documents_without_card(ship.card), output)
    written = model if sources else without_coefficients(model)
    made = make_fmu(written, fmi=fmi, documents=documents, platforms=chosen, report=report, sources=sources)
    files: dict[Path, str | bytes] = {output: made.content}
    if ssp:
        from tank2sim.fmu.ssp import ship_with_autopilot

        files[ssp] = ship_with_autopilot(model, made, every_input=ssp_inputs, platforms=chosen, report=report)
    if osp:
        files |= {
            output.parent / name: text for name, text in osp_system(model, output.name, made.model_identifier).items()
        }
    study = ExportStudy(
        ship=ship.name,
        fmu=str(output),
        ssp=str(ssp) if ssp else None,
        fmi=made.fmi,
        model_identifier=made.model_identifier,
        token=made.token,
        platforms=made.platforms,
        size_bytes=len(made.content),
        notices=(*ship.model.notices, *(_renamed(output, made.model_identifier) if lean else ())),
    )
    return ExportResult(study, made, files, ship.card)


def _refuse_without_package(ssp: Path | None, ssp_inputs: bool, lean: bool) -> None:
    if ssp_inputs and ssp is None:
        raise ArgumentError("ssp_inputs", "", "needs an SSP package", "give ssp too")
    if lean and ssp:
        raise ArgumentError("lean", "", "lacks what an autopilot is designed with", "leave ssp or lean out")


def _renamed(output: Path, identifier: str) -> tuple[Notice, ...]:
    """A notice to users of game engines where the file has a name that the model cannot have."""
    if output.stem == identifier:
        return ()
    text = (
        f"modelName is {identifier}, which differs from the name of the file: Unity and Unreal do not find such an FMU "
        "(letters, digits and _, at most 60, a letter first)"
    )
    return (Notice(text),)


@verb(
    "an FMU validated, and compared with its reference",
    name="check",
    results=("tank2sim.results.fmu:CheckResult",),
    choices={"host": HOSTS},
    options={"host": "--for"},
)
def check_fmu(
    fmu: str | Path,
    card: Vessel | str | Path | None = None,
    *,
    host: Literal["unity", "unreal", "osp"] | None = None,
) -> CheckResult:
    """Validate an FMU and compare its outputs with the model of its card, in every kind of FMI it offers.

    It runs the FMU's own code with your rights: check only files from sources that you trust. The command ends with
    exit code 1 if the description is not valid or an output differs.

    Parameters
    ----------
    fmu : path
        FMI 2.0 or 3.0, with a library for this machine.
    card : Vessel, optional
        What the FMU should be: a card, or the name of a bundled ship; by default the card inside it.
    host : str, optional
        A program whose conditions the FMU is to meet, too; one that is not met is a failure.

    Raises
    ------
    InputError
        The file is missing, not an FMU, of another version of FMI, or has no library for this machine.
    """
    from tank2sim.cards import parse_card
    from tank2sim.dynamics import build
    from tank2sim.dynamics.simulator_interface import with_simulator_interface
    from tank2sim.dynamics.vessel import as_vessel
    from tank2sim.fmu.check import compare_with_model
    from tank2sim.fmu.unpacking import embedded_card
    from tank2sim.results.fmu import CheckResult

    path = Path(fmu)
    text = embedded_card(path) if card is None else None
    inside = build(parse_card(text, f"{path}: resources/ship.toml")) if text is not None else None
    model = inside if card is None else as_vessel(card).model
    report = compare_with_model(path, model=model and with_simulator_interface(model), host=host)
    lacking = Notice(
        "the FMU carries no card, so that its equations were not compared; for an FMU without sources give its card"
    )
    doubts = foremost(model.notices) if model else ()
    notices = (*report.notices, *doubts, *(() if report.compared else (lacking,)))
    return CheckResult(replace(report, notices=notices))
