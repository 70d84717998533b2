"""The result of a gap: its words, tables and charts hold the numbers of the study, whatever the verdict."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tank2sim.answer.charts.before_after import in_noise
from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.parts import Verdict
from tank2sim.gap.outcome.export import gap_study
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, OUTSIDE_LIBRARY, Gap, Passed, Rival
from tank2sim.results.gap import NO_TRIALS, GapResult, gap_result
from tank2sim.results.gap_cause_charts import agreement_chart, rival_chart
from tank2sim.results.gap_charts import misfit_chart, shown_places, worst_replays
from tank2sim.results.gap_text import found_in_words, probabilities_in_words, with_error
from tests.answer.drawn import rows_of
from tests.gap import made_up
from tests.marks import first_fast


def result_of(gap):
    return gap_result(gap, NO_TRIALS, NO_TRIALS)


def charts_of(gap):
    return result_of(gap)._charts()


def words_of(gap):
    return found_in_words(gap_study(gap))


@pytest.fixture(scope="module")
def charts():
    return charts_of(made_up.missing())


def tables_of(gap):
    return {table.caption: table for table in result_of(gap).tables}


@first_fast("verdict", made_up.EVERY)
def test_every_verdict_has_a_whole_page_which_its_json_gives_again(verdict) -> None:
    result = result_of(made_up.EVERY[verdict]())
    html = result.page()
    assert verdict in html and "nan" not in html.partition("<script")[0].lower()
    assert sum(len(section.charts) for section in result.sections) == len(result._charts())
    assert all(section.text or section.tables or section.charts for section in result.sections)
    first = result.key_figures[0]
    assert (first.value, first.note) == ("current", verdict) if verdict == MISSING else first.value == verdict
    assert (first.verdict is Verdict.CAUTION) == (verdict in (AMBIGUOUS, OUTSIDE_LIBRARY))
    read = GapResult.read(json.loads(result.to_json()), "gap.json")
    assert read.page() == html and read.card is None
    with pytest.raises(LookupError):
        _ = read.improved


def test_frames_hold_the_effect_with_its_parameters_and_the_misfit_of_each_trial() -> None:
    result = result_of(made_up.missing())
    assert result.effects["value"].to_list() == pytest.approx([0.45, 270.0])
    assert result.effects["standard_error"].to_list() == pytest.approx([0.02, 1.5])
    assert result.misfit.loc["turn20"].to_list() == [True, pytest.approx(9.0), pytest.approx(1.5)]
    assert result.coefficients.empty and result.surroundings.empty


def test_a_named_effect_is_reported_in_words_and_in_a_mariners_units() -> None:
    words = words_of(made_up.missing())
    assert "current (speed 0.45 ± 0.02 m/s, direction towards 270.0 ± 1.5 deg)" in words
    assert "The water moves over the ground" in words
    (row,) = (row for row in tables_of(made_up.missing())["What was found, ± one standard error"].rows[1:])
    assert row[:4] == ["current", "direction towards", "270.0 ± 1.5", "deg"]


def test_a_sensor_at_fault_is_not_called_a_fault_of_the_model() -> None:
    gap = made_up.missing()
    gyro = replace(gap.effects[0], name="gyro_bias", parameters={"rate_radps": np.deg2rad(0.1)}, standard_errors={})
    words = words_of(replace(gap, effects=(gyro,)))
    assert words.startswith("A sensor is at fault, not the model: gyro bias (rate 0.1 deg/s)")


def test_ambiguity_names_each_explanation_once() -> None:
    gap = made_up.ambiguous()
    candidates = "do not distinguish several explanations: current, or wind with rudder bias."
    assert candidates in words_of(gap)
    assert "The improved card has current." in words_of(gap)
    reported = tables_of(gap)["Effects that these data cannot distinguish"].rows
    assert [row[0] for row in reported] == ["current", "wind", "rudder bias"]


@pytest.mark.parametrize(("after", "whole"), [(1.0, True), (16.0, False)])
def test_an_explanation_is_all_that_is_missing_only_where_the_trials_are_followed(after: float, whole: bool) -> None:
    gap = replace(made_up.missing(), passed=(made_up.passed("turn35", 90.0, after),))
    lines = probabilities_in_words(gap_study(gap))
    assert sum("all that is missing" in line for line in lines) == whole


@pytest.mark.parametrize(
    ("probability", "said"), [(0.15, "nothing is missing (15 %)"), (0.004, "has a probability of 1 % or more")]
)
def test_the_likeliest_explanation_without_a_named_effect_is_reported_with_its_probability(probability, said) -> None:
    gap = made_up.missing()
    lag = Rival(("rudder_lag",), 9.0, 0.003)
    rivals = (Rival(("current",), 0.0, 0.8), Rival(("current", "wind"), 3.0, 0.05), lag, Rival((), 19.0, probability))
    text = result_of(replace(gap, rivals=rivals)).sections[1].text
    assert said in text and "rudder lag" not in text


def test_what_coefficients_that_explain_the_gap_may_be_instead_is_on_the_page() -> None:
    (section,) = (
        section for section in result_of(made_up.explained()).sections if section.heading.startswith("How sure")
    )
    assert "coefficients that are off from linear yaw damping" in section.text
    assert "largest changes are Nr by 4.0" in words_of(made_up.explained())
    assert [row[0] for row in section.tables[0].rows] == ["linear yaw damping"]
    assert "4 %" in json.dumps(rival_chart(gap_study(made_up.explained())))


@pytest.mark.parametrize(
    ("none", "other", "said"),
    [
        (0.64, 0.36, ["Probability that no tried effect is missing: 64 %; most probable otherwise: wind (36 %)."]),
        (0.998, 0.002, ["Probability that no tried effect is missing: 99 %."]),
        (0.3, 0.6, []),  # the name was withheld by simulations
    ],
)
def test_a_card_that_lacks_nothing_has_the_probability_that_it_does(none, other, said) -> None:
    rivals = (Rival(("wind",), 0.0, other), Rival((), 6.0, none))
    for gap in (made_up.nothing(), made_up.explained()):
        page = result_of(replace(gap, rivals=rivals))
        assert [*page.headline[1:]] == probabilities_in_words(page.study)
        figures = [figure for figure in page.key_figures if figure.label == "Probability that nothing is missing"]
        assert len(figures) == len(said) and all(figure.value in said[0] for figure in figures)
        assert all((figure.verdict is Verdict.CAUTION) == (none < 0.9) for figure in figures)
        words = [line.replace(", if the coefficients may be so far off", "") for line in page.headline[1:]]
        assert words == said and (words != [*page.headline[1:]]) == bool(said and gap.alternatives)


def test_outside_the_library_the_best_of_what_was_tried_is_on_the_page_and_no_test_is_promised() -> None:
    gap = replace(made_up.outside(), rivals=(Rival(("wind", "rudder_lag"), 0.0, 0.99), Rival((), 90.0, 0.01)))
    sections = {section.heading: section for section in result_of(gap).sections}
    assert "is wind with rudder lag" in sections["How sure, and what else it could be"].text
    assert "Next test" not in sections
    page = result_of(replace(gap, rivals=(Rival((), 0.0, 0.9), Rival(("wind",), 9.0, 0.1))))
    assert "what was tried" not in page.sections[1].text


def test_three_effects_are_listed_and_each_has_its_probability() -> None:
    gap = made_up.missing()
    others = [
        replace(gap.effects[0], name=name, parameters={}, standard_errors={}, confidence=0.91)
        for name in ("hull_fouling", "trim")
    ]
    study = gap_study(replace(gap, effects=(*gap.effects, *others)))
    assert "), hull fouling and trim." in found_in_words(study)
    line = probabilities_in_words(study)[0]
    whole = Rival(("current", "hull_fouling", "trim"), 0.0, 0.9)
    assert "current with hull fouling and trim are all" in probabilities_in_words(replace(study, rivals=(whole,)))[1]
    assert line == "Probability that each effect is there: current 97 %; hull fouling 91 %; trim 91 %."


def test_a_sensor_at_fault_next_to_an_effect_of_the_ship_is_not_lacking_in_the_model() -> None:
    gap = made_up.missing()
    gyro = replace(gap.effects[0], name="gyro_bias", parameters={"rate_radps": np.deg2rad(0.1)}, standard_errors={})
    words = words_of(replace(gap, effects=(gyro, *gap.effects)))
    lacking, fault = words.split(" A sensor is at fault: ")
    assert lacking.startswith("The model lacks an effect: current (") and fault.startswith(
        "gyro bias (rate 0.1 deg/s)."
    )


def test_an_effect_that_only_scores_better_is_mentioned_without_a_probability() -> None:
    gap = made_up.missing()
    named = tuple(effect.name for effect in gap.effects)
    first = replace(gap.rivals[0], effects=(*named, "rudder_lag"), probability=0.98)
    second = replace(gap.rivals[0], effects=named, loss=40.0, probability=0.02)
    lines = probabilities_in_words(gap_study(replace(gap, rivals=(first, second))))
    (mentioned,) = [line for line in lines if "rudder lag" in line]
    assert "%" not in mentioned and not any("all that is missing" in line for line in lines)


def test_nothing_missing_says_how_well_the_card_follows() -> None:
    gap = made_up.nothing()
    assert "follows the fitting trials to 1.02 times the noise" in words_of(gap)
    page = result_of(gap)
    heads = [column.title for column in tables_of(gap)["Misfit of each trial in units of the noise"].columns]
    assert heads == ["trial", "set", "before"]
    assert "How well the card follows" in [section.heading for section in page.sections]
    worse = replace(gap, passed=tuple(made_up.passed(one.name, 4.0, 4.0) for one in gap.passed))
    assert "4 times the noise, which is more than noise" in words_of(worse)


def test_misfits_stand_before_and_after_next_to_the_black_box() -> None:
    tables = tables_of(made_up.missing())
    signals = tables["Misfit of each signal in units of the noise"]
    assert [column.title for column in signals.columns[1:4]] == [
        "held out, before",
        "held out, after",
        "held out, black box",
    ]
    assert signals.rows[0] == ["north", 9.0, 1.5, 3.0, pytest.approx(7.07), 1.0, 3.0]
    assert signals.rows[-1] == ["all", 9.0, 1.5, 3.0, pytest.approx(7.07), 1.0, 3.0]
    assert tables["Misfit of each trial in units of the noise"].rows[0] == ["turn20", "held out", 9.0, 1.5, 3.0]
    assert tables["Figures in m"].rows == [
        ["turn35", "fitting", "advance", 500.0, pytest.approx(550), pytest.approx(505)]
    ]


def test_the_map_has_a_cell_for_each_signal_and_trial_before_and_after() -> None:
    cells = [row for row in rows_of(misfit_chart(gap_study(made_up.missing()))) if "misfit" in row]
    assert len(cells) == 2 * 3 * 5
    held = [row for row in cells if row["trial"] == "turn20" and row["signal"] == "psi"]
    assert {row["text"] for row in held} == {"9.0", "1.5"}


def test_what_left_all_bounds_is_darkest_and_infinite() -> None:
    cells = [row for row in rows_of(misfit_chart(gap_study(made_up.outside()))) if row.get("trial") == "turn35"]
    lost = [row for row in cells if row["signal"] != "psi"]  # of which nothing is measured where the motion is lost
    assert {row["text"] for row in lost} == {"∞"} and {row["misfit"] for row in lost} == {100.0}
    assert gap_study(made_up.outside()).set_misfit("before", held_out=False, signal="x_m") == np.inf


def test_places_show_what_is_left_in_the_units_of_the_column(charts) -> None:
    chart = chart_specification(charts["places"])
    titles = [panel["title"]["text"] for panel in chart["concat"]]
    assert titles == ["turn35 · north", "zigzag · heading"]
    below = chart["concat"][1]["vconcat"][1]
    rows = chart["datasets"][below["data"]["name"]]
    for run, size in (("card before", 1.2), ("card found", 0.2)):
        assert {round(row["v"], 4) for row in rows if row["run"] == run} == {size}
    (band,) = (row for row in rows_of(charts["places"]) if row.get("high") == pytest.approx(0.4))
    assert band["low"] == pytest.approx(-0.4)


def test_without_places_the_largest_misfits_are_shown() -> None:
    gap = made_up.nothing()
    worse = replace(gap, passed=(*gap.passed, made_up.passed("worst", 5.0, 5.0)))
    assert {place.trial for place in shown_places(gap_study(worse))[:5]} == {"worst.csv"}


def test_tracks_are_of_their_own_set() -> None:
    found = gap_study(made_up.missing())
    names = [[replay.trial for replay in worst_replays(found, held_out=held)] for held in (True, False)]
    assert names == [["turn20"], ["turn35", "zigzag"]]


def test_the_missing_force_is_drawn_over_one_turn_of_the_compass() -> None:
    rows = rows_of(charts_of(replace(made_up.missing(), effects=(), equation="sway"))["force"])
    means = [row for row in rows if row.get("trials") == 2]
    assert len(means) == 12 and all(0 <= row["s"] < 360 for row in rows if "s" in row)
    assert max(row["f"] for row in means) == pytest.approx(2.0, abs=0.1)  # MN
    assert np.sign(np.interp([90.0, 270.0], *zip(*[(row["s"], row["f"]) for row in means], strict=True))).tolist() == [
        1,
        -1,
    ]


def test_directions_of_trials_lie_next_to_each_other(charts) -> None:
    rows = [row for row in rows_of(charts["agreement"]) if row.get("name") == "zigzag"]
    assert {round(row["v"], 3) for row in rows} == {0.47, 271.0}


def test_across_north_too() -> None:
    """All trials together say 359 deg, one alone 1 deg: it is drawn at 361 deg."""
    gap = made_up.missing()
    north = replace(gap.effects[0], parameters={"direction_rad": np.deg2rad(-1.0)})
    alone = {"current.direction": {"turn35": (np.deg2rad(1.0), 0.01)}}
    rows = rows_of(agreement_chart(gap_study(replace(gap, effects=(north,), agreement=alone))))
    assert [row["v"] for row in rows if row.get("name") == "turn35"] == [pytest.approx(361)]


def test_rivals_are_ranked_and_none_is_always_among_them() -> None:
    gap = made_up.missing()
    many = tuple(Rival((f"effect_{place}",), 10.0 + place, 0.0) for place in range(20))
    rows = rows_of(rival_chart(gap_study(replace(gap, rivals=(*many, *gap.rivals)))))
    names = [row["name"] for row in rows]
    assert names[:2] == ["current", "effect 0"] and names[-1] == "no effect (coefficients alone)" and len(names) == 13


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (121.26, 2.04, "121.3 ± 2.0"),
        (-0.012, 0.2, "−0.01 ± 0.20"),
        (0.45, np.nan, "0.45"),
        (3.2e-5, 1.1e-6, "3.2×10⁻⁵ ± 1.1×10⁻⁶"),
    ],
)
def test_a_value_is_reported_to_two_figures_of_its_error(value, error, shown) -> None:
    assert with_error(value, error) == shown


@pytest.mark.parametrize(("misfit", "text"), [(0.98, "1.0"), (9.97, "10"), (251.3, "251"), (3e5, "3e5"), (np.inf, "∞")])
def test_a_misfit_fits_into_its_cell(misfit, text) -> None:
    assert in_noise(misfit) == text


@pytest.mark.slow
def test_thirteen_trials_take_little_of_the_page() -> None:
    gap = made_up.missing()
    trials = tuple(made_up.passed(f"trial_{place}", 5.0, 1.0, held_out=place > 6) for place in range(13))
    charts = charts_of(replace(gap, passed=trials))
    assert sum(len(json.dumps(chart_specification(chart))) for chart in charts.values()) < 2e6


def test_what_was_found_but_not_measured_does_not_break_the_page() -> None:
    """One trial has nothing but a heading: no tracks, and no cells of what it lacks."""
    gap = made_up.missing()
    turn = gap.passed[0]
    gone = {name: np.full(100, np.nan) for name in turn.measured}
    blind = replace(turn, measured={**gone, "motion.psi": turn.measured["motion.psi"]})
    blind_gap = replace(gap, passed=(blind,), where=(), verdict=NO_EFFECT_MISSING, effects=())
    assert len(tables_of(blind_gap)["Misfit of each signal in units of the noise"].rows) == 2
    assert words_of(replace(blind_gap, verdict=MISSING))


def carried() -> Gap:
    """Trials whose positions run away with 0.5 m/s to the east of what log and heading say."""

    def trial(name: str) -> Passed:
        time = np.arange(0.0, 400.0, 0.5)
        psi = 0.02 * time
        rng = np.random.default_rng(len(name))
        true = {
            "motion.u": 5.0 + 0 * time,
            "motion.v": 0 * time,
            "motion.psi": psi,
            "motion.r": 0.02 + 0 * time,
            "motion.x": 250 * np.sin(psi),
            "motion.y": -250 * np.cos(psi),
        }
        sizes = [0.02, 0.02, 2e-3, 3e-4, 0.5, 0.5]
        noise = dict(zip(true, sizes, strict=True))
        seen = {key: values + noise[key] * rng.standard_normal(len(time)) for key, values in true.items()}
        seen["motion.y"] = seen["motion.y"] + 0.5 * time
        return Passed(name, False, time, noise, seen, true, true)

    return replace(made_up.missing(), passed=(trial("turn35"), trial("zigzag")))


@pytest.mark.slow
def test_a_fault_of_kinematics_shows_the_missing_velocity_and_no_force() -> None:
    gap = carried()
    drawn = charts_of(gap)
    assert {"signal", "when_signal"} <= set(drawn) and not {"force", "when_force"} & set(drawn)
    means = [row["f"] for row in rows_of(drawn["signal"]) if row.get("trials") == 2]
    assert np.mean(means) == pytest.approx(0.5, abs=0.02)
    assert "missing velocity to east (m/s)" in json.dumps(chart_specification(drawn["when_signal"]))
    (where,) = (section for section in result_of(gap).sections if section.heading == "Where the gap is")
    assert "No force is missing" in where.text and "the motion over the ground" in where.text
    forced = replace(gap.effects[0], name="rudder_bias", parameters={}, standard_errors={})
    both = charts_of(replace(gap, effects=(*gap.effects, forced)))
    assert {"signal", "force"} <= set(both)


def test_each_probability_says_of_what_it_is() -> None:
    gap = made_up.missing()
    some = (Rival(("current",), 0.0, 0.55), Rival(("current", "wind"), 3.0, 0.4), Rival((), 50.0, 0.0))
    page = result_of(replace(gap, rivals=some))
    text = page.sections[1].text
    assert "Probability that the effect is there, alone or with another one: current 97 %." in text
    assert "Probability that current alone is all that is missing, among the explanations compared: 55 %." in text
    (card,) = (figure for figure in page.key_figures if figure.label.startswith("Probability"))
    assert card.note == "alone or with another effect"
    assert "as a whole" in json.dumps(rival_chart(gap_study(gap)))


def test_what_the_others_would_be_is_reported_and_they_do_not_hide() -> None:
    gap = made_up.ambiguous()
    test = gap.next_test
    assert test is not None
    sizes = {"wind": ({"speed_mps": 11.0}, {"speed_mps": 2.0}), "current": ({"speed_mps": 0.5}, {})}
    tables = tables_of(replace(gap, next_test=replace(test, sizes=sizes)))
    (row,) = tables["What the others would be, ± one standard error"].rows
    assert row[:4] == ["wind", "speed", "11 ± 2", "m/s"]
    assert [row[0] for row in tables["Sizes that these data cannot show"].rows] == ["linear yaw damping"]


def test_what_replaces_something_of_the_card_has_no_up_to() -> None:
    gap = replace(made_up.missing(), could_hide={"rudder_lag": {"time_constant_s": 1.04}, "trim": {"by_stern_m": 0.1}})
    lag, trim = tables_of(gap)["Sizes that these data cannot show"].rows
    assert lag[2] == "1 in place of the card's" and trim[2] == "up to 0.1"


@pytest.mark.parametrize("effect", ["rudder_lag", "trim"])
def test_a_steering_gear_is_mentioned_only_where_one_is_judged(effect: str) -> None:
    hidden = {"rudder_lag": {"time_constant_s": 1.04}} if effect == "rudder_lag" else {"trim": {"by_stern_m": 0.1}}
    sections = {
        section.heading: section for section in result_of(replace(made_up.missing(), could_hide=hidden)).sections
    }
    assert ("steering gear" in sections["What could hide"].text) is (effect == "rudder_lag")


def test_a_name_that_leaves_much_of_the_gap_is_reported_with_caution() -> None:
    gap = made_up.missing()
    poor = replace(gap, passed=tuple(made_up.passed(one.name, 9.0, 5.0, held_out=one.held_out) for one in gap.passed))
    words = [caution.line for caution in result_of(poor).cautions]
    # sqrt((5^2 - 1)/(9^2 - 1)) = 0.55; a black box of 3 is better
    assert words[0].startswith("CHECK: named, but 55 % of the gap of the held-out trials remains")
    assert "a linear black box with as many coefficients follows the held-out trials better" in words[1]
    assert result_of(poor).key_figures[0].verdict is Verdict.CAUTION
    assert not result_of(gap).cautions
