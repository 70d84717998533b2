"""Every number of Wilinski and Zellman (1984) that can be computed, beside the printed one, and the modern re-analysis.

Prints the mean speeds, Table 2, the inner products, the solution (2.3), the deviation of (2.4), the drag coefficient of
Fig. 2, the mass by (2.5), and what models of other size make of the same tows; ends with 1 if a number that should be
reproduced is not.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import printed_tows
from numpy.polynomial import Polynomial
from paper_numbers import PaperNumbers

from tank2sim.apps.rigs.tow import paper
from tank2sim.apps.rigs.tow.equation_error import discretise, fit_mean_speed, solve_normal_equations
from tank2sim.apps.rigs.tow.identify import identify_tow
from tank2sim.apps.rigs.tow.output_error import simulated_speeds
from tank2sim.apps.rigs.tow.records import Tows, read_tows
from tank2sim.apps.rigs.tow.study import TowStudy, speed_polynomials, study_tows, towed_body
from tank2sim.apps.rigs.tow.surge import SurgeCoefficients
from tank2sim.apps.rigs.tow.theory import TowedBody, drag_polynomial, mass_by_theory, masses_by_theory
from tank2sim.bundled import bundled
from tank2sim.identification.conditioning import scaled_condition

TERMS = ("B1", "B2", "B3")
EXACT = (2775.71, 13033.2, -4553.94, 557.27)
"""Solution of (1.12) with the unrounded products of (2.1)."""
PER_TOW = (3063, 3124, 2742, 2687, 2816)
"""M of each tow by the paper's algorithm, over 50 s."""
REANALYSIS = {
    "M": (3336, 63, 0.00689, -476.9),
    "M, B3": (3148, 141, 0.00641, -482.9),
    "M, B3, delay": (2772, 226, 0.00581, -491.3),
    "M, B2, B3": (3344, 295, 0.00629, -483.7),
    "M, B1, B2, B3": (4047, 571, 0.00570, -492.3),
    "M, B1, B2, B3, delay": (3355, 1276, 0.00570, -491.3),
}
"""M and its 95 % half-width (kg), scatter (m/s), AIC, by an independent computation."""

BY_TOW = ((3374, 56), (3350, 37), (3100, 89), (2898, 185), (3067, 103))
"""M and B3 of each tow by output error, by an independent computation."""
CONDITIONS = {"M": 1, "M, B3": 19, "M, B3, delay": 68, "M, B2, B3": 1.6e3, "M, B1, B2, B3": 5.5e5}
CONDITIONS |= {"M, B1, B2, B3, delay": 1.3e6}
"""Scaled condition of J'J of each model, by an independent computation."""
DRAGS = {
    "M, B3": {"B3": (97, 66)},
    "M, B3, delay": {"B3": (185, 68), "delay": (2.1, 1.1)},
    "M, B2, B3": {"B3": (-388, 643), "B2": (3381, 4413)},
    "M, B1, B2, B3": {"B3": (-5520, 3864), "B2": (82889, 58490), "B1": (-306602, 222881)},
    "M, B1, B2, B3, delay": {"B3": (-3016, 5239)},
}
"""Drag terms and delay with their 95 % half-widths, by the same independent computation."""
OTHER_DATA = "Table 2 was computed from other data than Table 1 prints"
NO_SOLUTION = "the printed coefficients do not solve the paper's own equations"

beside = PaperNumbers()


def printed_means() -> Tows:
    """The mean speeds as Table 1 prints them, as one tow."""
    return Tows(Path("Table 1"), ("speed_1_mps",), paper.TIMES_S, paper.MEANS_MPS[:, None])


def means(tows: Tows) -> None:
    """The means of Table 1."""
    for time, printed, true in zip(paper.TIMES_S, paper.MEANS_MPS, tows.mean_speed_mps, strict=True):
        misprint = "a misprint of 0.0142, the mean of the five readings" if time == 5 else ""
        beside(f"Table 1, mean speed at {time:g} s, m/s", printed, true, None if misprint else 6e-5, misprint)


