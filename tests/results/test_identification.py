"""The result of an identification shows the record, the motions by both cards, and the estimates."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim.answer.charts.picture import chart_specification
from tank2sim.answer.parts import Verdict
from tank2sim.cards import parse_card
from tank2sim.identification.trials.assessment.evaluation import comparison_windows
from tank2sim.identification.trials.assessment.identifiability import share_from_trials
from tank2sim.identification.trials.identify import identify_trials
from tank2sim.identification.trials.options import IdentificationOptions
from tank2sim.identification.trials.problem.estimation_problem import scaled_prior
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card
from tank2sim.identification.trials.study import (
    CardReplay,
    PredictedFigure,
    TrialErrors,
    WindowError,
    card_replay,
    study_identification,
)
from tank2sim.notices import Notice
from tank2sim.records.trials import Trial
from tank2sim.results import identification as identification_module
from tank2sim.results import trial_charts
from tank2sim.results.identification import MOST_TRIALS, IdentificationResult
from tank2sim.results.trial_charts import AFTER, BEFORE, MEASURED, history_grid, track_grid
from tests.answer import drawn
from tests.cli.command_line import tank2sim
from tests.identification.trials import made_up_ship

OFF = {"Nd": 1.25, "Nr": 0.8, "Yv": 1.2, "Xu": 0.8}
COLUMNS = {"delta_deg": "delta_rad", "u_mps": "u_mps", "v_mps": "v_mps", "r_degps": "r_radps", "psi_deg": "psi_rad"}


def text_of(factors):
    """The made-up ship's card in which these derivatives are off, little known, and the only ones to estimate."""
    lines, errors = [], ["[uncertainty]"]
    gear = "[steering_gear]\nmax_rate_degps = 20.0\nmax_angle_deg = 40.0"
    for line in made_up_ship.CARD.replace("[steering_gear]", gear).splitlines():
        name, _, value = line.partition(" = ")
        factor = factors.get(name) if name in made_up_ship.TRUTH else None
        lines.append(f"{name} = {float(value) * factor}" if factor else line)
        if name in made_up_ship.TRUTH:
            errors.append(f"{name} = {0.25 * abs(float(value)) if factor else 0.0}")
    return "\n".join([*lines, *errors])


@pytest.fixture(scope="module")
def trials():
    """A turn, and a rudder that goes to and fro by the clock: no zigzag, for the heading does not tell it when."""
    runs = {"turn": made_up_ship.turn(20), "by_the_clock": made_up_ship.zigzag(15, 45.0)}
    return {
        name: made_up_ship.trial(rudder, name=name, duration=220.0, step=0.5, noise=0.0)
        for name, rudder in runs.items()
    }


@pytest.fixture(scope="module")
def found(trials):
    """The identification, its result and its charts."""
    known = parse_card(text_of(OFF), "off.toml")
    fitted = Measured((trials["by_the_clock"],), "angle", (Notice("mended"),))
    held = Measured((trials["turn"],), "angle", ())
    result = identify_trials(known, fitted, held, IdentificationOptions(method="equation_error", members=20))
    found = IdentificationResult(study_identification(known, result, fitted, held), None, result)
    return result, found, found._charts()


def held_out(found) -> list[CardReplay]:
    return [trial for trial in found[1].study.replays if trial.held_out]


def over_ground(trial: Trial) -> Trial:
    names = {"u_mps": "u_ground_mps", "v_mps": "v_ground_mps"}
    return replace(trial, signals={names.get(name, name): values for name, values in trial.signals.items()})


def rows_of(chart, series, panel=None):
    sets = chart_specification(chart)["datasets"]
    return [row for name, rows in sets.items() for row in rows if row.get("run") == series and panel in (None, name)]


@pytest.mark.parametrize("seen_from", [lambda trial: trial, over_ground], ids=["through the water", "over the ground"])
def test_the_true_card_runs_along_with_the_record(trials, seen_from) -> None:
    truth = parse_card(text_of({"Nd": 1.0}), "true.toml")
    both = tuple(seen_from(trial) for trial in trials.values())
    turn, clock = comparison_windows(problem_from_card(truth, both, "angle"), truth, both, {})
    assert (turn.closed_loop, clock.closed_loop) == (True, False), "a track and a heading are enough to know a turn by"
    limits = {"rudder": 0.02, "motion.psi": 0.01, "motion.r": 5e-4, "motion.beta": 0.005}
    for passage in (turn, clock):
        inside = (passage.time_s > passage.model_time_s[0] + 2) & (passage.time_s < passage.model_time_s[-1] - 2)
        for name, limit in {**limits, "motion.speed": 0.01, "motion.x": 1.0, "motion.y": 1.0}.items():
            measured = passage.measured[name][inside]
            simulated = np.interp(passage.time_s[inside], passage.model_time_s, passage.simulated[name])
            assert np.abs(simulated - measured).max() < limit < np.abs(measured).max() / 10, (passage.name, name)


