"""Steering cards: one ship in several steering models, with the points of its steering diagram that are known.

The format is ``tank2sim-steering/1``: ``[ship]``, ``[[models]]`` with their coefficients, ``[[points]]``, and printed
influence coefficients in ``[influence]``. Which coefficients a model has is defined next to its equations
(:mod:`tank2sim.dynamics.steering_models`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from tank2sim.bundled import bundled
from tank2sim.cards.form import CardSection, Positive, Text
from tank2sim.cards.form_faults import form_fault
from tank2sim.cards.reading import parsed_toml
from tank2sim.errors import InputError
from tank2sim.files import read_text
from tank2sim.quantities import Draught, Length, Speed
from tank2sim.units import to_si

_FORMAT = "tank2sim-steering/1"
_FILE = "steering.toml"

Rudder = Annotated[float, Field(gt=-1.5707963267948966, lt=1.5707963267948966)]


class SteeringShip(CardSection):
    """``[ship]``: what every model of the card is about, SI."""

    name: Text
    source: Text
    length_m: Length
    speed_mps: Speed
    notes: str | None = None


class SteeringEntry(CardSection):
    """One of ``[[models]]``: a form of the catalogue with coefficients, which may be incomplete."""

    name: Text
    title: Text
    form: Text
    source: Text
    draught_m: Draught | None = None
    coefficients: dict[str, float] = Field(default_factory=dict)
    notes: str | None = None


class SteeringPoint(CardSection):
    """One of ``[[points]]`` of a steering diagram: a rudder angle, and the yaw rate or the radius it gave.

    The first two `measured` ones are those that a model can be tuned to.
    """

    label: Text
    measured: bool = False
    source: Text
    rudder_rad: Rudder
    yaw_rate_radps: float | None = None
    radius_m: Positive | None = None
    drift_rad: float | None = None


class PrintedInfluence(CardSection):
    """``[influence]``: printed influence coefficients K % of a radius over the draught, and a printed slip.

    Parameters
    ----------
    model : str
        Name of the model in the card.
    rudder_rad : float
        Rudder of the turn.
    change_percent : float
        Change of a coefficient behind K.
    radius_m : float
        Printed radius of that turn, which the printed K refer to.
    draughts_m : list of float
        Draughts of the values.
    K_percent : dict
        Coefficient to K at each draught.
    misread_as : dict
        Coefficient to the one whose K the source multiplied its agreed variation by, where they differ.
    """

    model: Text
    rudder_rad: Rudder
    source: Text
    change_percent: Positive
    radius_m: Positive
    draughts_m: list[Draught]
    K_percent: dict[str, list[float]]
    misread_as: dict[str, str] = Field(default_factory=dict)


class _Form(CardSection):
    """The file."""

    format: Literal["tank2sim-steering/1"]
    ship: SteeringShip
    models: Annotated[list[SteeringEntry], Field(min_length=1)]
    points: list[SteeringPoint] = Field(default_factory=list)
    influence: PrintedInfluence | None = None


@dataclass(frozen=True)
class SteeringCard:
    """A steering card; angles in rad.

    Parameters
    ----------
    source : str
        File name, for messages.
    ship : SteeringShip
        The ship.
    models : mapping
        Name to entry, in the order of the file.
    points : tuple of SteeringPoint
        Known points of the steering diagram.
    influence : PrintedInfluence or None
        Printed influence coefficients.
    """

    source: str
    ship: SteeringShip
    models: Mapping[str, SteeringEntry]
    points: tuple[SteeringPoint, ...]
    influence: PrintedInfluence | None

    def fault(self, place: str, problem: str, remedy: str) -> InputError:
        """An error about this card, to be raised: its place, the problem, and the remedy."""
        return InputError(self.source, place, problem, remedy)

    def place(self, model: str) -> str:
        """The place of a model in the file, for messages."""
        return f"models.{list(self.models).index(model)}"


def find_steering_card(name: str) -> Path | None:
    """Path of a steering card, a file or the name of a bundled one; None if it is not one.

    A file counts as one by its ``format``, so that a command can distinguish it from a ship card.
    """
    path = Path(name)
    if not path.is_file():
        path = bundled("models") / name.lower() / _FILE
        return path if name and path.is_file() else None
    try:
        content = parsed_toml(read_text(path), path)
    except InputError:
        return None  # the reader of ship cards reports the fault
    return path if str(content.get("format", "")).startswith(_FORMAT.partition("/")[0] + "/") else None


def read_steering_card(name: str | Path) -> SteeringCard:
    """Read a steering card, a file or the name of a bundled one (``poznyakov-yudin``).

    Raises
    ------
    InputError
        The card does not exist, or something in it is wrong; the message names file, key and what was expected.
    """
    path = find_steering_card(str(name))
    if path is None and not Path(name).is_file():
        known = sorted(folder.parent.name for folder in bundled("models").glob(f"*/{_FILE}"))
        raise InputError(name, "", "is neither a file nor a bundled steering card", f"bundled are: {', '.join(known)}")
    return parse_steering_card(read_text(path or Path(name)), str(path or name))


def parse_steering_card(text: str, source: str) -> SteeringCard:
    """The card that a TOML text describes; `source` names it in messages. Raises as :func:`read_steering_card`."""
    content = parsed_toml(text, source)
    spelt: dict[str, str] = {}
    _to_radians(content, spelt)
    try:
        form = _Form.model_validate(content)
    except ValidationError as error:
        raise form_fault(error, source, spelt, form=_Form, what="a steering card") from None
    models = {entry.name: entry for entry in form.models}
    if len(models) < len(form.models):
        raise InputError(source, "models", "two have the same name", "give each model a name of its own")
    if len({entry.title for entry in form.models}) < len(form.models):
        raise InputError(source, "models", "two have the same title", "give each model a title of its own")
    for number, point in enumerate(form.points):
        if (point.yaw_rate_radps is None) == (point.radius_m is None):
            remedy = "give yaw_rate_degpmin or radius_m"
            raise InputError(source, f"points.{number}", "has not one of yaw rate and radius", remedy)
    _check_influence(form, models, source)
    return SteeringCard(source, form.ship, models, tuple(form.points), form.influence)


def _check_influence(form: _Form, models: Mapping[str, SteeringEntry], source: str) -> None:
    influence = form.influence
    if influence is None:
        return
    if influence.model not in models:
        remedy = f"the models are {', '.join(models)}"
        raise InputError(source, "influence.model", f"{influence.model!r} is not a model of the card", remedy)
    if len(set(influence.draughts_m)) < len(influence.draughts_m):
        raise InputError(source, "influence.draughts_m", "has one draught twice", "give each draught once")
    for name, values in influence.K_percent.items():
        if len(values) != len(influence.draughts_m):
            remedy = f"give one for each of the {len(influence.draughts_m)} draughts"
            raise InputError(source, f"influence.K_percent.{name}", f"has {len(values)} values", remedy)
    for pair in influence.misread_as.items():
        for name in pair:
            if name not in influence.K_percent:
                raise InputError(source, "influence.misread_as", f"{name} has no K", "name a key of K_percent")


def _to_radians(content: dict[str, Any], spelt: dict[str, str]) -> None:
    """Convert the angles and rates of ``[[points]]`` and ``[influence]`` in place; `spelt` learns their own keys."""
    points = content.get("points")
    sections = [(f"points.{n}", point) for n, point in enumerate(points if isinstance(points, list) else [])]
    for place, section in [*sections, ("influence", content.get("influence"))]:
        if not isinstance(section, dict):
            continue  # the form will refuse it, or there is none
        for key in list(section):
            value = section[key]
            number = isinstance(value, int | float) and not isinstance(value, bool)
            si_key, si_value = to_si(key, float(value) if number else 0.0)
            if si_key != key and si_key not in section:
                spelt[f"{place}.{si_key}"] = f"{place}.{key}"
                section[si_key] = si_value if number else value
                del section[key]
