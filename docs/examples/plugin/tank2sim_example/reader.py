"""The log of a bridge: a line ``BRIDGE LOG``, then time, heading, rate of turn, two speeds and rudder in each line."""

import numpy as np

from tank2sim.records.csv_table import read_bytes_as_text, table_of_rows
from tank2sim.records.trials import Trial, TrialReader
from tank2sim.units import KNOT_MPS

COLUMNS = ("time (s)", "heading (deg)", "rate (deg/min)", "ahead (kn)", "starboard (kn)", "rudder (deg)")


def read(path):
    """Signals in SI, angles in rad, continuous heading, rudder positive to starboard."""
    lines = enumerate(read_bytes_as_text(path).splitlines(), start=1)
    rows = {number: ",".join(line.split()) for number, line in lines if number > 1 and line.strip()}
    table = table_of_rows(path, COLUMNS, [*rows.values()], np.array([*rows]))
    time, heading, rate, ahead, starboard, rudder = map(table.column, COLUMNS)
    motion = {"psi_rad": np.unwrap(np.radians(heading)), "r_radps": np.radians(rate / 60)}
    speeds = {"u_mps": KNOT_MPS * ahead, "v_mps": KNOT_MPS * starboard}
    return Trial(path, time, {"delta_rad": np.radians(rudder), **motion, **speeds})


BRIDGE_LOG = TrialReader(
    name="bridge_log",
    description="bridge logs",
    suffixes=(".log",),
    recognises=lambda text: text.startswith("BRIDGE LOG"),
    read=read,
)
