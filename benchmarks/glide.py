"""The underwater glider of Kulikovsky and Velikanov (2012): every figure of the corrected paper beside what is found.

The figures on the left were computed independently from the corrected equations, to the digits shown.
"""

from __future__ import annotations

import math
import sys
import time

from paper_numbers import PaperNumbers

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.apps.rigs.glider.path import GlidePath, fly, read_programme
from tank2sim.apps.rigs.glider.steady import (
    SteadyGlide,
    force_residual,
    glide_as_printed,
    radius_as_printed,
    smallest_angle,
    steady_glide,
)
from tank2sim.apps.rigs.glider.study import best_glide, fastest_glide
from tank2sim.apps.rigs.glider.transient import compare_with_steady, equilibrium, quasi_steady_error, swing_errors
from tank2sim.bundled import bundled
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.simulation.integrator import Integrator

GLIDES = {
    25: (3.2402, 0.6798, 0.3170, 0.2034, 21.760),
    30: (2.1603, 0.4499, 0.2598, 0.2444, 27.840),
    35: (1.6578, 0.3441, 0.2410, 0.2718, 33.342),
    45: (1.0914, 0.2257, 0.2257, 0.3119, 43.909),
}
TURNS = {5: (2.1728, 0.2442, 12.034), 10: (2.2114, 0.2434, 5.933), 20: (2.3834, 0.2399, 2.792)}
PRINTED = {30: (12.75, 0.0972), 45: (23.97, 0.0619)}
PLACES = {
    6: (127.018, 0.0, -73.334, 0.0),
    7: (138.844, 14.266, -85.544, 1.757),
    12: (119.215, 118.279, -24.432, 1.757),
}


ONE_DIGIT = 1.01
"""Tolerance in units of the last digit told, for numbers that were rounded or cut."""

number = PaperNumbers()


def beside(what: str, names: str, expected: tuple[float, ...], found: tuple[float, ...], digit: float = 1e-4) -> None:
    """Figures expected and found, each under its name; all to one unit of the `digit`."""
    for name, own, value in zip(names.split(", "), expected, found, strict=True):
        number(f"{what}: {name}", own, value, ONE_DIGIT * digit)


def steady(card: GliderCard) -> None:
    """Steady glides, turns and the printed equations."""
    least = smallest_angle(card)
    at_least = steady_glide(card, least)
    number.heading("Steady glides and turns")
    found = (math.degrees(least), -math.degrees(at_least.incidence_rad))
    beside("smallest angle", "eps deg, alpha deg", (23.385, 4.822), found, 1e-3)
    residual = 0.0
    for angle, expected in GLIDES.items():
        glide = steady_glide(card, math.radians(-angle))
        residual = max(residual, *map(abs, force_residual(card, glide)))
        coefficients = (glide.lift_coefficient, glide.drag_coefficient, glide.speed_mps)
        told = (math.degrees(glide.incidence_rad), *coefficients)
        beside(f"eps {angle} deg", "alpha deg, C_L, C_D, v m/s", expected[:4], told)
        beside(f"eps {angle} deg", "theta deg", expected[4:], (-math.degrees(glide.pitch_rad),), 1e-3)
    for roll, expected in TURNS.items():
        glide = steady_glide(card, math.radians(-30), roll_rad=math.radians(roll))
        residual = max(residual, *map(abs, force_residual(card, glide)))
        what = f"eps 30, gamma {roll} deg"
        beside(what, "alpha deg, v m/s", expected[:2], (math.degrees(glide.incidence_rad), glide.speed_mps))
        beside(what, "R m", expected[2:], (glide.turning_radius_m,), 1e-3)
    number("largest residual of forces, three axes, N", 0.0, residual, 1e-12)
    number.heading("As the paper prints it, (8), (10), (12), which are wrong")
    for angle, expected in PRINTED.items():
        glide = glide_as_printed(card, math.radians(-angle))
        beside(f"eps {angle} deg", "alpha deg", expected[:1], (math.degrees(glide.incidence_rad),), 1e-2)
        beside(f"eps {angle} deg", "v m/s", expected[1:], (glide.speed_mps,))
    _printed_turn(card, steady_glide(card, math.radians(-30), roll_rad=math.radians(5)))
    frontal = read_card("kulikovsky-velikanov", {"glider.reference_area_m2": 0.0356})
    assert isinstance(frontal, GliderCard)
    ratio = steady_glide(frontal, math.radians(30)).speed_mps / steady_glide(card, math.radians(30)).speed_mps
    number("speed with frontal area, ratio", 2.1, ratio, 0.05)
    _data(card)


