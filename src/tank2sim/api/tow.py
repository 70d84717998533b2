"""Surge mass and drag from accelerating tows, as a result with its card."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from numpy.polynomial import Polynomial

from tank2sim.api.bounds import NumberArgument, checked
from tank2sim.errors import InputError
from tank2sim.identification.tow.identify import TOW_METHODS, identify_tow, parse_terms
from tank2sim.identification.tow.output_error import TowOptions
from tank2sim.identification.tow.study import study_tows, towed_body
from tank2sim.records.tows import read_tows
from tank2sim.results.tow import TowResult


@checked
def tow(
    tows: str | Path,
    *,
    force_N: float | Sequence[float] | None = None,
    mass_kg: NumberArgument | None = None,
    terms: str | Sequence[str] = "B3,B2,B1",
    start_delay: bool = False,
    total_mass_kg: NumberArgument | None = None,
    length_m: NumberArgument | None = None,
    beam_m: NumberArgument | None = None,
    volume_m3: NumberArgument | None = None,
    method: str = "output_error",
    name: str | None = None,
) -> TowResult:
    """Estimate M and the drag of M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T from tows from rest (Wilinski & Zellman 1984).

    Parameters
    ----------
    tows : path
        CSV file with ``t_s`` and the speeds ``speed_1_mps``, ...
    force_N : float or sequence of float, optional
        Towing force T, N: a constant, or the coefficients of a polynomial of the time since the release in rising
        powers (N, N/s, ...); by default that in the file.
    mass_kg : float, optional
        Mass m with the water inside, kg; by default that in the file.
    terms : str or sequence of str
        Drag terms to estimate in addition to M: any of B3, B2, B1, or ``"none"``.
    start_delay : bool
        The body starts late, by a time that the output error estimates.
    total_mass_kg : float, optional
        Hold M at this value and estimate the drag alone.
    length_m, beam_m, volume_m3 : float, optional
        Size of the body, for drag coefficients and the mass by theory; by default that in the file, and the volume of
        a body that floats.
    method : str
        Method whose numbers the card gets: ``paper``, ``qr`` or ``output_error``.
    name : str, optional
        Name of the body on the card; by default that of the file.

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
    if method not in TOW_METHODS:
        raise InputError("--method", "", f"{method!r} is not known", f"there are: {', '.join(TOW_METHODS)}")
    read = read_tows(tows)
    force = force_N if force_N is None or isinstance(force_N, int | float) else Polynomial(list(force_N))
    chosen = parse_terms(terms if isinstance(terms, str) else ",".join(terms) or "none")
    result = identify_tow(read, force, mass_kg, terms=chosen, options=TowOptions(start_delay, total_mass_kg))
    size = {"length_m": length_m, "beam_m": beam_m, "volume_m3": volume_m3}
    study = study_tows(result, read, towed_body(read, result.mass_kg, size))
    return TowResult(study, method, name or read.path.stem)
