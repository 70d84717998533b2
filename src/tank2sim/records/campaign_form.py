"""The form of a captive campaign's file: its sections, their keys, and what each may hold.

Values here are in SI and radians: a file may give any angle in degrees and revolutions in rpm or rps, and the key is
then renamed (``drift_deg`` to ``drift_rad``, ``propeller_rps`` to ``propeller_radps``). Signs are still the file's own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args

from pydantic import Field, ValidationError

from tank2sim.cards.form import CardSection, Gravity, Positive, Text
from tank2sim.cards.form_faults import form_fault
from tank2sim.errors import InputError
from tank2sim.quantities import (
    Area,
    BlockCoefficient,
    Breadth,
    Draught,
    Length,
    Mass,
    Speed,
    TankSize,
    Viscosity,
    WaterDensity,
    YawInertia,
)
from tank2sim.units import to_si

RunType = Literal[
    "static_drift", "static_rudder", "drift_and_rudder", "steady_turn", "pure_sway", "pure_yaw", "yaw_with_drift"
]
RUN_TYPES: tuple[RunType, ...] = get_args(RunType)
OSCILLATING: tuple[RunType, ...] = ("pure_sway", "pure_yaw", "yaw_with_drift")
"""Types of run in which the model oscillates; in the others it is towed steadily."""

NotNegative = Annotated[float, Field(ge=0)]
Angle = Annotated[float, Field(gt=-1.5707963267948966, lt=1.5707963267948966)]


class ModelSection(CardSection):
    """``[model]``: the ship model as tested, SI.

    Parameters
    ----------
    mass_kg, yaw_inertia_kgm2, x_G_m
        Body that the gauges carry, about midships; x_G positive forward. The inertia is needed by yaw tests.
    trim_m
        Positive by the stern.
    scale
        Length of the ship over the length of the model, lambda.
    z_G_m
        Height of the centre of gravity above the keel.
    """

    name: Text
    length_m: Length
    beam_m: Breadth | None = None
    draught_m: Draught | None = None
    mass_kg: Mass
    yaw_inertia_kgm2: YawInertia | None = None
    x_G_m: float = 0.0
    z_G_m: float | None = None
    trim_m: float | None = None
    block_coefficient: BlockCoefficient | None = None
    scale: Annotated[float, Field(ge=1)] | None = None
    rudder_area_m2: Area | None = None
    propeller_diameter_m: Breadth | None = None


class TankTest(CardSection):
    """``[test]``: how it was tested.

    Parameters
    ----------
    speed_mps
        The test speed u0, about which the forces are expanded.
    force_convention
        ``on_model``: the force of the mechanism on the model; ``on_gauge``: the reaction; ``hydrodynamic``: that of
        the water on the model, the inertia of the model already removed.
    rudder_sign
        To which side a positive rudder angle turns the ship, in the run files and ``[[runs]]``.
    inertia_speed
        The u with which the rigid body's m u r and m x_G u r are computed: ``test``, u = U as the paper has it
        (papers 2.2, 2.3), or ``axial``, u = U cos(beta). They differ in runs that yaw with drift alone; steady turns
        always have u = U cos(beta).
    force_delay_s
        By how much the recorded forces lag the recorded motion, s (filters, clocks); it is taken out.
    free_motions
        Motions left free, such as ``["heave", "pitch"]``.
    """

    water_density_kgpm3: WaterDensity = 1000.0
    gravity_mps2: Gravity = 9.80665
    speed_mps: Speed
    force_convention: Literal["on_model", "on_gauge", "hydrodynamic"]
    rudder_sign: Literal["starboard", "port"] = "starboard"
    inertia_speed: Literal["test", "axial"] = "test"
    propeller_radps: NotNegative | None = None
    force_delay_s: Annotated[float, Field(gt=-10, lt=10)] = 0.0
    free_motions: list[str] | str | bool | None = None
    kinematic_viscosity_m2ps: Viscosity | None = None

    @property
    def sense(self) -> float:
        """By what recorded forces are multiplied to be positive as the water pushes the model: 1 or -1."""
        return -1.0 if self.force_convention == "on_model" else 1.0


class TankSection(CardSection):
    """``[tank]``: the basin."""

    length_m: TankSize | None = None
    breadth_m: TankSize | None = None
    depth_m: TankSize | None = None


class UncertaintySection(CardSection):
    """``[uncertainty]``: Type B standard uncertainties (one standard deviation) that no scatter of the runs shows.

    ITTC 7.5-02-06-04. Each is one error common to the whole campaign; absent means not stated, and none is added.

    Parameters
    ----------
    calibration_relative
        Relative error of the gauges in every force and moment, each of X, Y and N by itself.
    alignment_rad
        Angle between the model's axis at zero drift and the tank's.
    rudder_rad
        Zero of the rudder angle.
    speed_relative
        Relative error of the carriage speed.
    mass_relative, yaw_inertia_relative
        Relative errors of the carried mass and its yaw inertia.
    force_delay_s
        Error of the delay of the forces behind the motion, s; if stated, it replaces the campaign's own estimate.
    blockage_relative
        Relative error of the speed of the water past the model, by the walls of the tank.
    """

    calibration_relative: NotNegative = 0.0
    alignment_rad: NotNegative = 0.0
    rudder_rad: NotNegative = 0.0
    speed_relative: NotNegative = 0.0
    mass_relative: NotNegative = 0.0
    yaw_inertia_relative: NotNegative = 0.0
    force_delay_s: NotNegative = 0.0
    blockage_relative: NotNegative = 0.0


class FullScaleSection(CardSection):
    """``[full_scale]``: the water the ship sails in, for a card at ship scale."""

    water_density_kgpm3: WaterDensity = 1025.0
    gravity_mps2: Gravity = 9.80665
    kinematic_viscosity_m2ps: Viscosity = 1.19e-6


class ColumnEntry(CardSection):
    """An entry of ``[columns]``: what a column of the run files holds. SI value = sign * factor * (recorded - offset).

    Parameters
    ----------
    quantity
        ``t y psi v r speed delta X Y N``, or with its unit: ``Y_kN``.
    unit
        Unit of the recorded values (``kN``, ``mm``, ``deg/s``); by default the file's. Not needed with a factor.
    sign
        1, or -1 where the column has the opposite sign.
    factor
        To the unit, or to SI if none is given: for channels in volts or in a unit that is not known here.
    offset
        Recorded value that is zero.
    """

    quantity: Text
    unit: Text | None = None
    sign: Literal[1, -1] = 1
    factor: Annotated[float, Field(gt=0)] | None = None
    offset: float = 0.0


ColumnMap = dict[str, ColumnEntry | Text]


class FilesSection(CardSection):
    """``[files]``: the layout of run files that are text, where it is not found from the files themselves.

    Parameters
    ----------
    separator
        Between columns: ``,`` ``;`` ``|``, ``tab``, or ``blanks`` for any number of blanks.
    decimal
        Sign of decimals.
    widths
        Characters of each column of fixed width, where no blank separates them.
    names
        Names of the columns of files without names.
    skip_lines
        Lines at the beginning that are not read.
    """

    separator: Literal[",", ";", "|", "tab", "blanks"] | None = None
    decimal: Literal[",", "."] | None = None
    widths: list[Annotated[int, Field(gt=0)]] | None = None
    names: list[Text] | None = None
    skip_lines: Annotated[int, Field(ge=0)] = 0


class RunSheet(CardSection):
    """One of ``[[runs]]``: what the test sheet says of a run; its file holds what was measured.

    Parameters
    ----------
    yaw_rate_radps
        Yaw rate of a steady turn on a rotating arm or in circular motion, positive to starboard.
    heel_rad
        At which the model is held, positive to starboard.
    """

    file: Text
    type: RunType
    drift_rad: Angle | None = None
    rudder_rad: Angle | None = None
    frequency_radps: Positive | None = None
    amplitude_m: Positive | None = None
    yaw_rate_radps: float | None = None
    heel_rad: Angle | None = None
    yaw_rate_amplitude_radps: Positive | None = None
    propeller_radps: NotNegative | None = None
    notes: str | None = None
    columns: ColumnMap = Field(default_factory=dict)


class AverageColumns(CardSection):
    """``[averages.columns]``: quantity to the heading of its column.

    Parameters
    ----------
    heel_rad
        Angle at which the model is held, positive to starboard.
    yaw_rate_radps, yaw_rate_prime
        Yaw rate of rotating-arm and circular-motion tests, positive to starboard; prime: r L/U.
    thrust, rudder_normal_force
        Of the propeller, positive forward, and of the water on the rudder; in the scaling of the forces. With two
        propellers those of the right side.
    thrust_left, rudder_normal_force_left
        The same of the left side.
    torque
        That the propeller takes, positive ahead; in the scaling of the moments.
    """

    drift_rad: str | None = None
    rudder_rad: str | None = None
    heel_rad: str | None = None
    speed_mps: str | None = None
    propeller_radps: str | None = None
    yaw_rate_radps: str | None = None
    yaw_rate_prime: str | None = None
    thrust: str | None = None
    rudder_normal_force: str | None = None
    thrust_left: str | None = None
    rudder_normal_force_left: str | None = None
    torque: str | None = None
    X: str
    Y: str
    N: str


class AveragesSection(CardSection):
    """``[averages]``: a table of static conditions, one a row, in place of ``[[runs]]``."""

    file: Text
    scaling: Literal["prime", "prime_ii", "dimensional"]
    rudder_sign: Literal["starboard", "port"] | None = None
    normal_force_sign: Literal["starboard", "port"] = "port"
    columns: AverageColumns


class OpenWaterSection(CardSection):
    """``[open_water]``: points of the propeller's open-water curve, in the file or a table of their own.

    Parameters
    ----------
    J, K_T, K_Q
        Points; or, with ``file``, the headings of their columns. K_Q is needed where torque is measured.
    K_Q_factor
        What K_Q is multiplied by: 0.1 where 10 K_Q is given.
    """

    file: Text | None = None
    J: list[float] | Text = "J"
    K_T: list[float] | Text = "K_T"
    K_Q: list[float] | Text | None = None
    K_Q_factor: Positive = 1.0


class PropellerTest(CardSection):
    """``[propeller]``: the place of the propeller over L.

    Parameters
    ----------
    x_P
        Positive forward of midships.
    number
        1, or 2 side by side, each before a rudder.
    y_P
        Place of the right one of two, to starboard.
    """

    x_P: Annotated[float, Field(gt=-1, lt=1)] = -0.5
    number: Literal[1, 2] = 1
    y_P: Annotated[float, Field(gt=0, lt=0.5)] | None = None


class RudderTest(CardSection):
    """``[rudder]``: the rudder as tested.

    Parameters
    ----------
    height_m
        The race covers the share D_P/H_R of it.
    aspect_ratio, f_alpha
        One of the two: f_alpha, the slope of the normal force, by Fujii's formula from the aspect ratio.
    x_R
        Its place over L, positive forward of midships.
    y_R
        Place over L of the right one of two rudders, to starboard.
    """

    height_m: Breadth
    aspect_ratio: Positive | None = None
    f_alpha: Positive | None = None
    x_R: Annotated[float, Field(gt=-1, lt=1)] = -0.5
    y_R: Annotated[float, Field(gt=0, lt=0.5)] | None = None


class SpeltColumn(NamedTuple):
    """How ``[averages.columns]`` spells a quantity: its key there, and the factor that brings the column to SI."""

    key: str
    factor: float


class CampaignFile(CardSection):
    """The whole of ``campaign.toml``."""

    format: Literal["tank2sim-campaign/1"] = "tank2sim-campaign/1"
    model: ModelSection
    test: TankTest
    tank: TankSection = TankSection()
    uncertainty: UncertaintySection = UncertaintySection()
    full_scale: FullScaleSection | None = None
    averages: AveragesSection | None = None
    open_water: OpenWaterSection | None = None
    propeller: PropellerTest = PropellerTest()
    rudder: RudderTest | None = None
    files: FilesSection = FilesSection()
    columns: ColumnMap = Field(default_factory=dict)
    runs: tuple[RunSheet, ...] = ()


# Columns of averages that are one quantity in another scaling
_SAME_QUANTITY = {"yaw_rate_radps": "yaw_rate_prime", "yaw_rate_prime": "yaw_rate_radps"}


def campaign_file(content: dict[str, Any], source: Path) -> tuple[CampaignFile, dict[str, SpeltColumn]]:
    """The checked form of a campaign's parsed TOML, and how it spells the columns of ``[averages]``, by SI key.

    `content`: The parsed TOML. `source`: For messages.

    Raises InputError: A key is missing, unknown, given twice in two units, or holds what it cannot.
    """
    content, spelt = dict(content), dict[str, str]()
    for section in ("model", "test", "tank", "uncertainty", "full_scale"):
        if isinstance(content.get(section), dict):
            content[section] = section_in_si(content[section], section, source, spelt)
    if isinstance(content.get("runs"), list):
        content["runs"] = tuple(
            section_in_si(run, f"runs.{number}", source, spelt) if isinstance(run, dict) else run
            for number, run in enumerate(content["runs"])
        )
    spelt_columns: dict[str, SpeltColumn] = {}
    averages = content.get("averages")
    if isinstance(averages, dict) and isinstance(averages.get("columns"), dict):
        columns, spelt_columns = _columns_in_si(averages["columns"], source)
        spelt |= {
            f"averages.columns.{si_key}": f"averages.columns.{as_given.key}"
            for si_key, as_given in spelt_columns.items()
        }
        content["averages"] = {**averages, "columns": columns}
    try:
        return CampaignFile.model_validate(content), spelt_columns
    except ValidationError as error:
        raise form_fault(error, source, spelt, form=CampaignFile, what="a campaign") from None


def _columns_in_si(columns: dict[str, Any], source: Path) -> tuple[dict[str, Any], dict[str, SpeltColumn]]:
    """Headings of the columns of averages by their SI keys, and how these are spelt."""
    headings: dict[str, Any] = {}
    spelt: dict[str, SpeltColumn] = {}
    for key, heading in columns.items():
        si_key, factor = to_si(key, 1.0)
        same = next((known for known in (si_key, _SAME_QUANTITY.get(si_key, "")) if known in spelt), None)
        if same is not None:
            problem = f"is given twice, also as {spelt[same].key}"
            raise InputError(source, f"averages.columns.{key}", problem, "give it once")
        headings[si_key], spelt[si_key] = heading, SpeltColumn(key, factor)
    return headings, spelt


def section_in_si(section: dict[str, Any], place: str, source: Path, spelt: dict[str, str]) -> dict[str, Any]:
    """A section of parsed TOML with its numbers, and their keys, in SI; `spelt` gets the file's key of each place.

    Raises InputError: A key is given twice in two units.
    """
    converted: dict[str, Any] = {}
    for key, value in section.items():
        number = isinstance(value, int | float) and not isinstance(value, bool)
        si_key, si_value = to_si(key, value) if number else (key, value)
        if si_key in converted:
            other = spelt[f"{place}.{si_key}"].rpartition(".")[2]
            raise InputError(source, f"{place}.{key}", f"is given twice, also as {other}", "give it once")
        spelt[f"{place}.{si_key}"] = f"{place}.{key}"
        converted[si_key] = si_value
    return converted
