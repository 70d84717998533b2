"""Free-running trials of four ships with hidden effects: an independent truth for the gap workflow.

Shares no code with the program it judges: own integrator, own ship, each effect in another form of the same physics.
"""

from gap_truth.draws import EFFECTS, OUTSIDERS, SENSORS
from gap_truth.lane import Setting
from gap_truth.make import SHIP_TOML, Made, make, sampled, truth, write, wrong_card
from gap_truth.manoeuvres import FIT, HOLDOUT
from gap_truth.ship import HULLS

__all__ = [
    "EFFECTS",
    "FIT",
    "HOLDOUT",
    "HULLS",
    "OUTSIDERS",
    "SENSORS",
    "SHIP_TOML",
    "Made",
    "Setting",
    "make",
    "sampled",
    "truth",
    "write",
    "wrong_card",
]
