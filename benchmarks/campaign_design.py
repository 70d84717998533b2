"""Designed captive campaigns on made-up ships, reduced: is the certainty of the figures as predicted, and what time is
saved against usual matrices?

For each ship of the generator (:mod:`tests.identification.captive.generator`, which shares no code with tank2sim) the
card that the design knows is wrong by 15 % in every derivative. The usual matrix of tank2sim takes its hours; the plan
is the shortest that is predicted to make every figure as certain. Both are made up with noise, zero and gain errors for
several seeds, reduced by ``reduce``, and the figures of the reduced ships are compared with those of the true one. The
same is predicted against the generator's own full matrix.

Last, a real tank's matrix: the 141 captive runs of the KVLCC2 at INSEAN, which gave no forces. How many runs of a plan
are predicted to be as certain? Needs the data folder (TANK2SIM_DATA).

    python benchmarks/campaign_design.py [SHIPS [SEEDS]]
    python benchmarks/campaign_design.py 0   # the real matrix alone
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tank2sim.analysis.influence.figures import parse_figure
from tank2sim.analysis.influence.study import Study
from tank2sim.apps.design.captive_runs import PlannedRun
from tank2sim.apps.design.command import design_campaign
from tank2sim.apps.design.figure_slopes import both_sides
from tank2sim.apps.design.tank_form import TankFile
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.errors import InputError
from tank2sim.identification.captive.reduction import ReductionOptions, reduce_campaign
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.generator import DENSITY, GRAVITY, NOISE_SHARE, Campaign, Run, Ship, ship, write

FIGURES = ("advance_m@35", "tactical_diameter_m@35", "overshoot_1_deg@10/10", "overshoot_1_deg@20/20")
BUNDLED = ("mariner", "kvlcc2-captive", "kvlcc2", "esso-osaka", "container")
FIRST_SEED = 401
RATE_HZ = 5.0
GAIN = 0.002
PRIOR_ERROR = 0.15


INSEAN = (
    Path(os.environ.get("TANK2SIM_DATA", Path(__file__).resolve().parents[2] / "shared"))
    / "data/kvlcc2_insean_runs/index_PMM.csv"
)
INSEAN_SHIPS = ("kvlcc2", "kvlcc2-captive")


def print_insean() -> None:
    """Runs and hours of a plan that is predicted to be as certain as INSEAN's matrix, and standard errors of both."""
    if not INSEAN.is_file():
        print(f"no matrix of INSEAN: there is no {INSEAN} (set TANK2SIM_DATA)")
        return
    for name in INSEAN_SHIPS:
        whole = design_campaign(name, figures=FIGURES, usual=INSEAN).design
        kinds = Counter(run.type for group in whole.usual for run in group)
        print(f"{name}: INSEAN's matrix, {sum(kinds.values())} runs in {whole.usual_hours:.1f} h: {dict(kinds)}")
        if whole.hours_needed is None:
            print("  no plan is as certain in these hours")
        else:
            short = design_campaign(name, figures=FIGURES, usual=INSEAN, hours=whole.hours_needed).design
            print(f"  a plan of {len(short.runs)} runs in {whole.hours_needed:.1f} h is as certain")
        for figure, plan, usual in zip(FIGURES, whole.standard_errors, whole.usual_standard_errors, strict=True):
            print(f"  {figure}: standard error in the same hours {plan:.3g}, by the matrix {usual:.3g}")


