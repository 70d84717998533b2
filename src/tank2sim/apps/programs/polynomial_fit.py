"""An MMG ship as a third-order polynomial: least squares over the motions of standard manoeuvres, scattered.

The polynomial is (3.8) with ``speed_scale = "instantaneous"`` and ``yaw_rate_terms = "hydrodynamic"``. Each of
X, Y, N without the ship's own inertia, over 1/2 rho L^2 U^2 (and L), is fitted by all its terms in v', r', delta, Du'
at nominal revolutions. Added masses are the card's, X_nn is half the slope of X by n/n0 on the straight course.
In linear terms it is then Y_r' - m_x', X_vr' + m_y', and the rudder's share of Y_v to N_r, as derived from the method;
a kink (gamma_R, C_2) and X_vvvv have no term of their own and are fitted into others.

The fit is linear in the forces, theta = A F(p), so that errors of the MMG card's numbers p carry over by its slopes:
Cov(theta) = S Cov(p) S^T, S = A dF/dp, at held revolutions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
import tomlkit

from tank2sim.apps.programs.conventions import roll_in_file
from tank2sim.apps.programs.program_files import PolynomialFit, standard_manoeuvres, to_digits
from tank2sim.arrays import Array
from tank2sim.cards.card import ManoeuvringCard, MmgCard
from tank2sim.cards.covariance import Covariance, not_referring
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.cards.reading import parse_card
from tank2sim.cards.terms import known_term
from tank2sim.dynamics import build
from tank2sim.dynamics.abkowitz import ABKOWITZ_TERMS, ACCELERATION_TERMS
from tank2sim.dynamics.card_parameters import JointErrors, card_parameters, joint_errors, study_model
from tank2sim.dynamics.mmg.ship import is_symmetric
from tank2sim.dynamics.model import Model
from tank2sim.dynamics.rigid_body import inertial_forces
from tank2sim.simulation.run import simulate

SCATTER = 0.3
"""Share of :data:`SPREADS` by which each motion is scattered: project choice. With 0.3 the KVLCC2's tactical diameters
err by 2.8 % at most and its overshoots by 0.9 deg; with 1 by 5.4 % and 0.8 deg."""

SPREADS = {"u": 0.1, "v": 0.1, "r": 0.2, "rudder_deg": 10.0}
"""Standard deviations of the scatter: u over u0, v over U, r' and the rudder. Project choices."""

SCATTERED_MOTIONS = 20000
"""Motions that are fitted: with twice as many, figures of the KVLCC2's manoeuvres change by 0.3 % at
most. Project choice."""

_SEED = 0
_ROWS = 400
_STATES = ("motion.u", "motion.v", "motion.r", "rudder.angle")
_SLOWEST = 0.05  # of u0


def manoeuvre_motions(model: Model) -> Array:
    """u, v, r, rudder (n, 4), SI, of the standard manoeuvres of a ship, :data:`_ROWS` of each."""
    found = []
    for manoeuvre in standard_manoeuvres(model):
        run = simulate(model, manoeuvre).trajectory
        rows = np.linspace(0, len(run.t) - 1, _ROWS).astype(int)
        found.append(np.column_stack([run[name][rows] for name in _STATES]))
    return np.vstack(found)


def scattered_motions(model: Model, motions: Array, scatter: float = SCATTER) -> Array:
    """Motions near the motions of manoeuvres, within the rudder's limits and ahead of rest.

    `motions` (n, 4): u, v, r, rudder, SI; `scatter`: Over :data:`SPREADS`. Returns :data:`SCATTERED_MOTIONS` of them.
    """
    values = model.defaults
    u0, length = values["ship.speed"], values["ship.length"]
    largest = values.get("steering.max_angle", math.pi / 2)
    generator = np.random.default_rng(_SEED)
    found = motions[generator.integers(0, len(motions), SCATTERED_MOTIONS)].copy()
    speed = np.hypot(found[:, 0], found[:, 1])
    sizes = np.column_stack(
        [
            np.full(len(found), SPREADS["u"] * u0),
            SPREADS["v"] * speed,
            SPREADS["r"] * speed / length,
            np.full(len(found), math.radians(SPREADS["rudder_deg"])),
        ]
    )
    found += scatter * sizes * generator.normal(size=found.shape)
    found[:, 0] = np.maximum(found[:, 0], max(_SLOWEST * u0, values["low_speed.bound"]))
    found[:, 3] = np.clip(found[:, 3], -largest, largest)
    return found


