"""``tank2sim gap``: card, covariance, page and JSON, corrected trials, and what is refused."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tank2sim import find_gap, make_report
from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cards.covariance import Covariance, covariance_file, referring
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.cards.reading import changed_text
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.gap.improve_card import add_effects_to_card, card_with_effects_text
from tank2sim.gap.result import AMBIGUOUS, MISSING, NO_EFFECT_MISSING, Gap, Named
from tank2sim.identification.trials.problem.prepare_trials import fitted_as
from tank2sim.results.gap import improved_files
from tank2sim.simulation.manoeuvres import parse_manoeuvre
from tank2sim.simulation.run import simulate
from tank2sim.simulation.trial_file import trial_csv
from tank2sim.units import to_si
from tests.cli.command_line import refused, tank2sim
from tests.dynamics.effects.ships import TYPICAL
from tests.gap import made_up

CURRENT = Named(
    "current",
    {"speed_mps": 0.45, "direction_rad": math.radians(-110.0)},
    {"speed_mps": 0.02, "direction_rad": math.radians(2.0)},
    0.97,
)
BIAS = Named("gyro_bias", {"rate_radps": math.radians(0.05)}, {"rate_radps": math.radians(0.001)}, 0.95)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three simulated trials of the Mariner."""
    folder = tmp_path_factory.mktemp("gap")
    model = build(read_card("mariner"))
    for name, manoeuvre in (("turn20", "turn:20"), ("zigzag", "zigzag:20/20"), ("turn-35", "turn:-35")):
        run = simulate(model, parse_manoeuvre(manoeuvre), duration_s=150.0)
        (folder / f"{name}.csv").write_text(trial_csv(run.trajectory, name), encoding="utf-8")
    return folder


Find = Callable[..., Gap]


@pytest.fixture
def finding(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[tuple[object, ...]]]:
    """Lets the workflow find this, for what the command makes of it; gives the calls."""

    def found(
        effects: tuple[Named, ...], verdict: str = MISSING, *, fails: BaseException | None = None, test: bool = True
    ):
        calls: list[tuple[object, ...]] = []

        def find_gap(card, fitted, held, options, progress, executor=None) -> Gap:
            calls.append((card, fitted, held, options))
            progress("looking")
            if fails is not None:
                raise fails
            passed = tuple(
                made_up.passed(trial.name, 8.0, 1.0, held_out=trial in held.trials)
                for trial in (*fitted.trials, *held.trials)
            )
            improved = add_effects_to_card(card, [(one.name, one.parameters, one.standard_errors) for one in effects])
            gap = replace(made_up.missing(), card=card, base=card, improved=improved, verdict=verdict, effects=effects)
            where = tuple(replace(one, trial=passed[0].name) for one in gap.where)
            gap = replace(gap, passed=passed, where=where, missing_force=None, agreement={}, figures_before=())
            return gap if test else replace(gap, next_test=None)

        monkeypatch.setattr("tank2sim.api.gap_search.run_gap_workflow", find_gap)
        return calls

    return found


