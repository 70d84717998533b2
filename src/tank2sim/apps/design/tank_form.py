"""The form of a tank's file: what its carriage, its mechanism and its gauges can do.

Angles may be given in degrees; the key is then renamed (``drift_deg`` to ``drift_rad``).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from tank2sim.cards.form import CardSection, Gravity, Positive
from tank2sim.cards.form_faults import form_fault
from tank2sim.cards.reading import parsed_toml
from tank2sim.errors import InputError
from tank2sim.files import read_text
from tank2sim.quantities import Speed, TankModelLength, TankSize, WaterDensity
from tank2sim.records.campaign_form import Angle, TankSection, section_in_si

_Share = Annotated[float, Field(ge=0, lt=1)]
_Seconds = Annotated[float, Field(ge=0, le=1e5)]
"""Project choices, far beyond any tank: refuse wrong units."""


class CarriageSection(CardSection):
    """``[carriage]``: the way and the time of a run.

    Parameters
    ----------
    length_m
        Way of the carriage from standstill to standstill.
    acceleration_mps2
        Acceleration of its start and its stop.
    settling_lengths
        Lengths of the model that it sails before the record begins.
    waiting_s
        From the end of a run to the next, until the water is calm.
    return_speed_mps
        Speed of the way back, which is part of the waiting time.
    speed_mps
        Highest speed.
    """

    length_m: TankSize = 240.0
    acceleration_mps2: Annotated[float, Field(ge=1e-3, le=10)] = 0.3
    settling_lengths: Annotated[float, Field(ge=0, le=100)] = 2.0
    waiting_s: _Seconds = 600.0
    return_speed_mps: Speed = 2.0
    speed_mps: Speed | None = None


class MechanismSection(CardSection):
    """``[mechanism]``: the limits of the planar motion mechanism; what is not stated is not limited.

    Parameters
    ----------
    sway_amplitude_m
        Largest sideways amplitude, also of the path of pure yaw.
    heading_amplitude_rad
        Largest amplitude of the heading in yaw.
    drift_rad, rudder_rad
        Largest angles.
    lowest_frequency_radps, highest_frequency_radps
        Frequencies of the oscillation.
    cycles
        Fewest whole cycles of a record.
    """

    sway_amplitude_m: Positive | None = None
    heading_amplitude_rad: Annotated[float, Field(gt=0, lt=3.2)] | None = None
    drift_rad: Annotated[Angle, Field(gt=0)] | None = None
    rudder_rad: Annotated[Angle, Field(gt=0)] | None = None
    lowest_frequency_radps: Positive | None = None
    highest_frequency_radps: Positive | None = None
    cycles: Annotated[int, Field(ge=1, le=100)] = 3


GAUGE_UNITS = {"X": "N", "Y": "N", "N": "Nm"}
"""Gauge to the unit in the names of its keys."""


class GaugesSection(CardSection):
    """``[gauges]``: ranges and errors (one standard deviation).

    Parameters
    ----------
    X_range_N, Y_range_N, N_range_Nm
        Largest force and moment to either side; without them the largest of the usual matrix, and a quarter more.
    noise_share
        Noise of a single reading, over the range.
    zero_share
        Zero error that is constant in a run and differs from run to run, over the range.
    X_noise_N, Y_noise_N, N_noise_Nm, X_zero_N, Y_zero_N, N_zero_Nm
        The same as forces, in place of the shares.
    gain_relative
        Relative error of the gain from run to run.
    rate_hz
        Independent readings a second.
    """

    X_range_N: Positive | None = None
    Y_range_N: Positive | None = None
    N_range_Nm: Positive | None = None
    noise_share: _Share = 0.005
    zero_share: _Share = 0.001
    X_noise_N: Positive | None = None
    Y_noise_N: Positive | None = None
    N_noise_Nm: Positive | None = None
    X_zero_N: Positive | None = None
    Y_zero_N: Positive | None = None
    N_zero_Nm: Positive | None = None
    gain_relative: _Share = 0.003
    rate_hz: Annotated[float, Field(ge=0.01, le=1e5)] = 20.0

    def stated(self, what: str, force: str) -> float | None:
        """`what` (``range``, ``noise`` or ``zero``) of the gauge of a `force`, N or N m; None where no key has it."""
        value: float | None = getattr(self, f"{force}_{what}_{GAUGE_UNITS[force]}")
        return value


class TestedModelSection(CardSection):
    """``[model]``: the ship model.

    Parameters
    ----------
    length_m
        By default 4 m, or the ship's length if it is shorter.
    speed_mps
        Test speed; by default the card's at the same Froude number.
    """

    length_m: TankModelLength | None = None
    speed_mps: Speed | None = None
    water_density_kgpm3: WaterDensity = 1000.0
    gravity_mps2: Gravity = 9.80665


class TankFile(CardSection):
    """The whole of ``tank.toml``."""

    format: Literal["tank2sim-tank/1"] = "tank2sim-tank/1"
    carriage: CarriageSection = CarriageSection()
    mechanism: MechanismSection = MechanismSection()
    gauges: GaugesSection = GaugesSection()
    model: TestedModelSection = TestedModelSection()
    tank: TankSection = TankSection()


def read_tank(path: Path | str) -> TankFile:
    """Read a tank's file.

    Raises InputError: it is missing, not TOML, or has a key that is unknown, given twice, or out of its bounds.
    """
    path = Path(path)
    content = parsed_toml(read_text(path), path)
    spelt: dict[str, str] = {}
    content = {
        key: section_in_si(section, key, path, spelt) if isinstance(section, dict) else section
        for key, section in content.items()
    }
    try:
        return TankFile.model_validate(content)
    except ValidationError as error:
        raise form_fault(error, path, spelt, form=TankFile, what="a tank") from None


def refuse_contradictions(
    tank: TankFile, source: str, length_m: float, beam_m: float | None, draught_m: float | None
) -> None:
    """Refuse a tank that contradicts itself or does not take a model of this length, beam and draught, m.

    Raises InputError: the carriage's way is longer than the tank, the tank is not broader and deeper than the model, or
    the lowest frequency of the mechanism is above the highest.
    """
    basin, way, mechanism = tank.tank, tank.carriage.length_m, tank.mechanism
    if way > (basin.length_m or math.inf):
        assumed = "" if "length_m" in tank.carriage.model_fields_set else "assumed as "
        problem = f"is {assumed}{way:g} m, longer than the tank ([tank] length_m = {basin.length_m:g})"
        raise InputError(source, "carriage.length_m", problem, "state the way of the carriage within the tank")
    for key, value, what, size in (
        ("breadth_m", basin.breadth_m, "beam", beam_m),
        ("depth_m", basin.depth_m, "draught", draught_m),
    ):
        if value is not None and size is not None and value <= size:
            problem = f"is {value:g} m, and the model of {length_m:.3g} m has a {what} of {size:.3g} m"
            raise InputError(source, f"tank.{key}", problem, "state the size of the tank, or take a shorter model")
    low, high = mechanism.lowest_frequency_radps, mechanism.highest_frequency_radps
    if (low or 0.0) > (high or math.inf):
        problem = f"is {low:g} rad/s, above highest_frequency_radps = {high:g}"
        raise InputError(source, "mechanism.lowest_frequency_radps", problem, "give the lower of both")


def with_tank_values(tank: TankFile, section: str, **values: float | None) -> TankFile:
    """The tank with other values, of the types of their keys, in one section; None leaves a value as it is."""
    changed = {key: value for key, value in values.items() if value is not None}
    content = tank.model_dump(exclude_unset=True)
    content[section] = {**content.get(section, {}), **changed}
    return TankFile.model_validate(content)
