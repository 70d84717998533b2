"""Trials and their simulations by the given card and by the card found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard
from tank2sim.identification.trials.assessment.evaluation import Passage, comparison_windows
from tank2sim.identification.trials.identify import Identification
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.records.thinning import drawn_columns
from tank2sim.units import from_si

_COLUMNS = {
    "rudder": "delta_deg",
    "motion.psi": "psi_deg",
    "motion.r": "r_degps",
    "motion.speed": "speed_mps",
    "motion.beta": "beta_deg",
    "motion.x": "x_m",
    "motion.y": "y_m",
}
_SAMPLES = 240


def replays(card: ManoeuvringCard, result: Identification, trials: Measured) -> tuple[tuple[Passage, Passage], ...]:
    """Each trial with the simulation by `card`, the given card, and with that by the card found."""
    both = []
    whole = card.model.valid_speed_mps is None  # the card found states only the speeds of the fitted trials
    for each_card in (card, result.card):
        problem = problem_from_card(each_card, trials.trials, trials.driven_by, whole=whole)
        both.append(comparison_windows(problem, each_card, trials.trials, result.estimate.noise))
    return tuple(zip(*both, strict=True))


def replays_as_json(found: Sequence[tuple[Passage, Passage]], *, held_out: bool) -> list[dict[str, object]]:
    """JSON form: columns of the measurement and of both simulations, each over its own time, thinned for a chart."""
    return [
        {
            "trial": after.name,
            "held_out": held_out,
            "closed_loop": after.closed_loop,
            "measured": _columns(after.time_s, after.measured),
            "before": _columns(before.model_time_s, before.simulated),
            "found": _columns(after.model_time_s, after.simulated),
        }
        for before, after in found
    ]


def _columns(time_s: Array, signals: Mapping[str, Array]) -> dict[str, list[float]]:
    if not len(time_s):
        return {}
    columns = {_COLUMNS[name]: from_si(_COLUMNS[name], 1.0) * values for name, values in signals.items()}
    return drawn_columns({"t_s": time_s, **columns}, _SAMPLES)