def written(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_a_current_is_written_into_a_card_a_page_and_json(folder: Path, tmp_path: Path, finding) -> None:
    (call,) = [finding((CURRENT,))]
    result = tank2sim(
        *("gap", "mariner", "turn20.csv", "zigzag.csv", "--holdout", "turn-35.csv", "-o", str(tmp_path / "new/out")),
        *("--json", str(tmp_path / "g.json"), "--without", "wind", "trim", "--max-effects", "1", "--workers", "1"),
        cwd=folder,
    )
    assert result.returncode == 0, result.stderr
    out = tmp_path / "new/out"
    assert written(out) == {"gap.json", "improved.toml", "report.html", "next_test.csv"}
    ((card, fitted, held, options),) = call
    assert isinstance(card, ManoeuvringCard) and fitted.driven_by == "angle"
    assert [one.name for one in fitted.trials] == ["turn20", "zigzag"] and [one.name for one in held.trials] == [
        "turn-35"
    ]
    assert options.without == ("wind", "trim") and options.max_effects == 1 and options.workers == 1

    reported = json.loads((out / "gap.json").read_text())
    assert (tmp_path / "g.json").read_text() == (out / "gap.json").read_text()
    (effect,) = reported["effects"]
    assert effect["name"] == "current" and effect["parameters"]["direction_deg"] == pytest.approx(250.0)
    assert {one["trial"] for one in reported["trials"]} == {"turn20.csv", "zigzag.csv", "turn-35.csv"}
    assert reported["where"][0]["trial"] == "turn20.csv"
    improved = read_card(out / "improved.toml")
    assert isinstance(improved, ManoeuvringCard)
    assert [one.name for one in improved.effects] == ["current"]
    assert [fitted_as(improved, one) for one in (*fitted.trials, *held.trials)] == ["turn20", "zigzag", None]
    assert improved.text.startswith("# current added by tank2sim gap from turn20, zigzag\n")
    assert (out / "next_test.csv").read_text().startswith("t_s,delta_order_deg")
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "</html>" in page and make_report(out / "gap.json").page() == page

    words = " ".join(result.stdout.split())
    for reported in ("The model lacks an effect: current", "0.45 ± 0.02", "250", "m/s", "turn-35", "held out"):
        assert reported in words, reported
    assert "Next test: turn:35. A turn tells most." in words
    again = tank2sim("simulate", str(out / "improved.toml"), "--manoeuvre", "turn:20", "--duration", "60", cwd=tmp_path)
    assert again.returncode == 0, again.stderr


@pytest.mark.slow
def test_a_faulty_sensor_leaves_the_card_and_corrects_the_trials(folder: Path, tmp_path: Path, finding) -> None:
    finding((BIAS,))
    before = {name: (folder / name).read_bytes() for name in ("turn20.csv", "turn-35.csv")}
    result = tank2sim("gap", "mariner", "turn20.csv", "--holdout", "turn-35.csv", "-o", str(tmp_path), cwd=folder)
    assert result.returncode == 0, result.stderr
    corrected = {"corrected/turn20.csv", "corrected/turn-35.csv"}
    assert written(tmp_path) == {"gap.json", "improved.toml", "report.html", "next_test.csv", *corrected}
    assert (tmp_path / "improved.toml").read_text() == Path(read_card("mariner").source).read_text()
    old, new = (np.genfromtxt(there / "turn20.csv", delimiter=",", names=True, skip_header=skip)
                for there, skip in ((folder, 1), (tmp_path / "corrected", 2)))  # fmt: skip
    np.testing.assert_allclose(new["r_degps"], old["r_degps"] - 0.05, atol=1e-9)
    np.testing.assert_array_equal(new["psi_deg"], old["psi_deg"])
    assert {name: (folder / name).read_bytes() for name in before} == before


@pytest.mark.slow
def test_what_an_earlier_run_wrote_does_not_lie_there_as_if_it_were_of_this_one(
    folder: Path, tmp_path: Path, finding
) -> None:
    arguments = ("gap", "mariner", "turn20.csv", "-o", str(tmp_path))
    finding((BIAS,))
    assert tank2sim(*arguments, cwd=folder).returncode == 0
    assert json.loads((tmp_path / "gap.json").read_text())["files"] == sorted(written(tmp_path))
    (tmp_path / "corrected/mine.csv").write_text("t_s\n")
    # As if the card had had a covariance then.
    reported = json.loads((tmp_path / "gap.json").read_text())
    (tmp_path / "gap.json").write_text(
        json.dumps({**reported, "files": [*reported["files"], "improved.covariance.json"]})
    )
    (tmp_path / "improved.covariance.json").write_text("{}")
    finding((), NO_EFFECT_MISSING, test=False)
    result = tank2sim(*arguments, cwd=folder)
    assert result.returncode == 0, result.stderr
    assert written(tmp_path) == {"gap.json", "improved.toml", "report.html", "corrected/mine.csv"}
    assert "corrected/turn20.csv was of an earlier run, and was removed" in result.stdout
    assert "improved.covariance.json was of an earlier run, and was removed" in result.stdout
    assert "corrected/mine.csv is not of this run, and was left" in result.stdout
    (tmp_path / "corrected/mine.csv").unlink()
    assert tank2sim(*arguments, cwd=folder).returncode == 0 and not (tmp_path / "corrected").exists()


@pytest.mark.slow
def test_what_no_earlier_run_says_it_wrote_is_left(folder: Path, tmp_path: Path, finding) -> None:
    """Without a gap.json that names them, or as an input of this very run."""
    arguments = ("-o", str(tmp_path))
    (tmp_path / "next_test.csv").write_text("mine")
    (tmp_path / "gap.json").write_text('["of another program"]')
    finding((), NO_EFFECT_MISSING, test=False)
    result = tank2sim("gap", "mariner", "turn20.csv", *arguments, cwd=folder)
    assert result.returncode == 0 and (tmp_path / "next_test.csv").read_text() == "mine"
    assert "next_test.csv is not of this run, and was left" in result.stdout

    finding((BIAS,))
    assert tank2sim("gap", "mariner", "turn20.csv", *arguments, cwd=folder).returncode == 0
    finding((), NO_EFFECT_MISSING, test=False)
    result = tank2sim("gap", "mariner", str(tmp_path / "corrected/turn20.csv"), *arguments, cwd=folder)
    assert result.returncode == 0 and (tmp_path / "corrected/turn20.csv").exists()


@pytest.mark.slow
def test_lines_on_the_screen_are_not_broken_and_what_is_no_number_is_a_dash(
    folder: Path, tmp_path: Path, finding, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    long = "a_trial_with_a_name_that_is_longer_than_any_narrow_screen_would_take_in_a_table.csv"
    (tmp_path / long).write_bytes((folder / "turn20.csv").read_bytes())
    fouling = Named("hull_fouling", {"X_prime": -2e-4}, {"X_prime": math.nan}, 0.9)
    finding((fouling,))
    result = tank2sim("gap", "mariner", long, "-o", "out", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    (row,) = (line for line in result.stdout.splitlines() if long.removesuffix(".csv") in line)
    assert row.split()[1:4] == ["fitting", "8", "1"]
    assert "nan" not in result.stdout


@pytest.mark.slow
def test_trials_are_not_corrected_for_what_is_only_possible(folder: Path, tmp_path: Path, finding) -> None:
    finding((BIAS,), AMBIGUOUS)
    result = tank2sim("gap", "mariner", "turn20.csv", "-o", str(tmp_path), cwd=folder)
    assert result.returncode == 0 and not (tmp_path / "corrected").exists()


def test_a_run_that_is_stopped_leaves_nothing(folder: Path, tmp_path: Path, finding) -> None:
    finding((CURRENT,), fails=KeyboardInterrupt())
    result = tank2sim(
        "gap", "mariner", "turn20.csv", "-o", "out", "--json", "g.json", cwd=_with_trials(folder, tmp_path)
    )
    assert result.returncode == 130 and "nothing is left half-written" in result.stderr
    assert not (tmp_path / "out").exists() and not (tmp_path / "g.json").exists()


def _with_trials(folder: Path, new: Path) -> Path:
    for path in folder.glob("*.csv"):
        (new / path.name).write_bytes(path.read_bytes())
    return new


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["mariner", "turn20.csv", "turn20.csv"], ["turn20.csv", "has the name of another trial"]),
        (["mariner", "turn20.csv", "--holdout", "turn20.csv"], ["turn20.csv", "both fitted and held out"]),
        (["mariner", "turn20.csv", "--holdout", "sub/turn20.csv"], ["turn20.csv", "both fitted and held out"]),
        (["mariner", "no.csv"], ["no.csv", "does not exist"]),
        (["mariner", "turn20.csv", "--holdout", "no.csv"], ["no.csv"]),
        (["titanic", "turn20.csv"], ["titanic"]),
        (["linear.toml", "turn20.csv"], ["linear.toml", "model.kind", "linear"]),
        (["wilinski-zellman", "turn20.csv"], ["model.kind", "manoeuvring ship"]),
        (["mariner"], ["trials"]),
        (["mariner", "turn20.csv", "--effects", "curent"], ["--effects", "curent", "did you mean current"]),
        (["mariner", "turn20.csv", "--without", "kraken"], ["--without", "kraken"]),
        (["mariner", "turn20.csv", "--without", "--workers", "2"], ["--without is followed by nothing"]),
        (["mariner", "turn20.csv", "--max-effects", "5"], ["--max-effects"]),
        (["mariner", "empty"], ["empty", "holds no trial"]),
    ],
)
def test_bad_input_is_one_line_and_no_folder_is_made(
    folder: Path, tmp_path: Path, arguments: list[str], words: list[str]
) -> None:
    _with_trials(folder, tmp_path)
    (tmp_path / "empty").mkdir()
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub/turn20.csv").write_bytes((folder / "turn20.csv").read_bytes())
    text = Path(read_card("mariner").source).read_text().replace('kind = "abkowitz"', 'kind = "linear"')
    (tmp_path / "linear.toml").write_text(text)
    refused(tank2sim("gap", *arguments, "-o", "out", cwd=tmp_path), *words)
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_is_reported_before_the_work(folder: Path, tmp_path: Path, finding) -> None:
    calls = finding((CURRENT,))
    (tmp_path / "file").write_text("no folder")
    refused(tank2sim("gap", "mariner", "turn20.csv", "-o", str(tmp_path / "file"), cwd=folder), "file", "not a folder")
    if os.geteuid() != 0:
        (tmp_path / "locked").mkdir(mode=0o555)
        refused(tank2sim("gap", "mariner", "turn20.csv", "-o", str(tmp_path / "locked"), cwd=folder), "locked")
    assert not calls
    refused(tank2sim("gap", "mariner", "turn20.csv", cwd=folder), "-o")


