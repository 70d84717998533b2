"""Ships: a card and its model, with everything that can be asked of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack

import numpy as np

from tank2sim.api.autopilot import autopilot
from tank2sim.api.influence import find_influence, tune_ship
from tank2sim.api.manoeuvre import simulate_manoeuvre
from tank2sim.api.stability import judge_stability
from tank2sim.apps.bridge.command import make_pilot_card, make_poster
from tank2sim.apps.rigs.glider.command import glide
from tank2sim.apps.steering.command import make_steering_page
from tank2sim.apps.steering_cards.tuning_command import tune_ship_through
from tank2sim.arguments import (
    EnsembleSize,
    Seed,
    checked,
)
from tank2sim.arrays import Array
from tank2sim.cards import read_card
from tank2sim.dynamics.vessel import Vessel
from tank2sim.errors import InputError, close_name
from tank2sim.files import FMU, refuse_other_ending, write_together
from tank2sim.quantities import Breadth, Revolutions, SlantAngle, Speed
from tank2sim.units import to_si

if TYPE_CHECKING:
    import control
    import pandas as pd

    from tank2sim.results.fmu import ExportResult
    from tank2sim.results.manoeuvre import ManoeuvreResult


class SimulationOptions(TypedDict, total=False):
    """Options of every simulated manoeuvre; see :meth:`Ship.simulate`."""

    duration_s: float | None
    members: EnsembleSize
    seed: Seed
    executor: str


class Ship(Vessel):
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

    @checked
    def with_waves(
        self,
        mesh: str | Path,
        *,
        metacentric_height_m: Breadth | None = None,
        roll_gyradius_m: Breadth | None = None,
        roll_damping: float | None = None,
        frequencies_radps: Sequence[float] | None = None,
        directions_deg: Sequence[float] | None = None,
    ) -> Ship:
        """The ship with ``[waves]`` on its card, its motions and mean drift in waves, which the effect `waves` needs.

        Computed from the mesh of its hull by potential flow, at rest in deep water (the extra ``tank2sim[waves]``). The
        radius of gyration in pitch follows from the card's yaw inertia.

        Parameters
        ----------
        mesh : str or path
            Hull in m, at the size of the ship: x forward of midships, y to port, z above the waterline, normals into
            the water (``gdf``, ``stl`` and others).
        metacentric_height_m : float, optional
            By default as on the card.
        roll_gyradius_m : float, optional
            Radius of gyration in roll; by default 0.375 of the beam.
        roll_damping : float, optional
            Damping of roll over the critical one, in addition to that by waves; by default 0.05.
        frequencies_radps : sequence of float, optional
            Rising; by default 24, from waves of 12 L to L/8 or as short as the mesh can show.
        directions_deg : sequence of float, optional
            From 0 (head waves) to 180 in equal steps; by default every 15.

        Raises
        ------
        InputError
            Capytaine is not installed, the mesh cannot be read or is of another size, or metacentric height or beam is
            not known.
        """
        from tank2sim.analysis.wave_response import card_in_waves, hull_of

        card = self.manoeuvring()
        stated = {
            "metacentric_height_m": metacentric_height_m,
            "roll_gyradius_m": roll_gyradius_m,
            "roll_damping": roll_damping,
            "frequencies_radps": frequencies_radps,
            "directions_deg": directions_deg,
        }
        given = {name: value for name, value in stated.items() if value is not None}
        return Ship(card_in_waves(card, mesh, hull_of(card, given)))

    @checked
    def turn(self, rudder_deg: SlantAngle = 35.0, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a turning circle: the rudder is put over at t = 0 and held for 540 deg of heading.

        Options as for :meth:`simulate`.
        """
        return self.simulate(f"turn:{rudder_deg:.10g}", **options)

    @checked
    def zigzag(
        self, rudder_deg: SlantAngle = 10.0, heading_deg: SlantAngle = 10.0, **options: Unpack[SimulationOptions]
    ) -> ManoeuvreResult:
        """Simulate a zigzag: the rudder (negative begins to port) is reversed at each `heading_deg` off the course.

        Options as for :meth:`simulate`.
        """
        return self.simulate(f"zigzag:{rudder_deg:.10g}/{heading_deg:.10g}", **options)

    @checked
    def pullout(self, rudder_deg: SlantAngle = 20.0, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a pull-out: a steady turn with `rudder_deg`, then the neutral rudder. Options: :meth:`simulate`."""
        return self.simulate(f"pullout:{rudder_deg:.10g}", **options)

    @checked
    def spiral(self, rudder_deg: SlantAngle = 20.0, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a direct (Dieudonne) spiral, from `rudder_deg` to the other side and back.

        Options as for :meth:`simulate`.
        """
        return self.simulate(f"spiral:{rudder_deg:.10g}", **options)

    @checked
    def stop(self, revolutions_rpm: Revolutions | None = None, **options: Unpack[SimulationOptions]) -> ManoeuvreResult:
        """Simulate a stop with revolutions astern (rpm, negative or 0), by default full astern.

        Options as for :meth:`simulate`.
        """
        return self.simulate("stop" if revolutions_rpm is None else f"stop:{revolutions_rpm:.10g}", **options)

    @checked
    def steer(
        self,
        orders: pd.DataFrame | Mapping[str, Sequence[Any]] | str | Path,
        **options: Unpack[SimulationOptions],
    ) -> ManoeuvreResult:
        """Simulate orders over time.

        Parameters
        ----------
        orders : DataFrame, mapping or path
            Columns (n,) ``t_s`` (from 0), ``delta_order_deg`` and, with propulsion, ``n_rpm``; each order holds until
            the next. A path names a CSV file.
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
        if not hasattr(orders, "keys"):
            problem = f"is of the type {type(orders).__name__}"
            raise InputError("orders", "", problem, "give a data frame, a mapping of columns or a file")
        columns: dict[str, Array] = {}
        for name in orders:
            si_name, factor = to_si(str(name), 1.0)
            if si_name in columns:
                raise InputError("orders", f"column {name}", "is given twice", "give each order once")
            try:
                columns[si_name] = factor * np.asarray(orders[name], dtype=float)
            except (TypeError, ValueError):
                raise InputError(
                    "orders", f"column {name}", "holds something else than numbers", "give numbers"
                ) from None
        if len({values.shape for values in columns.values()}) > 1 or any(each.ndim != 1 for each in columns.values()):
            raise InputError("orders", "", "has columns of different lengths", "give an order for each time")
        return self.simulate(orders_from_columns(columns, "orders"), **options)

    simulate = simulate_manoeuvre

    stability = judge_stability

    @checked
    def state_space(
        self,
        speed_mps: Speed | None = None,
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
            Of the model (``motion.r``, ``rudder.command``); by default all of them. SI and radians. States that are
            left out follow the others at once: without ``rudder.angle`` the rudder is where it is ordered. A state may
            be an input.

        Raises
        ------
        InputError
            The ship holds no straight course, a signal is unknown, or a state that is left out comes to no rest.
        """
        from tank2sim.analysis.linearisation import following_states, state_space, straight_course

        model = self.model
        point = straight_course(model, speed_mps)
        kept, given, shown = (None if names is None else list(names) for names in (states, inputs, outputs))
        known = (*model.state_names, *model.input_names, *model.outputs)
        for argument, names in (("inputs", given), ("outputs", shown)):
            for name in names or ():
                if name not in model:
                    raise InputError(argument, name, "is not a variable of the model", close_name(name, known))
        settled = () if kept is None else following_states(model, point, kept, given or ())
        return state_space(model, point, states=kept, inputs=given, outputs=shown, settled=settled)

    influence = find_influence
    tune = tune_ship
    tune_through = tune_ship_through
    autopilot = autopilot
    glide = glide
    poster = make_poster
    pilot_card = make_pilot_card
    steering_page = make_steering_page

    @checked
    def to_fmu(
        self,
        path: str | Path,
        *,
        fmi: Literal[2, 3] = 2,
        platforms: str = "host",
        sources: bool = True,
        osp: bool = False,
        lean: bool = False,
    ) -> ExportResult:
        """Write the FMU (Model Exchange and Co-Simulation).

        Parameters
        ----------
        path : path
        fmi : int
            2 or 3.
        platforms : str
            ``host``, ``all``, or names of FMI 3 with commas between (``x86_64-linux,x86_64-windows``).
        sources : bool
            False: without C sources, ship card and coefficients, which are then constants of the library.
        osp : bool
            Also write ``OspSystemStructure.xml`` and the OSP model description next to the FMU, for the Open Simulation
            Platform.
        lean : bool
            With few variables, for game engines.

        Raises
        ------
        InputError
            No compiler is found, or the file cannot be written, or its name ends as another kind of file's.
        """
        from tank2sim.api.fmu import make_fmu_file

        refuse_other_ending(Path(path), FMU)

        made = make_fmu_file(self, Path(path), fmi=fmi, platforms=platforms, sources=sources, osp=osp, lean=lean)
        write_together(made.files, inputs=[Path(self.card.source)])
        return made


@checked
def load(card: str | Path, values: Mapping[str, object] | None = None) -> Ship:
    """Read a ship from its card.

    Parameters
    ----------
    card : str or path
        Name of a bundled ship (:func:`ships`), or the TOML file of a card.
    values : mapping, optional
        Values in place of the card's, by dotted key, in its scaling and signs: ``{"derivatives.Yv": -0.012}``.

    Raises
    ------
    InputError
        The file is missing or at fault, or the card does not have a key.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> t2s.load("mariner").name
    'Mariner class'
    """
    return Ship(read_card(card, dict(values or {})))


def ships() -> pd.DataFrame:
    """The bundled ships: name (index) as :func:`load` takes it, title, kind of model, length (m) and source.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> "mariner" in t2s.ships().index
    True
    """
    from tank2sim.api.bundled_ships import list_ships

    return list_ships().df
