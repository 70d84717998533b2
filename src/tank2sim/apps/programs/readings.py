"""Readings of a table of derivatives with unstated conventions, and how probable each is.

A reading is a scaling, a sign of the rudder, whether the terms in yaw rate hold the inertia of the ship, and the
origin. It turns the printed numbers t into the derivatives theta of a ship about midships, in the prime system, without
inertia and with the rudder to starboard. Its weight is p(reading) p(t | reading), with densities taken from ships:

- linear and acceleration derivatives about the regressions of Clarke, Gedling and Hine (1983), with p(t) =
  p(theta) |d theta/d t|; mass and yaw inertia about displacement and 0.25 L; rudder forces about the forces of the
  rudder that the rules ask for;
- the heading after one ship's length by unit of rudder, Norrbin's P, and the growth of an unstable course;
- where the table has surge too, the tactical diameter at 35 deg;
- a term that a reading makes vanish to the printed digits: a wrong one does so only by chance.

By which speed the numbers are scaled, that of the ship at any time or u0, is not part of a reading: linear terms are
the same. It shows in the terms by Du' (:func:`scaled_with_nominal_speed`).

Densities have heavy tails (Student's t, 4 degrees of freedom), so that no single number decides.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import tomlkit
from scipy.linalg import expm
from scipy.stats import t as student

from tank2sim.apps.guess.prior import rudder_by_rules
from tank2sim.apps.programs.conventions import shift_matrix, shifted_body
from tank2sim.apps.programs.program_files import to_digits
from tank2sim.cards.card import ManoeuvringCard, scales_of_file
from tank2sim.cards.coefficient_table import STATED_CONVENTIONS, CoefficientTable
from tank2sim.cards.estimates import Particulars, estimate
from tank2sim.cards.form import RigidBody, ShipModel, ShipSection
from tank2sim.cards.reading import parse_card
from tank2sim.cards.scaling import FileScales, file_factor
from tank2sim.cards.terms import known_term
from tank2sim.dynamics.build import build
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

PRIOR: Mapping[str, Mapping[str, float]] = {
    "rudder_sign": {"starboard": 0.5, "port": 0.5},
    "scaling": {"prime": 0.5, "prime_ii": 0.25, "bis": 0.1, "dimensional": 0.15},
    "yaw_rate_terms": {"hydrodynamic": 0.5, "total": 0.5},
    "origin": {"midships": 0.7, "centre_of_gravity": 0.3},
}
"""How often tables are printed so, before a number is looked at. Project choices."""

_TAIL = 4.0

_MASS_ERROR = 0.05
"""Relative difference of a printed mass from the displacement: rounded dimensions. Project choice."""
_ASSUMED_ERRORS, _ASSUMED_MASS_ERROR = 2.0, 0.3
"""Factor on the errors of estimates where beam or draught are assumed, and relative error of a mass by assumed sizes.
Project choices: (T/L)^2 of ships varies by a factor of two either way."""
_CENTRE_ERROR = 0.02
"""Standard deviation of x_G over L among ships. Project choice: 0.035 is the most of those bundled."""
_P_MEDIAN, _P_SPREAD = 0.35, 0.5
"""Norrbin's P of ships: median and standard deviation of its logarithm; 0.3 is his limit for a good ship, 0.2 for large
tankers (Norrbin 1965, as in Lewis (ed.), Principles of Naval Architecture III, 1989, IX). The spread is a project
choice."""
_GROWTH = 0.3
"""Scale of the growth of an unstable course, by U/L: full tankers reach about 0.3. Project choice."""
_DIAMETER, _DIAMETER_SPREAD = 3.3, 0.35
"""Median of the tactical diameter at 35 deg over L, and standard deviation of its logarithm: 5 is IMO's limit, and
ships have 2 to 5 (project choice)."""
_WRONG_SIDE = -12.0
"""Log weight of a ship that turns against its rudder, or not at all. Project choice: one in 160 000."""
_VANISHES = 2e-3
"""Share of its parts below which a term has vanished: tables print three digits. Project choice."""
_CHANCE = 0.02
"""Probability that a wrong reading makes a given term vanish so. Project choice: some parts are alike by nature."""
_MOST_VANISHED = 3

_FAR = 2.5
"""Standard deviations from which a tactical diameter speaks against a reading. Project choice."""
_RUDDER_ERROR, _LEVER, _LEVER_ERROR = 0.6, 0.45, 0.1
"""Rudder's sway force: standard deviation of its logarithm about the force of a rudder by the rules. Its moment: lever
over L, 0.34 to 0.50 on the bundled ships, and standard deviation. Project choices."""


@dataclass(frozen=True)
class Reading:
    """Conventions by which a table may be read."""

    # `rudder_sign`, `scaling`, `yaw_rate_terms`, `origin`: One each of :data:`.STATED_CONVENTIONS`
    rudder_sign: str
    scaling: str
    yaw_rate_terms: str
    origin: str


@dataclass(frozen=True)
class ReadShip:
    """A ship as a reading of a table has it: prime system, midships, without inertia, rudder to starboard."""

    derivatives: Mapping[str, float]  # Name to value
    body: RigidBody
    vanished: tuple[str, ...]  # Derivatives that became zero to the printed digits


@dataclass(frozen=True)
class RankedReading:
    """A reading with its ship and its probability."""

    reading: Reading
    ship: ReadShip
    weight: float  # Natural logarithm of prior times density of the table
    probability: float  # Among all readings
    criterion: float  # C' of straight-line stability, positive if stable
    # Norrbin's P: heading by rudder after one ship's length, positive if it turns to the side of the rudder; None
    # without rudder forces
    turning_index: float | None
    against: tuple[str, ...]  # What speaks against it, the strongest first


def possible_readings(table: CoefficientTable) -> list[Reading]:
    """Every reading that the table leaves open.

    Where the centre of gravity is midships, or nothing is known of it, there is one origin; without a term by an odd
    power of the rudder one sign of it.
    """
    choices = {
        key: (table.conventions[key],) if key in table.conventions else values
        for key, values in STATED_CONVENTIONS.items()
    }
    if not table.centre_of_gravity_m and not table.body.get("x_G"):
        choices["origin"] = (table.conventions.get("origin", "midships"),)
    if not any(known_term(name).d % 2 for name in table.derivatives):
        choices["rudder_sign"] = (table.conventions.get("rudder_sign", "starboard"),)
    return [Reading(*values) for values in itertools.product(*choices.values())]


# Coefficients of Du', Du'^2 over the term's own, of a force that goes with u v, u r, u^2 delta, scaled with u0
_SIGNATURE = {"v": (1.0,), "r": (1.0,), "d": (2.0, 1.0)}

_LEAST_SIGNATURE = 3
"""Shares from which the scale is judged. Project choice: one or two may agree by chance."""
_SAME_SHARE = 0.02
"""Project choice: by how much a share may differ from one where terms are printed to two digits or more."""


def scaled_with_nominal_speed(table: CoefficientTable) -> bool | None:
    """Whether terms by Du' belong to numbers scaled with u0; None where too few are given.

    A lift goes with u v, u r and u^2 delta. Scaled with u0, so that u = u0 (1 + Du'), this is Y_vu = Y_v, Y_ru = Y_r,
    Y_du = 2 Y_d, Y_duu = Y_d, N alike; scaled with the speed at any time, all of these are about zero.
    """
    known = table.derivatives
    shares = [
        known[f"{force}{letter}{'u' * power}"] / (share * known[f"{force}{letter}"])
        for force in "YN"
        for letter, expected in _SIGNATURE.items()
        for power, share in enumerate(expected, start=1)
        if known.get(f"{force}{letter}") and f"{force}{letter}{'u' * power}" in known
    ]
    if len(shares) < _LEAST_SIGNATURE:
        return None
    return sum(abs(share - 1) < _SAME_SHARE for share in shares) > len(shares) / 2


def _speed_scale(table: CoefficientTable) -> str:
    """As the file states it, else by its terms."""
    return table.speed_scale or ("nominal" if scaled_with_nominal_speed(table) else "instantaneous")


def file_scales(table: CoefficientTable, scaling: str) -> FileScales | None:
    """System of the table's numbers by a scaling; None for the prime system."""
    ship = ShipSection(
        name="table",
        source=table.source,
        length_m=table.length_m,
        draught_m=table.draught_m,
        displacement_kg=table.displacement_kg,
    )
    model = ShipModel(
        kind="abkowitz",
        speed_mps=table.speed_mps,
        scaling=scaling,  # type: ignore[arg-type]
        speed_scale="instantaneous",
        yaw_rate_terms="hydrodynamic",
        rudder_sign="starboard",
    )
    return scales_of_file(ship, table.environment, model)


def read_as(table: CoefficientTable, reading: Reading) -> ReadShip:
    """The ship that the table is by a reading.

    Hydrodynamic terms from total ones: Y_r + m', N_r + m' x_G', X_vr - m', X_rr - m' x_G', with x_G of the table's
    origin, and scaled with u0 Y_ru + m', N_ru + m' x_G'; those of X only where the table has terms in v or r of X. Then
    the origin is moved to midships.
    """
    scales = file_scales(table, reading.scaling)
    to_port = reading.rudder_sign == "port"
    numbers = {
        name: value / file_factor(known_term(name), scales, rudder_to_port=to_port)
        for name, value in table.derivatives.items()
    }
    centre = _centre_of_gravity(table, scales)
    about_centre = reading.origin == "centre_of_gravity"
    body = _body(table, scales, centre, about_centre)
    inertial = _inertial_terms(table, body) if reading.yaw_rate_terms == "total" else {}
    names = tuple(dict.fromkeys([*numbers, *(name for name, value in inertial.items() if value)]))
    printed, added = (np.array([source.get(name, 0.0) for name in names]) for source in (numbers, inertial))
    ahead = -centre if about_centre else 0.0
    every, matrix = shift_matrix(names, ahead)
    values = matrix @ (printed + added)
    parts = np.abs(matrix) @ (np.abs(printed) + np.abs(added))
    changed = np.abs(values - np.array([numbers.get(name, 0.0) for name in every])) > 0.2 * parts
    vanished = tuple(
        name
        for name, value, part, other in zip(every, values, parts, changed, strict=True)
        if part > 0 and other and abs(value) < _VANISHES * part
    )
    derivatives = dict(zip(every, values.tolist(), strict=True))
    return ReadShip(derivatives, shifted_body(body, ahead) if about_centre else body, vanished)


def _inertial_terms(table: CoefficientTable, body: RigidBody) -> dict[str, float]:
    """Forces of the rigid body (prime) that total terms hold, with the signs that take them out."""
    mass, moment = body.mass, body.mass * body.x_G
    found = {"Yr": mass, "Nr": moment}
    if _speed_scale(table) == "nominal":  # m u r is m (1 + Du') r'
        found |= {"Yru": mass, "Nru": moment}
    terms = map(known_term, table.derivatives)
    if any(term.force == "X" and term.v + term.r > 0 for term in terms):
        found |= {"Xvr": -mass, "Xrr": -moment}
    return found


def _centre_of_gravity(table: CoefficientTable, scales: FileScales | None) -> float:
    """x_G' forward of midships."""
    if table.centre_of_gravity_m is not None:
        return table.centre_of_gravity_m / table.length_m
    return table.body.get("x_G", 0.0) / (scales.length if scales else 1.0)


def _body(table: CoefficientTable, scales: FileScales | None, centre: float, about_centre: bool) -> RigidBody:
    """Mass, inertia and x_G about the table's origin; what is not printed by displacement and 0.25 L."""
    of_mass, of_inertia = (scales.mass, scales.inertia) if scales else (1.0, 1.0)
    mass = table.body["mass"] / of_mass if table.body.get("mass", 0.0) > 0 else _mass(table)
    x_G = 0.0 if about_centre else centre
    inertia = table.body.get("yaw_inertia", 0.0) / of_inertia
    return RigidBody(mass=mass, yaw_inertia=inertia if inertia > 0 else mass * (0.25**2 + x_G**2), x_G=x_G)


def _log_density(z: float) -> float:
    return float(student.logpdf(z, _TAIL))


@dataclass
class _Evidence:
    """Log weights by what they are from, and what speaks against the reading."""

    total: float
    against: list[tuple[float, str]] = field(default_factory=list)

    def add(self, weight: float, expected: float, words: str) -> None:
        """Add a log weight; `words` speak against the reading where it is below what is `expected` by 3 or more."""
        self.total += weight
        if weight < expected - 3.0:
            self.against.append((expected - weight, words))

    def compare(self, z: float, words: str) -> None:
        """Add the density of a number `z` standard deviations from what ships have."""
        self.add(_log_density(z), _log_density(0), words)


def weigh(table: CoefficientTable, reading: Reading) -> RankedReading:
    """A reading with the log of its weight; its probability, which takes all readings, is 0 yet."""
    ship = read_as(table, reading)
    found = _Evidence(math.fsum(math.log(PRIOR[key][value]) for key, value in vars(reading).items()))
    _weigh_coefficients(found, table, reading, ship)
    full = _filled(table, ship)
    criterion, growth, index = linear_figures(full, ship.body)
    found.add(-0.5 * (max(0.0, growth) / _GROWTH) ** 2 if growth < 3 else -50.0, 0.0, f"grows with {growth:.2g} U/L")
    if index is not None:
        if index <= 0:
            found.add(_WRONG_SIDE, 0.0, "turns against the rudder")
        else:
            z = math.log(index / _P_MEDIAN) / _P_SPREAD
            found.add(max(_log_density(z), _WRONG_SIDE), _log_density(0), f"turns by P = {index:.2g}")
    count = min(len(ship.vanished), _MOST_VANISHED)
    found.total -= count * math.log(_CHANCE)
    against = tuple(words for _, words in sorted(found.against, reverse=True))
    return RankedReading(reading, ship, found.total, 0.0, criterion, index, against)


def _weigh_coefficients(found: _Evidence, table: CoefficientTable, reading: Reading, ship: ReadShip) -> None:
    scales = file_scales(table, reading.scaling)
    expected = estimate(
        _particulars(table, ship), ["Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot", "Yv", "Yr", "Nv", "Nr"]
    )
    for name, about in expected.items():
        if name not in table.derivatives:
            continue
        value, error = ship.derivatives.get(name, 0.0), about.standard_error
        if {"beam_m", "draught_m"} & set(table.assumed):
            error *= _ASSUMED_ERRORS
        factor = abs(file_factor(known_term(name), scales, rudder_to_port=False))
        z = (value - about.value) / error
        words = f"{name} = {value:.3g}, {abs(z):.0f} standard errors from {about.source.partition(',')[0]}"
        found.compare(z, words)
        found.total -= math.log(error * factor)
    of_length = scales.length if scales else 1.0
    if table.body.get("mass", 0.0) > 0:
        z = math.log(ship.body.mass / _mass(table)) / (_ASSUMED_MASS_ERROR if table.assumed else _MASS_ERROR)
        found.compare(z, f"mass {ship.body.mass / _mass(table):.3g} times the displacement")
    if table.body.get("yaw_inertia", 0.0) > 0:
        radius = math.sqrt(max(ship.body.yaw_inertia / ship.body.mass, 1e-12))
        z = math.log(radius / 0.25) / 0.1
        found.compare(z, f"radius of gyration {radius:.3g} L")
    if table.body.get("x_G") and table.centre_of_gravity_m is None:
        centre = table.body["x_G"] / of_length
        z = centre / _CENTRE_ERROR
        found.compare(z, f"x_G = {centre:.3g} L")
        found.total -= math.log(_CENTRE_ERROR * of_length)
    _weigh_rudder(found, table, ship)


def _weigh_rudder(found: _Evidence, table: CoefficientTable, ship: ReadShip) -> None:
    """Sway force to port and moment to starboard of a rudder to starboard, of an ordinary size."""
    side = rudder_by_rules(table.length_m, table.beam_m, table.draught_m, table.rudder_area_m2)
    Yd, Nd = (ship.derivatives.get(name) for name in ("Yd", "Nd"))
    if Yd:
        if Yd > 0:
            found.add(_WRONG_SIDE, 0.0, "a rudder to starboard pushes the stern to starboard")
        z = math.log(abs(Yd) / side) / _RUDDER_ERROR
        found.compare(z, f"Yd = {Yd:.3g}, {abs(Yd) / side:.2g} of a rudder by the rules")
    if Nd and not Yd:
        z = math.log(abs(Nd) / (side * _LEVER)) / _RUDDER_ERROR
        found.compare(z, f"Nd = {Nd:.3g}")
    if Yd and Nd:
        z = (-Nd / Yd - _LEVER) / _LEVER_ERROR
        found.compare(z, f"the rudder acts {Nd / Yd:.2g} L from midships")


def _mass(table: CoefficientTable) -> float:
    return table.displacement_kg / (0.5 * table.environment.water_density_kgpm3 * table.length_m**3)


def _particulars(table: CoefficientTable, ship: ReadShip) -> Particulars:
    return Particulars(
        length_m=table.length_m,
        beam_m=table.beam_m,
        draught_m=table.draught_m,
        density_kgpm3=table.environment.water_density_kgpm3,
        mass_kg=table.displacement_kg,
        x_G_m=ship.body.x_G * table.length_m,
    )


def _filled(table: CoefficientTable, ship: ReadShip) -> dict[str, float]:
    """Its derivatives, with the estimates of accelerations that the table lacks."""
    names = [name for name in ("Xudot", "Yvdot", "Yrdot", "Nvdot", "Nrdot") if name not in table.derivatives]
    lacking = estimate(_particulars(table, ship), names)
    return {name: entry.value for name, entry in lacking.items()} | dict(ship.derivatives)


def linear_figures(derivatives: Mapping[str, float], body: RigidBody) -> tuple[float, float, float | None]:
    """C', growth of the faster mode of sway and yaw (U/L), and Norrbin's P (None without rudder forces).

    `derivatives`: Prime, about the origin of `body`, without inertia, rudder to starboard; `body`: Prime.
    """
    d = {name: derivatives.get(name, 0.0) for name in ("Yv", "Yr", "Nv", "Nr", "Yd", "Nd")}
    a = {name: derivatives.get(name, 0.0) for name in ("Yvdot", "Yrdot", "Nvdot", "Nrdot")}
    m, m_x = body.mass, body.mass * body.x_G
    mass = np.array([[m - a["Yvdot"], m_x - a["Yrdot"]], [m_x - a["Nvdot"], body.yaw_inertia - a["Nrdot"]]])
    damping = np.array([[d["Yv"], d["Yr"] - m], [d["Nv"], d["Nr"] - m_x]])
    criterion = float(np.linalg.det(damping))
    if np.linalg.det(mass) <= 0 or mass[0, 0] <= 0:
        return criterion, math.inf, None
    system = np.linalg.solve(mass, damping)
    growth = float(np.linalg.eigvals(system).real.max())
    if not d["Yd"] and not d["Nd"]:
        return criterion, growth, None
    # v, r, psi and the rudder, which is held at 1
    whole = np.zeros((4, 4))
    whole[:2, :2], whole[:2, 3], whole[2, 1] = system, np.linalg.solve(mass, [d["Yd"], d["Nd"]]), 1.0
    size = np.abs(whole).max()
    return criterion, growth, float(expm(whole)[2, 3]) if size < 500 else -math.inf


def with_probabilities(readings: Sequence[RankedReading]) -> list[RankedReading]:
    """The readings, the most probable first, with probabilities that add to 1."""
    weights = np.array([entry.weight for entry in readings])
    shares = np.exp(weights - weights.max())
    shares /= shares.sum()
    ranked = [replace(entry, probability=float(share)) for entry, share in zip(readings, shares, strict=True)]
    return sorted(ranked, key=lambda entry: -entry.weight)


def with_diameter(ranked: RankedReading, diameter_lengths: float | None) -> RankedReading:
    """A reading whose weight takes the tactical diameter at 35 deg into account.

    `diameter_lengths`: Over L; None if the ship never turned so far.
    """
    if diameter_lengths is None:
        words = "does not turn through 180 deg at 35 deg of rudder"
        return replace(ranked, weight=ranked.weight + _WRONG_SIDE / 2, against=(*ranked.against, words))
    z = math.log(diameter_lengths / _DIAMETER) / _DIAMETER_SPREAD
    far = () if abs(z) < _FAR else (f"tactical diameter {diameter_lengths:.2g} L",)
    return replace(ranked, weight=ranked.weight + _log_density(z), against=(*ranked.against, *far))


def read_card_text(table: CoefficientTable, ranked: RankedReading) -> str:
    """TOML of a card of the ship by a reading: prime, midships, hydrodynamic, rudder to starboard.

    Accelerations that the table lacks are the estimates of :mod:`tank2sim.cards.estimates`, and said so.
    """
    filled, ship = _filled(table, ranked.ship), ranked.ship
    third = any(sum(known_term(name).powers.values()) > 1 and known_term(name).force != "X" for name in filled)
    read = ", ".join(f"{key} {value}" for key, value in vars(ranked.reading).items())
    sizes = {key: getattr(table, key) for key in ("length_m", "beam_m", "draught_m", "displacement_kg")}
    if table.rudder_area_m2 is not None:
        sizes["rudder_area_m2"] = table.rudder_area_m2
    source = f"{Path(table.source).name}, read as: {read} (probability {ranked.probability:.2g})"
    derivatives = {name: tomlkit.item(value) for name, value in to_digits(filled, 8).items() if value}
    for name in derivatives.keys() - table.derivatives.keys() - ship.derivatives.keys():
        derivatives[name].comment("ESTIMATED: the table has none")
    document = tomlkit.document()
    document |= {
        "format": "tank2sim-ship/1",
        "ship": {"name": Path(table.source).stem, **sizes, "source": source},
        "environment": {"water_density_kgpm3": table.environment.water_density_kgpm3},
        "model": {
            "kind": "abkowitz" if third else "linear",
            "speed_mps": table.speed_mps,
            "scaling": "prime",
            "speed_scale": _speed_scale(table),
            "yaw_rate_terms": "hydrodynamic",
            "rudder_sign": "starboard",
        },
        "rigid_body": to_digits(ship.body.model_dump(), 8),
        "derivatives": derivatives,
    }
    return tomlkit.dumps(document)


_SIMULATED = 1e-3
"""Probability from which a reading is simulated: others cannot become the first (project choice)."""


def ranked_readings(
    table: CoefficientTable,
) -> tuple[list[RankedReading], dict[Reading, dict[str, float | None]]]:
    """Every reading of a table, the most probable first, and figures of manoeuvres of those that were simulated.

    Raises InputError: No reading of it is a ship.
    """
    weighed = with_probabilities([weigh(table, reading) for reading in possible_readings(table)])
    if not math.isfinite(weighed[0].weight):
        raise InputError(table.source, "", "no reading of it is a ship", "check its sizes and units")
    # What a turn takes: surge that holds a speed, the rudder
    ship = read_as(table, possible_readings(table)[0])
    moves = {"Xu", "Nd"} <= {name for name, value in ship.derivatives.items() if value}
    figures = {entry.reading: _figures(table, entry) for entry in weighed if entry.probability > _SIMULATED and moves}
    ranked = [
        with_diameter(entry, figures[entry.reading].get("tactical_diameter_lengths"))
        if entry.reading in figures
        else entry
        for entry in weighed
    ]
    return with_probabilities(ranked), figures


def _figures(table: CoefficientTable, entry: RankedReading) -> dict[str, float | None]:
    """Figures of a turn and a zigzag of the ship by a reading; empty if it does not sail."""
    try:
        card = parse_card(read_card_text(table, entry), table.source)
        assert isinstance(card, ManoeuvringCard)
        model = build(card)
        turn = single_figures(simulate(model, Turn(math.radians(35))).figures)
        zigzag = single_figures(simulate(model, Zigzag(math.radians(10), math.radians(10))).figures)
    except InputError:  # no mass matrix, or a motion without bounds: not a ship
        return {}
    lengths = {
        f"{name}_lengths": turn[f"{name}_m"] / table.length_m if turn.get(f"{name}_m", 0.0) > 0 else None
        for name in ("advance", "tactical_diameter")
    }
    return {**lengths, "overshoot_1_deg": zigzag.get("overshoot_1_deg")}
