"""The whole way on bundled data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tank2sim.api.verbs import Progress, Written, verb
from tank2sim.files import plain_json, writable_folder

if TYPE_CHECKING:
    from tank2sim.apps.demo.result import DemoResult


@verb(
    "the whole way on bundled data: tows to an FMU, the Mariner to an FMU",
    name="demo",
    results=("tank2sim.apps.demo.result:DemoResult",),
    charts=False,
)
def run_demo(
    output: str | Annotated[Path, Written((), "DIR", by_function=True)] = "demo",
    *,
    report: Progress = lambda _: None,
) -> DemoResult:
    """Go the whole way on bundled data: tows to an FMU, the Mariner to checked FMUs, and a page that shows both.

    Parameters
    ----------
    output : path
        Folder of the files; it is made if it does not exist.
    report : callable
        Called with the step that begins.

    Raises
    ------
    InputError
        No C compiler is found, or a file cannot be written.
    """
    from tank2sim.apps.demo.result import DemoResult, DemoStudy
    from tank2sim.apps.demo.run import write_demo
    from tank2sim.native.compiler import require_compiler

    require_compiler("the demo")
    folder = writable_folder(Path(output))
    values = plain_json(write_demo(folder, report))
    return DemoResult(DemoStudy(values["towed_vehicle"], values["mariner"], tuple(values["files"])), folder)