def main() -> int:
    if sys.argv[1:2] == ["0"]:
        print_insean()
        return 0
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 8
    shares, generator_shares, design_ratios, usual_ratios, measured, before = [], [], [], [], [], []
    seed = FIRST_SEED
    while len(shares) < wanted and seed < FIRST_SEED + 60:
        found = _one_ship(seed, seeds)
        seed += 1
        if found is None:
            continue
        share, generator_share, by_design, by_usual = found
        shares.append(share)
        generator_shares.append(generator_share)
        design_ratios.append(by_design[0] / by_design[1])
        usual_ratios.append(by_usual[0] / by_usual[1])
        measured.append(by_design[0] / by_usual[1])
        before.append(by_design[1] / by_usual[1])
    design, usual, both, predicted = (
        np.sqrt(np.mean(np.square(each))) for each in (design_ratios, usual_ratios, measured, before)
    )
    print(
        f"{len(shares)} ships: the plan needs {100 * np.median(shares):.0f} % of the hours of the usual matrix "
        f"(median; {100 * min(shares):.0f} to {100 * max(shares):.0f} %), {100 * np.median(generator_shares):.0f} % of "
        f"the generator's full matrix ({100 * min(generator_shares):.0f} to {100 * max(generator_shares):.0f} %)"
    )
    print(
        f"errors of figures after reduce over those predicted, rms of {seeds * len(FIGURES)} each: plan {design:.2f}, "
        f"usual matrix {usual:.2f}; errors by the plan over those by the usual matrix: {both / usual:.2f} "
        f"(predicted {predicted:.2f})"
    )
    _bundled()
    print_insean()
    return 0


def _bundled() -> None:
    """Predicted shares of the hours for bundled ships, with the assumed errors of the gauges."""
    for name in BUNDLED:
        both, one = (design_campaign(name, figures=FIGURES, one_side=one_side).design for one_side in (False, True))
        shares = [
            f"{100 * found.hours_needed / found.hours:.0f} %" if found.hours_needed else "no shorter plan"
            for found in (both, one)
        ]
        print(f"{name}: {shares[0]} of the hours of the usual matrix; for figures to one side alone {shares[1]}")


def _one_ship(seed: int, seeds: int) -> tuple[float, float, Sequence[np.ndarray], Sequence[np.ndarray]] | None:
    began = time.perf_counter()
    campaign = Campaign(seed=seed, size="full", rate_hz=RATE_HZ, gain_error=GAIN)
    model = ship(campaign)
    draw = np.random.default_rng([seed, 9])
    known = {name: value * (1 + PRIOR_ERROR * draw.standard_normal()) for name, value in model.derivatives.items()}
    try:
        sides = [side for text in FIGURES for side in both_sides(parse_figure(text))]
        truth = Study(_card(model, model.derivatives), sides)
        usual = design_campaign(_card(model, known), figures=FIGURES, tank=_tank(model))
    except InputError as error:
        print(f"ship {seed}: left out, {error}")
        return None
    hours = usual.design.hours_needed
    if hours is None:
        print(f"ship {seed}: no plan is as good as the usual matrix")
        return None
    plan = design_campaign(_card(model, known), figures=FIGURES, tank=_tank(model), hours=hours)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sheet = write(replace(campaign, rate_hz=2.0), folder / "sheet").path
        against = design_campaign(_card(model, known), figures=FIGURES, tank=_tank(model), usual=sheet)
        runs = {
            "plan": plan.design.runs,
            "usual": tuple(run for group in usual.design.usual for run in group),
        }
        errors = {
            kind: np.array([_errors(campaign, planned, truth, number, folder / kind) for number in range(1, seeds + 1)])
            for kind, planned in runs.items()
        }
    predicted = {"plan": plan.design.standard_errors, "usual": usual.design.usual_standard_errors}
    rms = {kind: np.sqrt(np.mean(values**2, axis=0)) for kind, values in errors.items()}
    share, generator_share = hours / usual.design.hours, (against.design.hours_needed or np.nan) / against.design.hours
    print(
        f"ship {seed}: {len(runs['plan'])} runs in {hours:.3g} h against {len(runs['usual'])} in "
        f"{usual.design.hours:.3g} h ({100 * share:.0f} %; of the generator's matrix {100 * generator_share:.0f} %)"
    )
    for row, figure in enumerate(FIGURES):
        print(
            f"  {figure:24s} {truth.base[2 * row]:9.4g}  predicted {predicted['plan'][row]:.3g} and "
            f"{predicted['usual'][row]:.3g}; rms error {rms['plan'][row]:.3g} and {rms['usual'][row]:.3g}"
        )
    print(f"  {time.perf_counter() - began:.0f} s", flush=True)
    return share, generator_share, (rms["plan"], predicted["plan"]), (rms["usual"], predicted["usual"])


