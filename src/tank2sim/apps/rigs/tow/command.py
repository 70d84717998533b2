"""Surge mass and drag from accelerating tows, as a result with its card."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tank2sim.api.verbs import Output, verb
from tank2sim.arguments import chosen_names
from tank2sim.files import CARD
from tank2sim.quantities import Breadth, Length, Mass, Volume

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.apps.rigs.tow.result import TowResult


def _parsed_force(text: str) -> float | list[float]:
    from tank2sim.apps.rigs.tow.records import parse_force

    coefficients: list[float] = parse_force(text).coef.tolist()
    return coefficients[0] if len(coefficients) == 1 else coefficients


@verb(
    "surge mass and drag from accelerating tows",
    Output("-o", CARD, "Write a surge card.", lambda result, path: result.card.files(path), "CARD.toml"),
    texts={"force_N": _parsed_force},
    results=("tank2sim.apps.rigs.tow.result:TowResult",),
)
def tow(
    tows: str | Path | pd.DataFrame,
    *,
    force_N: float | Sequence[float] | None = None,
    mass_kg: Mass | None = None,
    terms: str | Sequence[str] = "B3,B2,B1",
    start_delay: bool = False,
    total_mass_kg: Mass | None = None,
    length_m: Length | None = None,
    beam_m: Breadth | None = None,
    volume_m3: Volume | None = None,
    method: Literal["paper", "qr", "output_error"] = "output_error",
    name: str | None = None,
) -> TowResult:
    """Estimate M and the drag of M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T from tows from rest (Wilinski & Zellman 1984).

    Parameters
    ----------
    tows : path or DataFrame
        CSV file with ``t_s`` and the speeds ``speed_1_mps``, ...
    force_N : float or sequence of float, optional
        Towing force T, N: a constant, or the coefficients of a polynomial of the time since the release in rising
        powers (N, N/s, ...; on the command line with commas between); by default that in the file.
    mass_kg : float, optional
        Mass m with the water inside, kg; by default that in the file.
    terms : str or sequence of str
        Drag terms to estimate in addition to M: any of B3, B2, B1, or ``"none"``.
    start_delay : bool
        The body starts late, by a time that the output error estimates.
    total_mass_kg : float, optional
        Hold M at this value and estimate the drag alone.
    length_m : float, optional
        Length, for drag coefficients; by default that in the file.
    beam_m : float, optional
        Breadth, for the mass by theory; by default that in the file.
    volume_m3 : float, optional
        Volume; by default that in the file, or the volume of a body that floats.
    method : str
        Method whose numbers the card gets.
    name : str, optional
        Name of the body on the card; by default the file's.

    Raises
    ------
    InputError
        The file is at fault, force or mass are missing, or the tows do not determine the terms.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> from tank2sim.bundled import bundled
    >>> found = t2s.tow(bundled("models", "wilinski-zellman", "tows.csv"), terms="B3")
    >>> found.mass_range_kg[0] < found.total_mass_kg < found.mass_range_kg[1]
    True
    """
    from numpy.polynomial import Polynomial

    from tank2sim.apps.rigs.tow.identify import identify_tow
    from tank2sim.apps.rigs.tow.output_error import TowModel
    from tank2sim.apps.rigs.tow.records import read_tows
    from tank2sim.apps.rigs.tow.result import TowResult
    from tank2sim.apps.rigs.tow.study import study_tows, towed_body
    from tank2sim.apps.rigs.tow.surge import DRAG_POWERS
    from tank2sim.records.csv_table import table_or_path

    read = read_tows(table_or_path(tows, "tows"))
    force = force_N if force_N is None or isinstance(force_N, int | float) else Polynomial(list(force_N))
    model = TowModel(chosen_names("terms", terms, DRAG_POWERS), start_delay, total_mass_kg)
    result = identify_tow(read, force, mass_kg, model)
    size = {"length_m": length_m, "beam_m": beam_m, "volume_m3": volume_m3}
    study = study_tows(result, read, towed_body(read, result.mass_kg, size))
    return TowResult(study, method, name or read.path.stem)