def test_no_input_is_overwritten(folder: Path, tmp_path: Path, finding) -> None:
    """A card that was improved before stands where the new one is to be written; so may a trial."""
    calls = finding((CURRENT,))
    card = Path(read_card("mariner").source).read_text()
    (tmp_path / "improved.toml").write_text(card)
    result = tank2sim("gap", "improved.toml", "turn20.csv", "-o", ".", cwd=_with_trials(folder, tmp_path))
    refused(result, "improved.toml", "would be overwritten")
    assert (tmp_path / "improved.toml").read_text() == card and not (tmp_path / "gap.json").exists()
    result = tank2sim("gap", "mariner", "turn20.csv", "-o", "out", "--json", "no/g.json", cwd=tmp_path)
    refused(result, "no/g.json", "folder does not exist")
    assert not calls and not (tmp_path / "out").exists()


@pytest.mark.long
def test_a_slow_rudder_is_found_and_enters_the_card(data: Path, tmp_path: Path) -> None:
    """Synthetic trials of a ship whose gear is slower than the card says, made by equations that share no code."""
    case = data / "data" / "gap_cases" / "case_2"
    truth = json.loads((case.parent / "case_2-truth.json").read_text())
    trials = [str(case / f"{name}.csv") for name in ("zigzag20_20", "zigzag10_10", "turn35_stbd")]
    result = tank2sim(
        *("gap", str(case / "ship.toml"), *trials, "--holdout", str(case / "turn35_port.csv"), "-o", "out"),
        *("--max-effects", "1"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "out/gap.json").read_text())
    assert found["verdict"] == truth["verdict"]
    assert [one["name"] for one in found["effects"]] == truth["effects"]
    (rate,) = truth["parameters"]["rudder_rate_limit"].values()
    improved = read_card(tmp_path / "out/improved.toml")
    assert isinstance(improved, ManoeuvringCard) and improved.steering_gear is not None
    assert improved.steering_gear.max_rate_radps == pytest.approx(math.radians(rate), rel=0.05)
    assert "was 5.0 before rudder_rate_limit" in improved.text
    misfit = found["misfit"]
    assert misfit["after"]["holdout"] < 1.2 < misfit["before"]["holdout"]
    assert {"gap.json", "improved.toml", "report.html"} <= written(tmp_path / "out")


