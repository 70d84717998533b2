"""Study of steady captive tests by the MMG method: coefficients, their certainty, computed and measured readings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array
from tank2sim.cards import Card
from tank2sim.cards.card import PROPELLER_COEFFICIENTS
from tank2sim.cards.covariance import Covariance
from tank2sim.cards.plausibility import unusual_signs, yaw_damping
from tank2sim.dynamics.mmg.hull import MMG_TERMS
from tank2sim.errors import InputError
from tank2sim.identification.captive.study import PrimeValue
from tank2sim.identification.captive.uncertainty_budget import blockage_speed
from tank2sim.identification.captive_mmg.card_text import MASS_KEYS, tested_card
from tank2sim.identification.captive_mmg.regression import ORDINARY, MmgFit
from tank2sim.identification.captive_mmg.steady_tests import place_of_column
from tank2sim.notices import Notice, caution

_UNEXPLAINED = 0.5
"""Share of a channel (rms of the residuals over rms of the readings) from which the method does not describe the
ship, and the result is refused. Project choice: a wrong sign leaves more than 1, HMRI's KVLCC2 at most 0.13."""
_CURVE_UNEXPLAINED = 0.2
"""Share of K_T or K_Q (rms of the residuals over rms of the points) from which the open-water curve belongs to another
propeller than the one behind the model. Project choice: open-water tests scatter by 1 or 2 %, a wrong sign leaves
100 %, a diameter that is 10 % too large 35 % (HMRI's KVLCC2)."""
_CURVE_DOUBTFUL = 0.04
"""Share from which the result is marked. Project choice: HMRI's KVLCC2 has 0.007, and K_T 5 % too large 0.047."""
_SIGNIFICANT = 2.0
"""Standard errors from which a sign that no ship has is taken for the ship's (project choice)."""
_FAR = 3.0
"""Deviations from ordinary ships from which a coefficient is named (project choice)."""
_TOO_FAR = 5.0
"""Deviations from ordinary ships from which the result is marked (project choice)."""
_UNITS = {"X": "N", "Y": "N", "N": "N.m", "T": "N", "F_N": "N", "T_left": "N", "F_N_left": "N", "Q": "N.m"}


@dataclass(frozen=True, kw_only=True)
class MmgCoefficient(PrimeValue):
    """A coefficient: of the hull by 1/2 rho L d U^2 (prime II), R0 positive aft; others as the method has them."""

    origin: str  # ``measured``, ``estimated`` (m_x, m_y by a published formula) or ``open`` (taken from ordinary ships)
    type_a: float  # Standard error by the scatter of the tests alone
    type_b: dict[str, float]  # Key of ``[uncertainty]`` to the standard error by it


@dataclass(frozen=True, kw_only=True)
class ChannelFit:
    """Residual of a channel: its unit, standard deviation in that unit, and rms over rms of the readings."""

    unit: str
    standard_deviation: float
    unexplained: float


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelReadings:
    """Measured and computed readings (conditions,) of a channel."""

    unit: str
    measured: Array
    computed: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class MmgStudy:
    """Coefficients of the MMG method from steady tests."""

    campaign: str
    model: str
    coefficients: dict[str, MmgCoefficient]  # By the names of an MMG card: R0 = -X0, mx = -Xudot, my = -Yvdot
    yaw_arm: PrimeValue  # x_R' + a_H x_H', which tests show better than x_H' itself
    # Positive to starboard, straight ahead; None if the tests do not show it
    rudder_angle_of_no_force_deg: float | None
    channels: dict[str, ChannelFit]  # Channel (``X``, ``Y``, ``N``, ``T``, ``F_N`` ...) to its residual
    open_water_points: int
    open_water: dict[str, ChannelFit]  # ``K_T``, and with torque ``K_Q``, to the residual of the open-water points
    readings: dict[str, ChannelReadings]  # Channel to its readings
    # `conditions`, `not_excited`: Names of the conditions, and of the terms that none of them shows
    conditions: tuple[str, ...]
    not_excited: tuple[str, ...]
    notices: tuple[Notice, ...]


