"""Irregular waves: the sea against its spectrum, drift against an integral, motions against the surface's slope."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest
from scipy.integrate import quad

from tank2sim.cards.wave_table import DRIFT_COLUMNS, motion_columns
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError

from .ships import G, forces, mariner_text, ship, state, values

SEA = {"height_m": 2.0, "period_s": 8.0, "direction_deg": 40.0}
FREQUENCIES = np.linspace(0.25, 2.0, 36)
DIRECTIONS = np.arange(0.0, 181.0, 15.0)
REST = state(0.0, 0.0, 0.0)

Answer = Callable[[float, float], complex]


def table(
    motions: Mapping[str, Answer] = {}, drift: Mapping[str, Answer] = {}, at: Sequence[float] = FREQUENCIES
) -> str:
    """A card's text with what these functions of frequency (rad/s) and direction (rad) give in ``[waves]``."""
    columns = ["frequency_radps", "direction_deg", *(name for one in motions for name in motion_columns(one))]
    columns += [DRIFT_COLUMNS[force] for force in drift]
    rows = []
    for frequency, direction in itertools.product(at, DIRECTIONS):
        b = np.radians(direction)
        given = [complex(one(frequency, b)) for one in motions.values()]
        row = [frequency, direction, *(part for one in given for part in (abs(one), np.degrees(np.angle(one))))]
        rows.append([float(value) for value in (*row, *(one(frequency, b) for one in drift.values()))])
    card = mariner_text().split("[waves]")[0]
    return f'{card}[waves]\nsource = "made up"\ncolumns = {columns}\nrows = {rows}\n'


def long_wave(frequency: float) -> float:
    return frequency**2 / G


FLAT = {
    "heave": lambda w, b: -1.0,
    "roll": lambda w, b: -1j * long_wave(w) * np.sin(b),
    "pitch": lambda w, b: 1j * long_wave(w) * np.cos(b),
}
"""A float that follows the surface, by the signs of the manual: heave down, roll to starboard, pitch bow up."""
DRIFTING = table(
    FLAT, {"X": lambda w, b: -1e4, "Y": lambda w, b: -1e5 * np.sin(b), "N": lambda w, b: 1e6 * np.sin(2 * b)}
)


def sea_ship(text: str, **more: float) -> Model:
    return ship({"waves": {**SEA, **more}}, text)


def bretschneider(w: float) -> float:
    """ITTC 7.5-02-07-01.1, with A and B of the significant height and T_1 = 0.772 T_p."""
    height, mean = SEA["height_m"], 0.772 * SEA["period_s"]
    return 173 * height**2 / mean**4 / w**5 * np.exp(-691 / mean**4 / w**4)


def jonswap(w: float, peakedness: float) -> float:
    """DNV-RP-C205, 3.5.5.1."""
    peak = 2 * np.pi / SEA["period_s"]
    width = 0.07 if w <= peak else 0.09
    pierson = 5 / 16 * SEA["height_m"] ** 2 * peak**4 * w**-5 * np.exp(-5 / 4 * (w / peak) ** -4)
    sharper = peakedness ** np.exp(-0.5 * ((w - peak) / (width * peak)) ** 2)
    return float((1 - 0.287 * np.log(peakedness)) * pierson * sharper)


@pytest.mark.parametrize("peakedness", [1.0, 3.3, 5.0])
def test_the_sea_has_the_significant_height_and_the_spectrum_ordered(peakedness: float) -> None:
    """A drift coefficient of one makes X twice the variance, near 2 Hs^2/16; that of w^2, twice the second moment."""
    ends = FREQUENCIES[[0, -1]]
    model = sea_ship(table(drift={"X": lambda w, b: 1.0}), peakedness=peakedness)
    variance = quad(lambda w: jonswap(w, peakedness), *ends, points=[2 * np.pi / SEA["period_s"]], limit=200)[0]
    assert values(model, ["waves.X"], REST)[0] == pytest.approx(2 * variance, rel=0.01)
    assert variance == pytest.approx(SEA["height_m"] ** 2 / 16, rel=0.05)
    if peakedness == 1.0:
        moment = 2 * quad(lambda w: w**2 * bretschneider(w), *ends)[0]
        curved = sea_ship(table(drift={"X": lambda w, b: w**2}))
        assert values(curved, ["waves.X"], REST)[0] == pytest.approx(moment, rel=0.01)