def test_speed_and_drift_are_those_of_the_measured_track(trials) -> None:
    """The track's direction, and how fast it is run, tell both without the velocities."""
    truth, turn = parse_card(text_of({"Nd": 1.0}), "true.toml"), trials["turn"]
    (passage,) = comparison_windows(problem_from_card(truth, (turn,), "angle"), truth, (turn,), {})
    north, east = (np.gradient(turn.signals[name], turn.time_s) for name in ("x_m", "y_m"))
    drift = turn.signals["psi_rad"] - np.unwrap(np.arctan2(east, north))
    for name, there in (("motion.beta", drift), ("motion.speed", np.hypot(north, east))):
        shown = np.interp(turn.time_s[5:-5], passage.time_s, passage.measured[name])
        np.testing.assert_allclose(shown, there[5:-5], atol=0.01, err_msg=name)
    assert np.abs(drift).max() > 0.1


@pytest.mark.slow
def test_histories_are_in_degrees_and_thinned(found, trials) -> None:
    _, _, charts = found
    chart = charts["histories_held_out"]
    measured = rows_of(chart, MEASURED)
    assert max(row["s1"] for row in measured) == pytest.approx(
        np.rad2deg(trials["turn"].signals["psi_rad"].max()), 1e-2
    )
    assert max(row["s0"] for row in measured) == pytest.approx(20, 1e-3)
    assert len(measured) < 60 and len(rows_of(chart, AFTER)) < 160
    titles = [one["layer"][0]["encoding"]["y"]["title"] for one in chart_specification(chart)["concat"][0]["vconcat"]]
    assert titles == ["rudder (deg)", "heading (deg)", "yaw rate (deg/s)", "speed (m/s)", "drift angle (deg)"]


def test_a_track_has_one_scale_and_all_three_series(found) -> None:
    chart = track_grid(held_out(found))
    (panel,) = chart_specification(chart)["concat"]
    across, up = (panel["layer"][0]["encoding"][axis]["scale"]["domain"] for axis in ("x", "y"))
    assert (across[1] - across[0]) / panel["width"] == pytest.approx((up[1] - up[0]) / panel["height"])
    assert {series for series in (MEASURED, BEFORE, AFTER) if rows_of(chart, series)} == {MEASURED, BEFORE, AFTER}


def test_without_positions_the_cards_alone_have_tracks(trials) -> None:
    truth = parse_card(text_of({"Nd": 1.0}), "true.toml")
    seen = {name: values for name, values in trials["turn"].signals.items() if name not in ("x_m", "y_m")}
    blind = (replace(trials["turn"], signals=seen),)
    (passage,) = comparison_windows(problem_from_card(truth, blind, "angle"), truth, blind, {})
    chart = track_grid([card_replay(passage, passage, held_out=True)])
    assert rows_of(chart, AFTER) and not rows_of(chart, MEASURED)


def test_the_card_before_is_drawn_as_before_and_the_card_found_as_found(found) -> None:
    """The card that was off misses the record, the one found does not."""
    chart = track_grid(held_out(found))
    ends = {series: rows_of(chart, series)[-1] for series in (MEASURED, BEFORE, AFTER)}
    distance = {
        series: np.hypot(ends[series]["x"] - ends[MEASURED]["x"], ends[series]["y"] - ends[MEASURED]["y"])
        for series in (BEFORE, AFTER)
    }
    assert distance[AFTER] < 5 < distance[BEFORE]


def test_windows_show_the_share_of_each_signal_by_trial(found) -> None:
    result, _, charts = found
    cells = [row for row in drawn.rows_of(charts["windows"]) if row.get("model") == "after"]
    now = {(row["trial"], row["signal"]): row["misfit"] for row in cells}
    for one in (*result.fit.following, *result.holdout.following):
        assert now[one.name, "r"] == pytest.approx(100 * one.relative("motion.r"), 1e-4)
        assert now[one.name, "ψ"] == pytest.approx(100 * one.relative("motion.psi"), 1e-4)


