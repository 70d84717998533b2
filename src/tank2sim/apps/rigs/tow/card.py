"""The card of a towed body: surge mass and drag, (1.5) of paper 1."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from tank2sim.cards.card import Card
from tank2sim.cards.form import (
    BodyModel,
    BodySection,
    CardSection,
    Environment,
    Mass,
)


class SurgeModel(BodyModel):
    """``[model]`` of a body that only surges (eq. 1.5)."""

    kind: Literal["surge"]


class Surge(CardSection):
    """``[surge]``: coefficients of (1.5), M dv/dt + B1 v^4 + B2 v^3 + B3 v^2 = T."""

    total_mass_kg: Mass
    B1_kgs2pm3: float = 0.0
    B2_kgspm2: float = 0.0
    B3_kgpm: float
    force_N: float = 0.0
    dry_mass_kg: Mass | None = None


class SurgeForm(CardSection):
    """The card of a body that only surges, as in its file."""

    format: Literal["tank2sim-ship/1"]
    ship: BodySection
    environment: Environment = Environment()
    model: SurgeModel
    surge: Surge
    uncertainty: dict[str, Annotated[float, Field(ge=0)]] = Field(default_factory=dict)


@dataclass(frozen=True)
class SurgeBodyCard(Card):
    """Card of a body that only surges: (1.5) of paper 1, SI."""

    model: SurgeModel
    surge: Surge
    uncertainty: Mapping[str, float] = field(default_factory=dict)
