"""Results of ``poster`` and ``pilotcard``: the wheelhouse poster and the pilot card of a ship (IMO A.601(15))."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.parts import Illustration, Section, Table, records_table
from tank2sim.answer.result import Result
from tank2sim.apps.bridge.study import Bridge, BridgeStudy

if TYPE_CHECKING:
    import pandas as pd

_TRACKS = {
    "turning_circles_deep": "Turning circles, deep water",
    "turning_circles_shallow": "Turning circles, shallow water",
    "stops": "Stops",
}


@dataclass(frozen=True, eq=False, repr=False)
class BridgeResult(Result[BridgeStudy]):
    """Circles, stops, speeds by revolutions and zigzags of a ship on a sheet of paper; unknown values are blank.

    Parameters
    ----------
    study : BridgeStudy
    bridge : Bridge, optional
        Data of the ship, or of its loaded condition; None if the result was read from its JSON.
    ballast : Bridge, optional
        Data of its ballast condition.
    """

    study: BridgeStudy
    bridge: Bridge | None = None
    ballast: Bridge | None = None

    @property
    def blanks(self) -> int:
        """Blanks that are to be filled in by hand."""
        return self._html.count('title="not known') + self.beyond_card

    @property
    def beyond_card(self) -> int:
        """Blanks whose figures are outside the range of the card; they are hatched."""
        return self._html.count('title="outside')

    @property
    def telegraph(self) -> pd.DataFrame:
        """Orders of the engine telegraph ahead: revolutions (rpm) and steady speed (m/s), nan where it is not known."""
        import pandas as pd

        return pd.DataFrame([asdict(order) for order in self.study.telegraph])

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: {self.command}"

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship and number of blanks."""
        if self.bridge is None:
            return (f"Manoeuvring data of {self.study.ship}.",)
        hatched = self.beyond_card
        outside = f", {hatched} of them hatched: outside the range of the card" if hatched else ""
        return (f"{self.study.ship}: {self.blanks} blanks are to be filled in by hand{outside}",)

    @property
    def sections(self) -> Sequence[Section]:
        """Turning circles and stops (the way ahead is up), speeds by revolutions."""
        charts = []
        for field, title in _TRACKS.items():
            tracks = [
                TrackData(label=track.name, x_m=track.ahead_m, y_m=track.starboard_m)
                for track in getattr(self.study, field)
            ]
            if tracks:
                chart = track_chart(tracks, title=title)
                charts.append(Illustration(chart=chart, caption="The ship heads up the page."))
        tables: list[Table] = []
        if self.study.telegraph:
            tables.append(records_table("Engine telegraph", self.study.telegraph, on_screen=False))
        if self.study.full_astern_from:
            tables.append(records_table("Full astern", self.study.full_astern_from, on_screen=False))
        return [Section(heading="Manoeuvres", charts=charts, tables=tables)]

    def page(self) -> str:
        """The sheet: self-contained HTML that prints on one page."""
        return self._html if self.bridge is not None else super().page()

    @cached_property
    def _html(self) -> str:
        raise NotImplementedError


class PosterResult(BridgeResult):
    """The wheelhouse poster of a ship (A3, landscape).

    Parameters are those of :class:`BridgeResult`.
    """

    command: ClassVar[str] = "poster"

    @cached_property
    def _html(self) -> str:
        from tank2sim.apps.bridge.pages import poster_page

        assert self.bridge is not None, "the JSON of a poster does not hold its card"
        return poster_page(self.bridge, self.ballast)


class PilotCardResult(BridgeResult):
    """The pilot card of a ship (A4).

    Parameters are those of :class:`BridgeResult`.
    """

    command: ClassVar[str] = "pilotcard"

    @cached_property
    def _html(self) -> str:
        from tank2sim.apps.bridge.pages import pilot_card_page

        assert self.bridge is not None, "the JSON of a pilot card does not hold its card"
        return pilot_card_page(self.bridge, self.ballast)