def fit_polynomial(card: MmgCard, model: Model, motions: Array) -> PolynomialFit:
    """The polynomial by least squares over motions u, v, r, rudder (n, 4), SI.

    Raises InputError: The motions do not determine the terms.
    """
    forces, primes = _hydrodynamic_primes(card, model, motions)
    kept = [*ACCELERATION_TERMS, *(name for name in card.derivatives if _of_heeling(name))]
    derivatives = {name: card.derivatives[name] for name in kept if name in card.derivatives}
    errors = _stated_errors(card)
    numbers = [] if errors is None else [p.name for p in errors.parameters if p.name in model.parameter_names]
    slopes = _force_slopes(card, model, motions, numbers)
    sensitivity = [[float(number == f"derivatives.{name}") for number in numbers] for name in derivatives]
    residuals = {}
    for row, force in enumerate("XYNK"[: len(forces)]):
        names = _terms_of(force, symmetric=is_symmetric(card))
        design = np.column_stack([_powers(name, primes) for name in names])
        sizes = np.sqrt(np.mean(design**2, axis=0))
        found, _, rank, _ = np.linalg.lstsq(design / np.where(sizes > 0, sizes, 1.0), forces[row], rcond=1e-12)
        if rank < len(names):
            raise card.fault("model", "its motions do not determine a polynomial", "state wider ranges")
        coefficients = found / sizes
        derivatives |= dict(zip(names, coefficients.tolist(), strict=True))
        sensitivity += (np.linalg.lstsq(design / sizes, slopes[row], rcond=1e-12)[0] / sizes[:, None]).tolist()
        error = design @ coefficients - forces[row]
        residuals[force] = float(np.sqrt(np.mean(error**2) / np.mean(forces[row] ** 2)))
    covariance = None if errors is None else _carried(np.array(sensitivity), errors, numbers)
    revolutions = _effect_of_revolutions(card, model)
    return PolynomialFit(derivatives, revolutions, residuals, _ranges(card, motions), covariance)


def _stated_errors(card: MmgCard) -> JointErrors | None:
    """Errors of the numbers of a card; None if it states none."""
    stated = card.uncertainty or card.interaction_errors or read_covariance(card) is not None
    return joint_errors(card, card_parameters(card, study_model(card))) if stated else None


def _terms_of(force: str, *, symmetric: bool) -> list[str]:
    """Terms of the polynomial of a force; the moment K has the same terms as Y."""
    every = ABKOWITZ_TERMS["Y" if force == "K" else force]
    return [force + name[1:] for name in every if not symmetric or _of_symmetric_ship(force + name[1:])]


def _ranges(card: MmgCard, motions: Array) -> dict[str, tuple[float, float]]:
    """Ranges of the motions (n, 4), without the outermost 0.5 % at both ends."""
    u, v, r, rudder = motions.T
    visited = {
        "u": u / card.model.speed_mps,
        "drift_deg": np.degrees(np.arctan2(-v, u)),
        "yaw_rate_prime": r * card.ship.length_m / np.hypot(u, v),
        "rudder_deg": np.degrees(rudder),
    }
    return {name: (float(np.quantile(x, 0.005)), float(np.quantile(x, 0.995))) for name, x in visited.items()}


def _carried(sensitivity: Array, errors: JointErrors, numbers: Sequence[str]) -> Array:
    """S C S^T; C is the covariance of the card's `numbers`."""
    rows = [[p.name for p in errors.parameters].index(name) for name in numbers]
    covariance: Array = sensitivity @ errors.covariance[np.ix_(rows, rows)] @ sensitivity.T
    return 0.5 * (covariance + covariance.T)


def _of_symmetric_ship(name: str) -> bool:
    term = known_term(name)
    return (term.v + term.r + term.d) % 2 == (0 if term.force == "X" else 1)


def _of_heeling(name: str) -> bool:
    """True for a term of p or phi, and an acceleration derivative of a ship that rolls."""
    term = known_term(name)
    return term.p + term.phi > 0 or (term.of_roll and bool(term.acceleration))


def _powers(name: str, primes: tuple[Array, Array, Array, Array]) -> Array:
    term = known_term(name)
    v, r, d, du = primes
    return np.asarray(v**term.v * r**term.r * d**term.d * du**term.u)


def _hydrodynamic_primes(
    card: MmgCard, model: Model, motions: Array
) -> tuple[Array, tuple[Array, Array, Array, Array]]:
    """X', Y', N' and of a ship that rolls K' (3 or 4, n), upright, without its inertia, and v', r', delta, Du'."""
    u, v, r, delta = motions.T
    speed, length = np.hypot(u, v), card.ship.length_m
    forces = _forces_at(model, motions, model.input_values())[:, 0]
    body, scales = card.rigid_body, card.scales
    inertial = [*inertial_forces(body.mass * scales.mass, body.x_G * length, u, v, r)]
    if card.roll is not None:
        added = -card.derivatives.get("Xudot", 0.0) * card.roll.l_x
        inertial.append((added + body.mass * card.roll.z_G) * scales.mass * length * u * r)
    primes = (forces - np.array(inertial)) / _units(card, motions)[: len(forces)]
    return primes, (v / speed, r * length / speed, delta, (u - card.model.speed_mps) / speed)


def _units(card: MmgCard, motions: Array) -> Array:
    """Divisors of X, Y, N, K (4, n) in the prime system: N, N, N m, N m."""
    length = card.ship.length_m
    unit = 0.5 * card.scales.density * length**2 * (motions[:, 0] ** 2 + motions[:, 1] ** 2)
    return np.outer([1.0, 1.0, length, length], unit)


