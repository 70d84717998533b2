"""``tank2sim reduce``: files written together or not at all, results on screen and as JSON."""

import math
import tomllib

import pytest
from click.testing import CliRunner

from tank2sim.api.reduction import reduce
from tank2sim.cards import read_card
from tank2sim.cli.derived import command_of
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate
from tests.identification.captive.generator import Campaign, write


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(Campaign(seed=6, size="linear", rate_hz=5.0), tmp_path_factory.mktemp("campaign")).path


def run(*arguments):
    result = CliRunner().invoke(command_of(reduce.verb), [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.mark.slow
def test_a_missing_run_is_refused_and_nothing_is_written(tmp_path):
    faulty = write(Campaign(seed=6, size="linear", rate_hz=5.0, faults={"drift_+04": "missing"}), tmp_path / "c").path
    card = tmp_path / "card.toml"
    with pytest.raises(InputError, match=r"drift_\+04\.csv.*does not exist"):
        run(faulty, "-o", card)
    assert not card.exists()
    assert run(faulty, "-o", card, "--keep-going").exit_code == 0
    assert "left out because of a fault" in run(faulty, "--keep-going").output


def test_what_is_estimated_and_what_is_missing_is_said(path, tmp_path):
    assert "has no Xudot" in run(path).output
    filled = run(path, "--fill", "clarke1983", "-o", tmp_path / "card.toml").output
    assert "Estimated, not measured" in filled
    assert "ESTIMATED" in (tmp_path / "card.toml").read_text()


@pytest.mark.slow
def test_the_card_says_how_far_the_tests_went_and_marks_what_goes_beyond(path, tmp_path):
    card_file = tmp_path / "card.toml"
    run(path, "-o", card_file, "--fill", "clarke1983")
    campaign = tomllib.loads(path.read_text())
    runs, speed, length = campaign["runs"], campaign["test"]["speed_mps"], campaign["model"]["length_m"]
    sway = max(one.get("amplitude_m", 0.0) * one.get("frequency_radps", 0.0) for one in runs)
    drift = max(sway / speed, *(abs(math.sin(one.get("drift_rad", 0.0))) for one in runs))
    card = read_card(card_file)
    assert card.model.valid_drift_rad == pytest.approx(math.asin(drift), rel=0.05)
    assert card.model.valid_rudder_rad == pytest.approx(max(one.get("rudder_rad", 0.0) for one in runs), rel=0.01)
    rate = max(one.get("yaw_rate_amplitude_radps", 0.0) for one in runs) * length / speed
    assert card.model.valid_yaw_rate_prime == pytest.approx(rate, rel=0.05)
    hard, gentle = (simulate(build(card), Turn(math.radians(angle))).reading for angle in (35.0, 2.0))
    assert hard.outside("advance_m") and "rudder to 35 deg (card 10 deg)" in hard.how
    assert "rudder" not in gentle.how


@pytest.mark.slow
def test_a_card_at_ship_scale_tells_the_reynolds_ratio(path, tmp_path):
    shown = run(path, "--scale", "25", "-o", tmp_path / "card.toml").output
    assert "125 times the model's" in shown.replace("\n", " ")
    assert read_card(tmp_path / "card.toml").ship.length_m == pytest.approx(
        25 * read_card(_model_card(path, tmp_path)).ship.length_m, rel=1e-4
    )
    for wrong in ("ship", "0.5", "big"):
        with pytest.raises(InputError):
            run(path, "--scale", wrong)


def _model_card(path, folder):
    run(path, "-o", folder / "model.toml")
    return folder / "model.toml"


@pytest.mark.slow
@pytest.mark.parametrize("convention", ["on_gauge", "hydrodynamic"])
def test_a_wrong_force_convention_is_warned_of_before_the_numbers(path, convention):
    wrong = path.with_name(f"{convention}.toml")
    wrong.write_text(path.read_text().replace('"on_model"', f'"{convention}"'))
    shown = run(wrong).output
    assert shown.startswith("CHECK: ")
    assert shown.index("the added mass is negative") < shown.index("derivatives are measured")
    assert "CHECK: " not in run(path).output
