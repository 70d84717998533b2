"""A simulated run as a trial file, so that it can be read wherever a measured one can."""

from __future__ import annotations

import io

import numpy as np

from tank2sim.simulation.trajectory import Trajectory
from tank2sim.units import from_si

# Column of the trial format to the signal of the model that it holds.
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
}


def trial_csv(trajectory: Trajectory, comment: str) -> str:
    """Text of a trial CSV: a comment line, a header with units in its names, one row a sample; + is starboard."""
    model = trajectory.model
    known = {*model.outputs, *model.state_names, *model.input_names}
    columns = {name: signal for name, signal in _COLUMNS.items() if signal in known}
    table = [trajectory.t, *(from_si(name, 1.0) * trajectory[signal] for name, signal in columns.items())]
    text = io.StringIO()
    text.write(f"# {' '.join(comment.split())}\n")
    text.write(",".join(["t_s", *columns]) + "\n")
    np.savetxt(text, np.column_stack(table), fmt="%.10g", delimiter=",")
    return text.getvalue()
