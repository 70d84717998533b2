"""A simulated run in the format of a trial file, and its histories thinned for a chart."""

from __future__ import annotations

import io

import numpy as np

from tank2sim.arrays import Array, Columns
from tank2sim.records.thinning import drawn_columns
from tank2sim.simulation.trajectory import Trajectory
from tank2sim.units import from_si

# Column of the trial format to the signal of the model.
_COLUMNS = {
    "delta_order_deg": "rudder.command",
    "delta_deg": "rudder.angle",
    "n_rpm": "propeller.speed",
    "u_mps": "motion.u",
    "v_mps": "motion.v",
    "r_degps": "motion.r",
    "psi_deg": "motion.psi",
    "x_m": "motion.x",
    "y_m": "motion.y",
    "phi_deg": "motion.phi",
}


def trial_columns(trajectory: Trajectory) -> dict[str, Array]:
    """Columns (n,) of a run by their names in the trial format, ``t_s`` first, for the signals of the model."""
    model, names = trajectory.model, dict(_COLUMNS)
    speeds = (name for name in model.outputs if name.startswith("thrusters.") and name.endswith(".speed"))
    for thruster in (name.split(".")[1] for name in speeds):
        names[f"n_{thruster}_rpm"] = f"thrusters.{thruster}.speed"
        if f"thrusters.{thruster}.azimuth" in model:
            names[f"azimuth_{thruster}_deg"] = f"thrusters.{thruster}.azimuth"
    known = {*model.outputs, *model.state_names, *model.input_names}
    columns = {name: from_si(name, 1.0) * trajectory[signal] for name, signal in names.items() if signal in known}
    return {"t_s": trajectory.t, **columns}


def trial_csv(trajectory: Trajectory, comment: str) -> str:
    """Text of a trial CSV: a comment line, a header with units in its names, a row for each sample; + is starboard."""
    columns = trial_columns(trajectory)
    text = io.StringIO()
    text.write(f"# {' '.join(comment.split())}\n")
    text.write(",".join(columns) + "\n")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.10g", delimiter=",")
    return text.getvalue()


def histories(trajectory: Trajectory, begin_s: float = 0.0) -> Columns:
    """The columns of :func:`trial_columns` from `begin_s`, thinned for a chart, for the JSON of a result."""
    columns = trial_columns(trajectory)
    shown = columns["t_s"] >= begin_s
    return drawn_columns({name: values[shown] for name, values in columns.items()})
