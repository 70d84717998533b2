"""The improved card of ``gap`` has what of the covariance of the first one still holds, in its own folder."""

from __future__ import annotations

import numpy as np

from tank2sim.cards import ManoeuvringCard, parse_card, read_card
from tank2sim.cards.covariance import Covariance, covariance_file, referring
from tank2sim.cards.covariance_reading import read_covariance
from tank2sim.cards.reading import changed_text
from tank2sim.results.gap import improved_files

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
