"""Steady captive tests reduced to the coefficients of the MMG method, as a result with its card."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.cards import Card
from tank2sim.cards.card import PROPELLER_COEFFICIENTS
from tank2sim.cards.covariance import Covariance
from tank2sim.cards.plausibility import unusual_signs, yaw_damping
from tank2sim.dynamics.mmg.hull import MMG_TERMS
from tank2sim.errors import InputError
from tank2sim.identification.captive.uncertainty_budget import blockage_speed
from tank2sim.identification.captive_mmg.card_text import MASS_KEYS, tested_card
from tank2sim.identification.captive_mmg.contradicted_tests import place_of_column
from tank2sim.identification.captive_mmg.regression import ORDINARY, MmgFit, fit_mmg
from tank2sim.identification.captive_mmg.steady_tests import read_steady_tests
from tank2sim.marks import CHECK

if TYPE_CHECKING:
    import pandas as pd

_UNEXPLAINED = 0.5
"""Share of a channel (rms of what is left over rms of the readings) from which the method is not that of the
ship, and the result is refused. Project choice: a wrong sign leaves more than 1, HMRI's KVLCC2 at most 0.13."""
_CURVE_UNEXPLAINED = 0.2
"""Share of K_T or K_Q (rms of what is left over that of the points) from which the open-water curve is not that of the
propeller behind the model. Project choice: open-water tests scatter by 1 or 2 %, a wrong sign leaves 100 %, a diameter
that is 10 % too large 35 % (HMRI's KVLCC2)."""
_CURVE_DOUBTFUL = 0.04
"""Share from which the result is marked. Project choice: HMRI's KVLCC2 has 0.007, and K_T 5 % too large 0.047."""
_SIGNIFICANT = 2.0
"""Standard errors from which a sign that no ship has is taken for the ship's (project choice)."""
_FAR = 3.0
"""Deviations from ordinary ships from which a coefficient is named (project choice)."""
_TOO_FAR = 5.0
"""Deviations from ordinary ships from which the result is marked (project choice)."""
_UNITS = {"X": "N", "Y": "N", "N": "N.m", "T": "N", "F_N": "N", "T_left": "N", "F_N_left": "N", "Q": "N.m"}


@dataclass(frozen=True)
class MmgCoefficient:
    """One coefficient of the method.

    Parameters
    ----------
    value, standard_error : float
        Of the hull by 1/2 rho L d U^2 (prime II), R0 positive aft; others as the method has them.
    type_a : float
        Standard error by the scatter of the tests alone.
    type_b : mapping
        Key of ``[uncertainty]`` to the standard error by it.
    origin : str
        ``measured``, ``estimated`` (m_x, m_y by a published formula) or ``open``: that of ordinary ships.
    """

    value: float
    standard_error: float
    origin: str
    type_a: float
    type_b: Mapping[str, float]


