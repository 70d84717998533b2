"""A command: the tactical diameter over the rudder angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.parts import Illustration, Section, records_table
from tank2sim.answer.result import Result
from tank2sim.api.verbs import verb
from tank2sim.arguments import AngleArgument

if TYPE_CHECKING:
    from tank2sim.dynamics.vessel import Vessel


@dataclass(frozen=True)
class Turn:
    """Tactical diameter with a rudder angle (deg) held: m, and in lengths."""

    rudder_deg: float
    tactical_diameter_m: float
    tactical_diameter_lengths: float


@dataclass(frozen=True)
class Turns:
    """The study; its JSON and its JSON Schema are made from these fields."""

    ship: str
    turns: tuple[Turn, ...]


@dataclass(frozen=True, eq=False, repr=False)
class TurnsResult(Result[Turns]):
    """Tactical diameters: screen, page, pictures and tables are made from what is declared here."""

    study: Turns
    command: ClassVar[str] = "turns"

    @property
    def title(self) -> str:
        """Name of the ship."""
        return f"Turns of {self.study.ship}"

    @property
    def headline(self) -> tuple[str, ...]:
        """The tightest turn."""
        least = min(self.study.turns, key=lambda turn: turn.tactical_diameter_m)
        return (f"Tightest turn: {least.tactical_diameter_m:.0f} m with {least.rudder_deg:g} deg of rudder.",)

    @property
    def sections(self) -> Sequence[Section]:
        """A table and a chart."""
        return [
            Section(
                heading="Tactical diameters",
                tables=[records_table("Tactical diameters", self.study.turns, folded=False)],
                charts=[
                    Illustration(
                        chart=self._chart(), caption="Diameters fall as the rudder angle grows.", name="diameters"
                    )
                ],
            )
        ]

    def _chart(self):
        import altair as alt

        rows = [{"rudder (deg)": one.rudder_deg, "diameter (m)": one.tactical_diameter_m} for one in self.study.turns]
        return (
            alt.Chart(alt.InlineData(values=rows)).mark_line(point=True).encode(x="rudder (deg):Q", y="diameter (m):Q")
        )


@verb("tactical diameters over rudder angles", results=("tank2sim_example.command:TurnsResult",))
def turns(ship: Vessel, *, rudder_deg: Sequence[AngleArgument] = (10.0, 20.0, 35.0)) -> TurnsResult:
    """Simulate turning circles with several rudder angles.

    Parameters
    ----------
    ship : Ship
    rudder_deg : sequence of float
        Rudder angles, positive to starboard.

    Raises
    ------
    InputError
        The card is not one of a ship with a rudder.
    """
    import tank2sim as t2s

    found = []
    for angle in rudder_deg:
        figures = t2s.Ship(ship.card).turn(angle).figures
        found.append(Turn(angle, figures["tactical_diameter_m"], figures["tactical_diameter_lengths"]))
    return TurnsResult(Turns(ship.name, tuple(found)))