LONG = ("current", "rudder_rate_limit", "flow_memory", "trim")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("wind", marks=[pytest.mark.slow, pytest.mark.essential]),
        pytest.param("roll_coupling", marks=pytest.mark.slow),
        *(pytest.param(one, marks=pytest.mark.long) for one in LONG),
    ],
)
def test_an_improved_card_goes_all_the_way_to_a_checked_fmu(name: str, tmp_path: Path) -> None:
    found = [(name, dict(to_si(key, value) for key, value in TYPICAL[name].items()), {})]
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    (tmp_path / "improved.toml").write_text(
        card_with_effects_text(add_effects_to_card(card, found), found, ["turn20"]), encoding="utf-8"
    )
    for arguments in (
        ["simulate", "improved.toml", "--manoeuvre", "turn:20"],
        ["stability", "improved.toml"],
        ["export", "improved.toml", "-o", "ship.fmu", "--platforms", "host"],
        ["check", "ship.fmu", "--card", "improved.toml"],
    ):
        result = tank2sim(*arguments, cwd=tmp_path)
        assert result.returncode == 0, (arguments, result.stdout, result.stderr)


@pytest.mark.parametrize(("given", "option"), [({"effects": "wind"}, "effects"), ({"workers": 0}, "workers")])
def test_an_option_of_the_wrong_kind_is_refused_by_its_name(given: dict, option: str) -> None:
    with pytest.raises(InputError) as raised:
        find_gap("mariner", "turn20.csv", **given)
    assert raised.value.source == option


