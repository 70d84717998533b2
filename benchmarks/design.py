"""Design studies of two bundled ships: stability and steady turning of each, and autopilots with their margins.

Prints the figures of the manual for ``tank2sim stability`` and ``tank2sim autopilot``, and the seconds that the
steering diagram takes, continuation through the unstable branch included, beside those of one simulated turn.
"""

from __future__ import annotations

import time
from importlib.util import find_spec

from tank2sim.analysis.heading.study import StudySettings, study_autopilot
from tank2sim.analysis.stability.study import stability_study
from tank2sim.analysis.turning.diagram import steady_turning
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.model import Model
from tank2sim.fmu.autopilot import make_autopilot_fmu, verify_together
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate

SHIPS = ("mariner", "kvlcc2-captive")
WAVE_FILTER = 0.6  # rad/s, between the bandwidth of the Mariner's loop and the waves of the default weather


def main() -> None:
    for name in SHIPS:
        card = read_card(name)
        assert isinstance(card, ManoeuvringCard)
        model = build(card)
        print(card.ship.name)
        _stability(model)
        for kind in ("pid", "lqr", *(["robust"] if find_spec("slycot") else [])):
            _autopilot(card, model, kind)
    if not find_spec("slycot"):
        print("slycot is not installed: no robust design")


def _stability(model: Model) -> None:
    found = stability_study(model)
    turning = found.steady_turning
    assert turning is not None
    folds = ", ".join(f"{fold.rudder_deg:.3f} deg" for fold in turning.folds) or "none"
    own, margin, verdict = found.operating_point, found.margins, found.stability_criterion
    words = "stable" if verdict.stable else "unstable"
    print(f"  {own.speed_mps:.4g} m/s, drift {own.drift_deg:.3g} deg, rudder {own.rudder_deg:.3g} deg: {words}")
    print(
        f"  C' = {verdict.C_prime:.4g}, margin {margin.margin_percent:.3g} %, levers "
        f"{margin.lever_margin_lengths:.3g} L apart; folds: {folds}"
    )
    ends = turning.points.yaw_rate_degps[[0, -1]]
    print(f"  steady turns at 35 deg to port and to starboard: {' and '.join(f'{rate:.3g}' for rate in ends)} deg/s")
    loop = turning.loop
    if loop:
        height = "unknown" if loop.height_degps is None else f"{loop.height_degps:.3f} deg/s"
        print(f"  hysteresis loop: {loop.width_deg:.2f} deg of rudder wide, {height} high")
    integrator = Integrator(model)
    simulate(model, parse_manoeuvre("turn:35"), integrator=integrator)  # compiled by now
    begin = time.perf_counter()
    simulate(model, parse_manoeuvre("turn:35"), integrator=integrator)
    middle = time.perf_counter()
    steady_turning(model)
    end = time.perf_counter()
    print(f"  steering diagram {end - middle:.2f} s, {(end - middle) / (middle - begin):.0f} simulated turns of 35 deg")


def _autopilot(card: ManoeuvringCard, model: Model, kind: str) -> None:
    study, piloted = study_autopilot(card, model, StudySettings(kind=kind))
    first = study.margins[0]
    print(
        f"  {kind}: phase margin {first.phase_margin_deg:.1f} deg, Ms {first.sensitivity_peak:.3f}, "
        f"delay margin {first.delay_margin_s:.1f} s"
    )
    loop = study.closed_loop
    large = {name: round(one.overshoot_deg, 2) for name, one in loop.course_changes.items() if name.startswith("large")}
    print(f"    overshoot of a 90 deg change (deg): {large}")
    print(f"    course keeping: heading {loop.course_keeping.heading_error_rms_deg:.3g} deg rms", end="")
    print(f", rudder {loop.course_keeping.rudder_rms_deg:.3g} deg rms")
    if kind == "pid":
        settings = StudySettings(kind=kind, wave_filter_radps=WAVE_FILTER)
        filtered = study_autopilot(card, model, settings)[0].closed_loop.course_keeping
        print(f"    with a wave filter: {filtered.heading_error_rms_deg:.3g}, {filtered.rudder_rms_deg:.3g} deg rms")
        agreement = verify_together(
            model, piloted.autopilot, make_autopilot_fmu(piloted.autopilot, study.source, fmi=3)
        )
        steps = ", ".join(f"{one.error_deg:.3g} deg at {one.step_s:g} s" for one in agreement.steps)
        print(f"    two FMUs against one model: {steps}; order {agreement.order:.2f}")


if __name__ == "__main__":
    main()