def test_maps_next_to_each_other_share_one_legend(found) -> None:
    """Vega warns in the console where one of them has a legend and another none."""
    maps = chart_specification(found[2]["windows"])["vconcat"]
    legends = [one["spec"]["layer"][0]["encoding"]["color"]["legend"] for one in maps]
    assert len(legends) == 2 and all(one == legends[0] for one in legends)


@pytest.mark.slow
def test_overshoots_keep_the_digits_that_their_errors_need(found) -> None:
    rows = [
        ("zigzag", "overshoot_1_deg", 7.7, 7.81, 7.72, None),
        ("turn", "advance_m", 1234.5, 1300.0, 1235.5, (1200.0, 1300.0)),
    ]
    figures = tuple(
        PredictedFigure(
            trial=trial,
            figure=figure,
            measured=measured,
            before=before,
            predicted=predicted,
            error=predicted - measured,
            interval_95=interval,
        )
        for trial, figure, measured, before, predicted, interval in rows
    )
    html = replace(found[1], study=replace(found[1].study, figures={"fit": (), "holdout": figures})).page()
    shown = ("7.7", "7.81", "7.72", "+0.02 deg", "1234", "1300", "+0.1 %", "1200 to 1300")
    assert all(f">{text}<" in html for text in shown)


def test_parameters_are_in_standard_errors_of_the_prior(found) -> None:
    result, _, charts = found
    rows = [row for row in drawn.rows_of(charts["parameters"]) if "own" in row]
    unit = scaled_prior(result.problem, result.estimate.prior_scale)
    for place, name in enumerate(result.estimate.free):
        own, prior = (
            next(row for row in rows if row["name"] == name.partition(".")[2] and row.get("run") == run)
            for run in ("estimate", "prior")
        )
        moved = (result.estimate.values[place] - result.problem.prior_mean[place]) / unit[place]
        assert own["v"] == pytest.approx(moved, 1e-4) and prior["v"] == 0
        rounding = 1e-4 * max(abs(own["high"]), abs(own["low"]))  # a chart's numbers have five digits
        width = 2 * 1.96 * result.estimate.standard_errors[place] / unit[place]
        assert own["high"] - own["low"] == pytest.approx(width, rel=1e-2, abs=rounding)
        assert (prior["low"], prior["high"]) == pytest.approx((-1.96, 1.96), abs=1e-3)
        assert own["share"] == pytest.approx(100 * share_from_trials(result.problem, result.estimate)[place], 1e-4)


def test_figures_stand_with_their_errors_in_percent(found) -> None:
    result, _, charts = found
    rows = [row for row in drawn.rows_of(charts["figures"]) if "name" in row]
    advance = next(one for one in result.before_holdout.figures if one.name == "advance_m")
    shown, *more = [row for row in rows if row["run"] == BEFORE and row["name"] == "turn · advance"]
    assert all(row["error"] == shown["error"] for row in more)
    assert shown["measured"] == pytest.approx(advance.measured, 1e-4)
    assert shown["error"] == pytest.approx(100 * (advance.predicted / advance.measured - 1), 1e-3)
    assert abs(shown["error"]) > 1


def test_the_key_figures_tell_the_errors_of_the_trials_held_out(found) -> None:
    result, shown, charts = found
    figures = {figure.label: figure for figure in shown.key_figures}
    assert figures["Trials held out"].value == 1 and figures["Trials held out"].note == "1 were fitted"
    assert figures["Numbers fitted"].value == len(OFF)
    (turn,), (before,) = result.holdout.following, result.before_holdout.following
    error = figures["Yaw-rate error, held out"]
    assert error.value == pytest.approx(100 * turn.relative("motion.r"), 1e-2) and error.unit == "%"
    assert f"{100 * before.relative('motion.r'):.3g} %" in error.note and error.verdict is Verdict.NONE
    assert "Advance error, held out" in figures
    assert list(charts)[:2] == ["tracks_held_out", "histories_held_out"] and "singular_values" in charts
    assert "mended" in shown.notices and shown.notices == shown.study.notices


def test_a_card_without_a_yaw_rate_to_compare_still_has_a_first_line(found) -> None:
    shown = found[1]
    windows = {
        key: tuple(replace(trial, before={}, found={}) for trial in trials)
        for key, trials in shown.study.errors_over_windows.items()
    }
    (line,) = replace(shown, study=replace(shown.study, errors_over_windows=windows)).headline
    assert line.startswith(f"{len(OFF)} coefficients") and "yaw rate" in line


