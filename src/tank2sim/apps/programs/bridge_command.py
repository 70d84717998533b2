"""A ship as an own ship of Bridge Command 5.11: ``boat.ini`` with fitted numbers, and a box as its mesh.

A craft with two fixed thrusters is a ship with two engines and without a rudder. With levers e_P, e_S (shares of the
largest thrust F of a thruster, positive ahead) and the distance b between them::

    m du/dt = F (e_P + e_S) - A u|u| - B u        I dr/dt = F (e_P - e_S) b/2 - TA r|r| - TB r

F, b and the thrust astern are the card's. A and B follow its steady speeds, TA and TB its steady rates of turn in spins
and in turns by a difference, by least squares that keep them positive.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from tank2sim.apps.programs.bridge_command_surge import (
    HEADING_ASTERN,
    SurgeNumbers,
    fitted_surge,
    full_ahead_order,
    speed_against_drag,
    straight_runs,
    straight_runs_of_card,
)
from tank2sim.apps.programs.bridge_command_yaw import (
    COURSE_FIGURES,
    LARGEST_RUDDER_DEG,
    courses_of_card,
    fitted_yaw,
    force_at,
    heading_astern,
    moment_astern,
    sailed,
)
from tank2sim.apps.programs.program_files import FigureChange, ProgramFiles
from tank2sim.arrays import Array
from tank2sim.cards.card import Card, MmgCard, SteeredCard
from tank2sim.cards.small_craft import cruising_revolutions
from tank2sim.dynamics.build import build
from tank2sim.dynamics.effects import EFFECTS
from tank2sim.dynamics.effects.fields import CURRENT_FIELD, WIND_FIELD
from tank2sim.dynamics.effects.harbour import BOW_THRUSTER, STERN_THRUSTER
from tank2sim.dynamics.effects.surroundings import CURRENT, WAVE_DRIFT, WIND, in_calm
from tank2sim.dynamics.effects.twin_screws import TWIN_ORDERS
from tank2sim.dynamics.effects.waves import WAVES
from tank2sim.dynamics.model import Model
from tank2sim.errors import InputError
from tank2sim.simulation.card_range import single_figures
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate
from tank2sim.simulation.running import Running
from tank2sim.simulation.thruster_manoeuvres import DifferenceTurn, Spin, StraightRun

_FREEBOARD, _EYE_AFT, _LEAST_DRAG, _GEAR_DEGPS = 0.04, 0.3, 1e-6, 30.0
"""Freeboard and place of the eye aft of midships over L (project choices); drag across of a card without, above 0,
which asks for a default; rate of a rudder whose card states none, the default of Bridge Command."""

# Drag of still air on the box in Bridge Command, over area and squared speed (N s2/m4): part of the fitted drag
_AIR_DRAG = 0.5 * 1.225 * 0.51444**2

_WEATHER = {CURRENT.name, CURRENT_FIELD.name, WAVES.name, WAVE_DRIFT.name, WIND.name, WIND_FIELD.name}
_TUNNELS = {BOW_THRUSTER.name: "Bow", STERN_THRUSTER.name: "Stern"}

_VERSION = "5.11"

_USE = f"""Copy this folder, under a name of your choice, into `Models/Ownship/` of Bridge Command's user folder
(`~/.Bridge Command/{_VERSION}/` on Linux, `%APPDATA%\\Bridge Command\\{_VERSION}\\` on Windows), and name it as
`ShipName` in `ownship.ini` of a scenario. `boat.ini` has the numbers, `box.x` is a box of the ship's length, beam and
height, from which Bridge Command takes draught and areas of wind.