def polynomials(tows: Tows) -> None:
    """Table 2 beside the least squares of the printed and of the true means; (2.1) is its row of degree 2."""
    recomputed = iter((0.08729, 0.000618, 0.003467, -0.004501, 0.0041494, -0.00001365, -0.002269, 0.003440, 0.00002355,
                       -0.000000496))  # fmt: skip
    errors = ((0.05499, 0.05768), (0.00438, 0.00460), (0.00318, 0.00334), (0.00282, 0.00296))
    for own, true in zip(speed_polynomials(printed_means()), speed_polynomials(tows), strict=True):
        printed, error = paper.TABLE_2[own.degree]
        where = "Table 2" + (" and (2.1)" if own.degree == 2 else "") + f", degree {own.degree}"
        for power, value in enumerate(printed):
            found, others = own.coefficients[power], next(recomputed)
            beside(f"{where}, alpha{power} (true means {true.coefficients[power]:.5g})", value, found, None, OTHER_DATA)
            beside("  the same, by others from the printed means", others, found, 2e-3 * abs(others))
        reproduced = own.degree in (0, 3)
        beside(f"{where}, error, rms by n", error, own.rms_mps, 1e-4 if reproduced else None, OTHER_DATA)
        for words, others, found in zip(("n", "n - 1"), errors[own.degree], (own.rms_mps, own.rms_less_one_mps),
                                        strict=True):  # fmt: skip
            beside(f"  by others, rms by {words}", others, found, 6e-6)
    for power, (value, found) in enumerate(
        zip((-0.004727, 0.0041622, -0.00001382), list(speed_polynomials(tows))[2].coefficients, strict=True)
    ):
        beside(f"true means, degree 2, alpha{power}", value, found, 1e-3 * abs(value))
    sign = "(2.1) has lost the minus sign, which its inner products have"
    beside("(2.1), alpha0 as its text prints it", 0.00493, printed_tows.SPEED.coef[0], None, sign)
    for power, value in enumerate((0.0043, -0.000034)):
        beside(f"(2.2), t^{power} of a*", value, printed_tows.SPEED.deriv().coef[power], 1e-12)
    cubic = Polynomial(paper.TABLE_2[3][0])(paper.TIMES_S) - paper.MEANS_MPS
    beside("rms of the cubic as printed", 0.020, float(np.sqrt(np.mean(cubic**2))), 6e-4)


def solution() -> None:
    """Inner products, (2.3), J."""
    problem = discretise(printed_tows.SPEED, paper.TIMES_S, TERMS, printed_tows.FORCE_N)
    for i in range(4):
        for j in range(i, 4):
            name = f"b{i + 1}{j + 1}"
            beside(name, printed_tows.INNER_PRODUCTS[i, j], problem.inner_products[i, j], 2e-7)
    for i in range(4):
        value = printed_tows.FORCE_PRODUCTS[i]
        beside(f"b{i + 1}0", value, problem.force_products[i], 2e-5 * value + 5e-6)
    exact = solve_normal_equations(problem)
    printed = np.array(list(vars(paper.SOLUTION).values()))
    for name, value, right, found in zip(("M", *TERMS), printed, EXACT, exact, strict=True):
        beside(f"{name} of (2.4)", value, found, None, NO_SOLUTION)
        beside(f"{name}, solution of (1.12) by others", right, found, 3e-6 * abs(right))
    beside("J of the printed solution", 4.464, problem.J(printed), 5e-4)
    beside("J of the solution", 0.5150, problem.J(exact), 5e-5)
    rounded = np.linalg.solve(printed_tows.INNER_PRODUCTS, printed_tows.FORCE_PRODUCTS)
    for name, value, found in zip(("M", *TERMS), (2817.9, -2907, -265, 270), rounded, strict=True):
        beside(f"{name} from the products as printed", value, found, 0.05 if name == "M" else 0.5)
    rows = np.abs(problem.inner_products @ printed - problem.force_products)
    share = float(np.max(rows / (np.abs(problem.inner_products) @ np.abs(printed))))
    beside("(1.12) with (2.4), largest error over the sum of terms", 1.4e-4, share, 5e-6)
    beside("J of (2.4) over the least", 8.7, problem.J(printed) / problem.J(exact), 0.05)
    wrong = discretise(Polynomial([0.00493, 0.0043, -0.000017]), paper.TIMES_S, TERMS, printed_tows.FORCE_N)
    most = float(np.max(wrong.inner_products / printed_tows.INNER_PRODUCTS)) - 1
    beside("b_ij of (2.1) with +0.00493, too large by up to", 0.70, most, 0.05)
    rounding(problem.inner_products, problem.force_products)
    beside("B2 as (2.3) prints it", 26096, paper.SOLUTION.B2_kgspm2, None, "(2.3) has lost the minus sign of (2.4)")
    beside("condition number of (b_ij)", 3.30e6, float(np.linalg.cond(problem.inner_products)), 5e3)
    beside("the same, scaled", 2.30e4, scaled_condition(problem.design) ** 2, 50)
    deviation(exact)


