"""States of an FMU that are saved, carried as bytes, and taken up by another instance, also in another process."""

from __future__ import annotations

import math
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from tank2sim.fmu.running import RunningFmu, running
from tank2sim.fmu.unpacking import unpack
from tests.conftest import ROOT
from tests.fmu.driving import ERROR, STATES, FmuFile, Instantiate, Slave, Status, begun, steps
from tests.fmu.saved_state import restore, saved


def test_a_saved_state_goes_on_in_another_instance(fmi: int, instantiate: Instantiate) -> None:
    first = instantiate("hull", fmi, "CoSimulation")
    first.write({"derivatives.Yv": -0.15, "initial.u": 6.0})
    steps(begun(first, rudder__command=0.3), 20)
    data = saved(first)
    gone_on = steps(first, 20, begin=2.0)
    second = instantiate("hull", fmi, "CoSimulation")
    restore(second, data)
    assert steps(second, 20, begin=2.0) == gone_on
    restore(first, data)
    assert steps(first, 20, begin=2.0) == gone_on
    assert first.read(["derivatives.Yv"]) == second.read(["derivatives.Yv"]) == [-0.15]


def test_the_stop_time_is_part_of_the_state(fmi: int, instantiate: Instantiate, status: Status) -> None:
    first, second = (instantiate("hull", fmi, "CoSimulation") for _ in range(2))
    if fmi == 2:
        first.instance.setupExperiment(startTime=0.0, stopTime=2.0)
        first.instance.enterInitializationMode()
    else:
        first.instance.enterInitializationMode(startTime=0.0, stopTime=2.0)
    first.instance.exitInitializationMode()
    restore(second, saved(first))
    assert status(second.instance.doStep, 0.0, 2.1) == ERROR
    assert status(second.instance.doStep, 0.0, 2.0) == 0


def test_a_state_saved_before_initialisation_is_one_before_initialisation(fmi: int, instantiate: Instantiate) -> None:
    first = instantiate("hull", fmi, "ModelExchange")
    first.write({"initial.u": 5.0})
    data = saved(first)
    begun(first)
    restore(first, data)
    assert first.read(["motion.u"]) == [5.0]
    first.write({"initial.psi": 1.0})
    assert begun(first).read(["motion.u", "motion.psi"]) == [5.0, 1.0]


def test_bytes_that_are_no_state_of_this_fmu_are_refused(
    fmi: int, instantiate: Instantiate, status: Status, slave: Slave
) -> None:
    fmu = slave(rudder__command=0.3)
    before, data = steps(fmu, 5), saved(fmu)
    other_kind = saved(instantiate("hull", fmi, "ModelExchange"))
    other_model = saved(instantiate("body", fmi, "CoSimulation"))
    not_a_number = data[:-8] + b"\xff" * 8
    bad = [data[:-1], data + b"\0", b"", b"x" * len(data), b"\0" + data[1:], other_kind, other_model, not_a_number]
    assert [status(restore, fmu, case) for case in bad] == [ERROR] * len(bad)
    assert len(fmu.log) == len(bad)
    assert fmu.read(STATES) == before


def test_a_single_bit_that_is_wrong_is_found(status: Status, slave: Slave) -> None:
    fmu = slave(rudder__command=0.3)
    before, data = steps(fmu, 5), saved(fmu)
    for place in range(0, len(data), 7):
        damaged = bytearray(data)
        damaged[place] ^= 1 << (place % 8)
        assert status(restore, fmu, bytes(damaged)) == ERROR
    assert len(fmu.log) == len(range(0, len(data), 7))
    assert sum("checksum" in line for line in fmu.log) > len(data) // 14
    assert fmu.read(STATES) == before


def sealed(data: bytes) -> bytes:
    """A state with the checksum of its bytes: FNV-1a with 64 bits of what follows the checksum (RFC 9923)."""
    total = 14695981039346656037
    for byte in data[24:]:
        total = (total ^ byte) * 1099511628211 % 2**64
    return data[:16] + total.to_bytes(8, sys.byteorder) + data[24:]


def value_count(fmu: RunningFmu) -> int:
    """Values of a state: time, states, inputs, parameters and largest step, which come before the rates."""
    variables = fmu.unpacked.description.modelVariables
    return min(int(variable.valueReference) for variable in variables if variable.derivative is not None)


def test_every_value_of_a_state_comes_back(slave: Slave) -> None:
    fmu = slave(rudder__command=0.3)
    steps(fmu, 5)
    before, count = saved(fmu), value_count(fmu)
    assert sealed(before) == before
    assert struct.unpack_from("=d", before, len(before) - 8 * count)[0] == pytest.approx(0.5)  # the first is the time
    changed = sealed(before[: -8 * count] + struct.pack(f"={count}d", *(0.25 + 0.5 * k for k in range(count))))
    restore(fmu, changed)
    assert saved(fmu) == changed
    assert fmu.read(STATES) == [0.75 + 0.5 * k for k in range(len(STATES))]  # they follow the time
    restore(fmu, before)
    assert saved(fmu) == before


def test_a_state_with_one_value_that_is_no_number_is_refused_whichever_it_is(status: Status, slave: Slave) -> None:
    fmu = slave(rudder__command=0.3)
    steps(fmu, 5)
    data, count = saved(fmu), value_count(fmu)
    taken = []
    for place in range(len(data) - 8 * count, len(data), 8):
        damaged = sealed(data[:place] + struct.pack("=d", math.nan) + data[place + 8 :])
        if status(restore, fmu, damaged) != ERROR:
            taken.append(place)
    assert not taken
    assert saved(fmu) == data


def test_a_state_of_another_model_is_named_as_such(
    fmi: int, instantiate: Instantiate, status: Status, slave: Slave
) -> None:
    """Another ship with as many variables: only its token tells."""
    fmu = slave()
    data = saved(fmu)
    place = data.index(b"{")
    other = data[: place + 1] + bytes([data[place + 1] ^ 1]) + data[place + 2 :]
    assert status(restore, fmu, other) == ERROR
    assert "another FMU" in fmu.log[0]
    assert status(restore, fmu, saved(instantiate("gain", fmi, "CoSimulation"))) == ERROR
    assert "another length" in fmu.log[1]


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
