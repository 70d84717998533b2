"""Added yaw inertia and dissipation of a body that a motor turns in a tank, as a result with its cards."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from tank2sim.api.verbs import Output, verb
from tank2sim.apps.rigs.yaw import YawMethod
from tank2sim.arguments import Percent, checked
from tank2sim.errors import ArgumentError, InputError
from tank2sim.files import CARD, write_together
from tank2sim.notices import Notice
from tank2sim.quantities import CurrentNoise, Length, TorqueConstant, YawInertia, YawInertiaError

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.apps.rigs.yaw.records import YawRecord
    from tank2sim.apps.rigs.yaw.result import YawResult
    from tank2sim.apps.rigs.yaw.simulation import RigRun
    from tank2sim.cards import Card
    from tank2sim.dynamics.vessel import Vessel
    from tank2sim.records.csv_table import CsvTable


def write_yaw_card(
    result: YawResult, path: Path, *, card: Vessel | str | Path | None = None, length_m: Length | None = None
) -> YawResult:
    """Return the result with the card as its file, and a notice about it.

    Parameters
    ----------
    result : YawResult
    path : Path
        File of the card.
    card : Vessel, str or path, optional
        Ship whose card gets N_rdot, in place of a card of the rig.
    length_m : float, optional
        Length of the model for N_rdot, m; by default as the records say.
    """
    from tank2sim.dynamics.vessel import as_vessel

    if card is None:
        text, files = f"the rig's card has the estimates of {result.method}", result.rig_card(path.stem).files(path)
    else:
        before, ship = as_vessel(card).manoeuvring().derivatives, result.with_nrdot(card, length_m)
        value, error = result.nrdot(length_m)
        spread = "" if error is None else f" ± {error:.2g}"
        was = f"{before['Nrdot']:.4g} before" if "Nrdot" in before else "not on the card before"
        text, files = (
            f"N_rdot' = {value:.4g}{spread} ({was}) of {ship.name}, by {result.method}",
            {path: ship.card.text},
        )
    return _with_notice(replace(result, files=files), f"{path}: {text}")


@verb(
    "added yaw inertia and dissipation from records of a yaw rig",
    Output("-o", CARD, "Write the card of the ship, or a card of the rig.", write_yaw_card, "CARD.toml"),
    results=("tank2sim.apps.rigs.yaw.result:YawResult",),
)
def yaw(
    records: str | Path | pd.DataFrame | Sequence[str | Path | pd.DataFrame],
    *,
    inertia_kgm2: YawInertia | None = None,
    inertia_error_kgm2: YawInertiaError | None = None,
    torque_constant_NmpA: TorqueConstant | None = None,
    reference: str | Path | pd.DataFrame | None = None,
    reference_inertia_kgm2: YawInertia | None = None,
    rig: Vessel | Card | str | Path | None = None,
    terms: str | Sequence[str] | None = None,
    mirror_percent: Percent = 25.0,
    method: YawMethod = "energy_least_squares",
    theory: str | None = None,
    simulate: Vessel | Card | str | Path | None = None,
    medium: Literal["water", "air"] = "water",
    controller: Literal["tuned", "adaptive"] = "tuned",
    similar_to: str | None = None,
    noise_A: CurrentNoise = 0.0,
) -> YawResult:
    """Estimate added yaw inertia and dissipation from records of the yaw rig (Alyshev 2019).

    Records have the columns t_s, phi_rad and current_A; comments of the file state the programme. Records in air
    (``# medium: air``) give J_zz.

    Parameters
    ----------
    records : path, DataFrame, or sequence of them
        CSV files of the records; the ``attrs`` of a data frame are its comments.
    inertia_kgm2 : float, optional
        J_zz of body and rotor, kg m2; by default from records in air, or as the file says.
    inertia_error_kgm2 : float, optional
        Standard error of J_zz, kg m2.
    torque_constant_NmpA : float, optional
        k_t, N m/A; by default as the records say.
    reference : path or DataFrame, optional
        Record in air of a body of known inertia, from which k_t is taken.
    reference_inertia_kgm2 : float, optional
        Inertia of the body of the reference, kg m2.
    rig : Vessel, Card, str or path, optional
        Card of the rig; its walls, gravity, and inertias of accelerating and braking are taken into account.
    terms : str or sequence of str, optional
        Terms in addition to the inertia, of coulomb, viscous, quadratic, braking_quadratic, gravity_sine,
        gravity_cosine, with commas between; by default the terms of (3) for the medium.
    mirror_percent : float
        Largest difference of mirror images that is accepted, % of the largest rate.
    method : str
        Method whose estimates a card gets.
    theory : str, optional
        Also compare with (7) to (9) for ``"L,B,T,H"`` or ``"L,B,T,H,CB"``: length, beam, draught and depth of water in
        m, block coefficient; or for a card with these.
    simulate : Vessel, Card, str or path, optional
        Card of a rig. Its record is simulated and written to the one file of records first.
    medium : str
        Medium of the simulated body; air leaves out the water, and keeps the friction f_c and f_1 of the card.
    controller : str
        Controller of the simulated rig: ``tuned`` is (4), ``adaptive`` is (6).
    similar_to : str, optional
        Motion of a ship that the simulated body follows at its size: ``"L,B,R,T"``, length and beam in m, yaw rate in
        deg/min, time in s; by default the programme of the card.
    noise_A : float
        Noise of the simulated current, A, standard deviation.

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
    from tank2sim.apps.rigs.yaw.identify import YawOptions, identify_yaw, parse_yaw_terms
    from tank2sim.apps.rigs.yaw.records import read_yaw_record
    from tank2sim.apps.rigs.yaw.result import YawResult
    from tank2sim.apps.rigs.yaw.simulation import RigRun, rig_card_of
    from tank2sim.apps.rigs.yaw.theory import parse_body, theory_values
    from tank2sim.records.csv_table import tables_or_paths

    constant = _torque_constant(torque_constant_NmpA, reference, reference_inertia_kgm2)
    known = None if rig is None else rig_card_of(rig)
    options = YawOptions(
        inertia_kgm2=inertia_kgm2,
        inertia_error_kgm2=inertia_error_kgm2,
        torque_constant_NmpA=constant[0],
        torque_constant_error=constant[1],
        known=known.yaw_rig if known else None,
        terms=parse_yaw_terms(terms or ()),
        mirror_limit=mirror_percent / 100,
    )
    body = parse_body(theory) if theory else None
    sources = tables_or_paths(records, "records")

    def result(read: Sequence[YawRecord]) -> YawResult:
        found = identify_yaw(read, options)
        used = tuple(record for record in read if record.medium == found.medium)
        values = theory_values(body, used[0].programme.max_rate_radps) if body else []
        return YawResult(replace(found, theory=tuple(values)), method, used, known)

    run = RigRun(medium, controller, similar_to, noise_A)
    if simulate is not None:
        return _simulated(simulate, sources, run, result)
    if run != RigRun():
        argument = next(name for name, value in vars(RigRun()).items() if getattr(run, name) != value)
        raise ArgumentError(argument, "", "is of a simulated rig", "give the card to simulate as well")
    return result([read_yaw_record(source) for source in sources])


def _torque_constant(
    given_NmpA: float | None, reference: str | Path | pd.DataFrame | None, reference_inertia_kgm2: float | None
) -> tuple[float | None, float]:
    """k_t (N m/A) and its relative standard error: from a body of known inertia in air, else as given."""
    from tank2sim.apps.rigs.yaw.identify import identify_yaw, torque_constant
    from tank2sim.apps.rigs.yaw.records import read_yaw_record
    from tank2sim.records.csv_table import table_or_path

    if reference is None and reference_inertia_kgm2 is None:
        return given_NmpA, 0.0
    if reference is None or reference_inertia_kgm2 is None:
        missing = "reference" if reference is None else "reference_inertia_kgm2"
        raise ArgumentError(missing, "", "is missing", "give both, the reference and its inertia, or neither")
    in_air = identify_yaw([read_yaw_record(table_or_path(reference, "reference"))])
    return torque_constant(in_air, reference_inertia_kgm2)


def _simulated(
    simulate: Vessel | Card | str | Path,
    sources: Sequence[Path | CsvTable],
    run: RigRun,
    result: Callable[[Sequence[YawRecord]], YawResult],
) -> YawResult:
    """The result of a simulated record, which is written to the one file of `sources`."""
    from tank2sim.apps.rigs.yaw.records import yaw_record_text
    from tank2sim.apps.rigs.yaw.simulation import rig_card_of, similarity_words, simulated_record

    path = sources[0] if sources else None
    if len(sources) != 1 or not isinstance(path, Path):
        raise ArgumentError("simulate", "", f"has {len(sources)} records to write", "give the name of one file")
    card = rig_card_of(simulate)
    record = simulated_record(card, path, run)
    try:
        found = result([record])
    except InputError as fault:
        if fault.source != str(path):
            raise
        problem = f"the record simulated of it: {fault.problem}"
        raise card.fault(fault.place, problem, fault.remedy) from None
    write_together({path: yaw_record_text(record)}, inputs=[Path(card.source)])
    return _with_notice(found, similarity_words(record, run.similar_to)) if run.similar_to else found


@checked
def simulate_yaw(
    card: Vessel | Card | str | Path,
    path: str | Path,
    *,
    medium: Literal["water", "air"] = "water",
    controller: Literal["tuned", "adaptive"] = "tuned",
    similar_to: str | None = None,
    noise_A: CurrentNoise = 0.0,
) -> Path:
    """Write the record that the yaw rig of a card would give, and return its file.

    Parameters
    ----------
    card : Vessel, Card, str or path
        Card of the rig with its body (``"alyshev"``).
    path : path
        The new file.
    medium, controller, similar_to, noise_A
        As of :func:`yaw`.

    Raises
    ------
    InputError
        The file exists, the card is not one of a yaw rig, or the motor saturates.
    """
    from tank2sim.apps.rigs.yaw.records import yaw_record_text
    from tank2sim.apps.rigs.yaw.simulation import RigRun, rig_card_of, simulated_record

    rig, path = rig_card_of(card), Path(path)
    record = simulated_record(rig, path, RigRun(medium, controller, similar_to, noise_A))
    write_together({path: yaw_record_text(record)}, inputs=[Path(rig.source)])
    return path


def _with_notice(result: YawResult, text: str) -> YawResult:
    return replace(result, study=replace(result.study, notices=(*result.study.notices, Notice(text))))