def rounding(inner: np.ndarray, force: np.ndarray) -> None:
    """What seven decimals of the b_ij leave of the solution: 95 % range over 20 000 random roundings."""
    change = np.random.default_rng(1).uniform(-5e-8, 5e-8, (20_000, 4, 4))
    symmetric = np.triu(change) + np.triu(change, 1).transpose(0, 2, 1)
    symmetric[:, 2, 2] = symmetric[:, 1, 3]  # b33 and b24 are the same integral, rounded alike
    symmetric[:, 3, 1] = symmetric[:, 1, 3]
    found = np.linalg.solve(inner + symmetric, np.broadcast_to(force[:, None], (20_000, 4, 1)))[..., 0]
    told = {"M": (2718, 2905), "B1": (-34000, 32600), "B2": (-9950, 8300), "B3": (-307, 921)}
    for (name, ends), low_high in zip(told.items(), np.percentile(found, (2.5, 97.5), axis=0).T, strict=True):
        for words, value, own in zip(("low", "high"), ends, low_high, strict=True):
            beside(f"b_ij rounded to seven decimals: {name}, {words}", value, own, 0.1 * (ends[1] - ends[0]))


def deviation(exact: np.ndarray) -> None:
    """Largest difference of the simulated from the mean speeds."""
    for words, coefficients, expected in (
        ("largest deviation of (2.4), m/s", paper.SOLUTION, 0.0142),
        ("the same of the solution", SurgeCoefficients(**dict(zip(vars(paper.SOLUTION), exact, strict=True))), 0.0128),
        ("the same with B2 positive, as (2.3)", replace(paper.SOLUTION, B2_kgspm2=26096.0), 0.113),
    ):
        speeds = simulated_speeds(coefficients, printed_tows.FORCE_N, paper.TIMES_S)
        apart = np.abs(speeds - paper.MEANS_MPS)
        beside(words, expected, float(np.max(apart)), 5e-4 if expected > 0.1 else 5e-5)
        if coefficients is paper.SOLUTION:
            beside("the same as printed, m/s", printed_tows.LARGEST_DEVIATION_MPS, float(np.max(apart)), 5e-4)
            beside("its time, s", 10, float(paper.TIMES_S[np.argmax(apart)]), 0)


def body_of_the_paper() -> None:
    """Fig. 2 and (2.5)."""
    body = TowedBody(length_m=3.8, beam_m=0.9, volume_m3=2.243)
    drag = drag_polynomial(paper.SOLUTION, body)
    for name, expected in (("A1_s2pm2", 12.800), ("A2_spm", -3.6144), ("A3", 0.27909)):
        beside(name, expected, vars(drag)[name], 5e-5 * abs(expected))
    for speed, expected in ((0.0, 0.279), (0.05, 0.1304), (0.10, 0.0456), (0.1412, 0.0239), (0.17, 0.0346)):
        beside(f"C at {speed:g} m/s, Re {body.reynolds(np.array(speed)):.3g}", expected,
               float(drag.at(np.array(speed))), 5.5e-4 if speed == 0 else 6e-5)  # fmt: skip
    beside("C by V^(2/3) over C by L^2", 8.427, body.area_ratio, 5e-4)
    triaxial, spheroid, printed = masses_by_theory(body)
    beside("k11, triaxial", 0.0946, triaxial.k11, 5e-5)
    beside("k11, spheroid", 0.0755, spheroid.k11, 5e-5)
    beside("M_s with k11 = 0.156, kg", printed_tows.MASS_BY_THEORY_KG, printed.near_surface_kg, 0.5)
    beside("V, m3", 2243, body.volume_m3, None, "printed as 2243 m3; 2243 kg of water are 2.243 m3")
    slip = "a slip after (2.5): the M of (2.4) is meant"
    beside("M_0 in the text, kg", 2520, paper.SOLUTION.total_mass_kg, None, slip)
    beside("M_s with k11 = 0.16, kg", 2497.8, mass_by_theory(body, 0.16, "").near_surface_kg, 0.05)
    apart = 100 * (paper.SOLUTION.total_mass_kg / printed_tows.MASS_BY_THEORY_KG - 1)
    beside("M of (2.4) above M_s, %", 2.45, apart, 0.005)
    beside("the same as printed, about, %", 3, apart, 0.6)
    beside("lambda11 = M - m of (2.4), kg", 307, paper.SOLUTION.total_mass_kg - 2243, 0.5)
    beside("the same of the solution, kg", 533, EXACT[0] - 2243, 0.5)


