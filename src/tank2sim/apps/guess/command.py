"""A ship guessed from dimensions and the figures of a wheelhouse poster."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tank2sim.api.verbs import Output, verb
from tank2sim.arguments import DEFAULT_MEMBERS, GuessedShips, Seed
from tank2sim.files import CARD
from tank2sim.quantities import BlockCoefficient, Breadth, Draught, Length, SpeedKnots

if TYPE_CHECKING:
    from tank2sim.apps.guess.result import GuessResult

_BYTES = 15_000
"""Bytes of a ship of the prior, measured: 14 kB."""


@verb(
    "a ship from dimensions and the figures of a wheelhouse poster",
    Output(
        "-o", CARD, "Write the card, with its covariance.", lambda result, path: result.card.files(path), "CARD.toml"
    ),
    results=("tank2sim.apps.guess.result:GuessResult",),
)
def guess(
    *,
    length_m: Length,
    beam_m: Breadth,
    draught_m: Draught,
    block: BlockCoefficient,
    speed_kn: SpeedKnots,
    turn35: str | None = None,
    zigzag10: str | None = None,
    zigzag20: str | None = None,
    name: str = "guessed ship",
    members: GuessedShips = DEFAULT_MEMBERS,
    seed: Seed = 0,
) -> GuessResult:
    """Guess a ship from its main dimensions and figures of its manoeuvres.

    A prior over ships, from published regressions and the bundled ships, is moved to the figures by simulation. The
    card has the errors that are left, next to it lies their covariance.

    Parameters
    ----------
    length_m : float
        Length between perpendiculars, m. Below 20 m it is taken for a model of a ship.
    beam_m : float
        Moulded beam, m.
    draught_m : float
        Mean draught, m.
    block : float
        Block coefficient.
    speed_kn : float
        Speed at which the manoeuvres begin, knots.
    turn35 : str, optional
        Figures of a turn at 35 deg of rudder: ``"advance_m=970 transfer_m=400 tactical_diameter_m=980+-30"``, each if
        known, with its standard error after ``+-``.
    zigzag10 : str, optional
        Overshoots of a 10/10 zigzag: ``"overshoot_1_deg=9.4 overshoot_2_deg=15"``.
    zigzag20 : str, optional
        Overshoots of a 20/20 zigzag: ``"overshoot_1_deg=14"``.
    name : str
        Name of the ship on the card.
    members : int
        Ships of the prior.
    seed : int
        Seed of the prior: the same seed gives the same ships.

    Raises
    ------
    InputError
        A number is not one of a ship or model, figures are impossible or contradict each other, or there is no C
        compiler.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> dimensions = dict(length_m=320, beam_m=58, draught_m=20.8, block=0.81, speed_kn=15.5)
    >>> found = t2s.guess(**dimensions, turn35="advance_m=970 tactical_diameter_m=980", members=200)
    >>> bool(found.figures.loc["tactical_diameter_m@35", "p5"] < 980)
    True
    """
    from tank2sim.apps.guess.prior import ShipDimensions
    from tank2sim.apps.guess.result import GuessResult
    from tank2sim.apps.guess.study import guess_ship, parse_figures
    from tank2sim.memory import refuse_beyond_memory

    refuse_beyond_memory("members", members, _BYTES)
    ship = ShipDimensions(length_m=length_m, beam_m=beam_m, draught_m=draught_m, block=block, speed_kn=speed_kn)
    stated = {"turn35": turn35, "zigzag10": zigzag10, "zigzag20": zigzag20}
    given = [
        figure for manoeuvre, text in stated.items() if text is not None for figure in parse_figures(manoeuvre, text)
    ]
    study, card = guess_ship(ship, given, name, members, seed)
    return GuessResult(study, card)
