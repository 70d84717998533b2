"""States of an FMU saved and restored."""

from __future__ import annotations

from tank2sim.fmu.running import RunningFmu


def saved(fmu: RunningFmu) -> bytes:
    instance = fmu.instance
    state = instance.getFMUstate() if fmu.unpacked.fmi == 2 else instance.getFMUState()
    data = instance.serializeFMUstate(state) if fmu.unpacked.fmi == 2 else instance.serializeFMUState(state)
    (instance.freeFMUstate if fmu.unpacked.fmi == 2 else instance.freeFMUState)(state)
    return bytes(data)


def restore(fmu: RunningFmu, data: bytes) -> None:
    instance = fmu.instance
    if fmu.unpacked.fmi == 2:
        state = instance.deSerializeFMUstate(data)
        instance.setFMUstate(state)
        instance.freeFMUstate(state)
    else:
        state = instance.deserializeFMUState(data)
        instance.setFMUState(state)
        instance.freeFMUState(state)