def algorithm(tows: Tows, study: TowStudy) -> None:
    """M by the paper's algorithm with four unknowns: each tow over 50 s, the true means, all readings together.

    Tow 4 has no reading at 50 s. With its polynomial continued to 50 s, as for the other tows, it gives 2687; over its
    own 45 s, as `tank2sim tow` takes each record by itself, 2682. Neither is the better: the difference is that of the
    times over which the error of the equation is summed.
    """

    def mass(speed: Polynomial) -> float:
        return float(solve_normal_equations(discretise(speed, paper.TIMES_S, TERMS, printed_tows.FORCE_N))[0])

    by_tow = list(study.tow_by_tow.values())
    for number, expected in enumerate(PER_TOW):
        own = tows.only(number)
        continued = "" if own.time_s[-1] == 50 else ", continued from 45 s to 50 s"
        beside(f"M of tow {number + 1}{continued}, kg", expected, mass(fit_mean_speed(own).polynomial), 0.6)
    beside("M of tow 4 over its own 45 s, kg", 2682, by_tow[0].alone[3, 0], 0.6)
    beside("M of the true means, kg", 2857, mass(fit_mean_speed(tows).polynomial), 0.5)
    every = ~np.isnan(tows.speed_mps)
    times = np.broadcast_to(tows.time_s[:, None], every.shape)[every]
    beside("M of the pooled readings, kg", 2870, mass(Polynomial.fit(times, tows.speed_mps[every], 2).convert()), 0.5)


def reanalysis(study: TowStudy) -> None:
    """Models of other size, tow by tow."""
    for one in study.models:
        name = one.label
        mass, half, scatter, aic = REANALYSIS.get(name, (np.nan,) * 4)
        known = name in REANALYSIS
        beside(f"{name}: M, kg", mass, one.estimates["M"], 0.01 * mass if known else None)
        beside(f"{name}: 95 % half-width, kg", half, one.half_widths_95["M"], 0.04 * half if known else None)
        beside(f"{name}: scatter, m/s", scatter, one.scatter_mps, 6e-6 if known else None)
        beside(f"{name}: AIC", aic, one.aic, 0.1 if known else None)
        if known:
            beside(f"{name}: scaled condition", CONDITIONS[name], one.condition_scaled, 0.06 * CONDITIONS[name])
    _, simple, late = study.tow_by_tow.values()
    for way, errors in zip((simple, late), ((84, 23), (62, 13, 0.4)), strict=True):
        for name, expected, found in zip(way.unknowns, errors, way.jackknife_standard_errors, strict=True):
            beside(f"leave-one-out error, {way.unknowns[-1]}: {name}", expected, found, 0.5 if expected > 1 else 0.05)
    for number, (expected, found) in enumerate(zip(BY_TOW, simple.alone, strict=True), start=1):
        for name, value, own in zip(("M", "B3"), expected, found, strict=True):
            beside(f"{name} of tow {number}, output error of M, B3", value, own, 0.6)
    models = {one.label: one for one in study.models}
    for name, told in DRAGS.items():
        for term, (value, half) in told.items():
            beside(f"{name}: {term}", value, models[name].estimates[term], max(0.04 * half, 0.06))
            found_half = models[name].half_widths_95[term]
            beside(f"{name}: {term}, 95 % half-width", half, found_half, max(0.04 * half, 0.06))
    low, high = study.mass_range_kg or (np.nan, np.nan)
    beside("least M of the usable models, kg", 2500, low, 100)
    beside("greatest M of the usable models, kg", 3400, high, 100)


def main() -> int:
    tows = read_tows(bundled("models", "wilinski-zellman", "tows.csv"))
    beside.heading("Wilinski and Zellman (1984)")
    means(tows)
    polynomials(tows)
    solution()
    body_of_the_paper()
    result = identify_tow(tows)
    study = study_tows(result, tows, towed_body(tows, result.mass_kg, {}))
    algorithm(tows, study)
    reanalysis(study)
    for note in study.notices:
        print(f"note: {note}")
    return beside.end()


if __name__ == "__main__":
    sys.exit(main())
