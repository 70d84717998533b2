"""The MMG card of a tested model, with what was found and what had to be estimated."""

from __future__ import annotations

from collections.abc import Mapping

import tomlkit

from tank2sim.cards import parse_card
from tank2sim.cards.card import PROPELLER_COEFFICIENTS, RUDDER_COEFFICIENTS, MmgCard
from tank2sim.cards.estimates import estimate
from tank2sim.cards.mmg import fujii
from tank2sim.dynamics.mmg.hull import HULL_TERMS
from tank2sim.errors import InputError
from tank2sim.escaping import one_line
from tank2sim.identification.captive.result_card import model_particulars, model_yaw_inertia
from tank2sim.identification.captive_mmg.steady_tests import SteadyTests, place_of_column
from tank2sim.records.campaign_form import CampaignFile

_CAUSES = {
    "derivatives.Y": ("Y", "drift"),
    "derivatives.N": ("N", "drift"),
    "derivatives.": ("X", "thrust"),
    "propeller.": ("thrust",),
    "rudder.l_R": ("yaw_rate",),
    "rudder.t_R": ("X", "rudder_normal_force"),
    "rudder.a_H": ("Y", "rudder_normal_force"),
    "rudder.x_H": ("N", "rudder_normal_force"),
    "rudder.": ("rudder_normal_force",),
}
"""Beginning of a place on a card to the columns that give what is there; the first that fits."""
MASS_KEYS = {"Xudot": "mx", "Yvdot": "my", "Nrdot": "Jz"}
"""Derivative to its name on an MMG card, where it has the opposite sign."""


def mmg_card_text(tests: SteadyTests, values: Mapping[str, float], errors: Mapping[str, float], note: str) -> str:
    """The text of a card.

    `values`, `errors`: Coefficients of hull (prime II, by 1/2 rho L d U^2), propeller and rudder by name, and their
    standard errors; `note`: Sentence that says where the numbers are from.
    """
    form = tests.form
    model = form.model
    assert model.draught_m is not None and model.beam_m is not None
    volume_unit = 0.5 * form.test.water_density_kgpm3 * model.length_m**2 * model.draught_m
    inertia, inertia_source = model_yaw_inertia(model)
    document = tomlkit.document()
    document["format"] = "tank2sim-ship/1"
    document["ship"] = {
        "name": model.name,
        "length_m": model.length_m,
        "beam_m": model.beam_m,
        "draught_m": model.draught_m,
        "displacement_kg": model.mass_kg,
        "propeller_diameter_m": model.propeller_diameter_m,
        "rudder_area_m2": model.rudder_area_m2,
        "source": note,
    }
    document["environment"] = {
        "water_density_kgpm3": form.test.water_density_kgpm3,
        "gravity_mps2": form.test.gravity_mps2,
    }
    document["model"] = {"kind": "mmg", "speed_mps": form.test.speed_mps}
    document["rigid_body"] = {
        "mass": _rounded(model.mass_kg / volume_unit),
        "yaw_inertia": tomlkit.item(_rounded(inertia / (volume_unit * model.length_m**2))).comment(
            one_line(inertia_source)
        ),
        "x_G": _rounded(model.x_G_m / model.length_m),
    }
    document.update(_coefficients(tests, values, errors))
    return tomlkit.dumps(document)


def _coefficients(
    tests: SteadyTests, values: Mapping[str, float], errors: Mapping[str, float]
) -> dict[str, dict[str, object]]:
    """Tables of derivatives, propeller, rudder and standard errors."""
    form = tests.form
    derivatives: dict[str, object] = {}
    propeller, rudder = _equipment(form)
    uncertainty: dict[str, object] = {}

    def enter(name: str, table: dict[str, object], key: str, sign: float = 1.0) -> None:
        table[key] = _rounded(sign * values[name])
        if name in errors:
            uncertainty[key] = _rounded(errors[name], 3)

    for name in (name for names in HULL_TERMS.values() for name in names if name in values):
        enter(name, derivatives, *(("R0", -1.0) if name == "X0" else (name, 1.0)))
    for name, (value, error) in estimated_masses(tests).items():
        number = tomlkit.item(_rounded(-values.get(name, value)))
        derivatives[MASS_KEYS[name]] = number.comment("ESTIMATED, not from steady tests")
        uncertainty[MASS_KEYS[name]] = _rounded(errors.get(name, error), 3)
    tables = {**dict.fromkeys(PROPELLER_COEFFICIENTS, propeller), **dict.fromkeys(RUDDER_COEFFICIENTS, rudder)}
    for name in (name for name in values if name in tables):
        enter(name, tables[name], name)
    return {"derivatives": derivatives, "propeller": propeller, "rudder": rudder, "uncertainty": uncertainty}


def _equipment(form: CampaignFile) -> tuple[dict[str, object], dict[str, object]]:
    """Tables of propeller and rudder as the campaign states them."""
    rudder = form.rudder
    assert rudder is not None
    f_alpha = rudder.f_alpha or _rounded(fujii(rudder.aspect_ratio or 0.0))
    of_propeller: dict[str, object] = {"x_P": form.propeller.x_P}
    of_rudder: dict[str, object] = {"height_m": rudder.height_m, "f_alpha": f_alpha, "x_R": rudder.x_R}
    if form.propeller.number == 2:
        of_propeller |= {"number": 2, "y_P": form.propeller.y_P}
        of_rudder |= {"number": 2, "y_R": rudder.y_R}
    return of_propeller, of_rudder


def tested_card(tests: SteadyTests, values: Mapping[str, float], errors: Mapping[str, float], note: str) -> MmgCard:
    """The card of :func:`mmg_card_text`, with the same `tests`, `values`, `errors` and `note`.

    Raises InputError: The coefficients do not describe a ship; it names the campaign, and the columns that give the
    one at fault.
    """
    try:
        card = parse_card(mmg_card_text(tests, values, errors, note), "the reduced card")
    except InputError as fault:
        keys = next((keys for start, keys in _CAUSES.items() if fault.place.startswith(start)), ())
        places = [place_of_column(tests.form, key) for key in keys]
        place = " or ".join(places) if places else "averages" if tests.form.averages else "runs"
        problem = f"the tests give what no card can have, {fault.place}: {fault.problem}"
        remedy = "check sign, unit and scaling of these, open_water and the sizes of the model"
        raise InputError(tests.path, place, problem, remedy) from None
    assert isinstance(card, MmgCard)
    return card


def estimated_masses(tests: SteadyTests) -> dict[str, tuple[float, float]]:
    """X_udot, Y_vdot, N_rdot (prime II) and their standard errors, from :mod:`tank2sim.cards.estimates`."""
    model = tests.form.model
    assert model.draught_m is not None
    ratio = model.length_m / model.draught_m
    found = estimate(model_particulars(model, tests.form.test), MASS_KEYS)
    return {name: (ratio * number.value, ratio * number.standard_error) for name, number in found.items()}


def _rounded(value: float, figures: int = 7) -> float:
    return float(f"{value:.{figures}g}")
