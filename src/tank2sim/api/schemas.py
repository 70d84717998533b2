"""Keys of the JSON of each result, and the JSON Schema that is generated from them.

Units are in the names of keys; what is not a finite number is null. A schema allows no key that is not declared here.
"""

from __future__ import annotations

from typing import Any, NotRequired

from pydantic import ConfigDict, TypeAdapter
from typing_extensions import TypedDict

from tank2sim.api.bounds import checked
from tank2sim.api.results import RESULT_CLASSES, result_schema
from tank2sim.files import schema_name

JsonNumber = float | None
"""A number; null where it is not finite or not known."""

JsonColumns = dict[str, list[JsonNumber]]
"""JsonColumns (n,) by name with unit, all of one length."""

FigureValues = dict[str, float | list[float] | None]
"""Manoeuvring figures by name with unit; null where the run was too short."""


class _Part(TypedDict):
    """Base of parts of results: no keys except those declared."""

    __pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[misc]


class _Keys(_Part):
    """Base of results."""

    schema: str


class EstimateKeys(_Part):
    """A coefficient identified from trials, and what was known of it before."""

    value: float
    standard_error: JsonNumber
    before: JsonNumber
    before_standard_error: JsonNumber
    prior_standard_error: JsonNumber
    share_from_trials: JsonNumber


class CraftEstimateKeys(_Part):
    """A coefficient of a craft (SI), what the trials say of it, and which of them most."""

    value: float
    standard_error: float
    before: float
    prior_standard_error: float
    verdict: str
    by: str | None


class CandidateTrialKeys(_Part):
    """A manoeuvre of five minutes: its orders (shares of the largest revolutions), and what it would determine."""

    words: str
    t_s: list[float]
    order_port: list[float]
    order_starboard: list[float]
    determines: list[str]


class OrderResponseKeys(_Part):
    """How a thruster follows its orders; the dead band is None where no order left the propeller at rest."""

    lag_s: float
    lag_error_s: float
    dead_band_rpm: float | None
    dead_band_error_rpm: float | None
    rest_rpm: float
    turning_rpm: float


class CraftIdentifyKeys(_Keys):
    """Coefficients and thrust curves of a craft with thrusters."""

    ship: str
    method: str
    trials: list[str]
    coefficients: dict[str, CraftEstimateKeys]
    noise: dict[str, float]
    determination: dict[str, JsonNumber] | None
    driven_by: str
    order_responses: dict[str, OrderResponseKeys]
    held_out: list[str]
    next_trials: list[CandidateTrialKeys]
    notices: list[str]


class WindowErrorKeys(_Part):
    """Root mean square of an error over windows, and of the measured signal."""

    rms_error: JsonNumber
    rms_signal: JsonNumber


class TrialErrorKeys(_Part):
    """Errors over windows of the card given and of the card found on a trial, by column."""

    trial: str
    before: dict[str, WindowErrorKeys]
    found: dict[str, WindowErrorKeys]


class PredictedFigureKeys(_Part):
    """A figure of a trial, by the card given (`before`) and by the card found (`predicted`)."""

    trial: str
    figure: str
    measured: float
    before: JsonNumber
    predicted: JsonNumber
    error: JsonNumber
    interval_95: list[JsonNumber] | None


class IdentifiabilityKeys(_Part):
    """How well the trials determine the parameters, in units of the prior's standard errors."""

    parameters: list[str]
    condition: JsonNumber
    singular_values: list[JsonNumber]
    correlation: list[list[JsonNumber]]
    correlated_pairs: list[list[str | float]]
    unseen: list[list[str]]
    notices: list[str]


class CardReplayKeys(_Part):
    """A trial as measured and as simulated by the card given and by the card found, thinned to draw."""

    trial: str
    held_out: bool
    closed_loop: bool
    measured: JsonColumns
    before: JsonColumns
    found: JsonColumns


class SampledKeys(_Part):
    """A sampled parameter: R-hat, effective sample size, and its values at the quantile levels."""

    r_hat: JsonNumber
    effective_sample_size: JsonNumber
    quantiles: list[JsonNumber]


class PosteriorKeys(_Part):
    """Samples of the posterior, on request."""

    sampler: str
    chains: int
    draws: int
    simulations: int
    converged: bool
    quantile_levels: list[float]
    parameters: dict[str, SampledKeys]