def _printed_turn(card: GliderCard, glide: SteadyGlide) -> None:
    radius = radius_as_printed(card, glide.lift_coefficient, glide.path_angle_rad, glide.roll_rad)
    right, printed = math.degrees(100 * glide.turn_rate_radps), math.degrees(100 * glide.speed_mps / radius)
    number("R by (12) over the right one, eps 30", 1.54, radius / glide.turning_radius_m, 0.005)
    beside("turn in 100 s", "right deg, by (11) and (13) deg", (100.7, 75.5), (right, printed), 0.1)


def _data(card: GliderCard) -> None:
    """The paper's body: its volume and mass do not go together."""
    own = card.glider
    number("S = V^(2/3), m2", 0.15799, 0.0628 ** (2 / 3), 1e-5)
    number("the same of the card, m2", 0.15799, own.reference_area_m2, 1e-5)
    for name, printed, found in (
        ("C_D0", 0.214, own.drag_zero),
        ("C_D", 32.2, own.drag_quadratic),
        ("C_L", 4.6, own.lift_quadratic),
        ("C_L0, 1/rad", 11.76, own.lift_slope),
    ):
        number(f"{name} of the card", printed, found, 1e-9)
    number("rho V less m_h + m_b, kg", 12.8, 1000 * 0.0628 - 50, 0.01)
    heavy = "0.0628 m3 of water weigh 62.8 kg; a glider's net buoyancy is 0.2 to 0.5 kg"
    number("m_h + m_b, kg, beside rho V", 50, 1000 * 0.0628, None, heavy)


def of_the_paper() -> tuple[GliderCard, GlidePath]:
    """Its numbers; the card and the sample path."""
    card = read_card("kulikovsky-velikanov")
    assert isinstance(card, GliderCard)
    steady(card)
    programme = read_programme(bundled("models", "kulikovsky-velikanov", "programme.csv"))
    path = fly(card, programme)
    number.heading("Sample path, 100 s a step")
    for step, expected in PLACES.items():
        beside(f"after step {step}", "x m, lateral m, height m", expected[:3], path.places[step][1:4], 1e-2)
        beside(f"after step {step}", "heading rad", expected[3:], path.places[step][4:], 1e-3)
    return card, path


def main() -> int:
    card, path = of_the_paper()
    fast = fastest_glide(card)
    print(f"best glide {1 / math.tan(-best_glide(card).path_angle_rad):.4f} m over the ground per m of depth; fastest")
    print(f"  at {-math.degrees(fast.path_angle_rad):.3f} deg, {fast.horizontal_speed_mps:.4f} m/s over the ground")
    model = build(card)
    integrator = Integrator(model)
    apart = max(
        abs(equilibrium(model, glide).speed_mps - glide.speed_mps)
        for glide in (steady_glide(card, math.radians(angle)) for angle in (-25, -30, 45, 70))
    )
    print(f"equilibria of the transient model against the closed form: {apart:.1e} m/s apart")
    for roll in TURNS:
        glide = steady_glide(card, math.radians(-30), roll_rad=math.radians(roll))
        wider = equilibrium(model, glide).turning_radius_m / glide.turning_radius_m - 1
        print(f"  added mass changes the radius at {roll} deg of roll by {100 * wider:+.3f} %")
    begin = time.perf_counter()
    found = compare_with_steady(integrator, path)
    print(f"sample path by the transient model: {found.distance_m[-1]:.2f} m from the end, {100 * found.share:.2f} %")
    print(f"  in {time.perf_counter() - begin:.3f} s for {path.places[-1].time_s:.0f} s")
    for one in quasi_steady_error(card, integrator):
        told = ", ".join(f"{t:g} s {100 * e:.3g} %" for t, e in zip(one.duration_s, one.share, strict=True))
        print(f"quasi-steady path, steps, {one.label}: {told}")
    for swing in swing_errors(card, integrator):
        told = ", ".join(f"{t:g} s {100 * e:.3g} %" for t, e in zip(swing.period_s, swing.share, strict=True))
        print(f"quasi-steady motion, swings, {swing.label}: {told}")
    return number.end()


if __name__ == "__main__":
    sys.exit(main())
