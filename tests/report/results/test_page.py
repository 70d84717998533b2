"""A page of any result: what is shown of it, with which units, and what is refused."""

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tank2sim.answer.page import render_page
from tank2sim.errors import InputError
from tank2sim.report.json_values import alike, json_quantities, rows_of, titled, words
from tank2sim.report.results.page import result_page
from tank2sim.report.results.result_types import RESULT_TYPES, kind_of
from tank2sim.report.results.subjects import needs_of
from tests.report.opened_page import CHROMIUM, opened

GAP = {
    "verdict": "missing effect",
    "could_hide": {"wind": {"speed_mps": 0.1}, "rudder_bias": {"angle_deg": 0.01}},
    "misfit": {"before": {"fit": 88.3, "holdout": 86.7}, "after": {"fit": 1.04, "holdout": None}},
    "trials": [
        {
            "trial": name,
            "held_out": False,
            "signals": {"x_m": {"before": 80.0, "after": after}, "psi_deg": {"before": 2.0, "after": 1.0}},
        }
        for name, after in (("turn.csv", 1.1), ("zigzag.csv", 0.9))
    ],
    "notices": ["look at this"],
}


def section(page, heading):
    return next(one for one in page.sections if one.heading == heading)


@pytest.mark.parametrize(
    ("key", "shown"),
    [
        ("advance_m", ("advance", "m")),
        ("steady_rate_degps", ("steady rate", "deg/s")),
        ("steady_radius_m@20", ("steady radius at 20 deg", "m")),
        ("K_per_s", ("K", "1/s")),
        ("x_G_m", ("x_G", "m")),
        ("C_prime", ("C′", "")),
        ("derivatives.Yv", ("derivatives.Yv", "")),
        ("turn10_s.csv", ("turn10_s.csv", "")),
    ],
)
def test_units_are_read_off_the_keys(key, shown):
    assert words(key) == shown


def test_each_quantity_keeps_its_own_digits():
    table = json_quantities("all", {"gravity_mps2": 9.81, "length_m": 1234.5, "small": 1.5e-7})
    assert [row[1] for row in table.rows] == ["9.81", "1234", "1.5×10⁻⁷"] or table.rows[0][1] == "9.81"
    wide = rows_of("all", [("a", {"value": -8.868e-05}), ("b", {"value": 0.08744})], "name")
    assert wide.rows[0][1].startswith("−8.868")


def test_objects_of_one_kind_share_a_table_and_others_do_not():
    assert alike({"a": {"value": 1, "error": 2}, "b": {"value": 3}})
    assert not alike({"a": {"value": 1}, "b": {"speed_mps": 3}})
    assert titled("u_mps") == "u (m/s)"


def test_a_gap_has_its_verdict_its_notices_and_a_map_to_switch():
    page = result_page(GAP, "gap.json")
    assert [figure.value for figure in page.figures] == ["missing effect", "88.3 → 1.04"]
    assert "none was held out" in page.figures[1].label
    assert "report.html" in page.sections[0].text
    assert page.sections[0].notes == ["look at this"]
    hidden = section(page, "Sizes that would not show").tables[0]
    assert [tuple(row) for row in hidden.rows] == [
        ("wind", "speed", "0.1", "m/s"),
        ("rudder bias", "angle", "0.01", "deg"),
    ]
    chart = section(page, "Trials").charts[0].chart.to_dict()
    switch = next(one for one in chart["params"] if one["name"] == "shown")
    assert switch["bind"]["options"] == ["before", "after", "both"] and switch["value"] == "both"


@pytest.mark.parametrize("result", [{}, [], 3, None, {"name": "package", "version": "1"}])
def test_what_no_command_wrote_is_refused(result):
    with pytest.raises(InputError, match="is not a result of a tank2sim command"):
        result_page(result, "x.json")


def test_every_kind_is_distinguished():
    for kind in RESULT_TYPES:
        assert kind_of(dict.fromkeys(kind.keys), "x.json").title == kind.title


