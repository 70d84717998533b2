"""``tank2sim tow``: surge mass and drag from accelerating tows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from tank2sim.api.result import cell_text
from tank2sim.cards import parse_card
from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.identification.tow.card import tow_card_text
from tank2sim.identification.tow.fit import TowFit
from tank2sim.identification.tow.force import force_words, parse_force
from tank2sim.identification.tow.identify import TOW_METHODS, TowResult, identify_tow, parse_terms
from tank2sim.identification.tow.output_error import TowOptions
from tank2sim.identification.tow.study import TowStudy, study_tows, towed_body
from tank2sim.records.tows import read_tows


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """The options."""

    force: float | None
    force_polynomial: str | None
    mass: float | None
    terms: str
    start_delay: bool
    total_mass: float | None
    length_m: float | None
    beam_m: float | None
    volume_m3: float | None
    method: str
    output: Path | None
    page: Path | None
    json_file: Path | None


@click.command("tow")
@click.argument("tow", type=click.Path(path_type=Path))
@click.option(
    "--force-N", "--force-n", "force", type=float, metavar="F", help="Towing force, N; else that in the file."
)
@click.option("--force-polynomial", metavar="C0,C1,...",
              help="A force that varies, N: T = C0 + C1 t + C2 t^2 + ..., t in s from the release.")  # fmt: skip
@click.option(
    "--mass-kg", "mass", type=float, metavar="M", help="Mass with the water inside, kg; else that in the file."
)
@click.option("--terms", default="B3,B2,B1", show_default=True, help="Drag terms of (1.5) next to M; or none.")
@click.option("--start-delay", is_flag=True, help="Let the body start late, by a time that output_error estimates.")
@click.option("--total-mass-kg", "total_mass", type=float, metavar="M", help="Hold M at this; estimate drag alone.")
@click.option("--length-m", type=float, metavar="L", help="Length, for drag coefficients; else that in the file.")
@click.option("--beam-m", type=float, metavar="B", help="Breadth, for the mass by theory; else that in the file.")
@click.option("--volume-m3", type=float, metavar="V", help="Volume; else that in the file, or of a body that floats.")
@click.option(
    "--method",
    type=click.Choice(TOW_METHODS),
    default="output_error",
    show_default=True,
    help="Whose numbers the card gets.",
)
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="CARD.toml", help="Write a surge card.")
@click.option("--page", type=click.Path(path_type=Path), metavar="PAGE.html", help="Write a page with charts.")
@json_option
def command(tow: Path, **options: object) -> None:
    """Estimate M and drag of M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T from the tows in TOW (a CSV).

    Beside them stand models of other size, each tow by itself, and the mass by theory, to show what the tows can tell.
    """
    asked = _Asked(**options)  # type: ignore[arg-type]  # click has checked them
    study = _study(tow, asked)
    contents: dict[Path, str | bytes] = {}
    if asked.output:
        contents[asked.output] = method_card_text(study, asked.method, str(asked.output))
    if asked.json_file:
        contents[asked.json_file] = json_text(study.as_json())
    if asked.page:
        contents[asked.page] = _page(study)
    write_together(contents, inputs=[tow], outputs=[asked.output, asked.page, asked.json_file])
    _show(study.result)
    _show_study(study)
    show_notices(study.notes)
    if asked.output:
        screen.print(f"{asked.output}: the card has the numbers of {asked.method}", soft_wrap=True, markup=False)


def method_card_text(study: TowStudy, method: str, name: str) -> str:
    """Text of the card with one method's numbers.

    Raises
    ------
    InputError
        They are no body's: the total mass is not positive.
    """
    result = study.result
    fit = result.fits.get(method) or result.fits["qr"]
    source = f"tank2sim tow {result.tows.path.name}, method {fit.method}"
    length = study.body.length_m if study.body else None
    text = tow_card_text(result, fit, name=Path(name).stem, source=source, length_m=length)
    parse_card(text, name)  # refuses a negative mass here, before anything is written
    return text


def _study(tow: Path, asked: _Asked) -> TowStudy:
    if asked.force is not None and asked.force_polynomial is not None:
        raise InputError("--force-polynomial", "", "does not go with --force-N", "give one of them")
    force = asked.force if asked.force_polynomial is None else parse_force(asked.force_polynomial)
    options = TowOptions(start_delay=asked.start_delay, total_mass_kg=asked.total_mass)
    tows = read_tows(tow)
    result = identify_tow(tows, force, asked.mass, terms=parse_terms(asked.terms), options=options)
    given = {"length_m": asked.length_m, "beam_m": asked.beam_m, "volume_m3": asked.volume_m3}
    return study_tows(result, towed_body(tows, result.mass_kg, given))


def _page(study: TowStudy) -> str:
    # Drawing is asked for seldom, and its library is slow to load.
    from tank2sim.report.kit.page import render_page
    from tank2sim.report.tow.page import tow_page

    return render_page(tow_page(study))


def _show(result: TowResult) -> None:
    fits = result.fits.values()
    names = dict.fromkeys(name for fit in fits for name in fit.estimates)
    rows: list[list[object]] = [[name, *(_estimate(fit, name) for fit in fits)] for name in names]
    rows.append(["J of (1.6), N s^1/2", *(cell_text(fit.J) for fit in fits)])
    rows.append(["condition number, scaled", *(f"{fit.condition_scaled:.3g}" for fit in fits)])
    rows.append(["largest speed error, m/s", *(cell_text(fit.largest_speed_error_mps) for fit in fits)])
    title = f"{result.tows.path.name}: {force_words(result.force)}, m = {result.mass_kg:g} kg"
    show_table(title, ["", *result.fits], rows)


def _estimate(fit: TowFit, name: str) -> str:
    if name not in fit.estimates:
        return "-"
    error = fit.standard_errors.get(name)
    return f"{fit.estimates[name]:.5g}" + (f" ± {error:.2g}" if error else "")


def _show_study(study: TowStudy) -> None:
    rows: list[list[object]] = []
    for model in study.models:
        fit = model.fit
        mass = f"{fit.estimates[0]:.0f} ± {fit.half_widths[0]:.0f}"
        drag = "ok" if model.plausible else "negative"
        rows.append(
            [model.model.label, mass, f"{fit.scatter_mps:.5f}", f"{fit.aic:.1f}", f"{fit.condition_scaled:.2g}", drag]
        )
    show_table(
        "Output error, models of different size", ("model", "M ± 95 % (kg)", "s (m/s)", "AIC", "cond.", "drag"), rows
    )
    for way in study.by_tow:
        alone = ", ".join(f"{row[0]:.0f}" for row in way.alone)
        half = f"± {way.half_widths[0]:.0f} kg (95 %)"
        screen.print(f"M of each tow alone, {way.label}: {alone} kg; by leaving one out in turn {half}", soft_wrap=True)
    if study.drags and study.body:
        rows = [[name, *(f"{value:.5g}" for value in own.as_json().values())] for name, own in study.drags.items()]
        title = f"C by L^2, (1.3); by V^(2/3) {study.body.area_ratio:.4g} times it"
        show_table(title, ("method", "A1 (s2/m2)", "A2 (s/m)", "A3"), rows)
    if study.theory:
        rows = [[one.basis, f"{one.k11:.4f}", f"{one.near_surface_kg:.0f}"] for one in study.theory]
        show_table("Mass by theory (2.5)", ("k11 of", "k11", "M_s (kg)"), rows)