NAMES = ("derivatives.Yv", "derivatives.Nv")


def test_the_improved_card_has_its_covariance_next_to_it_or_is_reported_to_have_none(tmp_path, mariner_card) -> None:
    ship, out = tmp_path / "ship.toml", tmp_path / "out" / "improved.toml"
    out.parent.mkdir()
    ship.write_text(referring(mariner_card.text + "\n[uncertainty]\nYv = 2e-4\nNv = 1e-4\n", ship))
    matrix = np.array([[4e-8, 1e-8], [1e-8, 1e-8]])
    covariance_file(ship).write_text(Covariance(NAMES, matrix).as_text())
    card = read_card(ship)
    assert isinstance(card, ManoeuvringCard)
    effect = "\n[[effects]]\nname = 'rudder_bias'\nparameters = {angle_deg = 1.0}\n"
    files, reported = improved_files(card, card.text + effect, out)
    assert not reported and set(files) == {out, covariance_file(out)}
    for path, content in files.items():
        path.write_text(content)
    found = read_covariance(read_card(out))
    assert found is not None and found.names == NAMES
    np.testing.assert_array_equal(found.matrix, matrix)
    changed = changed_text(card.text, card.source, {"derivatives.Yv": -0.01, "derivatives.Nv": -0.002})
    files, reported = improved_files(card, changed, out)
    assert set(files) == {out} and "no covariance" in reported[0]
    assert read_covariance(parse_card(str(files[out]), str(out))) is None
    # A search of an hour is not lost for a file that only ensembles need.
    covariance_file(ship).unlink()
    files, reported = improved_files(card, card.text + effect, out)
    assert set(files) == {out} and "is missing" in reported[0] and "# covariance" not in str(files[out])
