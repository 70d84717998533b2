"""``tank2sim identify`` as a user calls it, on made-up trials of a ship whose equations share no code with it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.identification.trials.assessment.evaluation import predicted_figures
from tank2sim.identification.trials.problem.prepare_trials import measured
from tests.cli.command_line import refused, tank2sim
from tests.identification.trials.made_up_ship import CARD, LENGTH, TRUTH, trial, turn, zigzag

COLUMNS = {"delta_rad": "delta_deg", "u_mps": "u_mps", "v_mps": "v_mps", "r_radps": "r_degps", "psi_rad": "psi_deg"}


def write(folder: Path, name: str, rudder, seed: int = 1, scale: float | None = None, truth=None) -> Path:
    made = trial(rudder, name=name, duration=200.0, step=0.5, seed=seed, truth=truth)
    lengths = 1.0 if scale is None else scale
    columns = {"t_s": made.time_s / np.sqrt(lengths)}
    for there, here in COLUMNS.items():
        factor = np.sqrt(lengths) if there == "r_radps" else 1 / np.sqrt(lengths) if there.endswith("mps") else 1.0
        values = made.signals[there] * factor
        columns[here] = np.rad2deg(values) if "deg" in here else values
    columns |= {name: made.signals[name] / lengths for name in ("x_m", "y_m")}
    path = folder / f"{name}.csv"
    comment = "" if scale is None else f"# scale: {scale}\n"
    np.savetxt(
        path, np.column_stack(list(columns.values())), delimiter=",", header=comment + ",".join(columns), comments=""
    )
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Trials, and the card with every hydrodynamic coefficient off by a fifth."""
    folder = tmp_path_factory.mktemp("trials")
    write(folder, "zigzag20", zigzag(20), seed=1)
    write(folder, "zigzag10", zigzag(10), seed=2)
    write(folder, "turn25", turn(25), seed=3)
    write(folder, "turn-35", turn(-35), seed=4)
    write(folder, "straight", lambda t: 0.0, seed=5)
    write(folder, "small", zigzag(20), seed=6, scale=25.0)
    rng = np.random.default_rng(7)
    text = CARD.split("[derivatives]")[0] + "[derivatives]\n"
    for name, value in TRUTH.items():
        text += f"{name} = {value if name.endswith('dot') else value * (1 + 0.2 * rng.choice([-1, 1]))}\n"
    (folder / "off.toml").write_text(text, encoding="utf-8")
    return folder


NO_BANDS = ("--members", "0")
SHORT = ("--method", "equation_error", "--structure", "card", *NO_BANDS)
FITTED = ("zigzag20.csv", "zigzag10.csv", "turn25.csv")


