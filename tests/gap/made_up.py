"""Small made-up findings of the gap workflow, one for each verdict; nothing is simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.gap.result import (
    AMBIGUOUS,
    COEFFICIENTS,
    MISSING,
    NO_EFFECT_MISSING,
    OUTSIDE_LIBRARY,
    Gap,
    MisfitPlace,
    MissingForce,
    Named,
    NextTest,
    Passed,
    Refitted,
    Rival,
)
from tank2sim.identification.trials.assessment.evaluation import FigureComparison
from tank2sim.notices import Notice

NOISE = {"motion.x": 0.5, "motion.psi": np.deg2rad(0.2), "motion.r": np.deg2rad(0.05), "motion.u": 0.02}
TIME = np.linspace(0.0, 99.0, 100)


def passed(name: str, before: float, after: float, *, held_out: bool = False) -> Passed:
    """A trial whose simulations err by these many standard deviations, everywhere; half of the headings are unknown."""
    measured = {variable: np.sin(TIME / 20) + 0 * TIME for variable in (*NOISE, "motion.y")}
    measured["motion.psi"] = np.where(TIME < 50, measured["motion.psi"], np.nan)
    noise = {**NOISE, "motion.y": 0.5}
    models = [
        {variable: np.sin(TIME / 20) + size * noise[variable] for variable in noise} for size in (before, after, 3.0)
    ]
    return Passed(name, held_out, TIME, noise, measured, *models)


def figures(factor: float) -> tuple[FigureComparison, ...]:
    return (
        FigureComparison("turn35", "advance_m", 500.0, 500.0 * factor),
        FigureComparison("zigzag", "overshoot_1_deg", 8.0, 8.0 * factor),
        FigureComparison("zigzag", "overshoot_2_deg", 9.0, None),
    )


def card() -> ManoeuvringCard:
    read = read_card("mariner")
    assert isinstance(read, ManoeuvringCard)
    return read


def force() -> MissingForce:
    heading = np.tile(np.linspace(0, 4 * np.pi, 100), 2)
    return MissingForce(
        equation="Y",
        trials=("turn35",) * 100 + ("zigzag",) * 100,
        time_s=np.tile(TIME, 2),
        force=2e6 * np.sin(heading) + np.repeat([1e4, -1e4], 100),
        states={"heading": heading, "rudder": 0.1 * heading, "speed": 7 + 0 * heading},
        explaining="heading",
        explained={"heading": 0.9, "rudder": 0.2, "speed": 0.0},
    )


def missing() -> Gap:
    """A current towards the west, named with two trials and held against a third."""
    current = Named(
        "current",
        {"speed_mps": 0.45, "direction_rad": -np.pi / 2},
        {"speed_mps": 0.02, "direction_rad": np.deg2rad(1.5)},
        0.97,
    )
    noise = {**{variable: (size, "estimated") for variable, size in NOISE.items()}, "motion.y": (0.5, "stated")}
    return Gap(
        card=card(),
        improved=card(),
        base=card(),
        verdict=MISSING,
        effects=(current,),
        coefficients=(),
        effect_alone={},
        alternatives=(),
        rivals=(Rival(("current",), 0.0, 0.97), Rival(("heading_offset",), 14.0, 0.02), Rival((), 5000.0, 0.0)),
        where=(
            MisfitPlace("turn35", "motion.x", 20.0, 80.0, 0.6),
            MisfitPlace("zigzag", "motion.psi", 10.0, 40.0, 0.1),
        ),
        equation="kinematics",
        noise=noise,
        waves=None,
        passed=(passed("turn35", 8.0, 1.0), passed("zigzag", 6.0, 1.0), passed("turn20", 9.0, 1.5, held_out=True)),
        figures_before=figures(1.1),
        figures_after=figures(1.01),
        missing_force=force(),
        at_work=(),
        could_hide={"rudder_bias": {"angle_rad": np.deg2rad(0.25)}, "linear_yaw_damping": {"factor": 0.05}},
        agreement={
            "current.speed": {"turn35": (0.44, 0.03), "zigzag": (0.47, 0.4), "turn20": (0.46, 0.03)},
            "current.direction": {"turn35": (np.deg2rad(268), 0.03), "zigzag": (np.deg2rad(-89), 0.03)},
        },
        next_test=NextTest(
            manoeuvre="turn:35",
            orders="t_s,delta_order_deg,n_rpm\n0,35,84\n",
            heading_rad=0.0,
            needs_instants=False,
            why="A turn tells most.",
            expected={"turn:35": 40.0},
        ),
        notices=(Notice("zigzag: y_m stood still for 1 s"),),
    )


def nothing() -> Gap:
    """The card follows both of its trials to the noise; none was held out, and little is reported."""
    trials = tuple(passed(name, 1.02, 1.02) for name in ("turn35", "zigzag"))
    return replace(
        missing(),
        verdict=NO_EFFECT_MISSING,
        effects=(),
        rivals=(Rival((), 0.0, 0.9), Rival(("current",), 6.0, 0.05)),
        where=(),
        equation="",
        passed=tuple(replace(trial, black_box={}) for trial in trials),
        figures_after=(),
        missing_force=None,
        agreement={},
        next_test=None,
        notices=(),
    )


def ambiguous() -> Gap:
    found = missing()
    return replace(
        found,
        verdict=AMBIGUOUS,
        effects=(replace(found.effects[0], confidence=0.5),),
        alternatives=(("current",), ("wind", "rudder_bias")),
    )


def outside() -> Gap:
    """A swell that no effect explains; one simulation leaves all bounds."""
    found = missing()
    lost = passed("turn35", 8.0, 8.0)
    gone = {name: np.where(TIME < 50, values, np.nan) for name, values in lost.before.items()}
    return replace(
        found,
        verdict=OUTSIDE_LIBRARY,
        effects=(),
        equation="sway",
        passed=(replace(lost, before=gone, after=gone), passed("zigzag", 6.0, 6.0)),
        could_hide={},
        figures_before=(),
        figures_after=(),
        agreement={},
        next_test=None,
    )


def explained() -> Gap:
    """A yaw damping of the card that is four of its standard errors off, or an effect that changes it alike."""
    found = missing()
    return replace(
        found,
        verdict=COEFFICIENTS,
        effects=(),
        coefficients=(Refitted("Nr", -0.0018, 2e-5, -0.0022, 1e-4), Refitted("Yr", 0.005, 1e-4, 0.005, 2e-4)),
        alternatives=(("linear_yaw_damping",),),
        rivals=(Rival((), 0.0, 0.96), Rival(("linear_yaw_damping",), 8.8, 0.04)),
        equation="",
        agreement={},
        next_test=None,
    )


EVERY = {
    MISSING: missing,
    NO_EFFECT_MISSING: nothing,
    AMBIGUOUS: ambiguous,
    OUTSIDE_LIBRARY: outside,
    COEFFICIENTS: explained,
}
