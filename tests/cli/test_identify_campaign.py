"""``tank2sim identify --campaign``: captive tests of a generator that shares no code, together with a free trial."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.cards import parse_card
from tank2sim.cards.reading import revised
from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.identification.captive.result_card import card_contents, reduced_card_text
from tank2sim.records.campaigns import read_campaign
from tests.cli.command_line import refused, tank2sim
from tests.identification.captive.generator import Campaign, write

SCALE = 25.0
NOISE = {"u_mps": 0.05, "v_mps": 0.05, "r_degps": 0.02, "psi_deg": 0.2, "x_m": 1.0, "y_m": 1.0}
CUBIC = ("Yvvv", "Nvvv", "Yvvr", "Nvvr")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign, a zigzag of the true ship at full scale, and a card with wide errors, off by a tenth."""
    home = tmp_path_factory.mktemp("tank")
    written = write(Campaign(seed=4, rate_hz=10.0), home / "tank")
    reduction = reduce_campaign(read_campaign(written.path))
    card = parse_card(reduced_card_text(reduction, card_contents(reduction), SCALE), "ship.toml")
    true = {name: (written.derivatives[name], 1e-9) for name in card.derivatives if name in written.derivatives}
    columns = t2s.Ship(revised(card, true)).zigzag(20, 20, duration_s=600).df[["t_s", "delta_deg", *NOISE]].iloc[::10]
    chance = np.random.default_rng(8)
    for name, deviation in NOISE.items():
        columns[name] += deviation * chance.standard_normal(len(columns))
    columns.to_csv(home / "zigzag.csv", index=False)
    hydrodynamic = {name: value for name, (value, _) in true.items() if not name.endswith("dot")}
    off = true | {name: (0.9 * value, 0.2 * abs(value) + 1e-6) for name, value in hydrodynamic.items()}
    revised(card, off).save(home / "off.toml")
    (home / "truth.json").write_text(json.dumps(written.derivatives), encoding="utf-8")
    return home


@pytest.mark.slow
def test_captive_tests_determine_what_a_zigzag_does_not(folder: Path) -> None:
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    options = {"structure": "card", "members": 0}
    alone = t2s.identify(folder / "off.toml", folder / "zigzag.csv", **options)
    both = t2s.identify(folder / "off.toml", folder / "zigzag.csv", campaign=folder / "tank/campaign.toml", **options)
    for name in CUBIC:
        key = f"derivatives.{name}"
        before, after = (found.estimates.loc[key] for found in (alone, both))
        assert after["standard_error"] < 0.7 * before["standard_error"], name
        assert abs(after["value"] - truth[name]) < 4 * after["standard_error"], name


@pytest.mark.slow
def test_what_a_campaign_cannot_be_fitted_with_is_one_line(folder: Path) -> None:
    command = ["identify", str(folder / "off.toml"), str(folder / "zigzag.csv"), "-o", str(folder / "out.toml")]
    campaign = ["--campaign", str(folder / "tank/campaign.toml")]
    refused(tank2sim(*command, *campaign, "--method", "kalman", cwd=folder), "--campaign", "kalman")
    other = (folder / "off.toml").read_text(encoding="utf-8")
    beam = next(line for line in other.splitlines() if line.startswith("draught_m"))
    wide = other.replace(beam, f"draught_m = {1.5 * float(beam.partition('=')[2].split('#')[0])}")
    (folder / "wide.toml").write_text(wide, encoding="utf-8")
    refused(
        tank2sim("identify", str(folder / "wide.toml"), *command[2:], *campaign, cwd=folder),
        "campaign.toml",
        "model.draught_m",
    )
    refused(tank2sim(*command, "--campaign", str(folder / "no.toml"), cwd=folder), "no.toml")
    assert not (folder / "out.toml").exists()