"""

_ONE_ENGINE = f"""The numbers are for version {_VERSION}, whose source halves `Max_propulsion_force` of a ship with one
engine (`PropSpace=0`) twice: the key is twice the thrust of the ship. Another version may need half of it: check the
speed at full ahead."""

_TWO_ENGINES = f"""The numbers are for version {_VERSION}. `Max_propulsion_force` is the thrust of each of the two
engines, which are `PropSpace` (m) apart."""


def bridge_command_files(card: Card) -> ProgramFiles:
    """The folder of an own ship of Bridge Command 5.11: ``boat.ini`` and its mesh ``box.x``.

    `card`: Card of a ship with a rudder (polynomial or MMG, one screw or two, with or without roll), or of a craft with
    a fixed thruster at either side.

    Raises InputError: The vessel has neither, the card lacks beam or draught, or the ship does not turn.
    """
    ship = card.steered()
    beam, draught = (_particular(ship, name) for name in ("beam_m", "draught_m"))
    model, length = in_calm(build(ship)), ship.ship.length_m
    numbers, changes, losses = (_of_craft if ship.thrusters else _of_ship)(ship, model)
    numbers["DynamicsSpeedA"] = max(0.0, numbers["DynamicsSpeedA"] - _AIR_DRAG * beam * _FREEBOARD * length)
    return ProgramFiles(
        files={
            "boat.ini": _ini(_seen(length, draught) | numbers | _across(model) | _tunnels(ship)),
            "box.x": box_mesh(length, beam, draught + _FREEBOARD * length),
        },
        use=_USE + (_TWO_ENGINES if numbers["PropSpace"] else _ONE_ENGINE),
        losses=(*losses, *_losses_of_all(ship)),
        changes=tuple(changes),
    )


def _particular(card: SteeredCard, name: str) -> float:
    value = getattr(card.ship, name)
    if value is None:
        raise card.fault(f"ship.{name}", "is missing, and the mesh of Bridge Command needs it", "add it")
    return float(value)


def _of_ship(card: SteeredCard, model: Model) -> tuple[dict[str, float], list[FigureChange], list[str]]:
    """Numbers of a ship with a rudder, figures before and after, and losses."""
    values = model.defaults
    speed, length = values["ship.speed"], values["ship.length"]
    runs = straight_runs_of_card(model)
    turned = math.radians(runs.pop(HEADING_ASTERN, 0.0))
    mass = (card.rigid_body.mass - card.derivatives.get("Xudot", 0.0)) * card.scales.mass
    surge = fitted_surge(runs, speed, float(mass))
    courses, wanted = courses_of_card(model, surge.speed(0.5), runs.get(("half thrust ahead", "final_speed_mps")))
    if np.isnan(wanted[1]).all():
        raise card.fault("derivatives", "make no turn that reaches 180 deg", "check the card with simulate")
    offset = _screw_offset(card)
    gear = math.degrees(values.get("steering.max_rate", math.radians(_GEAR_DEGPS)))
    # Two propellers walk against each other, so that only one can hold an asymmetric ship.
    neutral = 0.0 if offset else math.degrees(Running(Integrator(model)).neutral_rudder())
    yaw = fitted_yaw(model, courses, wanted, gear, neutral)
    time, _ = surge.run(-1.0, speed, 0.0)
    astern = 0.0 if offset else moment_astern(yaw, turned, time)
    made, straight = sailed(yaw, courses, gear, speed, 0.006 * length / speed)[:, 0], straight_runs(surge, speed)
    changes = [FigureChange("full ahead", "final_speed_mps", speed, surge.speed(1.0))]
    changes += [FigureChange(*key, value, straight[key]) for key, value in runs.items()]
    if turned:
        after = math.degrees(heading_astern(yaw, astern, time))
        changes.append(FigureChange(*HEADING_ASTERN, math.degrees(turned), after))
    for column, course in enumerate(courses):
        for row, name in enumerate(COURSE_FIGURES):
            before, after = float(wanted[row, column]), float(made[row, column])
            if not math.isnan(before):
                changes.append(FigureChange(course.manoeuvre, name, before, None if math.isnan(after) else after))
    inertia = float((card.rigid_body.yaw_inertia - card.derivatives.get("Nrdot", 0.0)) * card.scales.inertia)
    numbers = {
        **surge.keys,
        **yaw.keys(inertia, surge),
        # Of each of two engines; of one, 5.11 gives a quarter of the key to either side.
        "Max_propulsion_force": surge.thrust_N / 2 if offset else 2 * surge.thrust_N,
        "PropSpace": 2 * offset,
        "MaxRevs": (full_ahead_order(model) or 0.0) * 60 / math.tau or 100.0,
        "RudderAngularVelocity": gear,
        "PropWalkAstern": -astern * inertia / (2 * surge.astern),  # positive: to port going astern
    }
    return numbers, changes, _losses_of_ship(model)


def _screw_offset(card: SteeredCard) -> float:
    """Distance of either of two propellers from the centreline, m; 0 for one."""
    if isinstance(card, MmgCard):
        return card.ship.length_m * (card.propeller.y_P or 0.0) if card.propeller.number == 2 else 0.0
    return sum(one.parameters.get("place_m", 0.0) for one in card.effects if one.name == TWIN_ORDERS.name)


def _seen(length_m: float, draught_m: float) -> dict[str, float]:
    """Keys of the mesh, the view and the instruments."""
    return {
        **{"ScaleFactor": 1.0, "YCorrection": -draught_m, "AngleCorrection": 0.0, "Views": 1.0, "ViewX(1)": 0.0},
        **{"ViewY(1)": draught_m + 2 * _FREEBOARD * length_m, "ViewZ(1)": -_EYE_AFT * length_m},
        **{"HasGPS": 1.0, "HasDepthSounder": 1.0, "MaxDepth": 100.0, "HasRateOfTurnIndicator": 1.0},
    }


def _across(model: Model) -> dict[str, float]:
    """Drag across, from the card's at 0.5 and 1 m/s."""
    slow, fast = (-force_at(model, "force.Y", {"motion.v": v}) / v for v in (0.5, 1.0))
    quadratic = max(0.0, 2 * (fast - slow))
    return {
        "DynamicsLateralDragA": max(_LEAST_DRAG, quadratic),
        "DynamicsLateralDragB": max(_LEAST_DRAG, fast - quadratic),
    }


