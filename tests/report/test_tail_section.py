"""Small probabilities on the page of stability: the numbers of the JSON, and why there are none."""

from __future__ import annotations

import json

from tank2sim.analysis.ensemble.tails import Tail
from tank2sim.report.ensemble.sections import stability_section

KNOWN = Tail(4.2, 1.3e-5, 4.5, 4.7, 253.0, "", 2.0e-4, 1.2e-5, 2000, 900, 7, 3, 11, 0.0, {"derivatives.Nd": -2.8})
FAR = Tail(16.8, 0.0, 1.9, None, 0.0, "too far out")


def section(together_tail: Tail | None = KNOWN, **tails: Tail | None):
    imo = [
        {"name": name, "allowed": 4.5, "unit": "L", "probability_met": 1.0, "interval_95": [0.9, 1.0], "not_shown": 0}
        | {"beyond_card": 5, "band": None, "tail": tail and tail.as_json()}
        for name, tail in tails.items()
    ]
    together = {"criteria": list(tails), "probability_met": 0.75, "interval_95": [0.7, 0.8], "tail": None}
    together["tail"] = together_tail and together_tail.as_json()
    found = {"members": 100, "imo": imo, "imo_all": together, "probability_stable": None, "figures": {}}
    found = json.loads(json.dumps(found | {"curves": None, "notices": []}))
    return stability_section(found, [{"name": name, "beyond_card": False} for name in tails])


def test_each_small_probability_has_a_row_and_what_it_rests_on() -> None:
    made = section(near=KNOWN, far=FAR, seen=None)
    chances, tails, _ = made.tables
    assert [row[-1] for row in chances.rows] == [5, 5, 5]
    assert [row[0] for row in tails.rows] == ["near", "far", "any of these"]
    assert tails.rows[0][1:] == [2.0e-4, 1.2e-5, 253, 4.2, 1.3e-5, 4.5, 4.7]
    assert tails.rows[1][1:] == [None, None, 0, 16.8, 0.0, 1.9, None]
    near, far = made.notes[0], made.notes[-1]
    assert all(part in near for part in ("near", "900", "7 do not", "11 left", "3 cannot", "derivatives.Nd -2.8"))
    assert far == "far: too far out" and "0.75" in made.text


def test_without_small_probabilities_there_is_no_table_of_them() -> None:
    assert len(section(None, seen=None).tables) == 2 and not section(None, seen=None).notes
