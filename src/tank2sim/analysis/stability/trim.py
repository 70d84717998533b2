"""Effect of trim on straight-line stability: an estimate, because a card holds for a single trim.

Two sources, side by side. Both give the hydrodynamic derivatives, without the inertia of (3.1).

Paper 2 (Krezelewski and Misiag, section 5): a change of trim of 1 % changes one of the two most significant
coefficients by 7.5 %; the print is damaged and leaves open whether it is Y_r or N_r. Both readings are reported.

Inoue, Hirano and Kijima (1981), Hydrodynamic derivatives on ship manoeuvring, Int. Shipbuilding Progress 28(321), from
tests of models on even keel and trimmed, with tau the trim by the stern and d the mean draught (factors as quoted in
later literature):

    Y_v (1 + 0.67 tau/d)   Y_r (1 + 0.80 tau/d)   N_v (1 - 0.27 (Y_v/N_v) tau/d)   N_r (1 + 0.30 tau/d)

The mass, its centre and the rudder do not change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tank2sim.analysis.stability.margin import Margin
from tank2sim.arrays import Array
from tank2sim.dynamics.model import Model

PAPER_CHANGE = 0.075
"""Change of Y_r or N_r by 1 % of trim (paper 2, section 5)."""

INOUE = {"Yv": 2 / 3, "Yr": 0.80, "Nv": -0.27, "Nr": 0.30}
"""Relative change by tau/d (Inoue et al. 1981); that of N_v over its lever N_v/Y_v in ship lengths."""

TRIMS = np.linspace(-0.01, 0.01, 21)
"""Trim by the stern over ship length at which C' is reported."""


@dataclass(frozen=True)
class TrimEffect:
    """C' by trim.

    Parameters
    ----------
    readings : dict
        ``Yr`` and ``Nr``: C' with that derivative 7.5 % smaller and larger in magnitude (trim changed by 1 %).
    trims, criteria : arrays (k,)
        Trim by the stern over ship length, and C' after Inoue et al.
    draught_m : float
        Mean draught with which tau/d was formed.
    changes : dict
        Per cent by which 1 % of L of trim by the stern changes each derivative after Inoue et al.
    """

    readings: Mapping[str, tuple[float, float]]
    trims: Array
    criteria: Array
    draught_m: float
    changes: Mapping[str, float]

    def as_json(self) -> dict[str, object]:
        """Both estimates."""
        return {
            "estimate": True,
            "paper_7_5_percent": {name: {"less": low, "more": high} for name, (low, high) in self.readings.items()},
            "inoue_1981": {
                "trim_by_stern_over_length": self.trims,
                "C_prime": self.criteria,
                "draught_m": self.draught_m,
                "change_percent_by_1_percent": dict(self.changes),
            },
        }


def trim_effect(model: Model, margin: Margin) -> TrimEffect:
    """C' by trim, from the slopes of the margin."""
    values = dict(zip(model.parameter_names, model.parameter_values().tolist(), strict=True))
    length = values["ship.length"]
    mass = values["ship.mass"] / (0.5 * values["ship.water_density"] * length**3)
    inertia = {"Yr": mass, "Nr": mass * values["ship.x_G"] / length}
    (Yv, Yr), (Nv, Nr) = margin.slopes.tolist()
    bare = {"Yv": Yv, "Yr": Yr + inertia["Yr"], "Nv": Nv, "Nr": Nr + inertia["Nr"]}

    def criterion(factors: Mapping[str, float]) -> float:
        trimmed = {name: value * factors.get(name, 1.0) for name, value in bare.items()}
        return float(trimmed["Yv"] * (trimmed["Nr"] - inertia["Nr"]) - trimmed["Nv"] * (trimmed["Yr"] - inertia["Yr"]))

    draught = values["ship.draught"]
    lever = Nv / Yv if Yv and Nv else np.inf
    rates = {name: rate / (lever if name == "Nv" else 1.0) for name, rate in INOUE.items()}
    per_length = length / draught
    curve = [criterion({name: 1 + rate * trim * per_length for name, rate in rates.items()}) for trim in TRIMS]
    return TrimEffect(
        readings={
            name: (criterion({name: 1 - PAPER_CHANGE}), criterion({name: 1 + PAPER_CHANGE})) for name in ("Yr", "Nr")
        },
        trims=TRIMS,
        criteria=np.array(curve),
        draught_m=draught,
        changes={name: rate * per_length for name, rate in rates.items()},
    )
