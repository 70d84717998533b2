"""How many modules a trial, a campaign and a card enter on their way to a card or an FMU, and a gap on its way out.

Each command runs in this process under a profile of calls; what is counted are the modules of tank2sim in which a
function was called, other than by an import, without the command line and the presentation of results, and the rooms
(packages) in which they are.
"""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

ROOT = Path(__file__).resolve().parents[1]
OUTSIDE = ("cli", "answer", "results")  # how a result is shown is another walk
WALKS = {
    "trial to card": "identify mariner trials/zigzag.csv --method equation_error -o identified.toml",
    "campaign to card": "reduce campaign/campaign.toml -o reduced.toml",
    "card to FMU": "export mariner -o mariner.fmu",
    "trials to what is missing": "gap mariner trials/zigzag.csv trials/turn.csv -o gap",
}


@contextlib.contextmanager
def entered(package: Path) -> Iterator[set[str]]:
    """The modules below the folder `package` in which a function is called, by their path below it."""
    modules: set[str] = set()
    start = f"{package}/"
    imports = 0  # that have begun and not ended

    def profile(frame: FrameType, event: str, _: object) -> None:
        nonlocal imports
        if frame.f_code.co_name == "<module>":
            imports += {"call": 1, "return": -1}.get(event, 0)
        elif event == "call" and not imports and frame.f_code.co_filename.startswith(start):
            modules.add(frame.f_code.co_filename.removeprefix(start))

    sys.setprofile(profile)
    try:
        yield modules
    finally:
        sys.setprofile(None)


def main() -> None:
    import tank2sim
    from tank2sim.cli import main as command_line

    package = Path(tank2sim.__file__).parent
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for script, arguments in (("make_trials.py", ["trials", "damping"]), ("make_campaign.py", ["campaign"])):
            subprocess.run([sys.executable, ROOT / "docs" / "examples" / script, *arguments], check=True)
        for name, command in WALKS.items():
            sys.argv = ["tank2sim", *command.split()]
            with (
                entered(package) as modules,
                contextlib.redirect_stdout(io.StringIO()),
                contextlib.suppress(SystemExit),
            ):
                command_line()
            inside = sorted(module for module in modules if module.split("/")[0] not in OUTSIDE)
            rooms = sorted({module.rpartition("/")[0] or "(top)" for module in inside})
            print(f"{name}: {len(inside)} modules in {len(rooms)} rooms: {', '.join(rooms)}")


if __name__ == "__main__":
    main()
