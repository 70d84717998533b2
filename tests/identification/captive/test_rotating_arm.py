"""Steady turning tests of a rotating arm reduced to derivatives in r, against a hull written in plain numpy."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.errors import InputError
from tank2sim.identification.captive.reduction import reduce_campaign
from tank2sim.records.campaigns import read_campaign
from tests.identification.captive.rotating_arm import HEEL, TRUTH, L, conditions, gauges, write_arm
from tests.identification.captive_mmg.tank import KVLCC2, write_campaign
from tests.marks import first_fast


def reduced(path):
    return reduce_campaign(read_campaign(path)).derivatives


@pytest.mark.parametrize("column", ["prime", "deg"])
def test_without_noise_every_derivative_is_that_of_the_hull(tmp_path, column):
    found = reduced(write_arm(tmp_path, TRUTH, noise=1e-4, column=column))
    for name, value in TRUTH.items():
        assert found[name].value == pytest.approx(value, rel=1e-4), name
    others = [name for name in found if name not in TRUTH]
    assert all(abs(found[name].value) < 1e-6 for name in others)


# Few campaigns in the tests that are run often, with bounds that are as much wider as chance makes them.
COUNTS = pytest.mark.parametrize(
    ("campaigns", "least", "most"),
    [pytest.param(20, 0.90, 0.98, marks=pytest.mark.long), pytest.param(6, 0.87, 1.0, marks=pytest.mark.slow)],
)


@COUNTS
@pytest.mark.parametrize(("hull", "judged", "first"), [(TRUTH, TRUTH, 500), (TRUTH | HEEL, HEEL, 900)])
def test_intervals_have_the_truth_in_90_to_98_percent(campaigns, least, most, hull, judged, first, tmp_path):
    inside = []
    for seed in range(campaigns):
        random = np.random.default_rng(first + seed)
        truth = {name: value * random.uniform(0.85, 1.15) for name, value in hull.items()}
        found = reduced(write_arm(tmp_path, truth, seed))
        inside += [abs(found[name].value - truth[name]) < 1.96 * found[name].standard_error for name in judged]
    assert least <= np.mean(inside) <= most


def as_runs(folder, *, with_rate: bool):
    """The same arm with a file for each run, of 60 equal readings and a little noise of the gauges."""
    random = np.random.default_rng(3)
    U, beta, r, delta = conditions().T
    read = gauges(TRUTH, U, beta, r, delta)
    table = write_arm(folder, TRUTH, noise=0.0).read_text().partition("[averages]")[0]
    for place, (speed, drift, turn, rudder) in enumerate(zip(U, beta, r, delta, strict=True)):
        kind = "steady_turn" if turn else "drift_and_rudder" if drift and rudder else "static_rudder"
        kind = "static_drift" if not turn and not rudder else kind
        rate = turn * speed / L
        sheet = f"yaw_rate_radps = {rate}\n" if turn and not with_rate else ""
        table += f'[[runs]]\nfile = "{place}.csv"\ntype = "{kind}"\ndrift_rad = {drift}\nrudder_rad = {rudder}\n{sheet}'
        time = 0.1 * np.arange(60)
        columns = {"t_s": time, "speed_mps": np.full(60, speed)} | ({"r_radps": np.full(60, rate)} if with_rate else {})
        columns |= {
            name: read[force][place] + 0.01 * random.standard_normal(60)
            for force, name in (("X", "X_N"), ("Y", "Y_N"), ("N", "N_Nm"))
        }
        with (folder / f"{place}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([list(columns), *np.column_stack(list(columns.values())).tolist()])
    (folder / "campaign.toml").write_text(table)
    return folder / "campaign.toml"


@first_fast("with_rate", [True, False])
def test_a_file_for_each_turn_gives_the_derivatives_of_the_table(tmp_path, with_rate):
    found = reduced(as_runs(tmp_path, with_rate=with_rate))
    for name in ("Yr", "Nr", "Yvvr", "Nvvr", "Yvrr", "Xvr", "Xrr", "Yv", "Nd"):
        assert found[name].value == pytest.approx(TRUTH[name], rel=0.02), name


def test_a_turn_without_a_rate_is_refused_with_what_lacks(tmp_path):
    path = as_runs(tmp_path, with_rate=False)
    path.write_text("\n".join(line for line in path.read_text().splitlines() if not line.startswith("yaw_rate")))
    with pytest.raises(InputError, match="r_radps"):
        reduced(path)


def test_a_yaw_rate_in_degrees_read_as_radians_is_refused(tmp_path):
    path = write_arm(tmp_path, TRUTH, column="deg")
    path.write_text(path.read_text().replace("yaw_rate_degps", "yaw_rate_radps"))
    with pytest.raises(InputError, match=r"averages\.columns\.yaw_rate"):
        reduced(path)


@pytest.mark.slow
def test_a_yaw_rate_of_the_other_sign_is_in_the_first_lines(tmp_path):
    path = write_arm(tmp_path, TRUTH)
    rows = list(csv.DictReader((tmp_path / "runs.csv").open()))
    with (tmp_path / "runs.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows([{**row, "r": -float(row["r"])} for row in rows])
    assert any("Nr" in line for line in t2s.reduce(path).cautions)
    assert not any("Nr" in line for line in t2s.reduce(write_arm(tmp_path, TRUTH)).cautions)


@pytest.mark.slow
def test_tests_at_a_heel_give_the_terms_of_the_heel_and_leave_the_others(tmp_path):
    result = t2s.reduce(write_arm(tmp_path, TRUTH | HEEL, noise=1e-4))
    for name, value in (TRUTH | HEEL).items():
        if name != "X0":  # of a towed model, which a card does not have
            assert result.derivatives.value[name] == pytest.approx(value, rel=1e-3), name
    assert not set(HEEL) & set(result.card.derivatives)
    assert set(result.to_dict()["heel_derivatives"]) == set(HEEL)
    assert any("Nvvphi" in notice for notice in result.notices)


def test_a_heel_is_refused_where_the_method_is_of_an_upright_hull(tmp_path):
    path = write_campaign(tmp_path, KVLCC2)
    path.write_text(path.read_text().replace('drift_deg = "beta"', 'drift_deg = "beta"\nheel_deg = "beta"'))
    with pytest.raises(InputError, match="heel"):
        t2s.reduce_to_mmg(path)


def test_a_heel_in_degrees_read_as_radians_is_refused(tmp_path):
    path = write_arm(tmp_path, TRUTH | HEEL)
    path.write_text(path.read_text().replace("heel_deg", "heel_rad"))
    with pytest.raises(InputError, match="heel_rad"):
        reduced(path)
