"""A run of the yaw rig as the record that the rig would have written."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tank2sim.cards.card import YawRigCard
from tank2sim.cards.form import YawRig
from tank2sim.dynamics.yaw_programme import YawProgramme, programme_of
from tank2sim.records.yaw import Medium, YawRecord
from tank2sim.simulation.yaw_rig import Measuring, YawRun, run_yaw_rig
from tank2sim.simulation.yaw_rig_control import Controller, TunedController


def yaw_record(
    run: YawRun, rig: YawRig, path: Path, constants: Mapping[str, float] | None = None, *, medium: Medium = "water"
) -> YawRecord:
    """The record of a run; `constants` are reported in it besides the torque constant and the largest current."""
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


def simulated_record(
    card: YawRigCard,
    path: Path,
    current_noise_A: float = 0.0,
    *,
    medium: Medium = "water",
    controller: Controller | None = None,
    programme: YawProgramme | None = None,
) -> YawRecord:
    """The record of a programme on the card's rig, encoder and all.

    Parameters
    ----------
    card : YawRigCard
    path : Path
        The file that the record is for.
    current_noise_A : float
        Standard deviation of the recorded current.
    medium : str
        In ``air`` the rig is that of :func:`rig_in_air`.
    controller : optional
        By default (4), from the right inertia.
    programme : optional
        By default the card's.

    Raises
    ------
    InputError
        The motor saturates, or the card's rig or programme is none.
    """
    wet, programme = card.yaw_rig, programme or programme_of(card)
    rig = rig_in_air(wet) if medium == "air" else wet
    controller = controller or TunedController(inertia_kgm2=rig.inertia_kgm2 + rig.added_inertia_kgm2)
    run = run_yaw_rig(rig, programme, controller, Measuring(current_noise_A=current_noise_A))
    told = {}
    if medium == "water":
        told = {"inertia_kgm2": rig.inertia_kgm2, "water_density_kgpm3": card.environment.water_density_kgpm3}
        if error := card.uncertainty.get("inertia_kgm2"):
            told["inertia_error_kgm2"] = error
    if card.ship.length_m is not None:
        told["length_m"] = card.ship.length_m
    return yaw_record(run, rig, path, told, medium=medium)


def rig_in_air(rig: YawRig) -> YawRig:
    """The rig with its body in air: no added inertia, no f_662, no walls.

    Dry and viscous friction are those of the card: it does not tell the water's part of them. The inertia, which is
    what a run in air is for, does not depend on that.
    """
    water = ("added_inertia_kgm2", "quadratic_Nms2", "inertia_accelerating_kgm2", "inertia_braking_kgm2")
    return rig.model_copy(update={**dict.fromkeys(water, 0.0), "braking_quadratic_Nms2": None, "walls": None})
