"""``tank2sim report``, ``steer`` and ``open``, and JSON on the standard output."""

from __future__ import annotations

import json
import webbrowser
from pathlib import Path

import numpy as np
import pytest

from tests.cli.command_line import refused, tank2sim


def test_histories_in_the_json_are_thinned_samples_of_the_run(tmp_path: Path) -> None:
    command = "simulate mariner --manoeuvre turn:35 --duration 300 --json s.json -o s.csv".split()
    assert tank2sim(*command, cwd=tmp_path).returncode == 0
    histories = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))["histories"]
    header, *lines = (tmp_path / "s.csv").read_text(encoding="utf-8").splitlines()[1:]
    run = dict(zip(header.split(","), np.array([line.split(",") for line in lines], dtype=float).T, strict=True))
    assert list(histories) == list(run)
    assert 600 <= len(histories["t_s"]) < 620 < len(run["t_s"])
    kept = np.searchsorted(run["t_s"], np.array(histories["t_s"]) - 1e-4)
    for name, values in histories.items():
        np.testing.assert_allclose(values, run[name][kept], rtol=1e-5, atol=1e-5, err_msg=name)
        assert max(values) == pytest.approx(run[name].max(), rel=1e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [('{"name": 1}', "is not a result"), ("{", "is not JSON"), ("\xff", "is not UTF-8"), (None, "does not exist")],
)
def test_what_is_no_result_is_refused_in_one_line(tmp_path: Path, text: str | None, said: str) -> None:
    if text is not None:
        (tmp_path / "x.json").write_text(text, encoding="latin-1")
    refused(tank2sim("report", "x.json", "-o", "x.html", cwd=tmp_path), "x.json", said)
    assert not (tmp_path / "x.html").exists()


def test_a_towed_vehicle_has_nothing_to_steer(tmp_path: Path) -> None:
    refused(tank2sim("steer", "wilinski-zellman", "-o", "s.html", cwd=tmp_path), "has no rudder")
    assert not (tmp_path / "s.html").exists()


def test_a_steering_card_is_distinguished_from_a_ship(tmp_path: Path) -> None:
    result = tank2sim("steer", "poznyakov-yudin", "-o", "s.html", cwd=tmp_path)
    refused(result, "poznyakov-yudin", "not as a ship card", "tank2sim influence")


@pytest.fixture
def opened(monkeypatch):
    """Addresses that the browser was asked to show."""
    addresses = []
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or True)
    return addresses


def test_a_page_is_opened_by_its_address(tmp_path, opened):
    page = tmp_path / "a page.html"
    page.write_text("<p>", encoding="utf-8")
    assert tank2sim("open", page.name, cwd=tmp_path).returncode == 0
    assert opened == [page.as_uri()]


@pytest.mark.parametrize("name", ["none.html", "card.toml"])
def test_what_is_not_a_page_is_refused(tmp_path, opened, name):
    (tmp_path / "card.toml").write_text("", encoding="utf-8")
    refused(tank2sim("open", name, cwd=tmp_path), name)
    assert opened == []


def test_without_a_browser_the_address_is_reported(tmp_path, monkeypatch):
    page = tmp_path / "page.html"
    page.write_text("<p>", encoding="utf-8")
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    refused(tank2sim("open", page.name, cwd=tmp_path), page.as_uri())


@pytest.mark.parametrize(
    "arguments",
    [
        ("ships",),
        ("simulate", "mariner", "--manoeuvre", "turn:35"),
        ("influence", "mariner", "--figures", "criterion_C"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_json_on_standard_output_is_json_alone(tmp_path, arguments) -> None:
    result = tank2sim(*arguments, "--json", "-", cwd=tmp_path)
    assert result.returncode == 0 and json.loads(result.stdout)
    assert result.stderr.strip()  # the summary
    assert not list(tmp_path.iterdir())
    again = tank2sim(*arguments, cwd=tmp_path)  # and without it the summary is where it was
    assert again.stdout.strip() and not again.stderr.strip()


@pytest.mark.slow
def test_no_other_output_goes_there(tmp_path) -> None:
    refused(tank2sim("export", "mariner", "-o", "-", cwd=tmp_path), "standard output")
    assert not list(tmp_path.iterdir())