def _force_slopes(card: MmgCard, model: Model, motions: Array, numbers: Sequence[str]) -> Array:
    """dX'/dp, dY'/dp, dN'/dp and of a ship that rolls dK'/dp (3 or 4, n, k) by k parameters of the model."""
    slopes = _forces_at(model, motions, model.input_values(), numbers)[:, 1:]
    return np.moveaxis(slopes / _units(card, motions)[: len(slopes), None], 1, 2)


def _forces_at(model: Model, motions: Array, inputs: Array, numbers: Sequence[str] = ()) -> Array:
    """Forces of an upright ship (X, Y, N, and K if it rolls), SI, and slopes by k parameters: (3 or 4, 1 + k, n)."""
    names = [name for name in ("force.X", "force.Y", "force.N", "force.K") if name in model]
    forces = model.expand(model.symbols(names))
    slopes = ca.jacobian(forces, model.symbols(numbers))
    function = ca.Function("forces", [model.x, model.u, model.p], [ca.densify(ca.vec(ca.horzcat(forces, slopes)))])
    p, count = model.parameter_values(), len(motions)
    states = np.tile(np.array(model.initial(p)), (1, count))
    for column, name in enumerate(_STATES):
        states[model.state_names.index(name)] = motions[:, column]
    arguments = states, np.tile(inputs[:, None], (1, count)), np.tile(p[:, None], (1, count))
    found = np.array(function.map(count)(*arguments))
    return found.reshape(1 + len(numbers), len(names), count).swapaxes(0, 1)


def _effect_of_revolutions(card: MmgCard, model: Model) -> float:
    """Xnn: half of the slope of X' by n/n0 on the straight course."""
    change, straight = 1e-4, np.array([[card.model.speed_mps, 0.0, 0.0, 0.0]])
    nominal = float(model.input_values()[model.input_names.index("propeller.speed")])
    faster, slower = (
        _forces_at(model, straight, model.input_values({"propeller.speed": nominal * (1 + side * change)}))[0, 0, 0]
        for side in (1, -1)
    )
    return float((faster - slower) / (4 * change) / card.scales.force)


def polynomial_card(card: MmgCard, fit: PolynomialFit) -> ManoeuvringCard:
    """The polynomial as a card, with particulars, gear and effects of the MMG card.

    Raises InputError: An effect of the card is none of a polynomial.
    """
    document = tomlkit.parse(card.text.lstrip("\ufeff"))
    for section in ("model", "rigid_body", "derivatives", "uncertainty", "propeller", "rudder", "propulsion"):
        document.pop(section, None)
    tables: dict[str, Mapping[str, object]] = {
        "model": {
            "kind": "abkowitz",
            "speed_mps": card.model.speed_mps,
            "scaling": "prime",
            "speed_scale": "instantaneous",
            "yaw_rate_terms": "hydrodynamic",
            "rudder_sign": "starboard",
            **_valid_ranges(card, fit),
        },
        "rigid_body": to_digits({key: getattr(card.rigid_body, key) for key in ("mass", "yaw_inertia", "x_G")}, 12),
        "propulsion": {
            "nominal_radps": card.propulsion.nominal_radps if card.propulsion else 1.0,
            **to_digits({"Xnn": fit.Xnn}, 10),
        },
        "derivatives": to_digits(fit.derivatives, 10),
    }
    errors = np.zeros(len(fit.derivatives)) if fit.covariance is None else np.sqrt(np.diag(fit.covariance))
    uncertain = {name: error for name, error in zip(fit.derivatives, errors.tolist(), strict=True) if error > 0}
    if uncertain:
        tables["uncertainty"] = to_digits(uncertain, 3)
    if card.roll is not None:
        # The rudder's moment about the longitudinal axis is in the terms of K.
        document.pop("roll", None)
        roll = roll_in_file(card.roll.model_copy(update={"z_R": 0.0}), 1.0, 1.0)
        document["roll"] = {place.removeprefix("roll."): value for place, value in roll.items()}
    ship = document["ship"]
    assert isinstance(ship, dict)
    ship["source"] = f"{card.ship.source}; fitted by tank2sim convert to the MMG card {card.ship.name}"
    document.update(tables)
    for name in ("effects", "fitted_trials"):  # TOML wants lists of tables at the end
        if name in document:
            document[name] = document.pop(name)
    text = not_referring(tomlkit.dumps(document))
    new = parse_card(text, card.source)
    assert isinstance(new, ManoeuvringCard)
    build(new)
    if fit.covariance is None:
        return new
    known = np.flatnonzero(errors > 0)
    names = tuple(f"derivatives.{name}" for name in uncertain)
    return replace(new, covariance=Covariance(names, fit.covariance[np.ix_(known, known)]))


def _valid_ranges(card: MmgCard, fit: PolynomialFit) -> dict[str, object]:
    """Keys of ``[model]`` with the range of a fit."""
    low, high = card.model.speed_range_mps
    reach = {f"valid_{name}": max(map(abs, fit.ranges[name])) for name in ("drift_deg", "rudder_deg", "yaw_rate_prime")}
    return {
        "valid_speed_mps": [round(max(low, fit.ranges["u"][0] * card.model.speed_mps), 4), round(high, 4)],
        "low_speed_below_mps": card.model.low_speed_bound_mps,
        **to_digits(reach, 3),
    }