def test_the_estimates_are_a_table_and_a_data_frame(found) -> None:
    result, shown, _ = found
    assert shown.estimates["value"].to_numpy() == pytest.approx(result.estimate.values)
    assert list(shown.estimates.index) == list(result.estimate.free)
    (parameters,) = (table.df for table in shown.tables if "one standard error" in table.caption)
    assert parameters["coefficient"].to_list() == [name.partition(".")[2] for name in result.estimate.free]


@pytest.mark.slow
def test_of_many_trials_those_are_shown_that_are_followed_worst(found, monkeypatch) -> None:
    for module in (identification_module, trial_charts):
        monkeypatch.setattr(module, "MOST_TRIALS", 2)
    monkeypatch.setattr(trial_charts, "PER_SHEET", 1)
    errors = {"b": 0.2, "c": 0.1, "a": 0.3}
    windows = {name: {"r_degps": WindowError(rms_error=error, rms_signal=1.0)} for name, error in errors.items()}
    trials = tuple(TrialErrors(trial=name, before=error, found=error) for name, error in windows.items())
    study = replace(
        found[1].study,
        replays=tuple(replace(trial, trial=name) for name in errors for trial in held_out(found)),
        errors_over_windows={"fit": (), "holdout": trials},
    )
    shown = replace(found[1], study=study)
    charts = shown._charts()
    sheets = [chart_specification(charts[stem])["concat"] for stem in ("histories_held_out", "histories_held_out_2")]
    assert [[panel["title"]["text"] for panel in sheet] for sheet in sheets] == [["b"], ["a"]]
    notes = [section.text for section in shown.sections if section.heading == "Trials held out"]
    assert notes == ["The 2 of 3 trials with the largest error of yaw rate."]


def test_of_a_record_that_goes_on_after_the_manoeuvre_the_simulated_part_is_shown(found) -> None:
    (turn,) = held_out(found)
    half = {name: values[: len(values) // 2] for name, values in turn.found.items()}
    turn = replace(turn, before={}, found=half)
    times = [row["t"] for row in rows_of(history_grid([turn]), MEASURED)]
    model = half["t_s"]
    assert model[0] <= min(times) and max(times) <= model[-1] < turn.measured["t_s"][-1]
    assert not rows_of(history_grid([turn]), BEFORE), "a motion that left all bounds is left out"


def test_a_forced_result_is_marked_on_its_page(trials, found) -> None:
    none = Measured((), "angle", ())
    forced = replace(found[0], forced=("the rudder's moment differs",))
    held = Measured((trials["by_the_clock"],), "angle", ())
    made = IdentificationResult(study_identification(parse_card(text_of(OFF), "off.toml"), forced, held, none))
    assert any("the rudder's moment differs" in caution for caution in made.cautions)
    assert "FORCED" in made.page()


def test_one_trial_takes_little_of_the_page(found) -> None:
    """Pictures of as many trials as are shown, fitted and held out, stay below 3 MB; the page's script has 1 MB."""
    _, _, charts = found
    sizes = [len(json.dumps(chart_specification(charts[stem]))) for stem in ("tracks_held_out", "histories_held_out")]
    assert sum(sizes) * 2 * MOST_TRIALS < 3e6


def written(trial: Trial, folder: Path) -> Path:
    columns = {"t_s": trial.time_s} | {
        name: np.rad2deg(trial.signals[signal]) if "deg" in name else trial.signals[signal]
        for name, signal in (COLUMNS | {"x_m": "x_m", "y_m": "y_m"}).items()
    }
    path = folder / f"{trial.name}.csv"
    np.savetxt(path, np.stack(list(columns.values()), axis=1), "%.9g", ",", header=",".join(columns), comments="")
    return path


@pytest.mark.slow
def test_the_command_writes_the_page_and_its_pictures(trials, tmp_path) -> None:
    card, plots = tmp_path / "off.toml", tmp_path / "plots"
    card.write_text(text_of(OFF), encoding="utf-8")
    path = written(trials["turn"], tmp_path)
    shown = tank2sim(
        "identify", str(card), str(path), *("--method", "equation_error", "--plot", str(plots)), cwd=tmp_path
    )
    assert shown.returncode == 0, shown.stderr
    stems = ("windows", "figures", "tracks_fitted", "histories_fitted", "parameters", "correlation", "singular_values")
    assert {one.name for one in plots.iterdir()} == {"report.html", *(f"{stem}.png" for stem in stems)}
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in plots.glob("*.png"))
    page = (plots / "report.html").read_text(encoding="utf-8")
    assert "Made up" in page and "Nd" in page and page.count("<script src") == 0
