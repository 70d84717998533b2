"""A page of any result: what is shown of it, with which units, and what is refused."""

import json

import pytest

from tank2sim.errors import InputError
from tank2sim.report.page import Verdict, render_page
from tank2sim.report.result_kinds import KINDS, kind_of
from tank2sim.report.result_page import result_page
from tank2sim.report.result_values import alike, quantities, rows_of, titled, words
from tests.report.test_page_in_browser import CHROMIUM, opened

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

STABILITY = {
    "ship": "A ship",
    "stability_criterion": {"C_prime": 6e-6, "stable": True},
    "nomoto": {"dimensional": {"K_per_s": 0.18, "T_s": 107.0}, "prime": {"K_per_s": 3.8, "T_s": 5.1}},
    "eigenvalues": [[-0.008, 0.0], [-0.1, 0.02], [-0.1, -0.02]],
    "responses": [
        {
            "system": "rudder to yaw rate",
            "poles": [[-0.1, 0.0]],
            "zeros": [],
            "bode": {
                "omega_radps": [0.001 * 1.5**k for k in range(20)],
                "magnitude_dB": [-float(k) for k in range(20)],
                "phase_deg": [-2.0 * k for k in range(20)],
            },
        }
    ],
    "steady_turning": {
        "points": {
            "rudder_deg": [float(abs(k - 10) * (k - 10)) / 4 for k in range(21)],
            "yaw_rate_degps": [0.1 * (k - 10) for k in range(21)],
            "stable": [abs(k - 10) > 3 for k in range(21)],
        }
    },
    "imo": [
        {"name": "advance", "found": 3.7, "allowed": 4.5, "unit": "L", "passed": True},
        {"name": "first overshoot", "found": 13.0, "allowed": 10.0, "unit": "deg", "passed": False},
    ],
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
    table = quantities("all", {"gravity_mps2": 9.81, "length_m": 1234.5, "small": 1.5e-7})
    assert [row[1] for row in table.rows] == ["9.81", "1234", "1.5×10⁻⁷"] or table.rows[0][1] == "9.81"
    wide = rows_of("all", [("a", {"value": -8.868e-05}), ("b", {"value": 0.08744})], "name")
    assert wide.rows[0][1].startswith("−8.868")


def test_objects_of_one_kind_share_a_table_and_others_do_not():
    assert alike({"a": {"value": 1, "error": 2}, "b": {"value": 3}})
    assert not alike({"a": {"value": 1}, "b": {"speed_mps": 3}})
    assert titled("u_mps") == "u (m/s)"


def test_a_gap_has_its_verdict_its_notices_and_a_map_to_switch():
    page = result_page(GAP, "gap.json")
    assert page.figures[0].value == "missing effect"
    assert [figure.value for figure in page.figures[1:]] == [88.3, 1.04]
    assert page.sections[0].notes == ["look at this"]
    hidden = section(page, "Could hide").tables[0]
    assert [tuple(row) for row in hidden.rows] == [
        ("wind", "speed", "0.1", "m/s"),
        ("rudder bias", "angle", "0.01", "deg"),
    ]
    chart = section(page, "Trials").charts[0].chart.to_dict()
    switch = next(one for one in chart["params"] if one["name"] == "model")
    assert switch["bind"]["options"] == ["before", "after"]


def test_stability_has_its_diagrams_and_the_criteria_their_verdicts():
    page = result_page(STABILITY, "stability.json")
    assert page.figures[0].verdict is Verdict.PASSED
    table = section(page, "IMO criteria").tables[0]
    place = [column.title for column in table.columns].index("passed")
    assert [row[place] for row in table.rows] == [Verdict.PASSED, Verdict.FAILED]
    assert len(section(page, "Eigenvalues").charts) == 1
    assert len(section(page, "Responses").charts) == 2
    turning = section(page, "Steady turning").charts[0]
    assert "Dashed where stable is false" in turning.caption
    rows = next(iter(turning.chart.to_dict()["datasets"].values()))
    unstable = {round(row["y0"], 9) for row in rows if not row["truth"]}
    assert max(map(abs, unstable)) == pytest.approx(0.4)  # the line is drawn on to the first stable point


def test_named_values_with_standard_errors_are_compared():
    names = {"Yv": (-0.01, 1e-4), "Yr": (0.002, 1e-4), "Nv": (-0.003, 3e-4)}
    derivatives = {name: {"value": value, "standard_error": error} for name, (value, error) in names.items()}
    page = result_page({"campaign": "c.toml", "derivatives": derivatives}, "r.json")
    (chart,) = section(page, "Derivatives").charts
    rows = next(iter(chart.chart.to_dict()["datasets"].values()))
    assert [(row["name"], row["percent"]) for row in rows] == [("Yv", 1.0), ("Yr", 5.0), ("Nv", 10.0)]


@pytest.mark.parametrize("result", [{}, [], 3, None, {"name": "package", "version": "1"}])
def test_what_no_command_wrote_is_refused(result):
    with pytest.raises(InputError, match="is no result of a tank2sim command"):
        result_page(result, "x.json")


def test_every_kind_is_told_apart():
    for kind in KINDS:
        assert kind_of(dict.fromkeys(kind.keys), "x.json").title == kind.title


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to open the page in")
@pytest.mark.parametrize("result", [GAP, STABILITY], ids=["gap", "stability"])
def test_the_page_opens_without_a_word_in_the_console(result, tmp_path):
    html = render_page(result_page(json.loads(json.dumps(result)), "r.json"))
    assert len(html.encode()) < 6e6
    seen, console = opened(html, tmp_path)
    assert console == []
    assert 'data-charts="drawn"' in seen
    if result is GAP:
        assert seen.count('type="radio"') == 2
