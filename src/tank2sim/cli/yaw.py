"""``tank2sim yaw``: added yaw inertia and dissipation of a body that a motor turns in a tank."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, get_args

import click
from rich.markup import escape

from tank2sim.cards import ManoeuvringCard, YawRigCard, parse_card, read_card
from tank2sim.cards.form import YawRig
from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.dynamics.yaw_programme import Similarity, YawProgramme, programme_of
from tank2sim.dynamics.yaw_theory import FloatingBody, TheoryValue, theory_values
from tank2sim.errors import InputError
from tank2sim.files import write_together
from tank2sim.identification.yaw.card import (
    BEST,
    body_length,
    known_added_inertia,
    nrdot_prime,
    rig_card_text,
    tank_density,
    with_nrdot,
)
from tank2sim.identification.yaw.identify import (
    YAW_METHODS,
    YawOptions,
    YawResult,
    identify_yaw,
    parse_yaw_terms,
    torque_constant,
)
from tank2sim.identification.yaw.intervals import ENERGY_TERMS
from tank2sim.records.yaw import Medium, read_yaw_record, yaw_record_text
from tank2sim.simulation.yaw_rig_control import AdaptiveController, Controller

CONTROLLERS: dict[str, Controller | None] = {"tuned": None, "adaptive": AdaptiveController()}
"""Names of the controllers (4), from the right inertia, and (6)."""
_POSITIVE = click.FloatRange(min=0, min_open=True)


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """The options next to the records."""

    inertia_kgm2: float | None
    inertia_error: float | None
    torque_constant: float | None
    reference: Path | None
    reference_inertia: float | None
    rig: str | None
    terms: str | None
    mirror_percent: float
    method: str
    card: str | None
    length_m: float | None
    output: Path | None
    page: Path | None
    json_file: Path | None
    theory: str | None


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
@click.option("--similar-to", metavar="L,B,R,T",
              help="Simulate a ship's motion at model size: length, beam in m, yaw rate in deg/min, s.")  # fmt: skip
@click.option("--noise", "noise_A", type=click.FloatRange(min=0), default=0.0, help="Of the simulated current, A.")
@click.option("--inertia-kgm2", type=_POSITIVE, metavar="J", help="J_zz of body and rotor; else from records in air.")
@click.option("--inertia-error-kgm2", "inertia_error", type=click.FloatRange(min=0), help="Its standard error.")
@click.option("--torque-constant", type=_POSITIVE, metavar="KT", help="k_t, N m/A; else as the records say.")
@click.option("--reference", type=click.Path(path_type=Path), metavar="AIR.csv", help="Take k_t from a body in air ...")
@click.option("--reference-inertia-kgm2", "reference_inertia", type=_POSITIVE, help="... of this known inertia.")
@click.option("--rig", metavar="CARD", help="Card of the rig: its walls, gravity, accelerating and braking count.")
@click.option("--terms", metavar="LIST", help=f"Terms next to the inertia, of {', '.join(list(ENERGY_TERMS)[1:])}.")
@click.option("--mirror-percent", type=click.FloatRange(0, 1000), default=25.0, show_default=True,
              help="Largest difference of mirror images, % of the largest rate.")  # fmt: skip
@click.option(
    "--method", type=click.Choice(YAW_METHODS), default=BEST, show_default=True, help="Whose numbers a card gets."
)
@click.option("--card", metavar="SHIP", help="Put N_rdot into this ship's card; else -o writes a card of the rig.")
@click.option("--theory", metavar="L,B,T,H[,CB]",
              help="Also (7)-(9) for length, beam, draught, depth in m, block coefficient; or a CARD.")  # fmt: skip
@click.option("--length-m", type=_POSITIVE, metavar="L", help="Length of the model; else as the records say.")
@click.option("-o", "--output", type=click.Path(path_type=Path), metavar="CARD.toml", help="Write the card.")
@click.option("--page", type=click.Path(path_type=Path), metavar="PAGE.html", help="Write a page with charts.")
@json_option
def command(records: tuple[Path, ...], *, simulate: str | None, **options: object) -> None:
    """Estimate added yaw inertia and dissipation from each RECORD (t_s,phi_rad,current_A) of the yaw rig.

    Records in air ('# medium: air') give J_zz; the programme stands in comments of the file.
    """
    driven = {key: options.pop(key) for key in ("noise_A", "medium", "controller", "similar_to")}
    asked = _Asked(**options)  # type: ignore[arg-type]  # click has checked them
    if asked.card and not asked.output:
        raise InputError("--card", "", "has no file to be written to", "say which with -o CARD.toml")
    if simulate:
        source = _simulate(simulate, records, driven)
    elif driven["medium"] or driven["controller"] or driven["similar_to"]:
        options_told = "--medium, --controller, --similar-to"
        raise InputError(options_told, "", "are of a simulated rig", "give --simulate CARD as well")
    known = _known(asked.rig)
    try:
        result = identify_yaw([read_yaw_record(path) for path in records], _options(asked, known))
    except InputError as fault:
        if not simulate:
            raise
        records[0].unlink()  # a refusal leaves nothing behind
        if fault.source != str(records[0]):
            raise
        raise InputError(source, fault.place, f"the record simulated of it: {fault.problem}", fault.remedy) from None
    body = _floating_body(asked.theory) if asked.theory else None
    theory = theory_values(body, result.records[0].programme.max_rate_radps) if body else ()
    contents: dict[Path, str | bytes] = {}
    told = _card(result, asked, known, contents)
    if asked.json_file:
        contents[asked.json_file] = json_text({**result.as_json(), "theory": [asdict(own) for own in theory]})
    if asked.page:
        from tank2sim.report.kit.page import render_page
        from tank2sim.report.yaw.page import yaw_page

        contents[asked.page] = render_page(yaw_page(result, theory))
    inputs = [*records, *([asked.reference] if asked.reference else [])]
    write_together(contents, inputs=inputs, outputs=[asked.output, asked.page, asked.json_file])
    _show(result)
    _show_theory(theory)
    show_notices(result.notes)
    if told:
        screen.print(escape(told), soft_wrap=True)


def _simulate(name: str, records: tuple[Path, ...], driven: Mapping[str, Any]) -> str:
    """Write the record that the rig of a card would give, and return the card's file."""
    from tank2sim.simulation.yaw_record import simulated_record

    if len(records) != 1:
        raise InputError("--simulate", "", f"has {len(records)} records to write", "give the name of one")
    if records[0].exists():
        raise InputError(records[0], "", "is there already, and may be a measurement", "give --simulate a new name")
    card = _rig_card(name, "--simulate")
    similar = _similar(card, driven["similar_to"]) if driven["similar_to"] else None
    record = simulated_record(
        card,
        records[0],
        driven["noise_A"],
        medium=driven["medium"] or "water",
        controller=CONTROLLERS[driven["controller"] or "tuned"],
        programme=similar,
    )
    write_together({records[0]: yaw_record_text(record)}, inputs=[Path(card.source)])
    return card.source


