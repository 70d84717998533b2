"""Possible meanings of a table of derivatives with unstated conventions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, verb
from tank2sim.files import CARD

if TYPE_CHECKING:
    from tank2sim.apps.programs.convention_result import ConventionResult


@verb(
    "what a table of derivatives with unstated conventions means",
    Output("-o", CARD, "Write the card of the first reading.", lambda result, path: result.files(path), "CARD.toml"),
    results=("tank2sim.apps.programs.convention_result:ConventionResult",),
    charts=False,
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
    from tank2sim.apps.programs.readings import ranked_readings, read_card_text, scaled_with_nominal_speed
    from tank2sim.cards.coefficient_table import read_coefficients
    from tank2sim.cards.reading import parse_card

    read = read_coefficients(coefficients)
    ordered, figures = ranked_readings(read)
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
