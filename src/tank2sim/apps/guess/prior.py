"""Prior knowledge of a ship by its main dimensions: a card of published estimates with wide standard errors.

Linear and acceleration derivatives come from :mod:`tank2sim.cards.estimates`. The rudder is one of the
area that rules of classification require, in the slipstream of its propeller. For all other numbers there is no
regression that would hold here: their means and standard errors enclose what was identified or measured on the bundled
KVLCC2, Esso Osaka and Mariner, three ships, and so are uncertain themselves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cards.estimates import GYRATION, Particulars, estimate
from tank2sim.cards.writing import DerivativeEntry, ManoeuvringResult, TestedRange, manoeuvring_card_text
from tank2sim.dynamics.abkowitz import ACCELERATION_TERMS
from tank2sim.dynamics.effects.hull import CROSS_FLOW_DRAG
from tank2sim.dynamics.effects.loaded_rudder import LOADED_RUDDER
from tank2sim.errors import ArgumentError
from tank2sim.units import KNOT_MPS, in_words

_THREE_SHIPS = "ESTIMATED: about what KVLCC2, Esso Osaka and Mariner have"

_RUDDER_SLOPE = 6.13 * 1.5 / (1.5 + 2.25)
"""Normal force coefficient by angle of attack of a rudder of aspect ratio 1.5: Fujii's 6.13 A/(A + 2.25), as in
Yasukawa and Yoshimura (2015), J. Mar. Sci. Technol. 20, 37-52."""

_HULL_FORCE = 1.3
"""1 + a_H: side force of rudder and hull over the rudder's (KVLCC2 1.31, Yasukawa and Yoshimura 2015)."""

_SLIPSTREAM, _SLIPSTREAM_ERROR = 1.4, 0.35
"""Square of the inflow speed of the rudder over the ship's, and its relative standard error: the cards of KVLCC2,
Esso Osaka and Mariner have 1.2, 2.0 and 1.2 of the force at the ship's speed. Project choice."""

_ARM, _ARM_ERROR = 0.45, 0.4
"""Arm of the rudder force, L, and relative standard error of the moment: 0.49, 0.34 and 0.50 on the same cards. Project
choice."""

_YR_ERROR = 0.25
"""Standard error of Clarke's Y_r in units of pi (T/L)^2: a difference of numbers four times as large; those identified
on KVLCC2 and Esso Osaka are 0.23 and 0.5 away. Project choice."""

_BLOCK_OF_EVEN_TRIM, _TRIM_SLOPE = 0.683, 0.276
"""Block coefficient at which x_G is midships, and x_G/L by the block coefficient beyond it: through KVLCC2 and Mariner.
Project choice."""

_SURGE_DRIFT, _SURGE_DRIFT_ERROR = 0.8, 0.4
"""X_vr over -Y_vdot, and its standard error: 1.07, 1.0 and 0. Project choice."""

_RUDDER_DRAG, _RUDDER_DRAG_ERROR = 0.6, 0.4
"""X_dd over Y_d, and its relative standard error: 0.61, 0.75 and 0.34. Project choice."""

_OTHERS: Mapping[str, tuple[float, float]] = {
    "Xu": (-0.0028, 0.001),
    "Xuu": (0.0015, 0.002),
    "Xvv": (-0.004, 0.004),
    "Xrr": (0.0003, 0.001),
    "Nvvr": (-0.003, 0.012),
    "Nvrr": (0.0, 0.0015),
    "Nrrr": (0.0003, 0.0005),
}
"""Mean and standard error of derivatives without a formula. Project choice: as the beginning of this module says."""

_EFFECTS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    CROSS_FLOW_DRAG.name: {"drag_coefficient": (0.75, 0.2)},
    LOADED_RUDDER.name: {"loading": (0.62, 0.15), "straightening": (0.44, 0.12), "lever": (-0.72, 0.1)},
}
"""The same of effects. Project choice."""

_GEAR_RATE, _GEAR_ANGLE = 65.0 / 28.0, 35.0
"""Rate (deg/s) and largest angle (deg) of the steering gear: 35 deg to 30 deg on the other side in 28 s (SOLAS
II-1/29)."""

_LIMITS: Mapping[str, tuple[float, float]] = {
    "length": (1.0, 500.0),
    "beam": (0.08, 100.0),
    "draught": (0.02, 40.0),
    "block": (0.35, 1.0),
    "speed": (1.0, 45.0),
}
"""Limits of a merchant ship or its model, m, -, and the ship's speed, kn. Project choice: wider than any ship; models
below 1 m are toys."""

SHORTEST_SHIP_GUESSED_M, SHIP_OF_MODEL_M = 20.0, 200.0
"""Length (m) below which a guess is one of a model, and the length of the ship whose model it is taken for: speeds and
the rate of the steering gear follow Froude. Project choice: few ships are shorter, few models longer."""


