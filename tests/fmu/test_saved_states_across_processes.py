"""A state of an FMU saved in one process goes on in another: nothing in it may belong to the process that saved it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tank2sim.fmu.running import running
from tank2sim.fmu.unpacking import unpack
from tests.conftest import ROOT
from tests.fmu.driving import FmuFile, Instantiate, begun, steps
from tests.fmu.saved_state import restore, saved

LEG = 20
_ENTRY = f"import sys; from {__name__} import one_leg; one_leg(*sys.argv[1:])"


def one_leg(fmu: str, folder: str, place: str) -> None:
    """In a process of its own: the leg at this place of a voyage, from the state of the leg before to its own."""
    legs, leg = Path(folder), int(place)
    with running(unpack(Path(fmu), legs / f"unpacked{leg}"), "CoSimulation") as ship:
        if leg == 0:
            ship.write({"derivatives.Yv": -0.15, "initial.u": 6.0})
            begun(ship, rudder__command=0.3)
        else:
            restore(ship, (legs / f"{leg - 1}.state").read_bytes())
        steps(ship, LEG, begin=leg * LEG * 0.1)
        (legs / f"{leg}.state").write_bytes(saved(ship))


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_voyage_in_two_processes_is_that_in_one_to_the_last_bit(
    fmi: int, fmu_file: FmuFile, instantiate: Instantiate, tmp_path: Path
) -> None:
    for leg in (0, 1):
        command = [sys.executable, "-c", _ENTRY, str(fmu_file("hull", fmi)), str(tmp_path), str(leg)]
        subprocess.run(command, cwd=ROOT, check=True, timeout=120)
    ship = instantiate("hull", fmi, "CoSimulation")
    ship.write({"derivatives.Yv": -0.15, "initial.u": 6.0})
    begun(ship, rudder__command=0.3)
    for leg in (0, 1):
        there = steps(ship, LEG, begin=leg * LEG * 0.1)
    assert (tmp_path / "1.state").read_bytes() == saved(ship)
    restore(ship, (tmp_path / "1.state").read_bytes())
    assert steps(ship, 0) == there