def study_mmg(fit: MmgFit) -> MmgStudy:
    """The study of a fit.

    Raises InputError: The method does not describe a channel: its sign, unit or scale is another.
    """
    tests, channels = fit.tests, fit.tests.channels
    left = np.sqrt(np.mean(fit.residuals**2, axis=0) / np.mean(tests.readings**2, axis=0))
    unexplained = dict(zip(channels, left.tolist(), strict=True))
    for channel, share in unexplained.items():
        if share > _UNEXPLAINED:
            problem = f"{channel}: the MMG method leaves {100 * share:.0f} % of the readings unexplained"
            remedy = "check sign, unit and scaling of the column, normal_force_sign and the revolutions"
            raise InputError(tests.path, "averages.columns", problem, remedy)
    _refuse_other_curve(fit)
    _refuse_other_yaw_rate(fit)
    coefficients, (arm, arm_error) = mmg_coefficients(fit), fit.yaw_arm()
    computed, deviations = tests.readings - fit.residuals, fit.sigmas.tolist()
    curves = zip(fit.curves_unexplained.items(), deviations[len(channels) :], strict=True)
    offset = "rudder_offset" in fit.names
    return MmgStudy(
        campaign=str(tests.path),
        model=tests.form.model.name,
        coefficients=coefficients,
        yaw_arm=PrimeValue(value=float(arm), standard_error=arm_error),
        rudder_angle_of_no_force_deg=-float(np.degrees(fit.value("rudder_offset"))) if offset else None,
        channels={
            name: ChannelFit(unit=_UNITS[name], standard_deviation=deviation, unexplained=unexplained[name])
            for name, deviation in zip(channels, deviations, strict=False)
        },
        open_water_points=len(tests.open_water),
        open_water={
            name: ChannelFit(unit="", standard_deviation=deviation, unexplained=float(share))
            for (name, share), deviation in curves
        },
        readings={
            name: ChannelReadings(unit=_UNITS[name], measured=tests.readings[:, place], computed=computed[:, place])
            for place, name in enumerate(channels)
        },
        conditions=tuple(tests.names),
        not_excited=tuple(fit.not_excited),
        notices=(
            *(caution(f"{text}.") for text in _checks(fit, coefficients)),
            *tests.remarks,
            *(Notice(f"{text}.") for text in _remarks(fit, coefficients)),
        ),
    )


def _refuse_other_curve(fit: MmgFit) -> None:
    """Refuse open-water points that thrust or torque behind the model contradict."""
    remedies = {
        "K_T": "check it, the unit of the thrust, propeller_rps and model.propeller_diameter_m",
        "K_Q": "check sign and unit of the torque, and that the propeller is the same",
    }
    measured = {"K_T": "thrust", "K_Q": "torque"}
    for name, share in fit.curves_unexplained.items():
        if share > _CURVE_UNEXPLAINED:
            problem = f"is {100 * share:.0f} % off its curve where the {measured[name]} behind the model is met"
            raise InputError(fit.tests.path, f"open_water.{name}", problem, remedies[name])


def _refuse_other_yaw_rate(fit: MmgFit) -> None:
    """Refuse a yaw rate of the other sign: the water would drive the turn, and meet the rudder from inside."""
    if all(name in fit.names and _significant(fit, name, +1) for name in ("Nr", "l_R")):
        problem = f"Nr is {fit.value('Nr'):+.3g} and l_R {fit.value('l_R'):+.3g}; both are negative of every ship"
        remedy = "change the sign of the yaw rate: positive to starboard"
        raise InputError(fit.tests.path, place_of_column(fit.tests.form, "yaw_rate"), problem, remedy)


def _significant(fit: MmgFit, name: str, sign: int) -> bool:
    """Whether a fitted coefficient has a sign, by :data:`_SIGNIFICANT` standard errors."""
    return sign * fit.value(name) > _SIGNIFICANT * float(fit.errors[fit.names.index(name)])


def _checks(fit: MmgFit, coefficients: Mapping[str, MmgCoefficient]) -> Iterator[str]:
    """Marks of a result that contradicts itself, or that no ship has."""
    for name, share in fit.curves_unexplained.items():
        if share > _CURVE_DOUBTFUL:
            yield (
                f"{name} of the open-water points is {100 * share:.2g} % off the curve that the tests behind the "
                "model agree with; check open_water, model.propeller_diameter_m and the unit of the gauge"
            )
    if fit.at_limit:
        values = ", ".join(f"{name} = {fit.value(name):.3g}" for name in fit.at_limit)
        yield f"{values} at the limit of the search; no ship gives such tests"
    yield from _extraordinary(coefficients, _TOO_FAR, math.inf)
    yield from _unusual_hull(fit)


def _extraordinary(coefficients: Mapping[str, MmgCoefficient], above: float, most: float) -> Iterator[str]:
    """Coefficients that differ from ordinary ships' by so many standard deviations."""
    for name, (mean, deviation) in ORDINARY.items():
        value = coefficients[name].value
        if above * deviation < abs(value - mean) <= most * deviation:
            yield f"{name} is {value:.3g}; ordinary ships have {mean:g} ± {deviation:g}"


def _unusual_hull(fit: MmgFit) -> Iterator[str]:
    model = fit.tests.form.model
    assert model.draught_m is not None
    ratio = model.draught_m / model.length_m
    hull: list[str] = [name for name in ("Yv", "Nv", "Nr") if name in fit.names]
    prime = {name: ratio * fit.value(name) for name in hull}
    errors = {name: ratio * float(fit.errors[fit.names.index(name)]) for name in hull}
    for unusual in (*unusual_signs(prime, errors), *yaw_damping(prime, errors, ratio)):
        yield f"by 1/2 rho L² U², {unusual.message.rstrip('.')}"
    if "l_R" in fit.names and _significant(fit, "l_R", +1):
        yield f"l_R is {fit.value('l_R'):+.3g}; it is negative of every ship: check the sign of the yaw rate"


