"""Added yaw inertia and dissipation of a body that a motor turns in a tank, as a result with its cards."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from tank2sim.apps.rigs.yaw.card import YawRigCard
from tank2sim.apps.rigs.yaw.control import AdaptiveController, Controller
from tank2sim.apps.rigs.yaw.found_card import BEST
from tank2sim.apps.rigs.yaw.identify import (
    YAW_METHODS,
    YawOptions,
    identify_yaw,
    parse_yaw_terms,
    torque_constant,
)
from tank2sim.apps.rigs.yaw.programme import Similarity, YawProgramme, programme_of
from tank2sim.apps.rigs.yaw.records import Medium, read_yaw_record, yaw_record_text
from tank2sim.apps.rigs.yaw.result import YawResult
from tank2sim.apps.rigs.yaw.study import study_yaw
from tank2sim.apps.rigs.yaw.theory import FloatingBody, theory_values
from tank2sim.arguments import NonNegativeArgument, Percent, PositiveArgument, checked
from tank2sim.cards import Card
from tank2sim.dynamics.vessel import Vessel, as_vessel
from tank2sim.errors import InputError
from tank2sim.files import write_together

CONTROLLERS: dict[str, Controller | None] = {"tuned": None, "adaptive": AdaptiveController()}
"""Names of the controllers (4), from the right inertia, and (6)."""


@checked
def yaw(
    records: Sequence[str | Path] | str | Path,
    *,
    inertia_kgm2: PositiveArgument | None = None,
    inertia_error_kgm2: NonNegativeArgument | None = None,
    torque_constant_NmpA: PositiveArgument | None = None,
    reference: str | Path | None = None,
    reference_inertia_kgm2: PositiveArgument | None = None,
    rig: Vessel | Card | str | Path | None = None,
    terms: str | Sequence[str] | None = None,
    mirror_percent: Percent = 25.0,
    method: str = BEST,
    theory: str | None = None,
) -> YawResult:
    """Estimate added yaw inertia and dissipation from records of the yaw rig (Alyshev 2019).

    Parameters
    ----------
    records : path or sequence of paths
        CSV files with ``t_s,phi_rad,current_A``; records of a body in air (``# medium: air``) give J_zz.
    inertia_kgm2, inertia_error_kgm2 : float, optional
        J_zz of body and rotor and its standard error; by default from records in air, or as the file says.
    torque_constant_NmpA : float, optional
        k_t, N m/A; by default as the records say.
    reference, reference_inertia_kgm2 : path and float, optional
        A record in air of a body of this known inertia, from which k_t is taken.
    rig : Vessel, Card, str or path, optional
        Card of the rig: its walls, gravity, accelerating and braking count.
    terms : str or sequence of str, optional
        Terms in addition to the inertia (``"coulomb,viscous,quadratic"``); by default the terms of (3) for the medium.
    mirror_percent : float
        Largest difference of mirror images that is accepted, % of the largest rate.
    method : str
        Method whose numbers a card gets.
    theory : str, optional
        Also (7) to (9) for ``"L,B,T,H"`` or ``"L,B,T,H,CB"``: length, beam, draught and depth of water in m, block
        coefficient; or for a card with these.

    Raises
    ------
    InputError
        A file is at fault, is not a record of such a rig, or does not determine the terms.

    Examples
    --------
    >>> import tempfile
    >>> import tank2sim as t2s
    >>> file = t2s.simulate_yaw("alyshev", tempfile.mkdtemp() + "/rig.csv")
    >>> found = t2s.yaw(file)
    >>> round(found.added_inertia_kgm2, 3)
    0.03
    """
    if method not in YAW_METHODS:
        raise InputError("--method", "", f"{method!r} is not known", f"there are: {', '.join(YAW_METHODS)}")
    if (reference is None) != (reference_inertia_kgm2 is None):
        raise InputError("--reference", "", "goes with --reference-inertia-kgm2", "give both, or neither")
    error = 0.0
    if reference is not None and reference_inertia_kgm2 is not None:
        in_air = identify_yaw([read_yaw_record(reference)])
        torque_constant_NmpA, error = torque_constant(in_air, reference_inertia_kgm2)
    known = None if rig is None else _rig_card(rig, "--rig")
    options = YawOptions(
        inertia_kgm2=inertia_kgm2,
        inertia_error_kgm2=inertia_error_kgm2,
        torque_constant_NmpA=torque_constant_NmpA,
        torque_constant_error=error,
        known=known.yaw_rig if known else None,
        terms=parse_yaw_terms(terms if isinstance(terms, str) else ",".join(terms)) if terms else None,
        mirror_limit=mirror_percent / 100,
    )
    body = _floating_body(theory) if theory else None
    paths = [records] if isinstance(records, str | Path) else records
    found = identify_yaw([read_yaw_record(path) for path in paths], options)
    values = theory_values(body, found.records[0].programme.max_rate_radps) if body else ()
    return YawResult(study_yaw(found, values), method, found, known)


@checked
def simulate_yaw(
    card: Vessel | Card | str | Path,
    path: str | Path,
    *,
    medium: Medium = "water",
    controller: str = "tuned",
    similar_to: str | None = None,
    noise_A: NonNegativeArgument = 0.0,
) -> Path:
    """Write the record that the yaw rig of a card would give, and return its file.

    Parameters
    ----------
    card : Vessel, Card, str or path
        Card of the rig with its body (``"alyshev"``).
    path : path
        The new file.
    medium : str
        ``water`` or ``air``; in air with the card's friction f_c, f_1.
    controller : str
        ``tuned`` (4) or ``adaptive`` (6).
    similar_to : str, optional
        A ship's motion ``"L,B,R,T"`` to run at the size of the body: length and beam in m, yaw rate in deg/min, time
        in s; by default the programme of the card.
    noise_A : float
        Standard deviation of the noise of the recorded current, A.

    Raises
    ------
    InputError
        The file exists, the card is not one of a yaw rig, or the motor saturates.
    """
    from tank2sim.apps.rigs.yaw.simulation import simulated_record

    path = Path(path)
    if path.exists():
        raise InputError(path, "", "is there already, and may be a measurement", "give --simulate a new name")
    if controller not in CONTROLLERS:
        raise InputError("--controller", "", f"{controller!r} is not known", f"there are: {', '.join(CONTROLLERS)}")
    rig = _rig_card(card, "--simulate")
    programme = _similar(rig, similar_to) if similar_to else None
    record = simulated_record(
        rig, path, noise_A, medium=medium, controller=CONTROLLERS[controller], programme=programme
    )
    write_together({path: yaw_record_text(record)}, inputs=[Path(rig.source)])
    return path


def _rig_card(given: Vessel | Card | str | Path, option: str) -> YawRigCard:
    card = as_vessel(given).card
    if not isinstance(card, YawRigCard):
        raise card.fault("model.kind", f"is {card.model.kind!r}", f"give {option} a card of the yaw rig")
    return card


def _similar(card: YawRigCard, text: str) -> YawProgramme:
    """The programme that is a ship's motion ``L,B,R,T`` at the size of the card's body."""
    try:
        length, beam, rate_degpmin, time_s = (float(word) for word in text.split(","))
    except ValueError:
        length = beam = rate_degpmin = time_s = 0.0
    if not all(0 < value < math.inf for value in (length, beam, abs(rate_degpmin), time_s)):
        remedy = "write length and beam in m, yaw rate in deg/min and time in s: 38,8,100,120"
        raise InputError("--similar-to", "", f"{text!r} is not a motion of a ship", remedy)
    body = card.ship
    if body.length_m is None or body.beam_m is None:
        raise card.fault("ship", "has no length_m or no beam_m", "add them, on the waterline")
    ratio = Similarity(ship_length_m=length, ship_beam_m=beam, length_m=body.length_m, beam_m=body.beam_m)
    try:
        return ratio.programme(math.radians(rate_degpmin / 60), time_s, programme_of(card))
    except ValueError as error:
        raise InputError("--similar-to", "", str(error), "give another motion of the ship") from None


def _floating_body(text: str) -> FloatingBody:
    """From ``L,B,T,H`` or ``L,B,T,H,CB``, or from a card that states these."""
    if "," not in text:
        ship = as_vessel(text).card.ship
        sizes = [ship.length_m, ship.beam_m, ship.draught_m, ship.water_depth_m, ship.block_coefficient]
    else:
        try:
            sizes = [float(word) for word in text.split(",")]
        except ValueError:
            sizes = []
    missing = len(sizes) not in (4, 5) or any(size is None or not size > 0 for size in sizes[:4])
    if missing or (sizes[4:] and sizes[4] is not None and not 0 < sizes[4] <= 1):
        problem = f"{text!r} does not state length, beam, draught and depth of water"
        remedy = "write for example 0.67,0.20,0.08,0.22,0.47, or name a card with them"
        raise InputError("--theory", "", problem, remedy)
    length, beam, draught, depth = (size or 0.0 for size in sizes[:4])
    block = sizes[4] if len(sizes) > 4 else None
    return FloatingBody(length_m=length, beam_m=beam, draught_m=draught, depth_m=depth, block_coefficient=block)