class MmgReductionResult(PagedResult):
    """Coefficients of the MMG method from steady captive tests.

    Parameters
    ----------
    fit : MmgFit

    Raises
    ------
    InputError
        The method does not describe a channel: its sign, unit or scale is another.
    """

    command = "reduce"

    def __init__(self, fit: MmgFit) -> None:
        self.fit = fit
        for channel, share in zip(fit.tests.channels, self.unexplained, strict=True):
            if share > _UNEXPLAINED:
                problem = f"{channel}: the MMG method leaves {100 * share:.0f} % of the readings unexplained"
                remedy = "check sign, unit and scaling of the column, normal_force_sign and the revolutions"
                raise InputError(fit.tests.path, "averages.columns", problem, remedy)
        self._refuse_other_curve()
        self._refuse_other_yaw_rate()
        self.notices = (*self._checks(), *self._notices())
        assert self.card  # refuses coefficients that are not those of a ship

    def _refuse_other_curve(self) -> None:
        """Refuse open-water points that thrust or torque behind the model contradict."""
        remedies = {
            "K_T": "check it, the unit of the thrust, propeller_rps and model.propeller_diameter_m",
            "K_Q": "check sign and unit of the torque, and that the propeller is the same",
        }
        measured = {"K_T": "thrust", "K_Q": "torque"}
        for name, share in self.fit.curves_unexplained.items():
            if share > _CURVE_UNEXPLAINED:
                problem = f"is {100 * share:.0f} % off its curve where the {measured[name]} behind the model is met"
                raise InputError(self.fit.tests.path, f"open_water.{name}", problem, remedies[name])

    def _refuse_other_yaw_rate(self) -> None:
        """Refuse a yaw rate of the other sign: the water would drive the turn, and meet the rudder from inside."""
        fit = self.fit
        if all(name in fit.names and self._significant(name, +1) for name in ("Nr", "l_R")):
            problem = f"Nr is {fit.value('Nr'):+.3g} and l_R {fit.value('l_R'):+.3g}; both are negative of every ship"
            remedy = "change the sign of the yaw rate: positive to starboard"
            raise InputError(fit.tests.path, place_of_column(fit.tests.form, "yaw_rate"), problem, remedy)

    def _significant(self, name: str, sign: int) -> bool:
        """True of a fitted coefficient of a sign, by :data:`_SIGNIFICANT` standard errors."""
        fit = self.fit
        return sign * fit.value(name) > _SIGNIFICANT * float(fit.errors[fit.names.index(name)])

    def _checks(self) -> list[str]:
        """Marks of a result that contradicts itself, or is not that of a ship."""
        fit, found = self.fit, list[str]()
        for name, share in fit.curves_unexplained.items():
            if share > _CURVE_DOUBTFUL:
                found.append(
                    f"{name} of the open-water points is {100 * share:.2g} % off the curve that the tests behind the "
                    "model agree with; check open_water, model.propeller_diameter_m and the unit of the gauge"
                )
        if fit.at_limit:
            values = ", ".join(f"{name} = {fit.value(name):.3g}" for name in fit.at_limit)
            found.append(f"{values} at the limit of what is looked for; the tests are not those of a ship there")
        for name, (mean, deviation) in ORDINARY.items():
            value = self.coefficients[name].value
            if abs(value - mean) > _TOO_FAR * deviation:
                found.append(f"{name} is {value:.3g}; ordinary ships have {mean:g} ± {deviation:g}")
        model = fit.tests.form.model
        assert model.draught_m is not None
        ratio = model.draught_m / model.length_m
        hull: list[str] = [name for name in ("Yv", "Nv", "Nr") if name in fit.names]
        prime = {name: ratio * fit.value(name) for name in hull}
        errors = {name: ratio * float(fit.errors[fit.names.index(name)]) for name in hull}
        cautions = (*unusual_signs(prime, errors), *yaw_damping(prime, errors, ratio))
        found += [f"by 1/2 rho L² U², {caution.message.rstrip('.')}" for caution in cautions]
        if "l_R" in fit.names and self._significant("l_R", +1):
            found.append(
                f"l_R is {fit.value('l_R'):+.3g}; it is negative of every ship: check the sign of the yaw rate"
            )
        return [f"{CHECK} {text}." for text in found]

    @cached_property
    def unexplained(self) -> tuple[float, ...]:
        """rms of what is left over rms of the readings, of each channel."""
        left = np.sqrt(np.mean(self.fit.residuals**2, axis=0) / np.mean(self.fit.tests.readings**2, axis=0))
        return tuple(map(float, left))

    @cached_property
    def coefficients(self) -> Mapping[str, MmgCoefficient]:
        """Coefficients by the names of an MMG card: R0 = -X0, mx = -Xudot, my = -Yvdot; with torque, those of K_Q (q_0,
        q_1, q_2) and the relative rotative efficiency eta_R, too."""
        fit, found = self.fit, {}
        for place, name in enumerate(fit.names):
            if name == "rudder_offset":
                continue
            key, sign = _card_key(name)
            origin = "estimated" if name in MASS_KEYS else "open" if name in fit.open else "measured"
            value, error, random = sign * fit.values[place], fit.errors[place], fit.random[place]
            common = {source: float(errors[place]) for source, errors in fit.common.items()}
            found[key] = MmgCoefficient(float(value), float(error), origin, float(random), common)
        for name, (mean, deviation) in ORDINARY.items():
            if name not in found:
                found[name] = MmgCoefficient(mean, deviation, "open", deviation, {})
        return found

    @cached_property
    def card(self) -> Card:
        """The MMG card found, with the covariance of its coefficients; ``card.save("ship.toml")`` writes it."""
        fit = self.fit
        values = {name: mean for name, (mean, _) in ORDINARY.items()} | dict(
            zip(fit.names, map(float, fit.values), strict=True)
        )
        values = {name: 0.0 for name in fit.not_excited if name not in ("Y0", "N0")} | values
        errors = {name: deviation for name, (_, deviation) in ORDINARY.items()} | dict(
            zip(fit.names, map(float, fit.errors), strict=True)
        )
        path = fit.tests.path
        source = f"{path.resolve().parent.name}/{path.name}"
        note = f"tank2sim reduce --model mmg {source}: {len(fit.tests.names)} steady conditions"
        card = tested_card(fit.tests, values, errors, note)
        kept = [i for i, name in enumerate(fit.names) if name != "rudder_offset"]
        keys = [_card_key(fit.names[i]) for i in kept]
        signs = np.array([sign for _, sign in keys])
        matrix = fit.covariance[np.ix_(kept, kept)] * np.outer(signs, signs)
        return replace(card, covariance=Covariance(tuple(_place(key) for key, _ in keys), matrix))

    @property
    def ship(self) -> Ship:
        """The ship of the card found."""
        return Ship(self.card)

    @property
    def derivatives(self) -> pd.DataFrame:
        """Coefficients by name: value, standard error, origin; hull in prime II."""
        import pandas as pd

        rows = {
            name: {key: value for key, value in asdict(coefficient).items() if not key.startswith("type")}
            for name, coefficient in self.coefficients.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index")

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        fit = self.fit
        arm, arm_error = fit.yaw_arm()
        computed, channels = fit.tests.readings - fit.residuals, fit.tests.channels
        offset = fit.names.index("rudder_offset") if "rudder_offset" in fit.names else None
        return {
            "campaign": str(fit.tests.path),
            "model": fit.tests.form.model.name,
            "coefficients": {name: asdict(coefficient) for name, coefficient in self.coefficients.items()},
            "yaw_arm": {"value": arm, "standard_error": arm_error},
            "rudder_angle_of_no_force_deg": None if offset is None else -float(np.degrees(fit.values[offset])),
            "channels": {
                name: {"unit": _UNITS[name], "standard_deviation": float(deviation), "unexplained": share}
                for name, deviation, share in zip(channels, fit.sigmas, self.unexplained, strict=False)
            },
            "open_water": {
                "points": len(fit.tests.open_water),
                "standard_deviation": float(fit.sigmas[len(channels)]),
                "unexplained": fit.curves_unexplained["K_T"],
            },
            "readings": {
                name: {"unit": _UNITS[name], "measured": fit.tests.readings[:, i], "computed": computed[:, i]}
                for i, name in enumerate(channels)
            },
            "conditions": list(fit.tests.names),
            "not_excited": list(fit.not_excited),
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """How many coefficients of how many conditions."""
        origins = [coefficient.origin for coefficient in self.coefficients.values()]
        tests = self.fit.tests
        text = f"{tests.form.model.name}: {origins.count('measured')} coefficients of the MMG method from "
        text += f"{len(tests.names)} steady conditions"
        if origins.count("open"):
            text += f"; {origins.count('open')} are open, and those of ordinary ships"
        return (f"{text}.",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Coefficients, and how well the readings are computed."""
        rows = [
            (name, f"{found.value:.4g} ± {found.standard_error:.2g}", found.origin)
            for name, found in self.coefficients.items()
        ]
        arm, error = self.fit.yaw_arm()
        rows.append(("x_R + a_H x_H", f"{arm:.4g} ± {error:.2g}", "measured"))
        left = [
            (name, _UNITS[name], f"{deviation:.3g}", f"{100 * share:.2g}")
            for name, deviation, share in zip(self.fit.tests.channels, self.fit.sigmas, self.unexplained, strict=False)
        ]
        deviations = self.fit.sigmas[len(self.fit.tests.channels) :]
        left += [
            (f"{name} (open water)", "", f"{deviation:.3g}", f"{100 * share:.2g}")
            for (name, share), deviation in zip(self.fit.curves_unexplained.items(), deviations, strict=True)
        ]
        return (
            screen_table("Coefficients (hull: prime II, by 1/2 rho L d U²)", ("", "value", ""), rows),
            screen_table("What is left of the readings", ("", "unit", "standard deviation", "% of the rms"), left),
        )

    def _notices(self) -> tuple[str, ...]:
        fit, found = self.fit, list(self.fit.tests.remarks)
        if opened := [name for name, entry in self.coefficients.items() if entry.origin == "open"]:
            found.append(f"The tests leave open, and the card has the values of ordinary ships: {', '.join(opened)}.")
        if missing := [name for name in fit.not_excited if name not in ("Y0", "N0")]:
            found.append(
                f"No condition shows {', '.join(missing)}: they are zero on the card, and a turn simulated "
                "with it is as wrong as that."
            )
        for name, (mean, deviation) in ORDINARY.items():
            entry = self.coefficients[name]
            if _FAR * deviation < abs(entry.value - mean) <= _TOO_FAR * deviation:
                found.append(f"{name} is {entry.value:.3g}; ordinary ships have {mean:g} ± {deviation:g}.")
        if "rudder_offset" in fit.names:
            angle = -np.degrees(fit.value("rudder_offset"))
            found.append(
                f"Straight ahead the rudder has no force at {angle:.2f} deg (positive to starboard), by the swirl of "
                "the propeller or the zero of the gear; the card does not have it."
            )
        if not fit.common:
            found.append(
                "The standard errors are of the scatter alone: errors of calibration, alignment and speed, common to "
                "all conditions, are in them where [uncertainty] of the campaign states them."
            )
        form = fit.tests.form
        raised = blockage_speed(form.model, form.tank, form.test)
        if raised and not form.uncertainty.blockage_relative:
            found.append(
                f"By Schuster's formula the walls raise the speed past the model by {100 * raised:.2g} %, neither "
                "corrected nor in the standard errors: [uncertainty] blockage_relative takes it in."
            )
        found.append("f_alpha and eps² are one product: the error of eps is that for f_alpha as stated.")
        return tuple(found)


def _card_key(name: str) -> tuple[str, float]:
    """Key of a coefficient on an MMG card, and its sign there."""
    if name == "X0":
        return "R0", -1.0
    return (MASS_KEYS[name], -1.0) if name in MASS_KEYS else (name, 1.0)


def _place(key: str) -> str:
    if key in MMG_TERMS or key in ("R0", *MASS_KEYS.values()):
        return f"derivatives.{key}"
    return f"propeller.{key}" if key in PROPELLER_COEFFICIENTS else f"rudder.{key}"


@checked
def reduce_to_mmg(campaign: str | Path) -> MmgReductionResult:
    """Reduce steady captive tests with thrust and rudder normal force to the coefficients of the MMG method.

    One weighted regression of X, Y, N, thrust and normal force of all conditions, with the open-water points, gives the
    hull (R_0' to N_rrr'), t_P, w_P0, C_1, C_2+-, t_R, a_H, x_H', eps, kappa, l_R' and gamma_R+- with standard errors
    (Yasukawa and Yoshimura 2015; :mod:`tank2sim.identification.captive_mmg.regression`).

    Parameters
    ----------
    campaign : path
        ``campaign.toml`` with ``[averages]``, ``[open_water]``, ``[propeller]`` and ``[rudder]``.

    Raises
    ------
    InputError
        A file is missing or at fault, the tests do not show hull or rudder, or the method does not describe a channel.
    """
    return MmgReductionResult(fit_mmg(read_steady_tests(Path(campaign))))