def _errors(
    campaign: Campaign, planned: Sequence[PlannedRun], truth: Study, noise_seed: int, folder: Path
) -> np.ndarray:
    """Errors of the figures of the ship that ``reduce`` makes of a made-up campaign."""
    runs = [
        Run(
            f"run_{number}",
            run.type,
            run.drift_rad,
            run.rudder_rad,
            run.frequency_radps,
            run.sway_amplitude_m if run.type == "pure_sway" else run.velocity,
            run.record_s,
        )
        for number, run in enumerate(planned)
    ]
    written = write(replace(campaign, noise_seed=noise_seed), folder / str(noise_seed), runs)
    found = reduce_campaign(read_campaign(written.path), ReductionOptions(keep_going=True)).derivatives
    values = truth.values.copy()
    for place, parameter in enumerate(truth.parameters):
        if parameter.short in found and parameter.short != "X0":
            values[place] = found[parameter.short].value
    return (truth.figures_at(values) - truth.base).reshape(len(FIGURES), 2).mean(axis=1)


def _tank(model: Ship) -> TankFile:
    """A tank with the errors of the generator's gauges: of the noise, the part that is no vibration."""
    force, arm = NOISE_SHARE * model.force_N, 0.3 * model.length_m
    noise = np.sqrt(0.65) * force
    gauges = {"gain_relative": GAIN, "rate_hz": RATE_HZ, "X_noise_N": noise, "Y_noise_N": noise}
    gauges |= {"N_noise_Nm": noise * arm, "X_zero_N": force / 6, "Y_zero_N": force / 6, "N_zero_Nm": force / 6 * arm}
    shape = {"length_m": model.length_m, "speed_mps": model.speed_mps, "gravity_mps2": GRAVITY}
    return TankFile.model_validate({"gauges": {key: float(value) for key, value in gauges.items()}, "model": shape})


def _card(model: Ship, derivatives: dict[str, float]) -> ManoeuvringCard:
    """A card with these derivatives and a constant thrust against the resistance."""
    unit = 0.5 * DENSITY * model.length_m**3
    resistance = derivatives["X0"]
    listed = {name: value for name, value in derivatives.items() if name != "X0"}
    listed |= {"Xu": 2 * resistance, "Xuu": -resistance}
    listed.setdefault("Y0", 0.0)
    listed.setdefault("N0", 0.0)
    # What the regression may give and the ship has not, so that its error is felt.
    absent = [name for name in ("Y0", "N0") if listed[name] == 0.0]
    listed = {name: value for name, value in listed.items() if value}
    lines = [
        'format = "tank2sim-ship/1"',
        "[ship]",
        'name = "made up"',
        f"length_m = {model.length_m!r}",
        f"beam_m = {model.beam_m!r}",
        f"draught_m = {model.draught_m!r}",
        'source = "made up"',
        "[environment]",
        f"water_density_kgpm3 = {DENSITY}",
        f"gravity_mps2 = {GRAVITY}",
        "[model]",
        'kind = "abkowitz"',
        f"speed_mps = {model.speed_mps!r}",
        'scaling = "prime"',
        'speed_scale = "instantaneous"',
        'yaw_rate_terms = "hydrodynamic"',
        'rudder_sign = "starboard"',
        "[rigid_body]",
        f"mass = {model.mass_kg / unit!r}",
        f"yaw_inertia = {model.yaw_inertia_kgm2 / (unit * model.length_m**2)!r}",
        f"x_G = {model.x_G_m / model.length_m!r}",
        "[derivatives]",
        *(f"{name} = {float(value)!r}" for name, value in listed.items()),
        "[uncertainty]",
        *(f"{name} = {PRIOR_ERROR * abs(float(value))!r}" for name, value in listed.items()),
        *(f"{name} = 1e-6" for name in absent),
    ]
    card = parse_card("\n".join(lines) + "\n", "made up")
    assert isinstance(card, ManoeuvringCard)
    return card


if __name__ == "__main__":
    sys.exit(main())