def mmg_coefficients(fit: MmgFit) -> dict[str, MmgCoefficient]:
    """Coefficients by the names of an MMG card: R0 = -X0, mx = -Xudot, my = -Yvdot; with torque, K_Q (q_0,
    q_1, q_2) and the relative rotative efficiency eta_R, too."""
    found = {}
    for place, name in enumerate(fit.names):
        if name == "rudder_offset":
            continue
        key, sign = _card_key(name)
        origin = "estimated" if name in MASS_KEYS else "open" if name in fit.open else "measured"
        value, error, random = sign * fit.values[place], fit.errors[place], fit.random[place]
        common = {source: float(errors[place]) for source, errors in fit.common.items()}
        found[key] = MmgCoefficient(
            value=float(value), standard_error=float(error), origin=origin, type_a=float(random), type_b=common
        )
    for name, (mean, deviation) in ORDINARY.items():
        if name not in found:
            found[name] = MmgCoefficient(
                value=mean, standard_error=deviation, origin="open", type_a=deviation, type_b={}
            )
    return found


def mmg_card(fit: MmgFit) -> Card:
    """The MMG card of a fit, with the covariance of its coefficients.

    Raises InputError: No ship has these coefficients.
    """
    values = {name: mean for name, (mean, _) in ORDINARY.items()} | dict(
        zip(fit.names, map(float, fit.values), strict=True)
    )
    values = dict.fromkeys(_zero_on_card(fit), 0.0) | values
    errors = {name: deviation for name, (_, deviation) in ORDINARY.items()} | dict(
        zip(fit.names, map(float, fit.errors), strict=True)
    )
    path = fit.tests.path
    source = f"{path.resolve().parent.name}/{path.name}"
    note = f"tank2sim reduce --mmg {source}: {len(fit.tests.names)} steady conditions"
    card = tested_card(fit.tests, values, errors, note)
    kept = [i for i, name in enumerate(fit.names) if name != "rudder_offset"]
    keys = [_card_key(fit.names[i]) for i in kept]
    signs = np.array([sign for _, sign in keys])
    matrix = fit.covariance[np.ix_(kept, kept)] * np.outer(signs, signs)
    return replace(card, covariance=Covariance(tuple(_place(key) for key, _ in keys), matrix))


def _remarks(fit: MmgFit, coefficients: Mapping[str, MmgCoefficient]) -> Iterator[str]:
    if opened := [name for name, entry in coefficients.items() if entry.origin == "open"]:
        yield f"The tests leave open, and the card has the values of ordinary ships: {', '.join(opened)}"
    if missing := _zero_on_card(fit):
        yield (
            f"No condition shows {', '.join(missing)}: they are zero on the card, and a turn simulated with it is as "
            "wrong as that"
        )
    yield from _extraordinary(coefficients, _FAR, _TOO_FAR)
    if "rudder_offset" in fit.names:
        angle = -np.degrees(fit.value("rudder_offset"))
        yield (
            f"Straight ahead the rudder has no force at {angle:.2f} deg (positive to starboard), by the swirl of the "
            "propeller or the zero of the gear; the card does not have it"
        )
    if not fit.common:
        yield (
            "The standard errors are of the scatter alone: errors of calibration, alignment and speed, common to all "
            "conditions, are in them where [uncertainty] of the campaign states them"
        )
    form = fit.tests.form
    raised = blockage_speed(form.model, form.tank, form.test)
    if raised and not form.uncertainty.blockage_relative:
        yield (
            f"By Schuster's formula the walls raise the speed past the model by {100 * raised:.2g} %, neither "
            "corrected nor in the standard errors: [uncertainty] blockage_relative takes it in"
        )
    yield "f_alpha and eps² are one product: the error of eps is that for f_alpha as stated"


def _zero_on_card(fit: MmgFit) -> list[str]:
    """Terms that no condition shows, and that the card has as zero."""
    return [name for name in fit.not_excited if name not in ("Y0", "N0")]


def _card_key(name: str) -> tuple[str, float]:
    """Key of a coefficient on an MMG card, and its sign there."""
    if name == "X0":
        return "R0", -1.0
    return (MASS_KEYS[name], -1.0) if name in MASS_KEYS else (name, 1.0)


def _place(key: str) -> str:
    if key in MMG_TERMS or key in ("R0", *MASS_KEYS.values()):
        return f"derivatives.{key}"
    return f"propeller.{key}" if key in PROPELLER_COEFFICIENTS else f"rudder.{key}"