def _similar(card: YawRigCard, text: str) -> YawProgramme:
    """The programme that is a ship's motion ``L,B,R,T`` at the size of the card's body; it is reported on the
    screen."""
    try:
        length, beam, rate_degpmin, time_s = (float(word) for word in text.split(","))
    except ValueError:
        length = beam = rate_degpmin = time_s = 0.0
    given = (length, beam, abs(rate_degpmin), time_s)
    if not all(0 < value < math.inf for value in given):
        remedy = "write length and beam in m, yaw rate in deg/min and time in s: 38,8,100,120"
        raise InputError("--similar-to", "", f"{text!r} is no motion of a ship", remedy)
    own = card.ship
    if own.length_m is None or own.beam_m is None:
        raise card.fault("ship", "has no length_m or no beam_m", "add them, on the waterline")
    ratio = Similarity(ship_length_m=length, ship_beam_m=beam, length_m=own.length_m, beam_m=own.beam_m)
    try:
        programme = ratio.programme(math.radians(rate_degpmin / 60), time_s, programme_of(card))
    except ValueError as error:
        raise InputError("--similar-to", "", str(error), "give another motion of the ship") from None
    screen.print(
        f"{length:g} m x {beam:g} m at {own.length_m:g} m x {own.beam_m:g} m: rates times {ratio.rate_ratio:.4g}, so "
        f"{rate_degpmin:g} deg/min in {time_s:g} s is {math.degrees(programme.max_rate_radps):.4g} deg/s in "
        f"{3 * programme.rise_s:.4g} s",
        soft_wrap=True,
    )
    return programme


def _floating_body(text: str) -> FloatingBody:
    """From ``L,B,T,H`` or ``L,B,T,H,CB``, or from a card that tells these."""
    if "," not in text:
        ship = read_card(text).ship
        sizes = [ship.length_m, ship.beam_m, ship.draught_m, ship.water_depth_m, ship.block_coefficient]
    else:
        try:
            sizes = [float(word) for word in text.split(",")]
        except ValueError:
            sizes = []
    missing = len(sizes) not in (4, 5) or any(size is None or not size > 0 for size in sizes[:4])
    if missing or (sizes[4:] and sizes[4] is not None and not 0 < sizes[4] <= 1):
        problem = f"{text!r} does not tell length, beam, draught and depth of water"
        raise InputError(
            "--theory", "", problem, "write for example 0.67,0.20,0.08,0.22,0.47, or name a card with them"
        )
    length, beam, draught, depth = (size or 0.0 for size in sizes[:4])
    block = sizes[4] if len(sizes) > 4 else None
    return FloatingBody(length_m=length, beam_m=beam, draught_m=draught, depth_m=depth, block_coefficient=block)


