"""What a parameter of an effect may be: the ends of its range are taken, and what lies beyond is refused."""

from __future__ import annotations

import math

import pytest

from tank2sim.dynamics import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.errors import InputError

from .ships import TYPICAL, card_with

TURN, FAR = (-360.0, 360.0), (-1e4, 1e4)
LATERAL = {"Y_prime": (-0.01, 0.01), "N_prime": (-0.01, 0.01)}
THRUSTER = {"command": (-1, 1), "force_N": (0, 1e7), "forward_m": (-250, 250), "half_speed_mps": (0.01, 10)}
RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "waves": {
        "height_m": (0, 20), "period_s": (0.3, 30), "direction_deg": TURN, "peakedness": (1, 7), "speed_effect": (0, 1),
        "seed": (1, 1e6),
    },
    "bank": {
        "port_distance_m": (0, 1e4), "starboard_distance_m": (0, 1e4), "slope": (0, 20), "sway_coefficient": (-1, 2),
        "yaw_coefficient": (-1, 1),
    },
    "bow_tunnel_thruster": THRUSTER,
    "stern_tunnel_thruster": THRUSTER,
    "tugs": {
        f"{name}_{tug}_{unit}": ends
        for tug in (1, 2, 3, 4)
        for name, unit, ends in (
            ("force", "N", (0, 5e6)), ("direction", "deg", TURN), ("forward", "m", (-250, 250)),
            ("starboard", "m", (-50, 50)),
        )
    },
    "other_ship": {
        "forward_m": FAR, "starboard_m": FAR, "heading_deg": TURN, "speed_mps": (-15, 15), "length_m": (1, 500),
        "beam_m": (0.1, 100), "draught_m": (0.05, 40), "block_coefficient": (0.3, 0.95),
    },
    "rudder_rate_limit": {"max_rate_degps": (math.degrees(1e-4), math.degrees(2.0))},
    "rudder_lag": {"time_constant_s": (0.01, 100)},
    "rudder_backlash": {"width_deg": (0, 20)},
    "rudder_dead_band": {"half_width_deg": (0, 10)},
    "telemotor_lag": {"time_constant_s": (0.01, 100)},
    "loaded_rudder": {"loading": (0, 1.5), "straightening": (0, 2), "lever": (-4, 0), "measured": (0, 1)},
    "propeller_side_force": LATERAL,
    "propeller_walk": LATERAL,
    "loading_side_force": LATERAL,
    "engine_droop": {"droop": (-1, 1)},
    "engine_lag": {"time_constant_s": (0.01, 600)},
    "engine_telegraph": {"time_constant_s": (0.01, 600), "start_s": (0.1, 600), "reversal_s": (0.2, 900)},
    "astern_thrust": {"factor": (0, 1.5)},
    "propeller_astern": {"side_force": (-5, 5), "thrust": (0, 3)},
    "controllable_pitch": {
        "pitch": (-1.4, 1.4), "design_pitch": (0.5, 1.4), "blades": (2, 7), "area_ratio": (0.3, 1.05), "astern": (0, 1),
        "reversal_s": (0.1, 600), "time_constant_s": (0.01, 60), "advance_share": (0.3, 0.9),
    },
}  # fmt: skip
"""Effect, and its parameters as cards give them, to the ends of what a ship, its gear or a sea can have."""


@pytest.mark.parametrize("name", RANGES)
def test_the_range_of_a_parameter_ends_where_ships_and_their_gear_do(name: str) -> None:
    card = card_with()
    declared = {parameter.name: parameter for parameter in EFFECTS[name].parameters}
    assert len(declared) == len(RANGES[name])
    for key, ends in RANGES[name].items():
        in_degrees = key.endswith(("_deg", "_degps"))
        si = key.replace("_degps", "_radps").replace("_deg", "_rad")
        expected = [math.radians(end) if in_degrees else float(end) for end in ends]
        assert [declared[si].lowest(card), declared[si].maximum] == pytest.approx(expected), key


@pytest.mark.parametrize("name", ["rudder_lag", "engine_telegraph", "waves"])
def test_a_card_beyond_the_range_is_refused_and_at_its_end_taken(name: str) -> None:
    key = next(reversed(RANGES[name]))
    ends = RANGES[name][key]
    for end, out in zip(ends, (-1, 1), strict=True):
        build(card_with({name: {**TYPICAL[name], key: end}}))
        with pytest.raises(InputError, match=key.partition("_")[0]):
            build(card_with({name: {**TYPICAL[name], key: end + out * 1e-3 * abs(end)}}))


def test_what_is_ordered_or_known_from_outside_is_not_sought_on_trials() -> None:
    known = {
        "waves", "bank", "bow_tunnel_thruster", "stern_tunnel_thruster", "tugs", "other_ship", "engine_telegraph",
        "astern_thrust", "propeller_astern", "controllable_pitch",
    }  # fmt: skip
    assert {name for name in RANGES if not EFFECTS[name].sought} == known
