"""Surge mass and drag from accelerating tows, as a result with its card."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.polynomial import Polynomial

from tank2sim.answer.parts import Table, cell_text
from tank2sim.api.bounds import NumberArgument, checked
from tank2sim.api.result import OldResult, screen_table, section_charts
from tank2sim.api.ship import Ship
from tank2sim.cards import Card, parse_card
from tank2sim.errors import InputError
from tank2sim.identification.tow.fit import TowFit
from tank2sim.identification.tow.force import force_words
from tank2sim.identification.tow.identify import TOW_METHODS, identify_tow, parse_terms, tow_card_text
from tank2sim.identification.tow.output_error import TowOptions
from tank2sim.identification.tow.study import TowStudy, study_tows, towed_body
from tank2sim.records.tows import read_tows

if TYPE_CHECKING:
    import altair as alt
    import pandas as pd


class TowResult(OldResult):
    """Surge mass and drag of a towed body, SI.

    Parameters
    ----------
    study : TowStudy
    method : str
        Method whose numbers the card gets.
    name : str
        Name of the body on the card.
    """

    command = "tow"

    def __init__(self, study: TowStudy, method: str, name: str) -> None:
        self.study: TowStudy = study
        self.name = name
        fits = study.result.fits
        self.fit = fits[method] if method in fits else fits["qr"]
        self.notices = study.notes

    @property
    def method(self) -> str:
        """Method whose numbers the card gets; ``qr`` where the one asked for did not converge."""
        return self.fit.method

    @property
    def estimates(self) -> pd.DataFrame:
        """Estimates, a row each: method, name with unit (``total_mass_kg``), value, standard error."""
        import pandas as pd

        rows = [
            (method, name, value, fit.standard_errors.get(name))
            for method, fit in self.study.result.fits.items()
            for name, value in fit.estimates.items()
        ]
        return pd.DataFrame(rows, columns=["method", "name", "value", "standard_error"])

    @property
    def total_mass_kg(self) -> float:
        """M of :attr:`method`: mass with the water inside and added mass, kg."""
        return self.fit.estimates["total_mass_kg"]

    @property
    def added_mass_kg(self) -> float:
        """M - m of :attr:`method`, kg."""
        return self.fit.estimates["added_mass_kg"]

    @property
    def mass_range_kg(self) -> tuple[float, float] | None:
        """Range of M that these tows determine over all usable models, kg; None if no model is usable."""
        return self.study.mass_range_kg

    @cached_property
    def card(self) -> Card:
        """The card of the body that surges; ``card.save("body.toml")`` writes it.

        Raises
        ------
        InputError
            The estimates are not those of a body: the total mass is not positive.
        """
        result, body = self.study.result, self.study.body
        source = f"tank2sim tow {result.tows.path.name}, method {self.method}"
        length = body.length_m if body else None
        text = tow_card_text(result, self.fit, name=self.name, source=source, length_m=length)
        return parse_card(text, "the card found")

    @property
    def ship(self) -> Ship:
        """The body of the card found."""
        return Ship(self.card)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return self.study.as_json()

    @property
    def headline(self) -> tuple[str, ...]:
        """None: the tables say it."""
        return ()

    @property
    def tables(self) -> tuple[Table, ...]:
        """Estimates by method, models of other size, drag coefficients and mass by theory."""
        tables = [self._estimates(), self._models()]
        study = self.study
        if study.drags and study.body:
            rows = [
                [name, *(f"{value:.5g}" for value in drag.as_json().values())] for name, drag in study.drags.items()
            ]
            title = f"C by L^2, (1.3); by V^(2/3) {study.body.area_ratio:.4g} times it"
            tables.append(screen_table(title, ("method", "A1 (s2/m2)", "A2 (s/m)", "A3"), rows))
        if study.theory:
            rows = [[mass.basis, f"{mass.k11:.4f}", f"{mass.near_surface_kg:.0f}"] for mass in study.theory]
            tables.append(screen_table("Mass by theory (2.5)", ("k11 of", "k11", "M_s (kg)"), rows))
        return tuple(tables)

    def charts(self) -> dict[str, alt.TopLevelMixin]:
        """Charts of the page: speeds, models of different size, joint regions, drag."""
        return section_charts(self.layout().sections)

    def _estimates(self) -> Table:
        result = self.study.result
        fits = result.fits.values()
        names = dict.fromkeys(name for fit in fits for name in fit.estimates)
        rows = [[name, *(_estimate_text(fit, name) for fit in fits)] for name in names]
        rows.append(["J of (1.6), N s^1/2", *(cell_text(fit.J) for fit in fits)])
        rows.append(["condition number, scaled", *(f"{fit.condition_scaled:.3g}" for fit in fits)])
        rows.append(["largest speed error, m/s", *(cell_text(fit.largest_speed_error_mps) for fit in fits)])
        title = f"{result.tows.path.name}: {force_words(result.force)}, m = {result.mass_kg:g} kg"
        return screen_table(title, ("", *result.fits), rows)

    def _models(self) -> Table:
        rows = []
        for model in self.study.models:
            fit = model.fit
            mass = f"{fit.estimates[0]:.0f} ± {fit.half_widths[0]:.0f}"
            quality = f"{fit.scatter_mps:.5f}", f"{fit.aic:.1f}", f"{fit.condition_scaled:.2g}"
            rows.append([model.model.label, mass, *quality, "ok" if model.plausible else "negative"])
        notes = []
        for subset in self.study.by_tow:
            alone = ", ".join(f"{row[0]:.0f}" for row in subset.alone)
            half = f"± {subset.half_widths[0]:.0f} kg (95 %)"
            notes.append(f"M of each tow alone, {subset.label}: {alone} kg; by leaving one out in turn {half}")
        columns = ("model", "M ± 95 % (kg)", "s (m/s)", "AIC", "cond.", "drag")
        return screen_table("Output error, models of different size", columns, rows, tuple(notes))


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
    study = study_tows(result, towed_body(read, result.mass_kg, size))
    return TowResult(study, method, name or read.path.stem)


def _estimate_text(fit: TowFit, name: str) -> str:
    if name not in fit.estimates:
        return "-"
    error = fit.standard_errors.get(name)
    return f"{fit.estimates[name]:.5g}" + (f" ± {error:.2g}" if error else "")
