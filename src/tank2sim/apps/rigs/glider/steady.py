"""Steady glides of an underwater glider in closed form: paper 5 (Kulikovsky and Velikanov 2012), also as printed.

As the steady turning of ships: steady solutions of the equations of :mod:`tank2sim.apps.rigs.glider.model`.
With epsilon the angle of the path (+ up), theta the pitch, alpha the incidence, gamma the roll (+ starboard side down),
m0 the net buoyancy (kg, + light) and S the reference area:

    (2)     epsilon = theta - alpha                                     alpha > 0 diving, < 0 climbing
    (3),(9) D cos epsilon + L cos gamma sin epsilon = 0,   m0 g + L cos gamma cos epsilon - D sin epsilon = 0
    (8)     with tau = |tan epsilon| cos gamma:   (C_D - C_L tau) alpha^2 - C_L0 tau |alpha| + C_D0 = 0, the small root
    (10)    v^2 = 2 |m0| g / (rho S (C_D(alpha) sin|epsilon| + C_L(|alpha|) cos gamma cos epsilon))
    (11)    m (v cos epsilon)^2 / R = L sin gamma
    (12)    R = 2 m cos^2 epsilon / (rho S C_L(|alpha|) sin|gamma|)

The print lacks the constant drag in (8), has a surplus alpha before the drag in (10), and cos epsilon in the wrong
places of (11); its added mass is neglected throughout. A positive roll turns a dive to starboard, where the lift is up,
and a climb to port, where it is down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.optimize import brentq

from tank2sim.apps.rigs.glider.card import GliderCard
from tank2sim.dynamics.glider_forces import drag_coefficient, lift_coefficient
from tank2sim.errors import InputError

_STEEPEST = math.radians(89.9)
"""Upper end of the search for a path angle; straight down the incidence and the turn vanish."""


@dataclass(frozen=True, kw_only=True)
class SteadyGlide:
    """A steady glide: angles in rad, SI.

    epsilon (path angle) and theta (pitch) are + up, alpha (incidence) + when the flow comes from below, gamma (roll) +
    starboard side down, m0 (net buoyancy) + light. Lift has the sign of the incidence; R, the turning radius, is
    without sign and inf without roll; the rate of the course is + to starboard. `as_printed` is True for the equations
    as printed.
    """

    path_angle_rad: float
    pitch_rad: float
    incidence_rad: float
    roll_rad: float
    buoyancy_kg: float
    speed_mps: float
    lift_coefficient: float
    drag_coefficient: float
    lift_N: float
    drag_N: float
    turning_radius_m: float
    turn_rate_radps: float
    as_printed: bool = False

    @property
    def horizontal_speed_mps(self) -> float:
        """v cos(epsilon)."""
        return self.speed_mps * math.cos(self.path_angle_rad)

    @property
    def climb_mps(self) -> float:
        """v sin(epsilon), + up."""
        return self.speed_mps * math.sin(self.path_angle_rad)


def ballast_kg(card: GliderCard, buoyancy_kg: float) -> float | None:
    """m_b of (1), m0 = m - (m_h + m_b), kg; None if the card does not state the mass m_h of the hull.

    InputError if it would be negative.
    """
    hull = card.glider.hull_mass_kg
    if hull is None:
        return None
    displaced = card.environment.water_density_kgpm3 * card.glider.volume_m3
    ballast = displaced - hull - buoyancy_kg
    if ballast < 0:
        problem = f"leaves {ballast:.4g} kg of ballast: {displaced:.5g} kg displaced, net buoyancy {buoyancy_kg:+g} kg"
        raise card.fault("glider.hull_mass_kg", problem, "correct the volume or the mass of the hull")
    return ballast


def smallest_angle(card: GliderCard, roll_rad: float = 0.0) -> float:
    """The smallest |epsilon| (rad) of flight with a roll: the discriminant of (8) vanishes there.

    There the ratio of lift to drag is at its greatest, so that without roll this is also the best glide.
    """
    section = card.glider
    part = section.lift_quadratic * section.drag_zero
    root = math.sqrt(part**2 + section.lift_slope**2 * section.drag_quadratic * section.drag_zero)
    # 2 (root - part) / C_L0^2 without the difference of two almost equal numbers
    tau = 2 * section.drag_quadratic * section.drag_zero / (root + part)
    return math.atan2(tau, math.cos(roll_rad))


def steady_glide(
    card: GliderCard, path_angle_rad: float, *, roll_rad: float = 0.0, buoyancy_kg: float | None = None
) -> SteadyGlide:
    """The steady glide on a path (rad, + up), with a roll (rad, + starboard side down) and a net buoyancy m0 (kg, +
    light).

    By default m0 is the card's, light to climb and heavy to dive. 0 gives speed 0.

    Raises
    ------
    InputError
        The angle cannot be flown (the message names the smallest possible), angle or roll is beyond any glide, or
        the glider is light in a dive or heavy in a climb.
    """
    buoyancy = _buoyancy(card, path_angle_rad, buoyancy_kg)
    _check(path_angle_rad, roll_rad)
    least = smallest_angle(card, roll_rad)
    steep = abs(path_angle_rad)
    if steep < least * (1 - 1e-12):
        with_roll = f" with {math.degrees(roll_rad):g} deg of roll" if roll_rad else ""
        raise card.fault(
            "path angle",
            f"{math.degrees(path_angle_rad):g} deg cannot be flown{with_roll}: the drag is too large for the lift",
            f"the smallest that can is {math.degrees(least):.3f} deg",
        )
    section = card.glider
    tau = math.tan(steep) * math.cos(roll_rad)
    slope = section.lift_slope * tau
    under = slope**2 - 4 * (section.drag_quadratic - section.lift_quadratic * tau) * section.drag_zero
    # The small root, written so that nothing cancels and that it also holds where C_D = C_L tau.
    size = 2 * section.drag_zero / (slope + math.sqrt(max(0.0, under)))
    drag = drag_coefficient(size, section.drag_zero, section.drag_quadratic)
    return _glide(card, (path_angle_rad, roll_rad, buoyancy), size, drag)


def glide_at_pitch(
    card: GliderCard, pitch_rad: float, *, roll_rad: float = 0.0, buoyancy_kg: float | None = None
) -> SteadyGlide:
    """The steady glide at a pitch theta (rad, + up) in place of a path angle: (2) and (8) together.

    Raises as :func:`steady_glide`; the message names the smallest pitch.
    """
    _check(pitch_rad, roll_rad)
    buoyancy = _buoyancy(card, pitch_rad, buoyancy_kg)
    sign = math.copysign(1.0, pitch_rad)

    def beyond(steep: float) -> float:
        return abs(steady_glide(card, sign * steep, roll_rad=roll_rad).pitch_rad) - abs(pitch_rad)

    least = smallest_angle(card, roll_rad)
    if beyond(least) > 0:
        smallest = beyond(least) + abs(pitch_rad)
        raise card.fault(
            "pitch",
            f"at {math.degrees(pitch_rad):g} deg no glide of small incidence exists",
            f"the smallest pitch is {math.degrees(smallest):.3f} deg, on a path of {math.degrees(least):.3f} deg",
        )
    if beyond(_STEEPEST) < 0:
        raise card.fault("pitch", f"{math.degrees(pitch_rad):g} deg is a fall", "give less than 89 deg")
    steep = float(brentq(beyond, least, _STEEPEST, xtol=1e-15, rtol=1e-14))
    return steady_glide(card, sign * steep, roll_rad=roll_rad, buoyancy_kg=buoyancy)


def glide_as_printed(
    card: GliderCard, path_angle_rad: float, *, roll_rad: float = 0.0, buoyancy_kg: float | None = None
) -> SteadyGlide:
    """The glide by (8), (10), (12) and (13) as the paper prints them, for comparison.

    They balance a drag alpha (C_D0 + C_D alpha), which vanishes without incidence, unlike (7); the result is
    near the large root of the corrected (8), a slow glide at ten times the incidence. Parameters and exceptions as
    :func:`steady_glide`, except that the print has no smallest angle above the one of zero incidence.
    """
    buoyancy = _buoyancy(card, path_angle_rad, buoyancy_kg)
    _check(path_angle_rad, roll_rad)
    section = card.glider
    tau = math.tan(abs(path_angle_rad)) * math.cos(roll_rad)
    under = section.drag_quadratic - section.lift_quadratic * tau
    size = (section.lift_slope * tau - section.drag_zero) / under if under > 0 else -1.0
    if size <= 0:
        problem = f"{math.degrees(path_angle_rad):g} deg gives no incidence by (8) as printed"
        raise card.fault("path angle", problem, "give another angle, or leave as_printed out")
    drag = size * (section.drag_zero + section.drag_quadratic * size)
    return _glide(card, (path_angle_rad, roll_rad, buoyancy), size, drag, as_printed=True)


def radius_as_printed(card: GliderCard, lift: float, path_angle_rad: float, roll_rad: float) -> float:
    """R of (12) as printed (m), 1/cos^3(epsilon) times the right one; `lift` is the size of C_L. inf without roll."""
    half = 0.5 * card.environment.water_density_kgpm3 * card.glider.reference_area_m2
    aside = half * lift * abs(math.sin(roll_rad)) * math.cos(path_angle_rad)
    return card.glider.mass_kg / aside if aside else math.inf


def force_residual(card: GliderCard, glide: SteadyGlide) -> tuple[float, float, float]:
    """Residual of the forces along the course, to starboard and up, less the centripetal force, N: 0 in balance.

    Lift and drag follow (6) and (7) at the glide's incidence and speed, for a glide by any equations.
    """
    section = card.glider
    pressure = 0.5 * card.environment.water_density_kgpm3 * section.reference_area_m2 * glide.speed_mps**2
    lift = pressure * lift_coefficient(glide.incidence_rad, section.lift_slope, section.lift_quadratic)
    drag = pressure * drag_coefficient(glide.incidence_rad, section.drag_zero, section.drag_quadratic)
    along, up = math.cos(glide.path_angle_rad), math.sin(glide.path_angle_rad)
    upright, aside = math.cos(glide.roll_rad), math.sin(glide.roll_rad)
    centripetal = card.glider.mass_kg * glide.horizontal_speed_mps * glide.turn_rate_radps
    return (
        -drag * along - lift * upright * up,
        lift * aside - centripetal,
        glide.buoyancy_kg * card.environment.gravity_mps2 + lift * upright * along - drag * up,
    )


def _glide(
    card: GliderCard, flown: tuple[float, float, float], size: float, drag: float, *, as_printed: bool = False
) -> SteadyGlide:
    """The glide with path angle, roll (rad) and net buoyancy (kg) at an incidence of that size (rad), with that C_D."""
    path_angle, roll, buoyancy = flown
    section, steep, upward = card.glider, abs(path_angle), math.copysign(1.0, path_angle)
    lift = lift_coefficient(size, section.lift_slope, section.lift_quadratic)
    half = 0.5 * card.environment.water_density_kgpm3 * section.reference_area_m2
    share = drag * math.sin(steep) + lift * math.cos(roll) * math.cos(steep)
    speed = math.sqrt(abs(buoyancy) * card.environment.gravity_mps2 / (half * share))
    aside = half * lift * abs(math.sin(roll))
    radius = section.mass_kg * math.cos(steep) ** 2 / aside if aside else math.inf
    if as_printed:
        radius = radius_as_printed(card, lift, path_angle, roll)
    along = speed * (1.0 if as_printed else math.cos(path_angle))  # (13): v t = R dphi in print
    return SteadyGlide(
        path_angle_rad=path_angle,
        pitch_rad=path_angle - upward * size,
        incidence_rad=-upward * size,
        roll_rad=roll,
        buoyancy_kg=buoyancy,
        speed_mps=speed,
        lift_coefficient=-upward * lift,
        drag_coefficient=drag,
        lift_N=-upward * (half * speed**2) * lift,
        drag_N=half * speed**2 * drag,
        turning_radius_m=radius,
        turn_rate_radps=-upward * math.copysign(1.0, roll) * along / radius if math.isfinite(radius) else 0.0,
        as_printed=as_printed,
    )


def _check(angle: float, roll: float) -> None:
    if not 0 < abs(angle) < math.pi / 2:
        remedy = "an angle between 0 and 90 deg was expected, + to climb and - to dive"
        raise InputError("glide", "path angle", f"{math.degrees(angle):g} deg is not a glide", remedy)
    if not abs(roll) < math.pi / 2:
        raise InputError(
            "glide", "roll", f"{math.degrees(roll):g} deg is not a roll of flight", "give less than 90 deg"
        )


def _buoyancy(card: GliderCard, path_angle: float, given: float | None) -> float:
    if given is None:
        return math.copysign(card.glider.buoyancy_kg, path_angle)
    if given * path_angle < 0:
        light, goes = ("light", "dive") if given > 0 else ("heavy", "climb")
        problem = f"{given:+g} kg is {light}, and the glider is to {goes} at {math.degrees(path_angle):g} deg"
        raise card.fault("buoyancy", problem, "a light glider climbs (+), a heavy one dives (-)")
    if not math.isfinite(given):
        raise card.fault("buoyancy", f"{given} kg is not a number", "give kilograms")
    return given
