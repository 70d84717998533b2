"""A design as numbers: the plan, and its certainty next to the usual programme."""

from __future__ import annotations

from dataclasses import dataclass, field

from tank2sim.arrays import Number
from tank2sim.notices import Notice


@dataclass(frozen=True, kw_only=True)
class PlannedFigure:
    """A figure, and its standard errors.

    `value`: figure of the card's ship; `before`: by the errors of the card alone (of a trial); `design`, `usual`: by
    the plan, and by the usual programme in the same time; `variance_ratio`: variance by the plan over that by the usual
    programme, mean over the ships that the card may be (of a campaign).
    """

    value: Number
    before: Number | None = None
    design: Number
    usual: Number
    variance_ratio: Number | None = None


@dataclass(frozen=True, kw_only=True)
class PlannedCoefficient:
    """A coefficient, and its standard errors.

    `value`: prime value on the card (of a campaign); `before`: standard error on the card (of a trial); `design`,
    `usual`: by the plan and by the usual programme; of a campaign prime, of a trial over `before`; `share_of_variance`:
    figure to the share of its variance that would go if this coefficient were known exactly (of a campaign).
    """

    value: Number | None = None
    before: Number | None = None
    design: Number
    usual: Number
    share_of_variance: dict[str, Number] = field(default_factory=dict)

    @property
    def largest_share(self) -> float:
        """Largest share of the variance of a figure."""
        return max(self.share_of_variance.values(), default=0.0)


@dataclass(frozen=True, kw_only=True)
class Certainty:
    """Standard errors of each figure over the time, by plans and by the usual programme."""

    time_s: tuple[float, ...]
    usual_time_s: tuple[float, ...]
    design: dict[str, tuple[Number, ...]]
    usual: dict[str, tuple[Number, ...]]


@dataclass(frozen=True, kw_only=True)
class PlannedRow:
    """A run of a plan, as its row of the CSV; None where a column has no meaning for the run."""

    run: int
    file: str
    type: str
    speed_mps: float
    drift_deg: float
    rudder_deg: float
    frequency_radps: float | None
    period_s: float | None
    cycles: int | None
    sway_amplitude_m: float | None
    yaw_rate_amplitude_degps: float | None
    heading_amplitude_deg: float | None
    record_s: float
    tank_min: float
    purpose: str


@dataclass(frozen=True, kw_only=True)
class PlannedKind:
    """Runs of one kind: their number, angles (deg) with the sides they are run to, amplitude (v/U or r L/U)."""

    runs: int
    type: str
    drift: str | None
    rudder: str | None
    frequency_radps: float | None
    amplitude_prime: float | None
    cycles: int | None
    record_s: float
    check: bool


@dataclass(frozen=True)
class UsualMatrix:
    """The usual matrix of runs: its hours and runs, and how often the time of the plan has room for it."""

    hours: float
    runs: int
    repeats: float


@dataclass(frozen=True, kw_only=True)
class PlannedModel:
    """The model, and the largest angles and yaw rate of its tests."""

    length_m: float
    speed_mps: float
    longest_record_s: float
    drift_deg: float
    rudder_deg: float
    yaw_rate_prime: float


@dataclass(frozen=True)
class GaugeStudy:
    """A gauge: standard deviations of an independent reading and of its zero in a run, and its range; N or N m."""

    noise: float
    zero: float
    range: Number


@dataclass(frozen=True, kw_only=True)
class CampaignStudy:
    """A designed captive campaign; `hours_for_usual_certainty` is None if no plan is as certain as the usual matrix."""

    ship: str
    kind: str = "campaign"
    hours: float
    hours_used: float
    hours_for_usual_certainty: float | None
    usual_matrix: UsualMatrix
    model: PlannedModel
    gauges: dict[str, GaugeStudy]
    figures: dict[str, PlannedFigure]
    coefficients: dict[str, PlannedCoefficient]
    not_excited: tuple[str, ...]
    certainty: Certainty
    kinds: tuple[PlannedKind, ...]
    runs: tuple[PlannedRow, ...]
    notices: tuple[Notice, ...]


@dataclass(frozen=True)
class UsualSet:
    """The usual set of manoeuvres: its time once, and how often the time of the plan has room for it."""

    minutes: float
    manoeuvres: tuple[str, ...]
    repeats: float


@dataclass(frozen=True, kw_only=True)
class PlannedManoeuvre:
    """A manoeuvre of a designed trial: repeats, length, time of all with approaches, file of the orders."""

    manoeuvre: str
    repeats: int
    duration_s: float
    total_min: float
    orders: str


@dataclass(frozen=True, kw_only=True)
class TrialStudy:
    """A designed sea trial next to the usual set; `sensors` are standard deviations by column of a trial."""

    ship: str
    kind: str = "trial"
    minutes: float
    minutes_used: float
    minutes_for_usual_certainty: float | None
    usual_set: UsualSet
    sensors: dict[str, float]
    figures: dict[str, PlannedFigure]
    coefficients: dict[str, PlannedCoefficient]
    certainty: Certainty
    manoeuvres: tuple[PlannedManoeuvre, ...]
    notices: tuple[Notice, ...]
