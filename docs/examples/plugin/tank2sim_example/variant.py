"""A variant of a command of tank2sim: ``stability CARD --pivot``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.parts import Section
from tank2sim.answer.result import Result
from tank2sim.api.verbs import verb
from tank2sim.arguments import AngleArgument

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel


@dataclass(frozen=True)
class Pivot:
    """The point of the centre line that moves straight ahead in the steady turn, m forward of midships."""

    ship: str
    rudder_deg: float
    pivot_m: float


@dataclass(frozen=True, eq=False, repr=False)
class PivotResult(Result[Pivot]):
    """The pivot point, as ``stability --pivot`` prints it."""

    study: Pivot
    command: ClassVar[str] = "stability"

    @property
    def title(self) -> str:
        """Name of the ship."""
        return f"Pivot point of {self.study.ship}"

    @property
    def headline(self) -> tuple[str, ...]:
        """Where the pivot point is."""
        return (f"Pivot point {self.study.pivot_m:.1f} m forward of midships, rudder {self.study.rudder_deg:g} deg.",)

    @property
    def sections(self) -> Sequence[Section]:
        """None: the headline says it all."""
        return []


@verb("pivot point in the steady turn", name="stability.pivot", results=("tank2sim_example.variant:PivotResult",))
def pivot(ship: Vessel, *, rudder_deg: AngleArgument = 35.0) -> PivotResult:
    """Find the pivot point in the steady turn.

    Parameters
    ----------
    ship : Ship
    rudder_deg : float
        Rudder angle, positive to starboard.

    Raises
    ------
    InputError
        The card is not one of a ship with a rudder.
    """
    import math

    import tank2sim as t2s

    end = t2s.Ship(ship.card).turn(rudder_deg).df.iloc[-1]
    return PivotResult(Pivot(ship.name, rudder_deg, -end["v_mps"] / math.radians(end["r_degps"])))
