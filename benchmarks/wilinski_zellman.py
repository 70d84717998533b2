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
from numpy.polynomial import Polynomial

from tank2sim.bundled import bundled
from tank2sim.dynamics.surge import SurgeCoefficients
from tank2sim.dynamics.surge_theory import TowedBody, drag_polynomial, mass_by_theory, masses_by_theory
from tank2sim.identification.conditioning import scaled_condition
from tank2sim.identification.tow import paper
from tank2sim.identification.tow.equation_error import discretise, fit_mean_speed, solve_normal_equations
from tank2sim.identification.tow.identify import identify_tow
from tank2sim.identification.tow.output_error import simulated_speeds
from tank2sim.identification.tow.study import TowStudy, speed_polynomials, study_tows, towed_body
from tank2sim.records.tows import Tows, read_tows

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

_failed: list[str] = []


def beside(what: str, expected: float, found: float, tolerance: float | None = None) -> None:
    """A line: what it is, the number expected, the one found; with a tolerance (absolute) it must agree."""
    verdict = ""
    if tolerance is not None:
        verdict = "agrees" if abs(found - expected) <= tolerance else "DIFFERS"
        if verdict == "DIFFERS":
            _failed.append(what)
    print(f"  {what:44} {expected:13.6g} {found:13.6g}  {verdict}")


def printed_means() -> Tows:
    """The mean speeds as Table 1 prints them, as one tow."""
    return Tows(Path("Table 1"), ("speed_1_mps",), paper.TIMES_S, paper.MEANS_MPS[:, None])


def polynomials(tows: Tows) -> None:
    """Table 2 beside the least squares of the printed and of the true means."""
    for own, true in zip(speed_polynomials(printed_means()), speed_polynomials(tows), strict=True):
        printed, error = paper.TABLE_2[own.degree]
        reproduced = own.degree in (0, 3)
        for power, value in enumerate(printed):
            beside(f"degree {own.degree}, alpha{power} (true means {true.coefficients[power]:.5g})", value,
                   own.coefficients[power])  # fmt: skip
        beside(f"degree {own.degree}, error, rms by n", error, own.rms_mps, 1e-4 if reproduced else None)
    cubic = Polynomial(paper.TABLE_2[3][0])(paper.TIMES_S) - paper.MEANS_MPS
    beside("rms of the cubic as printed", 0.020, float(np.sqrt(np.mean(cubic**2))), 6e-4)


def solution() -> None:
    """Inner products, (2.3), J."""
    problem = discretise(paper.SPEED, paper.TIMES_S, TERMS, paper.FORCE_N)
    for i in range(4):
        for j in range(i, 4):
            name = f"b{i + 1}{j + 1}"
            beside(name, paper.INNER_PRODUCTS[i, j], problem.inner_products[i, j], 2e-7)
    for i in range(4):
        value = paper.FORCE_PRODUCTS[i]
        beside(f"b{i + 1}0", value, problem.force_products[i], 2e-5 * value + 5e-6)
    exact = solve_normal_equations(problem)
    printed = np.array(list(vars(paper.SOLUTION).values()))
    for name, value, right, found in zip(("M", *TERMS), printed, EXACT, exact, strict=True):
        beside(f"{name} of (2.3)", value, found)
        beside(f"{name}, solution of (1.12) by others", right, found, 3e-6 * abs(right))
    beside("J of the printed solution", 4.464, problem.J(printed), 5e-4)
    beside("J of the solution", 0.5150, problem.J(exact), 5e-5)
    rounded = np.linalg.solve(paper.INNER_PRODUCTS, paper.FORCE_PRODUCTS)
    beside("M from the products as printed", 2817.9, float(rounded[0]), 0.05)
    beside("condition number of (b_ij)", 3.30e6, float(np.linalg.cond(problem.inner_products)), 5e3)
    beside("the same, scaled", 2.30e4, scaled_condition(problem.design) ** 2, 50)
    for words, coefficients, expected in (
        ("largest deviation of (2.4), m/s", paper.SOLUTION, 0.0142),
        ("the same of the solution", SurgeCoefficients(**dict(zip(vars(paper.SOLUTION), exact, strict=True))), 0.0128),
        ("the same with B2 positive, as (2.3)", replace(paper.SOLUTION, B2_kgspm2=26096.0), 0.113),
    ):
        speeds = simulated_speeds(coefficients, paper.FORCE_N, paper.TIMES_S)
        beside(words, expected, float(np.max(np.abs(speeds - paper.MEANS_MPS))), 5e-4 if expected > 0.1 else 5e-5)


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
    beside("M_s with k11 = 0.156, kg", paper.MASS_BY_THEORY_KG, printed.near_surface_kg, 0.5)
    beside("M_s with k11 = 0.16, kg", 2497.8, mass_by_theory(body, 0.16, "").near_surface_kg, 0.05)
    apart = 100 * (paper.SOLUTION.total_mass_kg / paper.MASS_BY_THEORY_KG - 1)
    beside("M of (2.4) above M_s, %", 2.45, apart, 0.005)
    beside("lambda11 = M - m of (2.4), kg", 307, paper.SOLUTION.total_mass_kg - 2243, 0.5)


