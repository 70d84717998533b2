"""Possible meanings of a table of derivatives with unstated conventions."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, verb
from tank2sim.errors import InputError
from tank2sim.files import CARD

if TYPE_CHECKING:
    from tank2sim.apps.programs.convention_result import ConventionResult
    from tank2sim.apps.programs.readings import RankedReading
    from tank2sim.cards.coefficient_table import CoefficientTable

_SIMULATED = 1e-3  # Probability from which a reading is simulated: others cannot become the first (project choice)


@verb(
    "what a table of derivatives with unstated conventions means",
    Output("-o", CARD, "Write the card of the first reading.", lambda result, path: result.files(path), "CARD.toml"),
    results=("tank2sim.apps.programs.convention_result:ConventionResult",),
)
def convention(coefficients: str | Path) -> ConventionResult:
    """Say what a table of derivatives with unstated conventions may mean.

    Every reading (sign of the rudder, scaling, yaw-rate terms, origin) is made a ship, and ranked by how much it is
    like a ship of its dimensions. Conventions that the file states are taken as they are.

    Parameters
    ----------
    coefficients : str or path
        ``.toml`` like a ship card, in which conventions may be missing, or rows ``name,value`` with ``length_m``,
        ``speed_mps``, at least Yv, Yr, Nv, Nr, and what else there is (``beam_m``, ``draught_m``, ``displacement_kg``
        or ``block_coefficient``, ``mass``, ``yaw_inertia``, ``centre_of_gravity_m`` forward of midships).

    Raises
    ------
    InputError
        The table is at fault, or no reading of it is a ship.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> from pathlib import Path
    >>> rows = ["length_m,175", "beam_m,25.4", "draught_m,8.5", "displacement_kg,21752550", "speed_mps,7"]
    >>> rows += ["Yv,-0.012035", "Yr,-0.00522", "Yd,-0.002578", "Nv,-0.0038436", "Nr,-0.00243", "Nd,0.00126"]
    >>> _ = Path("s175.csv").write_text("\\n".join(rows))
    >>> t2s.convention("s175.csv").readings[0].yaw_rate_terms
    'total'
    """
    from tank2sim.apps.programs.convention_result import ConventionResult, ConventionStudy, ReadingFound
    from tank2sim.apps.programs.readings import (
        possible_readings,
        read_card_text,
        scaled_with_nominal_speed,
        weigh,
        with_diameter,
        with_probabilities,
    )
    from tank2sim.cards.coefficient_table import read_coefficients
    from tank2sim.cards.reading import parse_card

    read = read_coefficients(coefficients)
    weighed = with_probabilities([weigh(read, reading) for reading in possible_readings(read)])
    if not math.isfinite(weighed[0].weight):
        raise InputError(read.source, "", "no reading of it is a ship", "check its sizes and units")
    moves = _moves(read)
    figures = {entry.reading: _figures(read, entry) for entry in weighed if entry.probability > _SIMULATED and moves}
    ranked = [
        with_diameter(entry, figures[entry.reading].get("tactical_diameter_lengths"))
        if entry.reading in figures
        else entry
        for entry in weighed
    ]
    ordered = with_probabilities(ranked)
    unknown: dict[str, float | None] = dict.fromkeys(
        ("advance_lengths", "tactical_diameter_lengths", "overshoot_1_deg")
    )
    study = ConventionStudy(
        source=read.source,
        stated=dict(read.conventions),
        readings=tuple(
            ReadingFound(
                **vars(entry.reading),
                probability=entry.probability,
                C_prime=entry.criterion,
                turning_index=entry.turning_index,
                vanished=tuple(entry.ship.vanished),
                against=tuple(entry.against),
                **(unknown | figures.get(entry.reading, {})),  # type: ignore[arg-type]
            )
            for entry in ordered
        ),
        assumed={key: float(getattr(read, key)) for key in read.assumed},
        left_out=tuple(read.left_out),
        scaled_with_nominal_speed=scaled_with_nominal_speed(read),
        speed_scale=read.speed_scale,
    )
    return ConventionResult(study, parse_card(read_card_text(read, ordered[0]), read.source))


def _moves(table: CoefficientTable) -> bool:
    """True if it has what a turn takes: surge that holds a speed, the rudder, terms beyond the linear."""
    from tank2sim.apps.programs.readings import possible_readings, read_as

    ship = read_as(table, possible_readings(table)[0])
    return {"Xu", "Nd"} <= {name for name, value in ship.derivatives.items() if value}


def _figures(table: CoefficientTable, entry: RankedReading) -> dict[str, float | None]:
    """Figures of a turn and a zigzag of the ship by a reading; empty if it does not sail."""
    from tank2sim.apps.programs.readings import read_card_text
    from tank2sim.cards import ManoeuvringCard
    from tank2sim.cards.reading import parse_card
    from tank2sim.dynamics import build
    from tank2sim.simulation.card_range import single_figures
    from tank2sim.simulation.manoeuvres import Turn, Zigzag
    from tank2sim.simulation.run import simulate

    try:
        card = parse_card(read_card_text(table, entry), table.source)
        assert isinstance(card, ManoeuvringCard)
        model = build(card)
        turn = single_figures(simulate(model, Turn(math.radians(35))).figures)
        zigzag = single_figures(simulate(model, Zigzag(math.radians(10), math.radians(10))).figures)
    except InputError:  # no mass matrix, or a motion without bounds: not a ship
        return {}
    lengths = {
        f"{name}_lengths": turn[f"{name}_m"] / table.length_m if turn.get(f"{name}_m", 0.0) > 0 else None
        for name in ("advance", "tactical_diameter")
    }
    return {**lengths, "overshoot_1_deg": zigzag.get("overshoot_1_deg")}
