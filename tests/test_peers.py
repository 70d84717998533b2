"""The comparison with other libraries: its own readings against exact motions, and that it runs where they are."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import peer_ships
import peers
import pytest


def test_the_diameter_of_an_exact_circle_is_read_between_its_samples() -> None:
    rate, radius = 0.0123, 480.0
    t = np.arange(0.0, 400.0, 0.5)
    read = peer_ships.tactical_diameter(t, radius * (1 - np.cos(rate * t)), rate * t)
    assert read == pytest.approx(2 * radius, rel=1e-7)


def test_the_second_overshoot_is_that_to_port() -> None:
    psi = np.radians(np.concatenate([np.linspace(0, 31, 50), np.linspace(31, -27.5, 80), np.linspace(-27.5, 33, 80)]))
    assert peer_ships.second_overshoot(psi) == pytest.approx(7.5)


def of_levels(error: float) -> peer_ships.Case:
    """A method of first order whose figure is 100 (1 + error x step)."""
    steps = tuple(8.0 / 2**k for k in range(6))
    return peer_ships.Case(
        "none", "none", "turn", "step, s", steps, 1.0, lambda step: step, lambda h: 100 * (1 + error * h)
    )


def test_the_coarsest_accurate_level_is_found_and_one_out_of_reach_is_reported() -> None:
    assert peers.accurate_level(of_levels(1.5e-4)) == (
        1.0,
        True,
    )  # half of it moves the figure by 0.75e-4, twice by 1.5e-4
    assert peers.accurate_level(of_levels(0.1)) == (0.25, False)


def test_a_peer_that_is_not_installed_is_skipped_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(peers.MODULES, "shipmmg", "no_such_module")
    assert "shipmmg is not installed" in peers.reason_to_skip("shipmmg")


def test_shipmmg_has_the_ship_on_a_steady_course_at_the_speed_of_our_card() -> None:
    mmg = pytest.importorskip("shipmmg.mmg_3dof", reason="shipmmg is not installed (the extra 'peers')")
    basic, hull, speed, revolutions, _ = peer_ships.kvlcc2()
    t = np.linspace(0.0, 600.0, 601)
    u, v, _, x, *_ = mmg.simulate_mmg_3dof(
        basic, hull, t, np.zeros(601), np.full(601, revolutions), u0=speed, rtol=1e-8
    ).sol(t)
    assert basic.L_pp == 320.0 and basic.m == pytest.approx(312_600 * 1025, rel=2e-3)  # Yasukawa and Yoshimura 2015
    assert x[-1] == pytest.approx(600 * speed, rel=1e-6) and u[-1] == pytest.approx(speed, rel=1e-6)
    assert np.abs(v).max() < 1e-9


def test_what_a_peer_needs_and_does_not_install_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(peers.MODULES, "VMM", "numpy")
    monkeypatch.setitem(peers.BESIDES, "VMM", ("numpy", "no_such_module"))
    assert "vessel-manoeuvring-models needs no_such_module, which it does not install" in peers.reason_to_skip("VMM")


def test_the_printed_table_says_what_its_columns_are(capsys: pytest.CaptureFixture[str]) -> None:
    row = peers.Row(
        "none", peer_ships.MMG, "turn", "equal accuracy", "step, s 1", 969.0, 0.019, "reference", 1, None, 2
    )
    peers.show([row], {"tank2sim": 1.0})
    reported = capsys.readouterr().out
    assert all(
        words in reported
        for words in ("0.01%", "35 deg", "20/20", "second overshoot", "us/s", "KVLCC2 MMG", "1.9000 % reference")
    )


@pytest.mark.slow
def test_one_ship_in_two_libraries_turns_alike() -> None:
    """The Mariner of Chislett and Strom-Tejsen by their equations in sympy, and by ours: one diameter."""
    if reason := peers.reason_to_skip("VMM"):
        pytest.skip(reason)
    (theirs,) = peer_ships.of_vmm()
    own = next(case for case in peers.ours() if case.ship == theirs.ship)
    assert theirs.figure(theirs.run(1e-4)) == pytest.approx(own.figure(own.run(own.delivered)), rel=1e-5)


@pytest.mark.long
def test_the_table_has_every_library_and_holds_ours_and_theirs_to_one_accuracy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("shipmmg", reason="shipmmg is not installed (the extra 'peers')")
    peers.main(["--rounds", "1", "--json", str(tmp_path / "peers.json")])
    reported = capsys.readouterr().out
    found = json.loads((tmp_path / "peers.json").read_text())
    turns = {
        row["library"]: row
        for row in found["rows"]
        if (row["manoeuvre"], row["level"]) == ("turn", "equal accuracy") and row["ship"] != peer_ships.MARINER
    }
    assert {"tank2sim", "shipmmg"} <= set(turns)
    assert all(row["change"] < peers.ACCURACY for row in turns.values())
    assert 2 < turns["shipmmg"]["figure"] / 320 < 4 and math.isfinite(turns["shipmmg"]["times_ours"])
    assert all(f"{row['figure']:.5g}" in reported for row in found["rows"])
