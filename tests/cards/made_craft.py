"""A made-up craft with a thruster at either side, of whatever numbers a test needs."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.cards import CraftCard, parse_card


def craft_card(
    mass: float,
    yaw_inertia: float,
    derivatives: Mapping[str, float],
    *,
    speed_mps: float = 1.0,
    sides_m: tuple[float, float] = (-0.4, 0.4),
    more: str = "",
    **thruster: float,
) -> CraftCard:
    """2 m long, the centre of gravity amidships; `more` are lines of ``[model]``, `thruster` keys of both thrusters."""
    text = f"""format = "tank2sim-ship/1"
[ship]
name = "made up"
source = "made up"
length_m = 2.0
[model]
kind = "small_craft"
speed_mps = {speed_mps}
{more}
[rigid_body]
mass = {mass}
yaw_inertia = {yaw_inertia}
x_G = 0.0
[derivatives]
"""
    text += "".join(f"{name} = {value}\n" for name, value in derivatives.items())
    for name, y_m in zip(("port", "starboard"), sides_m, strict=True):
        text += f'[[thrusters]]\nname = "{name}"\ny_m = {y_m}\n'
        text += "".join(f"{key} = {value}\n" for key, value in thruster.items())
    card = parse_card(text, "made_up.toml")
    assert isinstance(card, CraftCard)
    return card
