"""Keys of the JSON of each result, and the JSON Schema that is generated from them.

Units are in the names of keys; what is not a finite number is null. A schema allows no key that is not declared here.
"""

from __future__ import annotations

from typing import Any, NotRequired

from pydantic import ConfigDict, TypeAdapter
from typing_extensions import TypedDict

from tank2sim.api.result import SCHEMA_VERSION

Number = float | None
"""A number; null where it is not finite or not known."""

Columns = dict[str, list[Number]]
"""Columns (n,) by name with unit, all of one length."""

FigureValues = dict[str, float | list[float] | None]
"""Manoeuvring figures by name with unit; null where the run was too short."""


class _Keys(TypedDict):
    """Base: no keys but those declared."""

    __pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[misc]
    schema: str


class BandKeys(TypedDict):
    """Quantiles over the members of an ensemble, and how many members show the figure."""

    __pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[misc]
    p5: Number
    p50: Number
    p95: Number
    shown_by: int


class SimulateKeys(_Keys):
    """A simulated manoeuvre."""

    ship: str
    manoeuvre: str
    figures: FigureValues
    left_card_range_s: Number
    left_card_range_by: str
    outside_card_range: list[str]
    notices: list[str]
    histories: Columns
    ensemble: NotRequired[dict[str, Any]]


class OperatingPointKeys(TypedDict):
    """The straight course about which the ship is linearised."""

    speed_mps: float
    drift_deg: float
    rudder_deg: float


class StabilityKeys(_Keys):
    """Stability, steady turning and IMO criteria."""

    ship: str
    operating_point: OperatingPointKeys
    eigenvalues: list[list[Number]]
    stability_criterion: dict[str, bool | float | list[str] | None]
    nomoto: dict[str, dict[str, Number]]
    margins: dict[str, Any]
    trim: dict[str, Any]
    responses: list[dict[str, Any]]
    steady_turning: dict[str, Any] | None
    characteristic: dict[str, Any] | None
    spirals: dict[str, dict[str, Any] | None]
    imo: list[dict[str, str | float | bool | None]]
    notices: list[str]
    ensemble: NotRequired[dict[str, Any]]


class ExportKeys(_Keys):
    """An FMU that was made."""

    ship: str
    fmu: str
    ssp: str | None
    fmi: int
    model_identifier: str
    token: str
    platforms: list[str]
    size_bytes: int
    notices: list[str]


class CheckKeys(_Keys):
    """The check of an FMU; errors are relative to each output's range."""

    path: str
    fmi: int
    kinds: list[str]
    validation: list[str]
    compared: bool
    differences: list[str]
    errors: dict[str, dict[str, Number]]
    max_error: dict[str, Number]
    limits: dict[str, float]
    duration_s: float
    reference_error: Number
    passed: bool


class DerivativeKeys(TypedDict):
    """A derivative (prime) from captive tests."""

    value: float
    standard_error: float
    origin: str
    source: NotRequired[str]
    type_a: NotRequired[Number]
    type_b: NotRequired[dict[str, Any]]
    paper_order: NotRequired[dict[str, Any] | None]


class ReduceKeys(_Keys):
    """Captive tests reduced to derivatives."""

    campaign: str
    model: dict[str, str | float | None]
    test: dict[str, str | float | None]
    conventions: dict[str, str | float | None]
    rigid_body: dict[str, Number]
    derivatives: dict[str, DerivativeKeys]
    missing: list[str]
    warnings: list[str]
    methods: dict[str, Any]
    selection: dict[str, list[dict[str, Any]]]
    spread: dict[str, dict[str, Any]]
    systematic_errors: list[dict[str, Any]]
    trends: list[dict[str, Any]]
    symmetry: dict[str, Any]
    leave_one_out: dict[str, list[dict[str, Any]]]
    prediction_errors: dict[str, dict[str, Any]]
    oscillations: list[dict[str, Any]]
    third_order: list[dict[str, Any]]
    runs: list[dict[str, Any]]
    not_used: dict[str, Any]
    faults: list[Any]
    repeats: dict[str, Any]
    resistance: dict[str, Any] | None


class EstimateKeys(TypedDict):
    """A coefficient identified from trials, and what was known of it before."""

    value: float
    standard_error: Number
    before: Number
    before_standard_error: Number
    share_from_trials: Number


class IdentifyKeys(_Keys):
    """Coefficients identified from free-running trials."""

    method: str
    structure: str
    forced: list[str]
    manoeuvres: dict[str, str]
    derivatives: dict[str, EstimateKeys]
    effects: dict[str, EstimateKeys]
    misfit: dict[str, Any]
    yaw_rate_error_over_windows: dict[str, dict[str, Number] | None]
    figures_are: str
    figures: dict[str, list[dict[str, Any]]]
    structures: dict[str, Any]
    criteria: dict[str, Number] | None
    bootstrap: dict[str, Any] | None
    residual_noise: dict[str, Number]
    prior_scale: dict[str, Number]
    cost: list[Number]
    identifiability: dict[str, Any]
    warnings: list[str]
    replays: list[dict[str, Any]]


class GapKeys(_Keys):
    """The missing effect of a model."""

    verdict: str
    effects: list[dict[str, Any]]
    alternatives: list[str]
    where: list[dict[str, Any]]
    acting: list[dict[str, Any]]
    equation: str
    misfit: dict[str, Any]
    could_hide: dict[str, dict[str, Number]]
    could_hide_in_words: dict[str, str]
    next_test: dict[str, Any] | None
    rivals: list[dict[str, Any]]
    trials: list[dict[str, Any]]
    figures: list[dict[str, Any]]
    agreement: dict[str, Any]
    missing_force: dict[str, Any] | None
    missing_signal: dict[str, Any] | None
    notices: list[str]
    files: NotRequired[list[str]]


KEYS: dict[str, type] = {
    "check": CheckKeys,
    "export": ExportKeys,
    "gap": GapKeys,
    "identify": IdentifyKeys,
    "reduce": ReduceKeys,
    "simulate": SimulateKeys,
    "stability": StabilityKeys,
}
"""Command to the keys of its JSON."""


def schema_name(command: str) -> str:
    """Name of the schema of a command's JSON, which stands in it under ``schema``: ``tank2sim/simulate/1``."""
    return f"tank2sim/{command}/{SCHEMA_VERSION}"


def json_schema(command: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of the JSON that a command writes.

    Parameters
    ----------
    command : str
        A key of :data:`KEYS`.

    Raises
    ------
    KeyError
        There is no schema of this command.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.json_schema("simulate")["properties"]["schema"]
    {'const': 'tank2sim/simulate/1'}
    """
    schema = TypeAdapter(KEYS[command]).json_schema()
    schema["properties"]["schema"] = {"const": schema_name(command)}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": schema_name(command), **schema}
