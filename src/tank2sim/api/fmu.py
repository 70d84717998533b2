"""FMUs of ships: written, and checked against their cards."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.cards import parse_card
from tank2sim.dynamics import build
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.fmu.check import CheckReport
from tank2sim.fmu.check import compare_with_model as check_against_model
from tank2sim.fmu.export import ExportedFmu, make_fmu, without_coefficients
from tank2sim.fmu.osp import osp_notices, osp_system
from tank2sim.fmu.platforms import named_platforms
from tank2sim.fmu.provenance import documents_of, documents_without_card
from tank2sim.fmu.unpacking import embedded_card
from tank2sim.marks import marked

if TYPE_CHECKING:
    from tank2sim.api.ship import Ship

Files = Mapping[Path, str | bytes]


class ExportResult(OldResult):
    """An FMU that was made.

    Parameters
    ----------
    ship : Ship
    path : Path
        Where it is written.
    exported : ExportedFmu
    ssp : Path or None
        SSP package in which a heading autopilot steers the ship.
    files : mapping
        Paths and bytes of both.
    notices : sequence of str
        Notices in addition to those of the model.
    """

    command = "export"

    def __init__(
        self,
        ship: Ship,
        path: Path,
        exported: ExportedFmu,
        ssp: Path | None = None,
        files: Files | None = None,
        notices: Sequence[str] = (),
    ) -> None:
        self.ship, self.path, self.exported, self.ssp = ship, path, exported, ssp
        self.files = files or {}
        self.notices = (*ship.model.notices, *notices)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        about = {"ship": self.ship.name, "fmu": self.path, "ssp": self.ssp}
        return {**about, **self.exported.as_json(), "notices": self.notices}

    @property
    def headline(self) -> tuple[str, ...]:
        """File, version of FMI, platforms and size."""
        return (
            f"{self.path}: {self.ship.name}, FMI {self.exported.fmi}, Model Exchange and Co-Simulation, "
            f"{', '.join(self.exported.platforms)}, {len(self.exported.content) / 1000:.0f} kB",
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """None."""
        return ()


class CheckResult(OldResult):
    """The check of an FMU against its card.

    Parameters
    ----------
    report : CheckReport

    Examples
    --------
    >>> import tank2sim as t2s
    >>> _ = t2s.load("mariner").to_fmu("mariner.fmu")
    >>> t2s.check_fmu("mariner.fmu").passed
    True
    """

    command = "check"

    def __init__(self, report: CheckReport, notices: tuple[str, ...] = ()) -> None:
        self.report = report
        self.notices = notices + (
            ()
            if report.compared
            else ("the FMU carries no card: only its description was validated; give --card to compare",)
        )

    @property
    def passed(self) -> bool:
        """True if the description is valid and no output differs from the model's by more than the limit."""
        return self.report.passed

    @property
    def problems(self) -> tuple[str, ...]:
        """What is wrong with the description or the outputs, one sentence each."""
        return (*self.report.validation, *self.report.differences)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return self.report.as_json()

    @property
    def headline(self) -> tuple[str, ...]:
        """Verdict, version of FMI and kinds; the error against the FMU's own reference result."""
        report = self.report
        verdict = ("passed" if report.compared else "valid") if report.passed else "FAILED"
        lines = [f"{report.path}: FMI {report.fmi}, {', '.join(report.kinds)}: {verdict}"]
        if report.reference_error is not None:
            error = f"largest error {report.reference_error:.1e} of a range"
            lines.append(f"{report.path}: repeats the reference result that it carries; {error}")
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Largest error of each output, relative to its range."""
        report = self.report
        if not report.errors:
            return ()
        rows: list[list[object]] = [
            [name, *(errors.get(name) for errors in report.errors.values())] for name in report.max_error
        ]
        rows.append(["limit", *(report.limits[kind] for kind in report.errors)])
        title = f"{report.path}: largest errors in {report.duration_s:g} s, relative to each output's range"
        return (screen_table(title, ("output", *report.errors), rows),)


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
    return ExportResult(ship, path, made, ssp, files, osp_notices(model) if osp else ())


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
    return CheckResult(report, tuple(marked(model.notices)) if model else ())