@pytest.mark.parametrize(
    ("u", "v", "psi_deg"), [(6.0, 0.0, 40.0), (6.0, 0.0, 220.0), (5.0, -1.0, 90.0), (0.0, 0.0, 0.0)]
)
def test_drift_is_that_at_the_frequency_of_encounter_and_the_relative_direction(
    u: float, v: float, psi_deg: float
) -> None:
    model = sea_ship(
        table(
            drift={
                "X": lambda w, b: -300.0 * w * np.cos(b),
                "Y": lambda w, b: -900.0 * w * np.sin(b),
                "N": lambda w, b: 7e3 * w * np.sin(2 * b),
            }
        ),
        speed_effect=0.0,
    )
    beta = np.radians(SEA["direction_deg"] - psi_deg)
    toward = u * np.cos(beta) + v * np.sin(beta)

    def integrand(w: float) -> float:
        met = abs(w + w**2 / G * toward)
        return min(met, FREQUENCIES[-1]) * bretschneider(w)

    integral = 2 * quad(integrand, FREQUENCIES[0], FREQUENCIES[-1], limit=200)[0]
    expected = integral * np.array([-300 * np.cos(beta), -900 * np.sin(beta), 7e3 * np.sin(2 * beta)])
    found = values(model, ["waves.X", "waves.Y", "waves.N"], {**state(u, v, 0.0), "motion.psi": np.radians(psi_deg)})
    np.testing.assert_allclose(found, expected, rtol=0.01, atol=1e-6)


@pytest.mark.parametrize(("u", "v", "psi_deg"), [(0.8, 0.0, 40.0), (0.6, -0.3, -50.0), (-0.4, 0.1, 100.0)])
def test_speed_changes_the_drift_by_the_formula_of_aranha(u: float, v: float, psi_deg: float) -> None:
    """The group velocity seen from the ship: D(w_e, direction of it) times the square of its size over that at rest."""
    text = table(drift={"X": lambda w, b: -300.0 * np.cos(b), "Y": lambda w, b: -900.0 * w * np.sin(b)})
    model = sea_ship(text)
    psi = np.radians(psi_deg)
    beta = np.radians(SEA["direction_deg"]) - psi

    def integrand(w: float, force: int) -> float:
        group = -G / (2 * w) * np.array([np.cos(beta), np.sin(beta)]) - [u, v]
        size, seen = np.hypot(*group) / (G / (2 * w)), np.arctan2(-group[1], -group[0])
        met = w + w**2 / G * (u * np.cos(beta) + v * np.sin(beta))
        value = (-300.0 * np.cos(seen), -900.0 * met * np.sin(seen))[force]
        return float(size**2 * value * bretschneider(w))

    expected = [2 * quad(integrand, FREQUENCIES[0], FREQUENCIES[-1], (force,), limit=200)[0] for force in (0, 1)]
    at = {**state(u, v, 0.0), "motion.psi": psi}
    found = values(model, ["waves.X", "waves.Y"], at)
    plain = values(sea_ship(text, speed_effect=0.0), ["waves.X", "waves.Y"], at)
    np.testing.assert_allclose(found, expected, atol=0.03 * np.max(np.abs(expected)))
    assert np.max(np.abs(found - plain)) > 0.05 * np.max(np.abs(expected))


def test_added_resistance_in_head_seas_grows_and_validity_says_how_far_the_formula_holds() -> None:
    model = sea_ship(table(drift={"X": lambda w, b: -300.0 * np.cos(b)}))
    names = ["waves.X", "validity_by.wave_speed"]
    slow, fast, beam = (
        values(model, names, {**state(u, 0.0, 0.0), "motion.psi": np.radians(psi)})
        for u, psi in ((0.0, 40.0), (7.0, 40.0), (1.0, -50.0))
    )
    assert fast[0] < 1.5 * slow[0] < 0 and beam[0] < 0  # a beam sea is met from ahead of the beam
    assert (slow[1], fast[1]) == (1.0, 0.0)
    calm = values(model, names, {**state(7.0, 0.0, 0.0), "waves.height": 0.0})
    assert calm.tolist() == [0.0, 1.0]


