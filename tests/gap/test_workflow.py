"""The whole gap workflow, from files to a name and its proof, on a few manoeuvres of a generator of hidden truths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from gap_truth import Made, Setting, make, sampled, write, wrong_card

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.errors import InputError
from tank2sim.gap.outcome.export import in_file_units
from tank2sim.gap.result import AMBIGUOUS, COEFFICIENTS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY, Gap
from tank2sim.gap.workflow import GapOptions, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import measured

FOUR = ("zigzag20_20", "turn35_stbd", "pullout_stbd", "straight")
HELD = ("turn35_port",)
SEED = 1


@dataclass(frozen=True)
class Case:
    made: Made
    gap: Gap

    @property
    def named(self) -> set[str]:
        return {named.name for named in self.gap.effects}

    @property
    def sole(self) -> bool:
        """Whether one name is said, as if it were sure."""
        return self.gap.verdict == MISSING

    def found(self, effect: str) -> dict[str, tuple[float, float, float]]:
        """What is in the truth of an effect: value found, its standard error, and truth, in the units of files."""
        (named,) = [named for named in self.gap.effects if named.name == effect]
        values = dict(in_file_units(name, value) for name, value in named.parameters.items())
        errors = dict(in_file_units(name, value) for name, value in named.standard_errors.items())
        return {name: (values[name], errors[name], true) for name, true in self.made.parameters[effect].items()}


def sought(
    folder: Path, made: Made, held: tuple[str, ...] = (), options: GapOptions | None = None, *, wrong: float = 0.0
) -> Case:
    write(made, folder)
    if wrong:
        (folder / "ship.toml").write_text(wrong_card(made, wrong), encoding="utf-8")
    card = read_card(folder / "ship.toml")
    assert isinstance(card, ManoeuvringCard)
    groups = [[name for name in made.trials if (name in held) == out] for out in (False, True)]
    fitted, held = (measured([folder / f"{name}.csv" for name in names], card) for names in groups)
    return Case(made, run_gap_workflow(card, fitted, held, options or GapOptions(workers=1)))


def hidden(folder: Path, *effects: str, trials=FOUR, held=()) -> Case:
    """Out of the whole library."""
    (made,) = make([Setting(effects, SEED, manoeuvres=(*trials, *held))])
    return sought(folder, made, held)


def misfit_and_share(case: Case, *, held_out: bool) -> tuple[float, float]:
    """Misfit with what was found, in units of the noise, and as a share of that of the given card."""
    before, after = (case.gap.misfit(version, held_out=held_out) for version in ("before", "after"))
    assert before is not None and after is not None
    return after, after / before


FEW = GapOptions(workers=1, effects=("current", "gyro_bias"))


@pytest.fixture(scope="module")
def made() -> dict[str, Made]:
    """With a current and without, all in one batch."""
    trials = ("turn35_stbd", "straight")
    cases = make([Setting(("current",), SEED, manoeuvres=(*trials, *HELD)), Setting((), SEED, manoeuvres=trials)])
    return dict(zip(("current", "nothing"), cases, strict=True))


@pytest.mark.essential
@pytest.mark.slow
def test_a_current_is_found_and_proved_on_a_trial_held_out(made, tmp_path: Path) -> None:
    case = sought(tmp_path, made["current"], HELD, FEW)
    assert case.gap.verdict == MISSING and case.named == {"current"}
    found = case.found("current")
    for name, tolerance in (("speed_mps", 0.02), ("direction_deg", 2.0)):
        value, error, true = found[name]
        assert (value - true + 180) % 360 - 180 == pytest.approx(0, abs=tolerance)
        assert 0 < error < tolerance
    after, share = misfit_and_share(case, held_out=True)
    assert after < 1.5 and share < 0.1
    assert case.gap.equation == "kinematics"


@pytest.mark.essential
@pytest.mark.slow
def test_a_trial_held_out_of_another_ship_changes_neither_the_name_nor_its_probability(made, tmp_path: Path) -> None:
    (other,) = make([Setting((), SEED, ship="tanker", manoeuvres=HELD)])
    foreign = replace(made["current"], trials={**made["current"].trials, **other.trials})
    gaps = [sought(tmp_path, each, HELD, FEW).gap for each in (made["current"], foreign)]
    assert gaps[0].verdict == gaps[1].verdict == MISSING
    for mine, others in zip(gaps[0].effects, gaps[1].effects, strict=True):
        assert (mine.name, mine.parameters, mine.confidence) == (others.name, others.parameters, others.confidence)
    assert gaps[0].rivals == gaps[1].rivals
    proved, missed = (gap.misfit("after", held_out=True) for gap in gaps)
    assert proved is not None and missed is not None and missed > 5 * proved


@pytest.mark.essential
@pytest.mark.slow
def test_where_nothing_is_hidden_nothing_is_named(made, tmp_path: Path) -> None:
    case = sought(tmp_path, made["nothing"], options=FEW)
    assert case.gap.verdict == NO_EFFECT_MISSING and case.named == set()
    assert set(case.gap.could_hide) == set(FEW.effects or ())
    assert 0 < case.gap.could_hide["current"]["speed_mps"] < 0.1  # of which a real one has 0.3 m/s and more
    assert case.gap.misfit("before", held_out=False) == pytest.approx(1.0, abs=0.4)


@pytest.mark.slow
def test_an_effect_that_cannot_be_tried_is_refused(made, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="rudder_walk cannot be tried"):
        sought(tmp_path, made["nothing"], options=GapOptions(workers=1, effects=("rudder_walk",)))


# -- the whole library, every class of effect ----------------------------------------------------------------------

WITHIN = {
    "current": {"speed_mps": 0.02, "direction_deg": 2.0},
    "rudder_rate_limit": {"max_rate_degps": 0.1},
    "cross_flow_drag": {"drag_coefficient": 0.06},
    "rudder_stall": {},  # in another form than ours: its numbers mean something else
    "gyro_bias": {"rate_degps": 0.002},
}
"""How far from the truth the numbers may be."""

FORMED = {"cross_flow_drag": 0.15, "rudder_stall": 0.7}
"""What may be left of the misfit of a trial held out, where the truth is of another form than ours; else the noise."""


@pytest.mark.long
@pytest.mark.parametrize("effect", WITHIN)
def test_a_hidden_effect_is_named_out_of_the_whole_library(effect: str, tmp_path: Path) -> None:
    case = hidden(tmp_path, effect, held=HELD)
    assert case.gap.verdict == MISSING and case.named == {effect}
    for name, tolerance in WITHIN[effect].items():
        value, error, true = case.found(effect)[name]
        assert (value - true + 180) % 360 - 180 == pytest.approx(0, abs=tolerance)
        assert 0 < error < 2 * tolerance
    (named,) = case.gap.effects
    assert 0.5 < named.confidence < 1
    after, share = misfit_and_share(case, held_out=True)
    assert share < FORMED[effect] if effect in FORMED else after < 1.5 and share < 1


@pytest.mark.long
def test_where_nothing_is_hidden_nothing_is_named_out_of_the_whole_library(tmp_path: Path) -> None:
    case = hidden(tmp_path)
    assert case.gap.verdict == NO_EFFECT_MISSING and case.named == set()
    assert case.gap.improved == case.gap.card


@pytest.mark.long
@pytest.mark.parametrize("outsider", ["out_tug", "out_oscillation"])
def test_what_no_effect_makes_is_said_to_be_outside_the_library(outsider: str, tmp_path: Path) -> None:
    case = hidden(tmp_path, outsider)
    assert case.gap.verdict == OUTSIDE_LIBRARY and case.named == set()
    assert any("no tried effect" in notice for notice in case.gap.notices)
    assert case.gap.improved == case.gap.card


@pytest.mark.long
@pytest.mark.parametrize("effects", [("current", "rudder_stall"), ("wind", "rudder_rate_limit")])
def test_two_hidden_effects_are_both_named(effects: tuple[str, str], tmp_path: Path) -> None:
    case = hidden(tmp_path, *effects)
    assert case.gap.verdict == MISSING and case.named == set(effects)
    _, share = misfit_and_share(case, held_out=False)
    assert share < 0.5


@pytest.mark.long
@pytest.mark.parametrize("effect", ["rudder_stall", "cross_flow_drag", "rudder_rate_limit", "linear_yaw_damping"])
def test_straight_runs_alone_never_make_a_wrong_name_sure(effect: str, tmp_path: Path) -> None:
    """What shows in turns alone cannot be reported from straight runs."""
    case = hidden(tmp_path, effect, trials=("straight", "accel"))
    assert case.gap.verdict in (NO_EFFECT_MISSING, AMBIGUOUS) or (case.sole and case.named == {effect})


@pytest.mark.slow
def test_three_hidden_effects_are_all_named(tmp_path: Path) -> None:
    (made,) = make([Setting(("engine_droop", "rudder_backlash", "cross_flow_drag"), SEED, manoeuvres=FOUR)])
    names = ("engine_droop", "rudder_backlash", "cross_flow_drag", "hull_fouling", "turning_drag", "gyro_bias")
    case = sought(tmp_path, made, options=GapOptions(workers=1, effects=names))
    assert case.sole and case.named == set(made.setting.effects)


SOME = GapOptions(workers=1, effects=("cross_flow_drag", "wind", "rudder_lag", "rudder_time_offset"))


@pytest.mark.long
def test_with_a_card_that_is_wrong_its_coefficients_are_fitted_together_with_the_effect(tmp_path: Path) -> None:
    (made,) = make([Setting(("cross_flow_drag",), SEED, manoeuvres=(*FOUR, *HELD))])
    case = sought(tmp_path, made, HELD, SOME, wrong=0.1)
    assert case.gap.verdict == MISSING and case.named == {"cross_flow_drag"}
    after, share = misfit_and_share(case, held_out=True)
    assert after < 2.5 and share < 0.05
    assert case.gap.effect_alone["holdout"] > 10 * after
    moved = {entry.name: entry for entry in case.gap.coefficients}
    for name, entry in moved.items():
        assert entry.value == pytest.approx(case.gap.improved.derivatives[name], abs=entry.standard_error)
        assert entry.before == case.gap.card.derivatives[name]
    ((value, error, true),) = case.found("cross_flow_drag").values()
    assert abs(value - true) < 4 * error


@pytest.mark.slow
def test_where_only_coefficients_are_wrong_they_are_the_explanation(tmp_path: Path) -> None:
    (made,) = make([Setting((), SEED, manoeuvres=(*FOUR, *HELD))])
    case = sought(tmp_path, made, HELD, SOME, wrong=0.1)
    assert case.gap.verdict == COEFFICIENTS and case.named == set()
    after, share = misfit_and_share(case, held_out=True)
    assert after < 2.0 and share < 0.1
    assert max(entry.moved for entry in case.gap.coefficients) > 1.0


@pytest.mark.parametrize("hertz", [pytest.param(2, marks=pytest.mark.long), pytest.param(1, marks=pytest.mark.slow)])
def test_an_order_that_is_sampled_once_a_second_is_not_taken_for_a_late_gear(tmp_path: Path, hertz: int) -> None:
    (made,) = make([Setting((), SEED, manoeuvres=FOUR)])
    gear = GapOptions(workers=1, effects=("rudder_lag", "rudder_time_offset", "rudder_rate_limit", "rudder_dead_band"))
    case = sought(tmp_path, sampled(made, hertz), options=gear)
    assert case.gap.verdict == NO_EFFECT_MISSING


@pytest.mark.long
def test_a_late_gear_is_found_in_orders_that_are_sampled_twice_a_second(tmp_path: Path) -> None:
    (made,) = make([Setting(("rudder_time_offset",), SEED, manoeuvres=FOUR)])
    case = sought(tmp_path, sampled(made, 2), options=SOME)
    assert case.named == {"rudder_time_offset"}
    ((value, error, true),) = case.found("rudder_time_offset").values()
    assert abs(value - true) < max(4 * error, 0.15)
