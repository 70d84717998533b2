"""A run of the yaw rig as the record that the rig would have written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tank2sim.cards.card import YawRigCard
from tank2sim.dynamics.yaw_programme import programme_of
from tank2sim.dynamics.yaw_rig import YawRig, rig_of
from tank2sim.records.yaw import Medium, YawRecord
from tank2sim.simulation.yaw_rig import Measuring, YawRun, run_yaw_rig
from tank2sim.simulation.yaw_rig_control import TunedController


def record_of(
    run: YawRun, rig: YawRig, path: Path, constants: Mapping[str, float] | None = None, *, medium: Medium = "water"
) -> YawRecord:
    """The record of a run; `constants` are told in it besides the torque constant and the largest current."""
    return YawRecord(
        path=path,
        time_s=run.time_s,
        angle_rad=run.angle_rad,
        current_A=run.current_A,
        medium=medium,
        programme=run.programme,
        stated=True,
        constants={
            "torque_constant_NmpA": rig.torque_constant_NmpA,
            "max_current_A": rig.max_current_A,
            **(constants or {}),
        },
    )


def simulated_record(card: YawRigCard, path: Path, current_noise_A: float = 0.0) -> YawRecord:
    """The record of the card's programme on the card's rig: controller (4) from the right inertia, encoder and all.

    Raises
    ------
    InputError
        The motor saturates, or the card's rig or programme is none.
    """
    rig, programme = rig_of(card), programme_of(card)
    controller = TunedController(inertia_kgm2=rig.inertia_kgm2 + rig.added_inertia_kgm2)
    run = run_yaw_rig(rig, programme, controller, Measuring(current_noise_A=current_noise_A))
    told = {"inertia_kgm2": rig.inertia_kgm2, "water_density_kgpm3": card.environment.water_density_kgpm3}
    if card.ship.length_m is not None:
        told["length_m"] = card.ship.length_m
    return record_of(run, rig, path, told)