@pytest.mark.essential
@pytest.mark.slow
def test_a_card_that_is_off_comes_back_to_the_truth(folder: Path) -> None:
    result = tank2sim(
        *("identify", "off.toml", *FITTED, "--holdout", "turn-35.csv"),
        *("-o", "found.toml", "--json", "found.json"),
        cwd=folder,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((folder / "found.json").read_text())
    within = [
        abs(entry["value"] - TRUTH[name]) < 3.5 * entry["standard_error"]
        for name, entry in found["derivatives"].items()
    ]
    assert np.mean(within) > 0.9
    for name in ("Nv", "Nr", "Nd", "Yv"):
        assert found["derivatives"][name]["value"] == pytest.approx(TRUTH[name], rel=0.05), name
    assert found["misfit"]["holdout"] < 1.5
    assert found["misfit"]["before"]["holdout"] > 5
    card = read_card(str(folder / "found.toml"))
    assert isinstance(card, ManoeuvringCard)
    assert card.derivatives["Nr"] == pytest.approx(found["derivatives"]["Nr"]["value"], rel=1e-3)
    assert card.uncertainty["Nr"] == pytest.approx(found["derivatives"]["Nr"]["standard_error"], rel=0.01)
    turns = {figure["figure"]: figure for figure in found["figures"]["holdout"]}
    assert turns["advance_m"]["predicted"] == pytest.approx(turns["advance_m"]["measured"], rel=0.02)


def test_a_trial_of_a_model_identifies_the_ship(folder: Path) -> None:
    """A 4 m model's zigzag, Froude-scaled, next to the ship's own turn."""
    result = tank2sim("identify", "off.toml", "small.csv", "turn25.csv", "--json", "small.json", *SHORT, cwd=folder)
    assert result.returncode == 0, result.stderr
    assert "25 times as long" in " ".join(result.stdout.split())
    found = json.loads((folder / "small.json").read_text())["derivatives"]
    assert found["Nr"]["value"] == pytest.approx(TRUTH["Nr"], rel=0.08)
    assert found["Nd"]["value"] == pytest.approx(TRUTH["Nd"], rel=0.08)


@pytest.mark.slow
def test_equation_error_answers_the_same_question(folder: Path) -> None:
    method = "equation_error"
    result = tank2sim("identify", "off.toml", *FITTED[::2], "--method", method, "--json", f"{method}.json", cwd=folder)
    assert result.returncode == 0, result.stderr
    found = json.loads((folder / f"{method}.json").read_text())
    assert found["method"] == method
    assert found["derivatives"]["Nr"]["value"] == pytest.approx(TRUTH["Nr"], rel=0.15)


def test_a_trial_without_excitation_is_refused_by_the_terms_it_cannot_see(folder: Path) -> None:
    result = tank2sim("identify", "off.toml", "straight.csv", "-o", "never.toml", cwd=folder)
    refused(result, "straight", "Nr", "Nd")
    assert not (folder / "never.toml").exists()


@pytest.mark.slow
def test_a_card_that_was_never_measured_in_yaw_holds_after_the_fit_as_far_as_the_trials_went(folder: Path) -> None:
    text = (folder / "off.toml").read_text()
    narrow = "valid_yaw_rate_prime = 0.0\nvalid_rudder_deg = 12.0\nvalid_drift_deg = 60.0\n"
    (folder / "narrow.toml").write_text(re.sub(r"(rudder_sign = .*\n)", rf"\1{narrow}", text))
    files = ("zigzag20.csv", "turn25.csv")
    arguments = ("identify", "narrow.toml", *files, "--method", "equation_error", "-o", "wide.toml")
    assert tank2sim(*arguments, cwd=folder).returncode == 0
    card = read_card(str(folder / "wide.toml"))
    assert isinstance(card, ManoeuvringCard)
    rates, rudders = [], []
    for name in files:
        heads, *rows = (folder / name).read_text().splitlines()
        table = dict(zip(heads.split(","), np.array([row.split(",") for row in rows], dtype=float).T, strict=True))
        rates.append(np.max(np.abs(np.radians(table["r_degps"])) * LENGTH / table["u_mps"]))
        rudders.append(np.max(np.abs(table["delta_deg"])))
    assert card.model.valid_yaw_rate_prime == pytest.approx(max(rates), rel=0.15)
    assert np.degrees(card.model.valid_rudder_rad or 0.0) == pytest.approx(max(rudders), rel=0.02)
    assert np.degrees(card.model.valid_drift_rad) == pytest.approx(60.0)  # stated further than the trials went: kept


@pytest.mark.slow
def test_a_term_that_is_held_stays_as_the_card_has_it(folder: Path) -> None:
    arguments = ("identify", "off.toml", *FITTED[::2], "--hold", "Xvv", "-o", "held.toml", "--json", "held.json")
    result = tank2sim(*arguments, *NO_BANDS, cwd=folder)
    assert result.returncode == 0, result.stderr
    assert "Xvv" not in json.loads((folder / "held.json").read_text())["derivatives"]
    before, after = (read_card(str(folder / name)) for name in ("off.toml", "held.toml"))
    assert isinstance(before, ManoeuvringCard) and isinstance(after, ManoeuvringCard)
    assert after.derivatives["Xvv"] == before.derivatives["Xvv"]
    assert after.derivatives["Nr"] != before.derivatives["Nr"]
    assert after.model.valid_speed_mps is not None and after.model.valid_speed_mps[1] > 4.9
    assert "# Identified by tank2sim" in after.text.splitlines()[0]
    covariance = read_covariance(after)  # which it refuses if its standard errors are not those of the card
    assert covariance is not None and "derivatives.Nr" in covariance.names
    refused(tank2sim("identify", "off.toml", "zigzag20.csv", "--hold", "Nope", cwd=folder), "--hold", "Nope")


@pytest.mark.slow
def test_the_figures_reported_are_those_of_the_card_written(folder: Path) -> None:
    """Of a hard turn too, in which the ship is slower than in any of the zigzags fitted."""
    options = ("--method", "equation_error", "--members", "0")
    files = ("zigzag20.csv", "zigzag10.csv", "--holdout", "turn-35.csv")
    result = tank2sim("identify", "off.toml", *files, *options, "-o", "w.toml", "--json", "w.json", cwd=folder)
    assert result.returncode == 0, result.stderr
    card = read_card(str(folder / "w.toml"))
    assert isinstance(card, ManoeuvringCard) and card.model.valid_speed_mps is not None
    reported = json.loads((folder / "w.json").read_text())
    trials = measured([folder / "turn-35.csv"], card).trials
    again = {one.name: one.predicted for one in predicted_figures(card, trials)}
    found = {one["figure"]: one["predicted"] for one in reported["figures"]["holdout"]}
    assert len(found) >= 2 and found == pytest.approx(again, rel=1e-9)
    slowest = min(np.loadtxt(folder / "turn-35.csv", delimiter=",", skiprows=1)[:, 2])
    assert slowest < card.model.valid_speed_mps[0], "the turn is held out at all its speeds"
    assert "turn-35" in reported["yaw_rate_error_over_windows"]["holdout"]


@pytest.mark.slow
def test_trials_without_velocities_identify_what_they_show(folder: Path) -> None:
    for name in ("zigzag20", "turn25"):
        lines = [line.split(",") for line in (folder / f"{name}.csv").read_text().splitlines()]
        kept = [place for place, head in enumerate(lines[0]) if head not in ("u_mps", "v_mps")]
        text = "\n".join(",".join(line[place] for place in kept) for line in lines)
        (folder / f"{name}_gps.csv").write_text(text + "\n")
    result = tank2sim(
        "identify", "off.toml", "zigzag20_gps.csv", "--json", "z.json", "-o", "z.toml", *NO_BANDS, cwd=folder
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((folder / "z.json").read_text())
    assert "Xvv" not in found["derivatives"]
    assert any("nothing of" in notice["text"] and "Xvv" in notice["text"] for notice in found["notices"])
    assert found["derivatives"]["Nd"]["value"] == pytest.approx(TRUTH["Nd"], rel=0.1)
    before, after = (read_card(str(folder / name)) for name in ("off.toml", "z.toml"))
    assert isinstance(before, ManoeuvringCard) and isinstance(after, ManoeuvringCard)
    assert after.derivatives["Xvv"] == before.derivatives["Xvv"]


@pytest.mark.slow
def test_holdout_takes_all_that_follow_it_up_to_the_next_option(folder: Path) -> None:
    several = ("--holdout", "turn-35.csv", "turn25.csv", *SHORT, "--json", "several.json")
    result = tank2sim(
        "identify",
        "off.toml",
        *FITTED[:2],
        *several,
        "--holdout",
        "small.csv",
        cwd=folder,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((folder / "several.json").read_text())["yaw_rate_error_over_windows"]
    assert set(found["fit"]) == {"zigzag20", "zigzag10", "all"}
    assert set(found["holdout"]) == {"turn-35", "turn25", "small", "all"}


@pytest.mark.slow
def test_what_the_trials_demand_of_the_prior_is_reported(folder: Path) -> None:
    result = tank2sim("identify", "off.toml", *FITTED[::2], "--method", "equation_error", cwd=folder)
    assert "standard errors were widened" in " ".join(result.stdout.split())


def test_bad_input_is_one_line_and_nothing_is_written(folder: Path) -> None:
    refused(tank2sim("identify", "off.toml", "no-such.csv", "-o", "n.toml", cwd=folder), "no-such.csv")
    refused(tank2sim("identify", "off.toml", "zigzag20.csv", "-o", "zigzag20.csv", cwd=folder), "zigzag20.csv")
    refused(tank2sim("identify", "wilinski-zellman", "zigzag20.csv", cwd=folder), "manoeuvr")
    refused(tank2sim("identify", "off.toml", "zigzag20.csv", "--piece", "-3", cwd=folder), "--piece")
    both = ("identify", "off.toml", "zigzag20.csv", "--holdout", "zigzag20.csv")
    refused(tank2sim(*both, cwd=folder), "both fitted and held out")
    refused(tank2sim("identify", "off.toml", "zigzag20.csv", "--piece", "0.1", cwd=folder), "--piece", "or more")
    refused(
        tank2sim("identify", "off.toml", "zigzag20.csv", "--holdout", cwd=folder), "--holdout is followed by nothing"
    )
    assert not (folder / "n.toml").exists()


def rewritten(folder: Path, source: str, name: str, factors: dict[str, float]) -> str:
    """A trial's file with some columns multiplied."""
    heads, *rows = (folder / source).read_text().splitlines()
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    for head, factor in factors.items():
        table[:, heads.split(",").index(head)] *= factor
    np.savetxt(folder / name, table, delimiter=",", header=heads, comments="")
    return name


@pytest.mark.parametrize(
    ("factors", "columns"),
    [
        ({"t_s": 2.0}, ["t_s"]),
        ({"x_m": 1.3, "y_m": 1.3}, ["x_m"]),
        ({"u_mps": 2.0, "v_mps": 2.0}, ["u_mps", "v_mps"]),
        ({"r_degps": 1.5}, ["r_degps", "psi_deg"]),
    ],
)
@pytest.mark.parametrize("command", ["identify", "validate", "gap"])
def test_a_scale_of_no_unit_stops_the_commands_that_use_the_trial(
    folder: Path, command: str, factors: dict[str, float], columns: list[str]
) -> None:
    name = rewritten(folder, "zigzag20.csv", "odd.csv", factors)
    outputs = {"identify": ("-o", "odd.toml"), "validate": ("-o", "odd.html"), "gap": ("-o", "odd")}[command]
    refused(tank2sim(command, "off.toml", name, *outputs, cwd=folder), "odd.csv", *columns)
    assert not any((folder / output).exists() for output in ("odd.toml", "odd.html", "odd"))


REPAIRED = {
    "rudder in radians": {"delta_deg": np.pi / 180},
    "positions in km": {"x_m": 1e-3, "y_m": 1e-3},
    "positions in feet": {"x_m": 1 / 0.3048, "y_m": 1 / 0.3048},
}


@pytest.mark.slow
def test_a_repaired_unit_gives_the_card_of_the_right_file(folder: Path) -> None:
    def identified(turn: str, zigzag: str) -> dict[str, float]:
        options = ("--method", "equation_error", "--members", "0", "--json", "unit.json")
        result = tank2sim("identify", "off.toml", turn, zigzag, *options, cwd=folder)
        assert result.returncode == 0, result.stderr
        found = json.loads((folder / "unit.json").read_text())["derivatives"]
        return {term: found[term]["value"] for term in ("Nv", "Nr", "Nd", "Yv")}

    right = identified("turn25.csv", "zigzag20.csv")
    for name, factors in REPAIRED.items():
        wrong = [rewritten(folder, kind, f"wrong_{kind}", factors) for kind in ("turn25.csv", "zigzag20.csv")]
        assert identified(*wrong) == pytest.approx(right, rel=1e-3), name


@pytest.mark.slow
def test_a_copy_of_a_trial_that_is_fitted_cannot_be_held_out(folder: Path) -> None:
    """Under another name, with other digits and a comment: neither for identify nor gap, nor as a repeat."""
    lines = (folder / "zigzag20.csv").read_text().splitlines()
    rows = [",".join(f"{float(cell):.5g}" for cell in line.split(",")) for line in lines[1:]]
    (folder / "another_run.csv").write_text("\n".join(["# a second run", lines[0], *rows]) + "\n")
    held = ("zigzag20.csv", "--holdout", "turn-35.csv", "another_run.csv", "-o", "copy_out")
    for command in ("identify", "gap"):
        result = tank2sim(command, "off.toml", *held, cwd=folder)
        refused(result, "another_run.csv", "both fitted and held out", "zigzag20.csv")
        assert not (folder / "copy_out").exists()
    for command in ("identify", "validate"):
        result = tank2sim(command, "off.toml", "zigzag20.csv", "another_run.csv", cwd=folder)
        refused(result, "another_run.csv", "zigzag20.csv again")


@pytest.mark.slow
def test_a_renamed_copy_of_a_trial_that_made_the_card_is_never_held_out(folder: Path) -> None:
    """Its columns in another order, with fewer digits, every second row, and its first rows cut."""
    made = ("identify", "off.toml", "zigzag10.csv", "turn25.csv", *SHORT, "-o", "signed.toml")
    assert tank2sim(*made, cwd=folder).returncode == 0
    heads, *rows = ((folder / "turn25.csv").read_text()).splitlines()
    cells = [[f"{float(cell):.5g}" for cell in reversed(line.split(","))] for line in rows[4::2]]
    lines = [",".join(reversed(heads.split(","))), *(",".join(row) for row in cells)]
    (folder / "unheard.csv").write_text("\n".join(lines) + "\n")
    result = tank2sim("validate", "signed.toml", "unheard.csv", "turn-35.csv", "--json", "signed.json", cwd=folder)
    assert result.returncode == 0, result.stderr
    assert "unheard: the card was identified from this trial (as turn25)" in " ".join(result.stdout.split())
    figures = json.loads((folder / "signed.json").read_text())["figures"]
    own, other = ([one for one in figures if one["trial"] == trial] for trial in ("unheard", "turn-35"))
    assert own and all(one["made_card"] and one["outcome"] in ("only fitted", "not validated") for one in own)
    assert any(one["outcome"] == "only fitted" for one in own)
    assert other and not any(one["made_card"] for one in other)
    for command in ("identify", "gap"):
        asked = (command, "signed.toml", "zigzag20.csv", "--holdout", "unheard.csv", "-o", "held_out")
        refused(tank2sim(*asked, cwd=folder), "unheard.csv", "is held out", "signed.toml was fitted to it", "turn25")
        assert not (folder / "held_out").exists()
    again = ("identify", "signed.toml", "zigzag10.csv", "zigzag20.csv", *SHORT, "-o", "more.toml")
    assert tank2sim(*again, cwd=folder).returncode == 0
    card = read_card(str(folder / "more.toml"))
    assert isinstance(card, ManoeuvringCard)
    assert [one.name for one in card.fitted_trials] == ["zigzag10", "turn25", "zigzag20"]


@pytest.mark.slow
def test_a_card_of_another_ship_is_refused_unless_forced(folder: Path) -> None:
    """The same card of a ship twice the size: its rudder would have to turn four times the inertia as fast."""
    text = (folder / "off.toml").read_text()
    for key, size in (("length_m", LENGTH), ("beam_m", 16.0), ("draught_m", 6.0)):
        text = text.replace(f"{key} = {size}", f"{key} = {2 * size}")
    (folder / "longer.toml").write_text(text)
    asked = ("identify", "longer.toml", *FITTED, *SHORT, "-o", "o.toml", "--json", "o.json")
    result = tank2sim(*asked, cwd=folder)
    refused(result, "zigzag20", "longer.toml", "force the fit")
    assert not (folder / "o.toml").exists() and not (folder / "o.json").exists()
    forced = tank2sim(*asked, "--force", cwd=folder)
    assert forced.returncode == 0, forced.stderr
    assert forced.stdout.startswith("CHECK: FORCED")
    card = read_card(str(folder / "o.toml"))
    assert "FORCED" in card.text.splitlines()[0] and "FORCED" in card.ship.source
    assert json.loads((folder / "o.json").read_text())["forced"]
    right = tank2sim("identify", "off.toml", *asked[2:], "--force", cwd=folder)
    assert right.returncode == 0 and "FORCED" not in right.stdout + (folder / "o.toml").read_text()
    assert json.loads((folder / "o.json").read_text())["forced"] == []


@pytest.mark.slow
def test_a_trial_of_another_ship_among_the_trials_is_refused(folder: Path) -> None:
    write(folder, "stranger", zigzag(20), seed=8, truth={**TRUTH, "Nd": 5 * TRUTH["Nd"], "Nr": 3 * TRUTH["Nr"]})
    result = tank2sim("identify", "off.toml", *FITTED, "stranger.csv", "-o", "two.toml", cwd=folder)
    refused(result, "by stranger the rudder gives more", "force the fit")
    assert not (folder / "two.toml").exists()


@pytest.mark.slow
def test_an_interrupt_keeps_the_best_card_so_far(folder: Path) -> None:
    program = """
import signal
from tank2sim.cli import main
from tank2sim.identification.trials.methods import output_error

signal.signal(signal.SIGINT, signal.default_int_handler)  # a process in the background begins with it ignored
# As Ctrl-C does, in the middle of the search: a first round is done, others would follow.
output_error._Search.widen = lambda *arguments: signal.raise_signal(signal.SIGINT)
main()
"""
    command = [sys.executable, "-c", program, "identify", "off.toml", *FITTED, "-o", "stopped.toml", "--json", "s.json"]
    process = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    out, err = process.stdout, process.stderr
    assert process.returncode == 0, err
    assert "interrupted" in out
    card = parse_card((folder / "stopped.toml").read_text(encoding="utf-8"), "stopped.toml")
    assert isinstance(card, ManoeuvringCard)


@pytest.mark.slow
def test_an_average_over_structures_states_their_weights_and_its_intervals_hold_each(folder: Path) -> None:
    held = ["--holdout", "turn-35.csv", "--members", "40", "--method", "equation_error", "--json", "result.json"]
    result = tank2sim("identify", "off.toml", *FITTED, "--structure", "average", *held, cwd=folder)
    assert result.returncode == 0, result.stderr
    found = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    weights = {name: structure["weight"] for name, structure in found["structures"].items()}
    assert sum(weights.values()) == pytest.approx(1.0) and found["structure"] == max(weights, key=weights.__getitem__)
    assert weights["linear"] < 0.02, "the ship has terms of third order"
    assert all(figure["interval_95"] is not None for figure in found["figures"]["holdout"])


@pytest.mark.slow
def test_samples_of_the_posterior_are_with_the_card_and_ensembles_take_them(folder: Path) -> None:
    options = ["--structure", "card", "--posterior", "nuts", "--draws", "60", "--json", "sampled.json"]
    files = ["-o", "sampled.toml", "--page", "sampled.html"]
    result = tank2sim("identify", "off.toml", "zigzag20.csv", "turn25.csv", *options, *files, cwd=folder)
    assert result.returncode == 0, result.stderr
    found = json.loads((folder / "sampled.json").read_text(encoding="utf-8"))
    posterior = found["posterior"]
    assert posterior["draws"] == 240 and posterior["chains"] == 4
    assert (result.stdout.startswith("CHECK: NOT CONVERGED")) == (not posterior["converged"])
    entries = found["derivatives"]
    assert set(posterior["parameters"]) == set(entries)
    for name, sampled in posterior["parameters"].items():
        low, *_, high = sampled["quantiles"]
        assert low < entries[name]["value"] < high
        assert high - low == pytest.approx(3.92 * entries[name]["standard_error"], rel=0.3)
    card = read_card(folder / "sampled.toml")
    known = read_covariance(card)
    assert known is not None and known.samples is not None and known.samples.shape == (240, len(entries))
    stated = [card.derivatives[name.partition(".")[2]] for name in known.names]
    np.testing.assert_allclose(known.samples.mean(axis=0), stated, rtol=1e-3, atol=1e-6)
    simulated = tank2sim("simulate", "sampled.toml", "--manoeuvre", "turn:20", "--members", "20", cwd=folder)
    assert "240 samples of the posterior" in simulated.stdout


def test_a_method_without_a_density_is_not_sampled(folder: Path) -> None:
    options = ["--posterior", "nuts", "--method", "kalman"]
    refused(tank2sim("identify", "off.toml", "zigzag20.csv", *options, cwd=folder), "--posterior", "kalman")