def _tunnels(card: SteeredCard) -> dict[str, float]:
    """Keys of the tunnel thrusters among the effects of a card."""
    found = {}
    for effect in card.effects:
        if end := _TUNNELS.get(effect.name):
            found[f"{end}ThrusterForce"] = effect.parameters["force_N"]
            found[f"{end}ThrusterDistance"] = abs(effect.parameters["forward_m"])
    return found


def _ini(numbers: dict[str, float]) -> str:
    """``boat.ini``. No text of the card is in it."""
    about = f"# for Bridge Command {_VERSION}, by tank2sim; one engine has half of Max_propulsion_force there"
    lines = [f"{key}={_number(value)}" for key, value in numbers.items()]
    return "\n".join([about, 'FileName="box.x"', *lines]) + "\n"


def _number(value: float) -> str:
    """A plain decimal of six digits, without an exponent."""
    return str(np.format_float_positional(float(f"{value:.6g}") + 0.0, trim="0"))


def box_mesh(length_m: float, beam_m: float, height_m: float) -> str:
    """A box as DirectX text: x to starboard, y up from the keel, z to the bow, origin midships; faces turn outwards."""
    corners = list(product((-0.5, 0.5), (0.0, 1.0), (-0.5, 0.5)))
    rows = [f"{_number(x * beam_m)};{_number(y * height_m)};{_number(z * length_m)};" for x, y, z in corners]
    faces = []
    for axis, end in product(range(3), (0, 1)):
        own, first, second = (4 >> (axis + turn) % 3 for turn in range(3))
        square = [end * own + a * first + b * second for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        a, b, c, d = square if end else square[::-1]
        faces += [f"3;{a},{b},{c};", f"3;{a},{c},{d};"]
    places, triangles = ",\n ".join(rows), ",\n ".join(faces)
    return f"xof 0303txt 0032\nMesh hull {{\n {len(rows)};\n {places};\n {len(faces)};\n {triangles};\n}}\n"


def _losses_of_ship(model: Model) -> list[str]:
    """Parts of a ship with a rudder that Bridge Command lacks, in numbers."""
    # A card without limits of its gear turns with 35 deg, as IMO's turning circle does.
    largest = math.degrees(model.defaults.get("steering.max_angle", math.radians(35.0)))
    turn = simulate(model, Turn(math.radians(min(largest, LARGEST_RUDDER_DEG)))).figures
    found = []
    if largest > LARGEST_RUDDER_DEG:
        hard = simulate(model, Turn(math.radians(largest))).figures["tactical_diameter_m"]
        diameter = f" (tactical diameter {hard:.4g} m)" if isinstance(hard, float) else ""
        found.append(
            f"the rudder is held within {LARGEST_RUDDER_DEG:g} deg: the card's turn with {largest:.3g} deg{diameter} "
            "is out of reach"
        )
    loss, drift = turn.get("speed_loss_percent"), turn.get("steady_drift_deg")
    if isinstance(loss, float) and isinstance(drift, float):
        found.append(
            f"a ship keeps its speed in a turn and does not drift, where the card loses {loss:.0f} % with {drift:.0f} "
            "deg of drift at the largest rudder: paths are fitted, and a turn takes less time (time_180_s)"
        )
    if full_ahead_order(model) is None:
        found.append("the card has no engine: speeds at other levers follow from its resistance, stops are not fitted")
    found.append("a ship turns alike to either side, except for its neutral rudder and the walk of a single screw")
    heel = turn.get("largest_heel_deg")
    if isinstance(heel, float):
        found.append(f"a ship does not heel in turns, and the card's to {abs(heel):.1f} deg")
    return found


def _losses_of_all(card: SteeredCard) -> list[str]:
    """Parts of any vessel that Bridge Command lacks."""
    names = {effect.name for effect in card.effects if EFFECTS[effect.name].acts_on != "sensor"}
    lost = sorted(names - {*_TUNNELS, *_WEATHER, TWIN_ORDERS.name})
    return [
        "levers are shares of the thrust and act at once; thrust does not change with speed",
        "wind has the force of a box with coefficient 1, times 0.265, and no yaw moment; sway has the mass of surge",
        *([f"effects of the card count only in the figures that were fitted: {', '.join(lost)}"] if lost else []),
        *(["the figures hold in calm water: wind, waves and current are the scenario's"] * bool(names & _WEATHER)),
    ]


_SHARES = (1.0, 0.7, 0.4)
"""Revolutions of straight runs and spins over the largest, and differences over twice what is left beyond the cruising
revolutions: the whole range (project choice)."""


def _of_craft(card: SteeredCard, model: Model) -> tuple[dict[str, float], list[FigureChange], list[str]]:
    """Numbers of a craft with two fixed thrusters by its runs, spins and turns, figures before and after, losses."""
    spacing, thruster, cruise = _spacing(card), card.thrusters[0], cruising_revolutions(card)
    most, least, force = thruster.max_radps, -thruster.lowest_radps, thruster.largest_thrust_N
    astern = max(1e-6, thruster.astern_Ns2 * least**2 / force)  # 0 would mean as much as ahead
    left = 1.9 * min(most - cruise, cruise + least)  # nearly all, for rounding

    def lever(revolutions: float) -> float:
        return math.copysign((revolutions / most) ** 2, revolutions)

    # Levers (port, starboard) of each run; a spin turns the starboard thruster astern.
    reversed_thrust = -thruster.astern_Ns2 / thruster.ahead_Ns2
    levers: dict[StraightRun | Spin | DifferenceTurn, tuple[float, float]] = {}
    ahead, spins, differences = (np.array(_SHARES) * largest for largest in (most, min(most, least), left))
    levers |= {StraightRun(n): (lever(n), lever(n)) for n in ahead.tolist()}
    levers |= {Spin(n): (lever(n), reversed_thrust * lever(n)) for n in spins.tolist()}
    levers |= {DifferenceTurn(d): (lever(cruise + d / 2), lever(cruise - d / 2)) for d in differences.tolist()}
    found = {run: _figures(model, run) for run in levers}
    moments = {run: force * (port - starboard) * spacing / 2 for run, (port, starboard) in levers.items()}
    A, B = _drag([(2 * force * levers[run][0], found[run]["final_speed_mps"]) for run in map(StraightRun, ahead)])
    rates = [
        (moments[run], math.radians(abs(rate)))
        for run, figures in found.items()
        if (rate := figures.get(_RATES.get(type(run), "")))
    ]
    if not rates:
        raise card.fault("thrusters", "turn the craft in no spin and no turn", "check the card with simulate")
    turn_A, turn_B = _drag(rates)
    surge = SurgeNumbers(A, B, 2 * force, astern, card.rigid_body.mass - card.derivatives.get("Xudot", 0.0))
    changes = []
    for run, ends in levers.items():
        speed, rate = surge.speed(sum(ends) / 2), speed_against_drag(moments[run], turn_A, turn_B)
        after = {"final_rate_degps": math.degrees(rate)}
        if isinstance(run, StraightRun):
            time, way = surge.run(ends[0], 0.0, 0.9 * speed)
            after = {"final_speed_mps": speed, "time_to_90_percent_s": time, "distance_to_90_percent_m": way}
        elif isinstance(run, DifferenceTurn):
            after = {"steady_rate_degps": math.degrees(rate), "steady_diameter_m": 2 * speed / rate}
        known = found[run]
        changes += [FigureChange(run.words, name, known[name], value) for name, value in after.items() if name in known]
    numbers = {
        **surge.keys,
        "Inertia": card.rigid_body.yaw_inertia - card.derivatives.get("Nrdot", 0.0),
        "Max_propulsion_force": force,
        "PropSpace": spacing,
        "MaxRevs": most * 60 / math.tau,
        "DynamicsTurnDragA": turn_A,
        "DynamicsTurnDragB": turn_B,
    }
    return numbers, changes, ["a turning craft neither drifts nor loses speed"]


# The rate of turn of a manoeuvre
_RATES: dict[type, str] = {Spin: "final_rate_degps", DifferenceTurn: "steady_rate_degps"}


def _spacing(card: SteeredCard) -> float:
    """Distance between two alike, fixed thrusters at either side, m; others are refused."""
    first, last = card.thrusters[0], card.thrusters[-1]
    alike = all(getattr(first, key) == getattr(last, key) for key in ("ahead_Ns2", "astern_Ns2", "max_radps", "x_m"))
    fixed = all(one.azimuth_rad == 0 and one.max_azimuth_rad is None for one in (first, last))
    if len(card.thrusters) != 2 or not alike or not fixed or not first.y_m or first.y_m != -last.y_m:
        problem = "are not two alike that push ahead, one at either side, as the engines of Bridge Command are"
        raise card.fault("thrusters", problem, 'export an FMU, or convert the card with to="gazebo"')
    return 2 * abs(first.y_m)


def _figures(model: Model, manoeuvre: StraightRun | Spin | DifferenceTurn) -> dict[str, float]:
    """Figures of a manoeuvre; none of one that the craft cannot do."""
    try:
        return single_figures(simulate(model, manoeuvre).figures)
    except InputError:
        return {}


def _drag(points: list[tuple[float, float]]) -> tuple[float, float]:
    """Quadratic and linear coefficient, not negative, by forces (or moments) and steady speeds (or rates)."""
    from scipy.optimize import nnls  # slow to import

    forces, speeds = np.array(points).T
    rows: Array = np.column_stack([speeds**2, speeds]) / forces[:, None]
    scale = np.linalg.norm(rows, axis=0)
    found = nnls(rows / scale, np.ones(len(forces)))[0] / scale
    return float(found[0]), float(found[1])