def _show_theory(theory: Sequence[TheoryValue]) -> None:
    if not theory:
        return
    heads = ["", "added inertia, 1e-4 kg m2", "paper's Table 1", "remark"]
    rows = [
        [
            own.formula,
            1e4 * own.value_kgm2,
            None if own.printed_kgm2 is None else 1e4 * own.printed_kgm2,
            own.remark,
        ]
        for own in theory
    ]
    show_table("From the form, by (7), (8) and (9) of Alyshev (2019)", heads, rows)


def _rig_card(name: str, option: str) -> YawRigCard:
    card = read_card(name)
    if not isinstance(card, YawRigCard):
        raise card.fault("model.kind", f"is {card.model.kind!r}", f"give {option} a card of the yaw rig")
    return card


def _known(rig: str | None) -> YawRig | None:
    return None if rig is None else _rig_card(rig, "--rig").yaw_rig


def _options(asked: _Asked, known: YawRig | None) -> YawOptions:
    constant, error = asked.torque_constant, 0.0
    if (asked.reference is None) != (asked.reference_inertia is None):
        raise InputError("--reference", "", "goes with --reference-inertia-kgm2", "give both, or neither")
    if asked.reference and asked.reference_inertia:
        constant, error = torque_constant(identify_yaw([read_yaw_record(asked.reference)]), asked.reference_inertia)
    return YawOptions(
        inertia_kgm2=asked.inertia_kgm2,
        inertia_error_kgm2=asked.inertia_error,
        torque_constant_NmpA=constant,
        torque_constant_error=error,
        known=known,
        terms=parse_yaw_terms(asked.terms) if asked.terms else None,
        mirror_limit=asked.mirror_percent / 100,
    )


def _card(result: YawResult, asked: _Asked, known: YawRig | None, contents: dict[Path, str | bytes]) -> str:
    """Put the card asked for among the contents; what to say of it."""
    if asked.output is None:
        return ""
    if asked.card is None:
        source = f"tank2sim yaw {' '.join(record.path.name for record in result.records)}, method {asked.method}"
        text = rig_card_text(result, asked.method, name=asked.output.stem, source=source, known=known)
        parse_card(text, str(asked.output))
        contents[asked.output] = text
        return f"{asked.output}: the rig's card has the numbers of {asked.method}"
    ship = read_card(asked.card)
    if not isinstance(ship, ManoeuvringCard):
        raise ship.fault("model.kind", f"is {ship.model.kind!r}, which has no N_rdot", "give --card a ship's card")
    known_added_inertia(result, asked.method)  # the first thing to be reported, if it is not known
    length = body_length(result, asked.length_m)
    new = with_nrdot(ship, result, asked.method, length)
    contents[asked.output] = new.text
    value, error = nrdot_prime(result, asked.method, length, tank_density(result))
    spread = "" if error is None else f" ± {error:.2g}"
    before = ship.derivatives.get("Nrdot")
    was = "not in the card before" if before is None else f"{before:.4g} before"
    return (
        f"{asked.output}: N_rdot' = {value:.4g}{spread} ({was}), from a model of {length:g} m to "
        f"{ship.ship.name} of {ship.ship.length_m:g} m, by {asked.method}"
    )


def _show(result: YawResult) -> None:
    rows = []
    for method, estimate in result.estimates.items():
        added = result.added_inertia(method)
        rows.append(
            [
                method.replace("_", " "),
                _with_error(*(added or (None, None))),
                _with_error(estimate.total_inertia_kgm2, estimate.inertia_error_kgm2),
                _with_error(estimate.dissipation_J, estimate.dissipation_error_J),
            ]
        )
    names = ", ".join(record.path.name for record in result.records)
    body = f"; J_zz = {1e4 * result.body.value_kgm2:.5g}e-4 kg m2 ({result.body.source})" if result.body else ""
    title = f"{names}: in {result.medium}, k_t = {result.torque_constant_NmpA:.4g} N m/A{body}"
    heads = ["", "added inertia, 1e-4 kg m2", "total, 1e-4 kg m2", "B + D, 1e-4 J"]
    show_table(title, heads, rows)
    friction = next(iter(result.estimates.values())).friction
    show_table(
        "Friction and water, by energy least squares",
        ["", "1e-4 SI"],
        [[term.replace("_", " "), _with_error(*own)] for term, own in friction.items()],
    )


def _with_error(value: float | None, error: float | None) -> str:
    """A value and its standard error, in units of 1e-4."""
    if value is None:
        return "-"
    spread = "" if error is None else f" ± {float(f'{1e4 * error:.2g}'):g}"
    return f"{1e4 * value:.5g}{spread}"
