"""``tank2sim yaw``: added yaw inertia and dissipation of a body that a motor turns in a tank."""

from __future__ import annotations

import math
from pathlib import Path
from typing import get_args

import click

from tank2sim.apps.rigs.yaw.command import CONTROLLERS, simulate_yaw
from tank2sim.apps.rigs.yaw.command import yaw as identify_yaw
from tank2sim.apps.rigs.yaw.found_card import BEST
from tank2sim.apps.rigs.yaw.identify import YAW_METHODS
from tank2sim.apps.rigs.yaw.intervals import ENERGY_TERMS
from tank2sim.apps.rigs.yaw.records import Medium, read_yaw_record
from tank2sim.apps.rigs.yaw.result import YawResult
from tank2sim.arguments import NonNegativeArgument, Percent, PositiveArgument
from tank2sim.cli.console import json_option, screen, show_result, write_result
from tank2sim.cli.options import OutputFile, number, page_option, plot_folder_option
from tank2sim.errors import InputError
from tank2sim.files import CARD
from tank2sim.ship import load

_POSITIVE = number(PositiveArgument)


@click.command("yaw")
@click.argument("records", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="RECORD.csv...")
@click.option("--simulate", metavar="CARD", help="First write the one RECORD, as the rig of this card would (alyshev).")
@click.option(
    "--medium",
    type=click.Choice(get_args(Medium)),
    help="Of the simulated body; in air with the card's friction f_c, f_1.",
)
@click.option(
    "--controller", type=click.Choice(list(CONTROLLERS)), help="Of the simulated rig: (4), by default, or (6)."
)
@click.option(
    "--similar-to",
    metavar="L,B,R,T",
    help="Simulate a ship's motion at model size: length, beam in m, yaw rate in deg/min, s.",
)
@click.option("--noise", "noise_A", type=number(NonNegativeArgument), default=0.0, help="Of the simulated current, A.")
@click.option("--inertia-kgm2", type=_POSITIVE, metavar="J", help="J_zz of body and rotor; else from records in air.")
@click.option("--inertia-error-kgm2", type=number(NonNegativeArgument), help="Its standard error.")
@click.option(
    "--torque-constant",
    "torque_constant_NmpA",
    type=_POSITIVE,
    metavar="KT",
    help="k_t, N m/A; else as the records say.",
)
@click.option("--reference", type=click.Path(path_type=Path), metavar="AIR.csv", help="Take k_t from a body in air ...")
@click.option("--reference-inertia-kgm2", type=_POSITIVE, help="... of this known inertia.")
@click.option("--rig", metavar="CARD", help="Card of the rig: its walls, gravity, accelerating and braking count.")
@click.option(
    "--terms", metavar="LIST", help=f"Terms in addition to the inertia, of {', '.join(list(ENERGY_TERMS)[1:])}."
)
@click.option(
    "--mirror-percent",
    type=number(Percent),
    default=25.0,
    show_default=True,
    help="Largest difference of mirror images, % of the largest rate.",
)
@click.option(
    "--method", type=click.Choice(YAW_METHODS), default=BEST, show_default=True, help="Whose numbers a card gets."
)
@click.option("--card", metavar="SHIP", help="Put N_rdot into this ship's card; else -o writes a card of the rig.")
@click.option(
    "--theory",
    metavar="L,B,T,H[,CB]",
    help="Also (7)-(9) for length, beam, draught, depth in m, block coefficient; or a CARD.",
)
@click.option("--length-m", type=_POSITIVE, metavar="L", help="Length of the model; else as the records say.")
@click.option("-o", "--output", type=OutputFile(CARD), metavar="CARD.toml", help="Write the card.")
@page_option()
@plot_folder_option
@json_option
def command(
    records: tuple[Path, ...],
    simulate: str | None,
    medium: Medium | None,
    controller: str | None,
    similar_to: str | None,
    noise_A: float,
    inertia_kgm2: float | None,
    inertia_error_kgm2: float | None,
    torque_constant_NmpA: float | None,
    reference: Path | None,
    reference_inertia_kgm2: float | None,
    rig: str | None,
    terms: str | None,
    mirror_percent: float,
    method: str,
    card: str | None,
    theory: str | None,
    length_m: float | None,
    output: Path | None,
    page: Path | None,
    plots: Path | None,
    json_file: Path | None,
) -> None:
    """Estimate added yaw inertia and dissipation from each RECORD (t_s,phi_rad,current_A) of the yaw rig.

    Records in air ('# medium: air') give J_zz; the programme is stated in comments of the file.
    """
    if card and not output:
        raise InputError("--card", "", "has no file to be written to", "say which with -o CARD.toml")
    if simulate:
        if len(records) != 1:
            raise InputError("--simulate", "", f"has {len(records)} records to write", "give the name of one")
        simulate_yaw(
            simulate,
            records[0],
            medium=medium or "water",
            controller=controller or "tuned",
            similar_to=similar_to,
            noise_A=noise_A,
        )
        if similar_to:
            screen.print(_similar_text(records[0], similar_to), soft_wrap=True)
    elif medium or controller or similar_to:
        options = "--medium, --controller, --similar-to"
        raise InputError(options, "", "are of a simulated rig", "give --simulate CARD as well")
    try:
        result = identify_yaw(
            records,
            inertia_kgm2=inertia_kgm2,
            inertia_error_kgm2=inertia_error_kgm2,
            torque_constant_NmpA=torque_constant_NmpA,
            reference=reference,
            reference_inertia_kgm2=reference_inertia_kgm2,
            rig=rig,
            terms=terms,
            mirror_percent=mirror_percent,
            method=method,
            theory=theory,
        )
    except InputError as fault:
        if not simulate:
            raise
        records[0].unlink()  # a refusal leaves nothing behind
        if fault.source != str(records[0]):
            raise
        problem = f"the record simulated of it: {fault.problem}"
        raise InputError(load(simulate).card.source, fault.place, problem, fault.remedy) from None
    files, text = _card(result, card, length_m, output) if output else ({}, "")
    inputs = [*records, *([reference] if reference else [])]
    write_result(result, inputs, json_file=json_file, page=page, plots=plots, files=files)
    show_result(result)
    if text:
        screen.print(text, soft_wrap=True, markup=False)


def _similar_text(record: Path, similar_to: str) -> str:
    length, beam, rate_degpmin, time_s = (float(word) for word in similar_to.split(","))
    programme = read_yaw_record(record).programme
    model_degps = math.degrees(programme.max_rate_radps)
    return (
        f"{length:g} m x {beam:g} m at model size: rates times {60 * model_degps / rate_degpmin:.4g}, so "
        f"{rate_degpmin:g} deg/min in {time_s:g} s is {model_degps:.4g} deg/s in {3 * programme.rise_s:.4g} s"
    )


def _card(
    result: YawResult, card: str | None, length_m: float | None, output: Path
) -> tuple[dict[Path, str | bytes], str]:
    """The files of the card asked for, and the sentence about it."""
    if card is None:
        text = f"{output}: the rig's card has the numbers of {result.method}"
        return result.rig_card(output.stem).files(output), text
    before, ship = load(card).manoeuvring(), result.with_nrdot(card, length_m)
    value, error = result.nrdot(length_m)
    spread = "" if error is None else f" ± {error:.2g}"
    was = f"{before.derivatives['Nrdot']:.4g} before" if "Nrdot" in before.derivatives else "not in the card before"
    text = f"{output}: N_rdot' = {value:.4g}{spread} ({was}) of {ship.name}, by {result.method}"
    return {output: ship.card.text}, text
