"""A ship guessed from dimensions and the figures of a wheelhouse poster."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tank2sim.analysis.guess.conditioning import LEAST_MEMBERS, POSTER_MANOEUVRES
from tank2sim.analysis.guess.prior import ShipDimensions
from tank2sim.analysis.guess.study import Guess, figure_unit, guess_ship, parse_figures
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import GuessedShips, PositiveArgument, Seed, checked
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.arguments import DEFAULT_MEMBERS
from tank2sim.cards import ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.memory import refuse_beyond_memory

if TYPE_CHECKING:
    import pandas as pd


_BYTES = 15_000
"""Bytes of a ship of the prior, measured: 14 kB."""


class GuessResult(PagedResult):
    """A guessed ship: the card with its covariance, what the figures settle, and what is predicted.

    Parameters
    ----------
    guess : Guess
    """

    command = "guess"

    def __init__(self, guess: Guess) -> None:
        self.guess = guess
        self.notices = guess.notices

    @property
    def card(self) -> ManoeuvringCard:
        """The card; ``card.save("ship.toml")`` writes it and its covariance."""
        return self.guess.card

    @property
    def ship(self) -> Ship:
        """The ship of the card."""
        return Ship(self.card)

    @property
    def figures(self) -> pd.DataFrame:
        """Figures by key (m, deg): given, and quantiles of 5, 50 and 95 % by the dimensions alone and found."""
        import pandas as pd

        rows = {}
        for key, entry in self._figures().items():
            before, after = entry["by_dimensions"], entry["found"]
            spread = {f"by_dimensions_{name}": value for name, value in before.items()} | dict(after)
            rows[key] = {"given": entry["given"], **spread}
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("figure")

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {**self.guess.as_json(), "notices": self.notices}

    @property
    def headline(self) -> tuple[str, ...]:
        """How many figures, and what they settle."""
        settled = [name for name, row in self.guess.parameters.items() if row[-1]]
        words = f"{len(self.guess.given)} figures settle {', '.join(settled)}" if settled else "nothing is settled"
        return (f"{self.card.ship.name}: {words}",)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Figures given and predicted; numbers of the card before and after; what would help most."""
        rows: list[list[object]] = []
        for key, entry in self._figures().items():
            before, after = entry["by_dimensions"], entry["found"]
            spread = f"{before['p5']:.4g} to {before['p95']:.4g}"
            rows.append([key, figure_unit(key), entry["given"], spread, *after.values()])
        columns = ("figure", "unit", "given", "by dimensions", "5 %", "50 %", "95 %")
        numbers: list[list[object]] = [
            [name, f"{row[0]:.3g} ± {row[1]:.2g}", f"{row[2]:.3g} ± {row[3]:.2g}", "settled" if row[4] else "open"]
            for name, row in self.guess.parameters.items()
        ]
        helpful: list[list[object]] = [[key, 100 * share] for key, share in self.guess.next_figures.items()]
        return (
            screen_table("Figures: nine of ten such ships lie between 5 and 95 %", columns, rows),
            screen_table(
                "Numbers of the card", ("number", "by dimensions", "with the figures", ""), numbers, wide=True
            ),
            screen_table("Which further figure would help most", ("figure", "variance gone (%)"), helpful),
        )

    def _figures(self) -> dict[str, dict[str, dict[str, float]]]:
        found = self.guess.as_json()["figures"]
        assert isinstance(found, dict)
        return found


@checked
def guess(
    *,
    length_m: PositiveArgument,
    beam_m: PositiveArgument,
    draught_m: PositiveArgument,
    block: PositiveArgument,
    speed_kn: PositiveArgument,
    figures: Mapping[str, str] | None = None,
    name: str = "guessed ship",
    members: GuessedShips = DEFAULT_MEMBERS,
    seed: Seed = 0,
) -> GuessResult:
    """Guess a ship from its main dimensions and figures of its manoeuvres.

    Parameters
    ----------
    length_m, beam_m, draught_m : float
        Between perpendiculars, moulded, mean, m.
    block : float
        Block coefficient.
    speed_kn : float
        Speed at which the manoeuvres begin, knots.
    figures : mapping, optional
        Manoeuvre (``turn35``, ``zigzag10``, ``zigzag20``) to its figures: ``{"turn35": "advance=970 tactical=980+-30",
        "zigzag10": "first=9.4"}``; distances in m, overshoots in deg, standard errors after ``+-``. A turning circle is
        at 35 deg of rudder, zigzags are 10/10 and 20/20.
    name : str
        Of the ship on the card.
    members : int
        Ships of the prior, 100 or more.
    seed : int
        The same seed gives the same ships.

    Raises
    ------
    InputError
        A number is not one of a ship, figures are impossible or contradict each other, or there is no C compiler.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> dimensions = dict(length_m=320, beam_m=58, draught_m=20.8, block=0.81, speed_kn=15.5)
    >>> found = t2s.guess(**dimensions, figures={"turn35": "advance=970 tactical=980"}, members=200)
    >>> bool(found.figures.loc["tactical_diameter@turn35", "p5"] < 980)
    True
    """
    refuse_beyond_memory("members", members, _BYTES)
    ship = ShipDimensions(length_m=length_m, beam_m=beam_m, draught_m=draught_m, block=block, speed_kn=speed_kn)
    if members < LEAST_MEMBERS:
        raise InputError("--members", "", f"is {members}", f"{LEAST_MEMBERS} or more were expected")
    given = []
    for manoeuvre, text in (figures or {}).items():
        if manoeuvre not in POSTER_MANOEUVRES:
            problem = f"{manoeuvre!r} is not a manoeuvre of a poster"
            raise InputError("figures", "", problem, f"there are: {', '.join(POSTER_MANOEUVRES)}")
        given += parse_figures(manoeuvre, text)
    return GuessResult(guess_ship(ship, given, name, members, seed))