class EstimatedCurrentKeys(_Part):
    """The current of trials at sea, estimated with the coefficients; `determined` where the trials determine it."""

    speed_mps: JsonNumber
    direction_deg: JsonNumber
    speed_standard_error_mps: JsonNumber
    direction_standard_error_deg: JsonNumber
    largest_standard_error_mps: JsonNumber
    determined: bool


class IdentifyKeys(_Keys):
    """Coefficients identified from free-running trials."""

    ship: str
    method: str
    method_reason: str | None
    current: EstimatedCurrentKeys | None
    structure: str
    forced: list[str]
    manoeuvres: dict[str, str]
    derivatives: dict[str, EstimateKeys]
    effects: dict[str, EstimateKeys]
    effects_of_card: list[str]
    misfit: dict[str, Any]
    yaw_rate_error_over_windows: dict[str, dict[str, JsonNumber] | None]
    errors_over_windows: dict[str, list[TrialErrorKeys]]
    figures_are: str
    figures: dict[str, list[PredictedFigureKeys]]
    structures: dict[str, Any]
    criteria: dict[str, JsonNumber] | None
    posterior: PosteriorKeys | None
    bootstrap: dict[str, Any] | None
    residual_noise: dict[str, JsonNumber]
    prior_scale: dict[str, JsonNumber]
    cost: list[JsonNumber]
    identifiability: IdentifiabilityKeys
    notices: list[str]
    warnings: list[str]
    replays: list[CardReplayKeys]


class GapReplayKeys(_Part):
    """A trial as measured and as simulated by the card given and by the card found, thinned to draw."""

    trial: str
    held_out: bool
    measured: JsonColumns
    before: JsonColumns
    found: JsonColumns


class MissingKeys(_Part):
    """A missing force or a contradiction of records: points and means of bins over a state, means over time."""

    equation: NotRequired[str]
    quantity: NotRequired[str]
    explaining: str
    explained: dict[str, JsonNumber]
    points: dict[str, list[str] | list[JsonNumber]]
    means: JsonColumns
    over_time: dict[str, list[str] | list[JsonNumber]]


class RefittedKeys(_Part):
    """A coefficient that was fitted together with the effects, and as the given card has it: prime or SI, rudder to
    starboard."""

    name: str
    value: JsonNumber
    standard_error: JsonNumber
    before: JsonNumber
    standard_error_before: JsonNumber


class GapKeys(_Keys):
    """The missing effect of a model."""

    ship: str
    verdict: str
    effects: list[dict[str, Any]]
    coefficients: list[RefittedKeys]
    alternatives: list[str]
    where: list[dict[str, Any]]
    acting: list[dict[str, Any]]
    equation: str
    misfit: dict[str, Any]
    could_hide: dict[str, dict[str, JsonNumber]]
    could_hide_in_words: dict[str, str]
    next_test: dict[str, Any] | None
    rivals: list[dict[str, Any]]
    trials: list[dict[str, Any]]
    figures: list[dict[str, Any]]
    agreement: dict[str, Any]
    missing_force: MissingKeys | None
    missing_signal: MissingKeys | None
    replays: list[GapReplayKeys]
    cautions: list[str]
    notices: list[str]
    files: NotRequired[list[str]]


KEYS: dict[str, Any] = {
    "gap": GapKeys,
    "identify": IdentifyKeys | CraftIdentifyKeys,
}
"""Command to the keys of its JSON; ``report`` and the fleet of ``gap`` have none."""


@checked
def json_schema(command: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of the JSON that a command writes.

    Parameters
    ----------
    command : str
        A key of :data:`KEYS`.

    Raises
    ------
    KeyError
        The command has no schema.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.json_schema("simulate")["properties"]["schema"]
    {'const': 'tank2sim/simulate/1'}
    """
    if command in RESULT_CLASSES:
        return result_schema(command)
    schema = TypeAdapter(KEYS[command]).json_schema()
    if "anyOf" in schema:  # no key is allowed that is not declared, so that one shape alone fits
        schema["oneOf"] = schema.pop("anyOf")
    for part in (schema, *schema.get("$defs", {}).values()):
        if "schema" in part.get("properties", {}):
            part["properties"]["schema"] = {"const": schema_name(command)}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": schema_name(command), **schema}
