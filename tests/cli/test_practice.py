"""``tank2sim compare``, ``validate``, ``poster`` and ``pilotcard``: files whole or none, and one line where refused."""

from __future__ import annotations

import json

import pytest

from tests.cli.command_line import refused, tank2sim


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare", "mariner"], "two cards"),
        (["compare", "mariner", "wilinski-zellman"], "model.kind"),
        (["poster", "wilinski-zellman", "-o", "w.html"], "model.kind"),
        (["poster", "mariner", "-o", "w.html", "--order", "Half ahead"], "NAME=NUMBER"),
        (["pilotcard", "mariner", "-o", "w.html", "--order", "Half ahead=-3"], "NAME=RPM"),
        (["pilotcard", "mariner", "-o", "w.html", "--order", "Full astern=60"], "order astern"),
        (["poster", "esso-osaka-estimated", "-o", "w.html", "--order", "Full=7000000"], "beyond 1,200 revolutions"),
        (["poster", "esso-osaka-estimated", "-o", "w.html", "--order", f"{'x' * 30}=500"], "no room"),
        (["poster", "mariner", "-o", "w.html", "--ballast", "kvlcc2-captive"], "length 320 m"),
        (["poster", "mariner", "-o", "w.html", "--ballast", "mariner"], "ship.draught_m"),
        (["pilotcard", "mariner"], "--page"),
        (["validate", "mariner", "nothing.csv", "-o", "v.html"], "nothing.csv"),
    ],
)
def test_bad_input_is_refused_in_one_line_and_nothing_is_written(tmp_path, arguments, words) -> None:
    refused(tank2sim(*arguments, cwd=tmp_path), words)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_validate_tells_each_figure_of_a_real_trial(tmp_path, data) -> None:
    trials = data / "data" / "kvlcc2_marin" / "MARIN_FREE_KVLCC2_zz_10_m.dat"
    arguments = ["validate", "kvlcc2-captive", str(trials), "--members", "0", "-o", "v.html", "--json", "v.json"]
    result = tank2sim(*arguments, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    found = json.loads((tmp_path / "v.json").read_text())
    rows = {one["name"]: one for one in found["figures"]}
    assert rows["overshoot_1_deg"]["measured"] == pytest.approx(9.4, abs=0.3)
    assert all(one["numerical"] < 0.01 for one in rows.values())
    assert sum(found["counts"].values()) == len(rows) == 4
    page = (tmp_path / "v.html").read_text()
    assert "Replays" in page and "Source of the coefficients" in page


@pytest.mark.slow
def test_a_criterion_beyond_the_card_is_neither_met_nor_probable(tmp_path) -> None:
    result = tank2sim("stability", "kvlcc2-captive", "--no-spirals", "--members", "3", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    for caption in ("IMO MSC.137(76), worse side", "Probability of each IMO criterion"):
        _, _, shown = result.stdout.partition(caption)
        row = next(row for row in shown.splitlines() if "tactical" in row)
        assert "beyond" in row and not {"passed", "yes", "1"} & set(row.split()), caption
    assert "IMO criteria together are met" not in result.stdout
