"""Ships: a card and its model, with everything that can be asked of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

import numpy as np

from tank2sim.api.ensemble import EnsembleOptions
from tank2sim.arrays import Array
from tank2sim.bundled import bundled_cards
from tank2sim.cards import Card, ManoeuvringCard, parse_card, read_card
from tank2sim.cards.reading import changed_text
from tank2sim.errors import InputError
from tank2sim.executors import PROCESSES
from tank2sim.files import write_together
from tank2sim.units import to_si

if TYPE_CHECKING:
    import control
    import pandas as pd

    from tank2sim.api.fmu import ExportResult
    from tank2sim.api.manoeuvre import ManoeuvreResult
    from tank2sim.api.stability import StabilityResult
    from tank2sim.dynamics.model import Model
    from tank2sim.simulation.manoeuvres import Manoeuvre


class SimulationOptions(TypedDict, total=False):
    """Options of every simulated manoeuvre; see :meth:`Ship.simulate`."""

    duration_s: float | None
    members: int
    seed: int
    executor: str


class Ship:
    """A ship (or another body) as its card describes it.

    Angles are in degrees, speeds in m/s, revolutions in rpm, times in s; rudder, drift and turns are positive to
    starboard. :func:`load` gives one; a card that was identified or reduced has one, too.

    Parameters
    ----------
    card : Card
        What is known of the ship, SI and radians.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> ship = t2s.load("mariner")
    >>> round(ship.turn(35).figures["tactical_diameter_lengths"], 1)
    6.4
    """

    def __init__(self, card: Card) -> None:
        self.card = card

    @property
    def name(self) -> str:
        """Name of the ship."""
        return self.card.ship.name

    @property
    def source(self) -> str:
        """Where the numbers of the card are from."""
        return self.card.ship.source

    @cached_property
    def model(self) -> Model:
        """The equations of motion in CasADi: states, inputs, outputs and parameters with units; SI and radians.

        Raises
        ------
        InputError
            The card names what its model does not have.
        """
        from tank2sim.dynamics import build

        return build(self.card)

    @property
    def derivatives(self) -> pd.DataFrame:
        """Hydrodynamic derivatives: prime value and standard error by name, rudder positive to starboard.

        Raises
        ------
        InputError
            The card is not one of a ship that manoeuvres.
        """
        import pandas as pd

        card = self.manoeuvring()
        rows = [(name, value, card.standard_error(name)) for name, value in card.derivatives.items()]
        return pd.DataFrame(rows, columns=["name", "value", "standard_error"]).set_index("name")

    def manoeuvring(self) -> ManoeuvringCard:
        """The card, if it is one of a ship that manoeuvres in the horizontal plane.

        Raises
        ------
        InputError
            It is not: a towed body, a yaw rig or a glider.
        """
        if not isinstance(self.card, ManoeuvringCard):
            remedy = "give a linear or abkowitz card"
            raise InputError(self.card.source, "model.kind", "is not that of a ship that manoeuvres", remedy)
        return self.card

    def replace(self, values: Mapping[str, object]) -> Ship:
        """The ship with other values on its card, by dotted key: ``{"derivatives.Yv": -0.012}``.

        Raises
        ------
        InputError
            The card has no such key, or the value is out of its bounds.
        """
        return Ship(parse_card(changed_text(self.card.text, self.card.source, values), self.card.source))

    def save(self, path: str | Path) -> None:
        """Write the card's TOML to a file, whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        write_together({Path(path): self.card.text})

    def turn(self, rudder_deg: float = 35.0, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a turning circle: the rudder is put over at t = 0 and held for 540 deg of heading.

        Options are those of :meth:`simulate`.
        """
        return self.simulate(f"turn:{rudder_deg:.10g}", **options)

    def zigzag(
        self, rudder_deg: float = 10.0, heading_deg: float = 10.0, **options: Unpack[SimulationOptions]
    ) -> ManoeuvreResult:
        """Simulate a zigzag: the rudder (negative begins to port) is reversed at each `heading_deg` off the course.

        Options are those of :meth:`simulate`.
        """
        return self.simulate(f"zigzag:{rudder_deg:.10g}/{heading_deg:.10g}", **options)

    def pullout(self, rudder_deg: float = 20.0, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a pull-out: a steady turn with `rudder_deg`, then the neutral rudder. Options: :meth:`simulate`."""
        return self.simulate(f"pullout:{rudder_deg:.10g}", **options)

    def spiral(self, rudder_deg: float = 20.0, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a direct (Dieudonne) spiral, from `rudder_deg` to the other side and back.

        Options are those of :meth:`simulate`.
        """
        return self.simulate(f"spiral:{rudder_deg:.10g}", **options)

    def stop(self, revolutions_rpm: float | None = None, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a stop with revolutions astern (rpm, negative or 0), by default full astern.

        Options are those of :meth:`simulate`.
        """
        return self.simulate("stop" if revolutions_rpm is None else f"stop:{revolutions_rpm:.10g}", **options)

    def steer(
        self,
        orders: pd.DataFrame | Mapping[str, Sequence[float]] | str | Path,
        **options: Unpack[SimulationOptions],
    ) -> ManoeuvreResult:
        """Simulate orders over time.

        Parameters
        ----------
        orders : DataFrame, mapping or path
            Columns (n,) ``t_s`` (from 0), ``delta_order_deg`` and, with propulsion, ``n_rpm``; each order holds until
            the next. A path is that of a CSV file.
        options
            Those of :meth:`simulate`.

        Raises
        ------
        InputError
            A column is missing, unknown or out of order.
        """
        from tank2sim.simulation.manoeuvres import orders_from_columns, read_orders

        if isinstance(orders, str | Path):
            return self.simulate(read_orders(Path(orders)), **options)
        columns: dict[str, Array] = {}
        for name in orders:
            si_name, factor = to_si(str(name), 1.0)
            columns[si_name] = factor * np.asarray(orders[name], dtype=float)
        return self.simulate(orders_from_columns(columns, "orders"), **options)

    def simulate(
        self,
        manoeuvre: str | Manoeuvre,
        *,
        duration_s: float | None = None,
        members: int = 0,
        seed: int = 0,
        executor: str = PROCESSES,
    ) -> ManoeuvreResult:
        """Simulate a manoeuvre in the words of the command line: ``"zigzag:20/20"``, ``"turn:-35"``, ``"stop"``.

        Parameters
        ----------
        manoeuvre : str or Manoeuvre
            Angles of a text in degrees; an object of :mod:`tank2sim.simulation.manoeuvres` has radians.
        duration_s : float, optional
            By default as long as the manoeuvre needs.
        members : int
            Size of an ensemble drawn from the standard errors of the card, for bands of 5, 50 and 95 %; 0 for none.
        seed : int
            Of the ensemble.
        executor : str
            Who computes the ensemble: ``processes`` or ``dask://host:port``.

        Raises
        ------
        InputError
            The text is not a manoeuvre, the card is not one of a ship with a rudder, or the motion leaves all bounds.
        """
        from tank2sim.api.manoeuvre import simulate_manoeuvre
        from tank2sim.simulation.manoeuvres import parse_manoeuvre

        parsed = parse_manoeuvre(manoeuvre) if isinstance(manoeuvre, str) else manoeuvre
        words = manoeuvre if isinstance(manoeuvre, str) else manoeuvre.words
        return simulate_manoeuvre(self, parsed, words, duration_s, EnsembleOptions(members, seed, executor))

    def stability(
        self,
        speed_mps: float | None = None,
        *,
        spirals: bool = True,
        members: int = 0,
        seed: int = 0,
        executor: str = PROCESSES,
    ) -> StabilityResult:
        """Straight-line stability, steady turning and the IMO criteria.

        Parameters
        ----------
        speed_mps : float, optional
            Of the straight course; by default the speed of the card.
        spirals : bool
            Simulate the spirals on the steady-turning diagram.
        members, seed, executor
            As in :meth:`simulate`.

        Raises
        ------
        InputError
            The ship holds no straight course.
        """
        from tank2sim.api.stability import judge_stability

        return judge_stability(self, speed_mps, spirals=spirals, ensemble=EnsembleOptions(members, seed, executor))

    def state_space(
        self,
        speed_mps: float | None = None,
        *,
        states: Iterable[str] | None = None,
        inputs: Iterable[str] | None = None,
        outputs: Iterable[str] | None = None,
    ) -> control.StateSpace:
        """The linearised model on a straight course as ``control.StateSpace``, its signals named as in the model.

        Parameters
        ----------
        speed_mps : float, optional
            By default the speed of the card.
        states, inputs, outputs : names, optional
            Of the model (``motion.r``, ``rudder.command``); by default all of them. SI and radians.

        Raises
        ------
        InputError
            The ship holds no straight course, or has no such signal.
        """
        from tank2sim.analysis.linearisation import state_space, straight_course

        point = straight_course(self.model, speed_mps)
        names = [None if given is None else list(given) for given in (states, inputs, outputs)]
        return state_space(self.model, point, states=names[0], inputs=names[1], outputs=names[2])

    def to_fmu(self, path: str | Path, *, fmi: int = 3, platforms: str = "host") -> ExportResult:
        """Write the FMU (Model Exchange and Co-Simulation).

        Parameters
        ----------
        path : path
        fmi : int
            2 or 3.
        platforms : str
            ``host``, ``all``, or names of FMI 3 with commas between (``x86_64-linux,x86_64-windows``).

        Raises
        ------
        InputError
            There is no compiler, or the file cannot be written.
        """
        from tank2sim.api.fmu import make_fmu_file

        made = make_fmu_file(self, Path(path), fmi=fmi, platforms=platforms)
        write_together(made.files, inputs=[Path(self.card.source)])
        return made

    def __repr__(self) -> str:
        particulars = [f"{self.card.model.kind} model"]
        if isinstance(self.card, ManoeuvringCard):
            particulars += [f"L = {self.card.ship.length_m:g} m", f"u0 = {self.card.model.speed_mps:.4g} m/s"]
            particulars += [f"{len(self.card.derivatives)} derivatives"]
            particulars += (
                [f"effects: {', '.join(effect.name for effect in self.card.effects)}"] if self.card.effects else []
            )
        return f"{self.name} ({', '.join(particulars)}); {self.card.source}"


def load(card: str | Path, values: Mapping[str, object] | None = None) -> Ship:
    """Read a ship from its card.

    Parameters
    ----------
    card : str or path
        Name of a bundled ship (:func:`ships`), or the TOML file of a card.
    values : mapping, optional
        Values in place of the card's, by dotted key: ``{"derivatives.Yv": -0.012}``.

    Raises
    ------
    InputError
        The file is missing or at fault, or the card has no such key.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.load("mariner").name
    'Mariner class'
    """
    return Ship(read_card(card, dict(values or {})))


def as_ship(card: Ship | Card | str | Path) -> Ship:
    """A ship, whatever names it: a ship itself, its card, a bundled ship's name or a file. Raises as :func:`load`."""
    if isinstance(card, Ship):
        return card
    return Ship(card) if isinstance(card, Card) else load(card)


def ships() -> pd.DataFrame:
    """The bundled ships: name (index) as :func:`load` takes it, title, kind of model, length (m) and source.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> "mariner" in t2s.ships().index
    True
    """
    import pandas as pd

    rows = []
    for name, path in bundled_cards().items():
        card = read_card(path)
        rows.append((name, card.ship.name, card.model.kind, card.ship.length_m, card.ship.source))
    return pd.DataFrame(rows, columns=["name", "ship", "model", "length_m", "source"]).set_index("name")
