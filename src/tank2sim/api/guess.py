"""A ship guessed from dimensions and the figures of a wheelhouse poster."""

from __future__ import annotations

from collections.abc import Mapping

from tank2sim.analysis.guess.conditioning import LEAST_MEMBERS, POSTER_MANOEUVRES
from tank2sim.analysis.guess.prior import ShipDimensions
from tank2sim.analysis.guess.study import guess_ship, parse_figures
from tank2sim.api.bounds import GuessedShips, PositiveArgument, Seed, checked
from tank2sim.arguments import DEFAULT_MEMBERS
from tank2sim.errors import InputError
from tank2sim.memory import refuse_beyond_memory
from tank2sim.results.guess import GuessResult

_BYTES = 15_000
"""Bytes of a ship of the prior, measured: 14 kB."""


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
    study, card = guess_ship(ship, given, name, members, seed)
    return GuessResult(study, card)