@dataclass(frozen=True, kw_only=True)
class ShipDimensions:
    """Main dimensions of a ship, or of a model of a ship (shorter than :data:`SHORTEST_SHIP_GUESSED_M`).

    Parameters
    ----------
    length_m, beam_m, draught_m : float
        Between perpendiculars, moulded, mean.
    block : float
        Block coefficient.
    speed_kn : float
        Speed at which the figures hold, knots.

    Raises
    ------
    InputError
        A number is not one of a ship or model, or the numbers do not fit one ship.
    """

    length_m: float
    beam_m: float
    draught_m: float
    block: float
    speed_kn: float

    def __post_init__(self) -> None:
        what, froude = ("models", math.sqrt(self.scale)) if self.scale > 1 else ("ships", 1.0)
        for (low, high), (name, value) in zip(_LIMITS.values(), vars(self).items(), strict=True):
            least, most = (low / froude, high / froude) if name == "speed_kn" else (low, high)
            if not least <= value <= most:
                unit = in_words(name)[1]
                of = f"{what} of this length have" if name == "speed_kn" and self.scale > 1 else "ships have"
                remedy = f"{of} {least:.3g} to {most:.3g} {unit}".rstrip()
                if name == "length_m":
                    remedy += f", models of ships {low:g} m at least"
                raise ArgumentError(name, "", f"is {value:g} {unit}".rstrip(), remedy)
        if not 2.2 <= self.length_m / self.beam_m <= 12.0:  # harbour tugs have 2.6
            problem = f"is 1/{self.length_m / self.beam_m:.3g} of the length"
            raise ArgumentError("beam_m", "", problem, "ships have 1/12 to 1/2.2: give metres")
        if not 1.5 <= self.beam_m / self.draught_m <= 8.0:
            problem = f"is 1/{self.beam_m / self.draught_m:.3g} of the beam"
            raise ArgumentError("draught_m", "", problem, "ships have 1/8 to 1/1.5: give metres")

    @property
    def scale(self) -> float:
        """Length of the ship over the model's, assumed (:data:`SHIP_OF_MODEL_M`); 1 for a ship."""
        return SHIP_OF_MODEL_M / self.length_m if self.length_m < SHORTEST_SHIP_GUESSED_M else 1.0

    @property
    def speed_mps(self) -> float:
        """The speed, m/s."""
        return self.speed_kn * KNOT_MPS


def rudder_by_rules(length_m: float, beam_m: float, draught_m: float, area_m2: float | None = None) -> float:
    """-Y_d' of a rudder of the area that rules of classification require, or of `area_m2`, in its propeller's
    slipstream."""
    # Rules of Det Norske Veritas: A = L T/100 (1 + 25 (B/L)^2), as in Molland and Turnock (2007), Marine Rudders.
    area = length_m * draught_m / 100 * (1 + 25 * (beam_m / length_m) ** 2) if area_m2 is None else area_m2
    return _HULL_FORCE * _RUDDER_SLOPE * _SLIPSTREAM * area / length_m**2


def prior_card(ship: ShipDimensions, name: str) -> ManoeuvringCard:
    """The card of a ship whose dimensions alone are known, with standard errors of all estimates."""
    x_G = _TRIM_SLOPE * (ship.block - _BLOCK_OF_EVEN_TRIM)
    particulars = Particulars(
        length_m=ship.length_m,
        beam_m=ship.beam_m,
        draught_m=ship.draught_m,
        block_coefficient=ship.block,
        x_G_m=x_G * ship.length_m,
    )
    names = [*ACCELERATION_TERMS, "Yv", "Yr", "Nv", "Nr", "yaw_inertia"]
    found = {
        key: (entry.value, entry.standard_error, f"ESTIMATED: {entry.source}")
        for key, entry in estimate(particulars, names).items()
    }
    _, _, inertia_source = inertia = found.pop("yaw_inertia")
    value, _, source = found["Yr"]
    found["Yr"] = value, _YR_ERROR * math.pi * (ship.draught_m / ship.length_m) ** 2, source
    side = rudder_by_rules(ship.length_m, ship.beam_m, ship.draught_m)
    rudder = "ESTIMATED: rudder of the area by rule, slope by Fujii"
    found["Yd"] = -side, _SLIPSTREAM_ERROR * side, rudder
    found["Nd"] = _ARM * side, _ARM_ERROR * _ARM * side, rudder
    found["Xdd"] = -_RUDDER_DRAG * side, _RUDDER_DRAG_ERROR * _RUDDER_DRAG * side, _THREE_SHIPS
    sway = -found["Yvdot"][0]
    found["Xvr"] = _SURGE_DRIFT * sway, _SURGE_DRIFT_ERROR * sway, _THREE_SHIPS
    found |= {key: (mean, error, _THREE_SHIPS) for key, (mean, error) in _OTHERS.items()}
    result = ManoeuvringResult(
        particulars={
            "name": name,
            "length_m": ship.length_m,
            "beam_m": ship.beam_m,
            "draught_m": ship.draught_m,
            "block_coefficient": ship.block,
        },
        source="guessed by tank2sim from main dimensions and manoeuvring figures",
        notes="No number was measured: each is an estimate with a wide standard error.",
        environment={"water_density_kgpm3": 1025.0 if ship.scale == 1.0 else 998.0},
        speed_mps=ship.speed_mps,
        largest=TestedRange(math.radians(30.0), math.radians(_GEAR_ANGLE), 1.2),
        rigid_body={"mass": particulars.mass_prime, "yaw_inertia": inertia[0], "x_G": x_G},
        inertia_source=inertia_source.removeprefix("ESTIMATED: ") or GYRATION,
        derivatives={key: DerivativeEntry(*entry) for key, entry in found.items()},
    )
    rate = _GEAR_RATE * math.sqrt(ship.scale)
    lines = [manoeuvring_card_text(result), "[steering_gear]", f"max_rate_degps = {rate:.4g}"]
    lines.append(f"max_angle_deg = {_GEAR_ANGLE:g}")
    for effect, values in _EFFECTS.items():
        lines += ["", "[[effects]]", f'name = "{effect}"', "[effects.parameters]"]
        lines += [f"{key} = {mean!r}" for key, (mean, _) in values.items()]
        lines += ["[effects.uncertainty]", *(f"{key} = {error!r}" for key, (_, error) in values.items())]
    card = parse_card("\n".join(lines) + "\n", name)
    assert isinstance(card, ManoeuvringCard)
    return card
