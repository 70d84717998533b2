"""Every number of Poznyakov and Yudin (2007) that can be computed, beside the printed one.

Prints Tables 1 to 6, eq. (4), curve 3 of Fig. 1 and the tuning of section 4; ends with 1 if a value that should be
reproduced is not. The printed numbers here are those of the paper; the coefficients come from the bundled card.
"""

from __future__ import annotations

import math
import sys
import time

from tank2sim.analysis.catalogue.comparison import missing_of, tuned
from tank2sim.analysis.catalogue.tables import (
    agreed_variation,
    combined_prediction,
    draught_polynomials,
    influence_of,
    turns_of,
)
from tank2sim.analysis.influence.percent import change_percent
from tank2sim.analysis.turning.two_point_tuning import TwoPointTuning
from tank2sim.cards.steering_card import SteeringCard, read_steering_card

RUDDERS = (5, 10, 15, 20, 25, 30, 35)
TABLE_1 = {
    "inoue-hirano": {
        "radius_m": (814.8, 561.0, 458.1, 399.6, 361.0, 333.3, 312.2),
        "drift_deg": (8.0, 11.4, 14.0, 16.2, 18.0, 19.6, 21.2),
        "yaw_rate_degpmin": (32.5, 47.2, 57.8, 66.3, 73.3, 79.4, 84.8),
    },
    "base-restored": {
        "radius_m": (865.7, 622.9, 521.1, 462.2, 422.9, 394.3, 372.4),
        "drift_deg": (10.8, 15.2, 18.5, 21.3, 23.7, 25.8, 27.8),
        "yaw_rate_degpmin": (30.6, 42.5, 50.8, 57.3, 62.6, 67.1, 71.1),
    },
}
TABLE_2 = {"C_y_b": 459.9, "C_y_w": 465.5, "C_y_bb": 460.3, "C_y_d": 464.5, "C_m_b": 450.6, "C_m_w": 475.2}
TABLE_2 |= {"C_m_bbw": 469.5, "C_m_d": 442.5, "C_m_ww": 470.6, "C_m_wwb": 465.4}
TABLE_3 = {"C_y_b": 407.0, "C_y_w": 392.7, "C_y_bb": 399.7, "C_y_d": 396.4, "C_y_bw": 403.0, "C_y_ww": 399.5}
TABLE_3 |= {"C_m_b": 376.4, "C_m_w": 427.8, "C_m_ww": 403.2, "C_m_d": 385.1, "C_m_bbw": 406.8, "C_m_bww": 400.9}
ORDER = ("C_y_b", "C_y_w", "C_y_bb", "C_y_bw", "C_y_ww", "C_y_d")
ORDER += ("C_m_b", "C_m_w", "C_m_ww", "C_m_bww", "C_m_bbw", "C_m_d")
DEEPER = (0.62, -2.153, 20.1529, 0.8781, 4.8633, -0.401, 1.6676, 1.356, 5.1959, 0.4026, -0.737, -0.551)
LIGHTER = (-0.698, 1.9835, -19.642, -0.879, -4.764, 0.3425, -1.872, -1.554, -2.949, -0.65, 0.478, 0.2986)
KC = {"inoue-hirano-deeper": DEEPER, "inoue-hirano-lighter": LIGHTER}
TOLERANCES = {"radius_m": 0.25, "drift_deg": 0.2, "yaw_rate_degpmin": 0.1}
NOT_REPRODUCED = {("Table 3", "C_m_bbw"), ("Table 2", "C_m_b"), ("Table 2", "C_m_w"), ("Table 2", "C_y_w")}


class Report:
    """Prints found and printed numbers, and remembers whether all agree."""

    def __init__(self) -> None:
        self.agrees = True

    def line(self, what: str, found: float, printed: float, tolerance: float, *, expected: bool = True) -> None:
        """One number beside the printed one; `expected` False for one that is known not to be reproduced."""
        within = abs(found - printed) <= tolerance
        self.agrees &= within or not expected
        verdict = "" if within else "  NOT reproduced" if not expected else "  DIFFERS"
        print(f"  {what:34} {found:11.4f}   printed {printed:10.4f}{verdict}")