def algorithm(tows: Tows) -> None:
    """M by the paper's algorithm with four unknowns: each tow over 50 s, the true means, all readings together."""

    def mass(speed: Polynomial) -> float:
        return float(solve_normal_equations(discretise(speed, paper.TIMES_S, TERMS, paper.FORCE_N))[0])

    for number, expected in enumerate(PER_TOW):
        beside(f"M of tow {number + 1}, kg", expected, mass(fit_mean_speed(tows.only(number)).polynomial), 0.6)
    beside("M of the true means, kg", 2857, mass(fit_mean_speed(tows).polynomial), 0.5)
    every = ~np.isnan(tows.speed_mps)
    times = np.broadcast_to(tows.time_s[:, None], every.shape)[every]
    beside("M of the pooled readings, kg", 2870, mass(Polynomial.fit(times, tows.speed_mps[every], 2).convert()), 0.5)


def reanalysis(study: TowStudy) -> None:
    """Models of other size, tow by tow."""
    for one in study.models:
        name = one.model.label
        fit = one.fit
        mass, half, scatter, aic = REANALYSIS.get(name, (np.nan,) * 4)
        known = name in REANALYSIS
        beside(f"{name}: M, kg", mass, fit.estimates[0], 0.01 * mass if known else None)
        beside(f"{name}: 95 % half-width, kg", half, fit.half_widths[0], 0.04 * half if known else None)
        beside(f"{name}: scatter, m/s", scatter, fit.scatter_mps, 6e-6 if known else None)
        beside(f"{name}: AIC", aic, fit.aic, 0.1 if known else None)
    for way, errors in zip(study.by_tow[1:], ((84, 23), (62, 13, 0.4)), strict=True):
        for name, expected, found in zip(way.unknowns, errors, way.jackknife_errors, strict=True):
            beside(f"leave-one-out error, {way.unknowns[-1]}: {name}", expected, found, 0.5 if expected > 1 else 0.05)
    low, high = study.mass_range_kg or (np.nan, np.nan)
    beside("least M of the usable models, kg", 2500, low, 100)
    beside("greatest M of the usable models, kg", 3400, high, 100)


def main() -> int:
    tows = read_tows(bundled("models", "wilinski-zellman", "tows.csv"))
    print(f"  {'':44} {'expected':>13} {'found':>13}")
    polynomials(tows)
    solution()
    body_of_the_paper()
    result = identify_tow(tows)
    algorithm(tows)
    study = study_tows(result, towed_body(tows, result.mass_kg, {}))
    reanalysis(study)
    for note in study.notes:
        print(f"note: {note}")
    print("all agree" if not _failed else f"differ: {', '.join(_failed)}")
    return 1 if _failed else 0


if __name__ == "__main__":
    sys.exit(main())