def test_the_drift_is_what_the_effect_adds_to_the_forces_and_the_phase_of_the_waves_is_not() -> None:
    model = sea_ship(DRIFTING)
    bare = ship({}, DRIFTING)
    at = state(6.0, 0.3, 0.004)
    added = forces(model, at) - forces(bare, at)
    np.testing.assert_allclose(added, values(model, ["waves.X", "waves.Y", "waves.N"], at), rtol=1e-9, atol=1e-6)
    later = {**at, "waves.clock": 100.0}
    np.testing.assert_array_equal(forces(model, later), forces(model, at))
    assert values(model, ["waves.heave"], later) != values(model, ["waves.heave"], at)


def test_a_float_follows_the_surface_and_its_slope() -> None:
    """Its heave is the surface, its roll and pitch the slope of the surface across and along, by finite differences."""
    model = sea_ship(table(FLAT))
    psi, step = 0.9, 0.01
    for clock in (0.0, 33.0):
        at = {**REST, "motion.x": 500.0, "motion.y": -300.0, "motion.psi": psi, "waves.clock": clock}

        def surface(forward: float, starboard: float, at: Mapping[str, float] = at) -> float:
            north = forward * np.cos(psi) - starboard * np.sin(psi)
            east = forward * np.sin(psi) + starboard * np.cos(psi)
            moved = {**at, "motion.x": at["motion.x"] + north, "motion.y": at["motion.y"] + east}
            return float(values(model, ["waves.elevation"], moved)[0])

        heave, roll, pitch = values(model, ["waves.heave", "waves.roll", "waves.pitch"], at)
        assert heave == pytest.approx(-surface(0, 0), rel=1e-9)
        assert pitch == pytest.approx((surface(step, 0) - surface(-step, 0)) / (2 * step), rel=0.02, abs=1e-5)
        assert roll == pytest.approx(-(surface(0, step) - surface(0, -step)) / (2 * step), rel=0.02, abs=1e-5)


def test_a_ship_meets_head_waves_oftener_and_following_ones_more_seldom() -> None:
    """Nearly regular waves repeat after the period of encounter 2 pi/(w + w^2 U cos(beta)/g)."""
    w, u = 0.605, 6.0
    model = sea_ship(table({"heave": lambda w, b: 1.0}, at=[0.6045, 0.6055]), direction_deg=0.0, period_s=2 * np.pi / w)
    for course in (1.0, -1.0):
        period = 2 * np.pi / (w + course * w**2 * u / G)
        times = np.linspace(0.0, 2 * period, 9)
        series = [
            values(model, ["waves.elevation"], {**REST, "waves.clock": t, "motion.x": course * u * t})[0] for t in times
        ]
        size = np.max(np.abs(series))
        np.testing.assert_allclose(series[4:], series[:5], atol=0.03 * size)
        assert np.abs(series[2] + series[0]) < 0.03 * size < 0.3 * np.abs(series[0] - series[2])


@pytest.mark.slow
def test_seas_of_one_seed_are_alike_and_those_of_another_are_not() -> None:
    model = sea_ship(table(FLAT))

    def elevation(clock: float, seed: int) -> float:
        return float(values(model, ["waves.elevation"], {**REST, "waves.clock": clock, "waves.seed": seed})[0])

    assert elevation(7.0, 3) == elevation(7.0, 3) != elevation(7.0, 4)
    series = [elevation(0.0, seed) for seed in range(1, 301)]
    assert 4 * np.std(series) == pytest.approx(SEA["height_m"], rel=0.1)
    assert abs(np.mean(series)) < 4 * np.std(series) / np.sqrt(300)


def test_waves_from_port_do_the_same_mirrored() -> None:
    names = ["waves.X", "waves.Y", "waves.N", "waves.heave", "waves.roll", "waves.pitch"]
    starboard, port = (
        values(sea_ship(DRIFTING, direction_deg=side * 70.0), names, {**REST, "waves.clock": 5.0}) for side in (1, -1)
    )
    np.testing.assert_allclose(port, starboard * [1, -1, -1, 1, -1, 1], rtol=1e-9)


