"""The card of a body with surge only, from its tows."""

from __future__ import annotations

from tank2sim.cards.writing import SurgeResult, surge_card_text
from tank2sim.identification.tow.fit import TowFit
from tank2sim.identification.tow.identify import TowIdentification


def tow_card_text(
    result: TowIdentification, fit: TowFit, *, name: str, source: str, length_m: float | None = None
) -> str:
    """TOML text of the card with the numbers of one method; its notes are the warnings of the result.

    Parameters
    ----------
    fit : TowFit
        One of ``result.fits``.
    name, source : str
        Name of the body, and source of the numbers.
    length_m : float, optional
        Length of the body, if known.
    """
    values = {key: value for key, value in fit.estimates.items() if key not in ("added_mass_kg", "start_delay_s")}
    return surge_card_text(
        SurgeResult(
            name=name,
            source=source,
            values={**values, "force_N": result.force_N, "dry_mass_kg": result.mass_kg},
            standard_errors={key: value for key, value in fit.standard_errors.items() if key in values},
            top_speed_mps=result.tows.top_speed_mps,
            length_m=length_m,
            notes=" ".join(result.warnings),
        )
    )
