"""The whole way on bundled data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tank2sim.apps.demo.result import DemoResult, DemoStudy
from tank2sim.arguments import checked
from tank2sim.files import plain_json, writable_folder
from tank2sim.native.compiler import require_compiler


@checked
def run_demo(folder: str | Path = "demo", *, report: Callable[[str], None] = lambda _: None) -> DemoResult:
    """Go the whole way on bundled data: tows to an FMU, the Mariner to checked FMUs, and a page that shows both.

    Parameters
    ----------
    folder : path
        Where the files go; made if it does not exist.
    report : callable
        Called with the step that begins.

    Raises
    ------
    InputError
        No C compiler is found, or a file cannot be written.
    """
    require_compiler("the demo")
    written = writable_folder(Path(folder))
    from tank2sim.apps.demo.run import write_demo  # drawing and control: seconds

    values = plain_json(write_demo(written, report))
    return DemoResult(DemoStudy(values["towed_vehicle"], values["mariner"], tuple(values["files"])), written)