def test_the_tiles_of_a_gap_name_the_effect_with_its_parameters_and_judge_by_the_trials_held_out():
    effect = {"name": "current", "parameters": {"speed_mps": 0.52867, "direction_deg": 252.93}}
    effect |= {"standard_errors": {"speed_mps": 0.0051, "direction_deg": None}}
    misfit = {"before": {"fit": 9.0, "holdout": 108.02}, "after": {"fit": 2.0, "holdout": 1.06}}
    page = result_page({**GAP, "effects": [effect], "misfit": misfit}, "gap.json")
    assert [(one.label, one.value, one.unit) for one in page.figures] == [
        ("Verdict", "missing effect", ""),
        ("current: speed", "0.5287 ± 0.0051", "m/s"),
        ("current: direction towards", "252.9", "deg"),
        ("Misfit of the trials held out", "108 → 1.06", ""),
    ]


def test_few_rows_of_many_columns_are_turned_and_what_nobody_knows_is_left_out():
    keys = [f"length_{place}_m" for place in range(12)]
    one = dict.fromkeys(keys, 1.5) | {"nowhere": None, "empty": []}
    table = rows_of("all", [("a", one), ("b", one)], "name")
    assert [column.title for column in table.columns] == ["quantity", "a", "b", "unit"]
    assert [tuple(row) for row in table.rows] == [(f"length {place}", "1.5", "1.5", "m") for place in range(12)]
    assert [row[0] for row in json_quantities("all", {"bootstrap": None, "ranges": [], "runs": 0}).rows] == ["runs"]


def test_a_fleet_is_reported_by_the_names_of_the_folders_without_ways_that_lead_nowhere():
    reported = {"verdict": "no missing effect", "effects": [], "alternatives": [], "trials": {"fit": 1, "holdout": 0}}
    reported |= {"misfit": {"before": {"fit": 1.0, "holdout": None}, "after": {"fit": 1.0, "holdout": None}}}
    ships = [{"folder": "ship one", "name": "A ship", **reported}, {"folder": "two", "fault": "no card"}]
    page = result_page({"fleet": "f", "ships": ships, "notices": []}, "fleet.json")
    assert page.figures[0].value == "2"
    assert section(page, "Ships").tables[0].rows[0][0] == "ship one"
    assert "report.html" in section(page, "Ships").text
    assert list(section(page, "Without a result").tables[0].rows[0]) == ["two", "no card"]


DAMAGES = st.sampled_from(["text", 5, True, [1, 2], {"a": 5}, [{}], ["x"] * 20, [None], {"a": {}}])
NEEDED = {kind.title: [*kind.keys, *needs_of(kind.title), "notices", "figures", "effects"] for kind in RESULT_TYPES}


@settings(max_examples=25, deadline=None)
@given(data=st.data(), kind=st.sampled_from(RESULT_TYPES), damage=DAMAGES)
def test_a_damaged_key_is_an_error_of_the_file_and_never_one_of_the_program(data, kind, damage):
    """Whatever stands under any key of any kind, the page is drawn or the key is reported."""
    whole = {key: form() for key, form in needs_of(kind.title).items()}
    key = data.draw(st.sampled_from(NEEDED[kind.title]))
    result = {**dict.fromkeys(kind.keys), **whole, key: damage}
    try:
        page = result_page(result, "x.json")
    except InputError as error:
        assert error.source == "x.json" and error.place
    else:
        assert page.title


@pytest.mark.parametrize("damage", ["text", 5])
@pytest.mark.parametrize(("kind", "key"), [(one.title, key) for one in RESULT_TYPES for key in needs_of(one.title)])
def test_text_or_a_number_in_place_of_what_is_drawn_is_reported_by_its_key(kind, key, damage):
    form = needs_of(kind)[key]
    if form is object or isinstance(damage, form):
        return
    known = next(one for one in RESULT_TYPES if one.title == kind)
    whole = {name: own() for name, own in needs_of(kind).items()}
    with pytest.raises(InputError, match=f"^x.json: {key}: has not the form") as caught:
        result_page({**dict.fromkeys(known.keys), **whole, key: damage}, "x.json")
    assert caught.value.place == key


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to open the page in")
def test_the_page_opens_without_a_word_in_the_console(tmp_path):
    html = render_page(result_page(json.loads(json.dumps(GAP)), "r.json"))
    assert len(html.encode()) < 6e6
    seen, console = opened(html, tmp_path)
    assert console == []
    assert 'data-charts="drawn"' in seen
    assert seen.count('type="radio"') == 3  # before, after, both