def test_the_pose_is_that_of_the_manoeuvre_with_the_motions_on_top() -> None:
    yaw = {"yaw": lambda w, b: 0.02j * np.sin(2 * b)}
    text = table({"surge": lambda w, b: 1j * np.cos(b), "sway": lambda w, b: 0.5j * np.sin(b), **FLAT, **yaw})
    at = {**state(5.0, 0.0, 0.0), "motion.x": 30.0, "motion.y": 40.0, "motion.psi": 0.6, "waves.clock": 3.0}
    model = sea_ship(text)
    moved = [f"waves.{motion}" for motion in ("surge", "sway", "heave", "roll", "pitch", "yaw")]
    surge, sway, heave, roll, pitch, turned = values(model, moved, at)
    pose = values(model, [f"pose.{name}" for name in ("x", "y", "z", "phi", "theta", "psi")], at)
    north, east = surge * np.cos(0.6) - sway * np.sin(0.6), surge * np.sin(0.6) + sway * np.cos(0.6)
    np.testing.assert_allclose(pose, [30 + north, 40 + east, heave, roll, pitch, 0.6 + turned], rtol=1e-12)
    assert min(abs(north), abs(east), abs(heave), abs(roll), abs(pitch), abs(turned)) > 1e-4


def test_a_sea_outside_the_frequencies_of_the_table_takes_the_validity() -> None:
    model = sea_ship(table(FLAT))
    inside, outside, calm = (
        values(
            model,
            ["validity_by.waves", "validity"],
            {**state(7.0, 0.0, 0.0), "waves.period": period, "waves.height": h},
        )
        for period, h in ((8.0, 2.0), (1.5, 2.0), (1.5, 0.0))
    )
    np.testing.assert_array_equal([inside[0], calm[0]], 1.0)
    assert outside[0] == outside[1] == 0.0


@pytest.mark.parametrize("height", [0.5, 6.0])
def test_validity_is_half_where_a_quarter_less_of_the_sea_than_asked_lies_in_the_table(height: float) -> None:
    """Of a Bretschneider sea the share exp(-5/4 (wp/w)^4) lies below w: the table that ends at w has 65 % of it."""
    peak = 2 * np.pi / SEA["period_s"]
    end = peak * (5 / 4 / np.log(1 / 0.65)) ** 0.25
    model = sea_ship(table(FLAT, at=np.linspace(0.1, end, 30)), height_m=height)
    assert values(model, ["validity_by.waves"], REST)[0] == pytest.approx(0.5, abs=0.06)
    more = sea_ship(table(FLAT, at=np.linspace(0.1, peak * (5 / 4 / np.log(1 / 0.92)) ** 0.25, 30)), height_m=height)
    assert values(more, ["validity_by.waves"], REST)[0] == 1.0


@pytest.mark.parametrize("psi_deg", [40.0, -50.0, 200.0])
def test_validity_is_half_at_a_speed_of_a_third_of_the_waves(psi_deg: float) -> None:
    """wp U/g = 0.15 + 0.35/2, whatever the direction: half way between what the formula holds for and 0.5."""
    speed = 0.325 * G * SEA["period_s"] / (2 * np.pi)
    drift = 0.2
    at = {**state(speed * np.cos(drift), speed * np.sin(drift), 0.0), "motion.psi": np.radians(psi_deg)}
    assert values(sea_ship(table(FLAT)), ["validity_by.wave_speed"], at)[0] == pytest.approx(0.5, abs=0.01)


def test_a_card_without_a_table_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match=r"waves: is missing; .*\[waves\]"):
        sea_ship(mariner_text().split("[waves]")[0])


FAULTS = {
    "an unknown column": ("heave_amplitude", "bounce_amplitude"),
    "a missing row": ("[0.25, 0.0,", "#"),
    "a row of another length": ("[0.25, 0.0,", "[0.25, 0.0, 1.0,"),
    "a rolling ship in head waves": ("[0.25, 0.0, 1.0, 180.0, 0.0,", "[0.25, 0.0, 1.0, 180.0, 9.0,"),
    "uneven directions": (" 15.0,", " 20.0,"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_table_that_is_none_is_refused(fault: str) -> None:
    old, new = FAULTS[fault]
    text = table(FLAT).replace("], [", "],\n[")
    assert old in text
    with pytest.raises(InputError, match="waves"):
        sea_ship(text.replace(old, new))