def main() -> int:
    start = time.perf_counter()
    report = Report()
    card = read_steering_card("poznyakov-yudin")
    turning(card, report)
    influence(card, report)
    agreement(card, report)
    print("Tuning to the trial points, 47 deg/min at 15 deg and 61 deg/min at 35 deg")
    found = tuned(card, "inoue-hirano")
    if isinstance(found, TwoPointTuning):
        rates = ", ".join(f"{60 * math.degrees(turn.yaw_rate_radps):.2f}" for turn in found.after)
        print(f"  hull factor {found.hull:.4f}, rudder factor {found.rudder:.4f}: {rates} deg/min;", end=" ")
        print(f"stable on a straight course: before {found.stable_before}, after {found.stable_after}")
    print("Missing")
    for name, told in missing_of(card).items():
        for words in told:
            print(f"  {name}: {words}")
    print(f"{time.perf_counter() - start:.2f} s; {'all as it should be' if report.agrees else 'SOMETHING DIFFERS'}")
    return 0 if report.agrees else 1


def turning(card: SteeringCard, report: Report) -> None:
    for name, printed in TABLE_1.items():
        print(f"Table 1, {card.models[name].title}")
        for place, turn in enumerate(turns_of(card, name, RUDDERS).turns):
            for key, values in printed.items():
                report.line(f"{RUDDERS[place]:2} deg, {key}", turn.as_json()[key], values[place], TOLERANCES[key])
    print("Fig. 1, curve 3 with its printed coefficients: yaw rate, deg/min, beside the trials'")
    for turn, printed_rate in zip(turns_of(card, "curve-3", (15, 35)).turns, (47.0, 61.0), strict=True):
        rate = turn.as_json()["yaw_rate_degpmin"]
        what = f"{math.degrees(turn.rudder_rad):.0f} deg"
        report.line(what, rate, printed_rate, 0.6, expected=printed_rate == 61.0)


def influence(card: SteeringCard, report: Report) -> None:
    for table, name, printed in (("Table 2", "base-restored", TABLE_2), ("Table 3", "inoue-hirano", TABLE_3)):
        found = influence_of(card, name)
        print(f"{table}, {card.models[name].title}, 20 deg: radius after 10 % more of each coefficient, m")
        for key, radius in printed.items():
            expected = (table, key) not in NOT_REPRODUCED
            report.line(f"{key} (K {found.K_percent[key]:+.2f} %)", found.radii_m[key], radius, 0.25, expected=expected)
    print("Table 6 and eq. (4): K over the draught through the printed values")
    polynomials = draught_polynomials(card)
    for key, values in (("C_m_b", (-0.58, -0.66, 0.008889)), ("C_m_w", (-6.73, 2.317, -0.087))):
        for power, (own, printed_value) in enumerate(zip(polynomials[key], values, strict=True)):
            report.line(f"{key}, T^{power}", own, printed_value, 0.0005)


def agreement(card: SteeringCard, report: Report) -> None:
    for other, printed in KC.items():
        print(f"Table 4, Kc to {card.models[other].title}, %")
        found = agreed_variation(card, "inoue-hirano", other)
        for key, value in zip(ORDER, printed, strict=True):
            report.line(key, found[key], value, 0.0006)
    print("Table 5: radius at 9.09 m foretold by the agreed variation, m")
    deeper = combined_prediction(card, "inoue-hirano-deeper")
    report.line("printed K, right pairs", deeper.predicted_m, 404.0, 0.06)
    report.line("printed K, as the paper pairs them", deeper.misread_m, 410.6, 0.06)
    report.line("the model itself", deeper.direct_m, 404.4, 0.06)
    report.line("the model with the slip", deeper.direct_misread_m, 411.5, 0.15)
    report.line("change, right pairs, %", deeper.percent, 1.11, 0.005)
    report.line("change, as printed, %", deeper.misread_percent, 2.75, 0.005)
    lighter = combined_prediction(card, "inoue-hirano-lighter")
    print("The same at 8.91 m (not in the paper)")
    print(f"  right pairs {lighter.predicted_m:.2f} m, the model itself {lighter.direct_m:.2f} m", end="; ")
    slip = change_percent(deeper.misread_m, deeper.direct_m)
    print(f"the slip makes the foretold radius at 9.09 m {slip:+.2f} % wrong")


if __name__ == "__main__":
    sys.exit(main())
