"""Published derivatives with scrambled conventions are read as what they are; what cannot be known is said so.

The rewriting into other conventions is that of ``benchmarks/convention.py``: by SI and by multiplying polynomials out;
it shares no code with what reads.
"""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from convention import HERE, Table, combinations

import tank2sim as t2s
from tank2sim.apps.programs.readings import (
    Reading,
    linear_figures,
    possible_readings,
    read_as,
    weigh,
    with_probabilities,
)
from tank2sim.bundled import bundled_cards
from tank2sim.cards.coefficient_table import read_coefficients
from tank2sim.cards.form import RigidBody
from tank2sim.errors import InputError
from tests.marks import first_fast

S175 = """name,value
length_m,175
beam_m,25.4
draught_m,8.5
displacement_kg,21752550
speed_mps,7
mass,0.00792
yaw_inertia,0.000456
Yvdot,-0.00705
Nrdot,-0.000419
Yv,-0.012035
Yr,-0.00522
Yd,-0.002578
Nv,-0.0038436
Nr,-0.00243
Nd,0.00126
"""
"""Son and Nomoto (1982), linear, with total yaw-rate terms, as printed in the prime system, rudder to starboard."""


def written(tmp_path: Path, text: str, name: str = "table.csv") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def mariner_without(tmp_path: Path, *keys: str) -> Path:
    """The bundled card without lines, and with the displacement that a table needs."""
    text = bundled_cards()["mariner"].read_text(encoding="utf-8")
    kept = "\n".join(line for line in text.splitlines() if not line.startswith(keys))
    return written(tmp_path, kept.replace("[ship]\n", "[ship]\ndisplacement_kg = 17045000.0\n"), "ship.toml")


EVERY = 5
"""Of the ways to print a table so many-th one is tried where not all are: a prime to the counts of each choice."""


@first_fast("name", ["s175_container", "mariner", "esso_osaka_model", "tanker_1972"])
def test_the_true_reading_of_a_scrambled_table_is_the_first(name: str, tmp_path: Path) -> None:
    source = HERE / f"{name}.csv"
    for wanted in list(combinations(Table(source)))[::EVERY]:
        path = written(tmp_path, "\n".join(Table(source).rows(wanted)) + "\n")
        table = read_coefficients(path)
        ranked = with_probabilities([weigh(table, reading) for reading in possible_readings(table)])
        assert vars(ranked[0].reading) == wanted
        assert math.fsum(entry.probability for entry in ranked) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("every", "least"), [pytest.param(1, 200, marks=pytest.mark.long), pytest.param(EVERY, 40, marks=pytest.mark.slow)]
)
def test_of_ten_published_tables_nine_in_ten_readings_are_true_and_all_but_for_the_origin(
    tmp_path: Path, every: int, least: int
) -> None:
    first, ship, count = 0, 0, 0
    for source in sorted(HERE.glob("*.csv")):
        for wanted in list(combinations(Table(source)))[::every]:
            path = written(tmp_path, "\n".join(Table(source).rows(wanted)) + "\n")
            found = vars(t2s.convention(path).readings[0])
            first += wanted.items() <= found.items()
            ship += all(found[key] == wanted[key] for key in wanted if key != "origin")
            count += 1
    assert count > least and first / count > 0.9 and ship / count > 0.98


def test_every_reading_of_a_table_that_was_scrambled_that_way_is_the_same_ship(tmp_path: Path) -> None:
    """What the true reading makes of each scrambled table are the published numbers."""
    source = HERE / "kvlcc2_mmg.csv"
    expected = None
    for wanted in combinations(Table(source)):
        table = read_coefficients(written(tmp_path, "\n".join(Table(source).rows(wanted)) + "\n"))
        ship = read_as(table, Reading(**wanted))
        expected = expected or ship
        largest = {force: max(abs(v) for n, v in expected.derivatives.items() if n[0] == force) for force in "XYN"}
        for term, value in expected.derivatives.items():
            assert ship.derivatives[term] == pytest.approx(value, rel=2e-3, abs=2e-3 * largest[term[0]]), (wanted, term)
        assert ship.body.x_G == pytest.approx(expected.body.x_G, abs=1e-6)
        assert ship.body.yaw_inertia == pytest.approx(expected.body.yaw_inertia, rel=2e-3)


def test_norrbins_index_of_a_ship_without_coupling_is_that_of_its_first_order_equation() -> None:
    """psi(1) = K (1 - T + T exp(-1/T)) by unit of rudder, K and T of yaw alone; C' is the product of the damping."""
    derivatives = {"Yv": -0.01, "Yr": 0.008, "Nv": 0.0, "Nr": -0.002, "Nd": 0.001, "Yd": 0.0, "Nrdot": -0.0004}
    criterion, growth, index = linear_figures(derivatives, RigidBody(mass=0.008, yaw_inertia=0.0005, x_G=0.0))
    K, T = 0.5, 0.0009 / 0.002
    assert index == pytest.approx(K * (1 - T + T * math.exp(-1 / T)), rel=1e-9)
    assert criterion == pytest.approx(2e-5) and growth == pytest.approx(-0.01 / 0.008)


def test_names_as_print_has_them_are_understood(tmp_path: Path) -> None:
    rows = (
        S175.replace("Yv,-0.012035", "Y_beta',0.012035")
        .replace("Nd,", "N_{δ},")
        .replace("Yvdot,-0.00705", "m_y,0.00705")
    )
    table = read_coefficients(written(tmp_path, rows.replace("mass,", "m',")))
    assert table.derivatives["Yv"] == -0.012035 and table.derivatives["Nd"] == 0.00126
    assert table.derivatives["Yvdot"] == -0.00705 and table.body["mass"] == 0.00792


@pytest.mark.slow
def test_a_card_without_its_conventions_is_a_table_and_what_it_states_is_taken(tmp_path: Path) -> None:
    found = t2s.convention(mariner_without(tmp_path, "rudder_sign", "yaw_rate_terms"))
    assert {entry.scaling for entry in found.readings} == {"prime"}
    first = found.readings[0]
    assert (first.rudder_sign, first.yaw_rate_terms, first.origin) == ("port", "total", "midships")
    assert found.readings[0].vanished == ("Xvr",)  # the printed X_vr' is m'
    assert any("steering_gear" in notice for notice in found.notices)


@pytest.mark.slow
def test_the_card_of_the_first_reading_is_the_published_ship(tmp_path: Path) -> None:
    found = t2s.convention(mariner_without(tmp_path, "rudder_sign", "yaw_rate_terms", "scaling"))
    expected, made = (ship.stability().to_dict()["stability_criterion"] for ship in (t2s.load("mariner"), found.ship))
    assert made["C_prime"] == pytest.approx(expected["C_prime"], rel=1e-4)  # type: ignore[index]
    turns = [ship.turn(35).figures["tactical_diameter_lengths"] for ship in (t2s.load("mariner"), found.ship)]
    assert turns[1] == pytest.approx(turns[0], rel=0.02)


@pytest.mark.slow
def test_the_speed_of_the_scaling_shows_in_the_terms_by_speed(tmp_path: Path) -> None:
    """The Mariner's Yvu = Yv, Ydu = 2 Yd are those of u v and u^2 delta scaled with u0; those of a fit are not."""
    found = t2s.convention(mariner_without(tmp_path, "speed_scale", "scaling"))
    assert found.to_dict()["scaled_with_nominal_speed"] is True
    assert found.ship.card.model.speed_scale == "nominal"  # type: ignore[union-attr]
    as_stated = t2s.load("mariner", {"model.speed_scale": "nominal"}).turn(35).figures["tactical_diameter_lengths"]
    assert found.ship.turn(35).figures["tactical_diameter_lengths"] == pytest.approx(as_stated, rel=0.02)
    assert 4.8 < as_stated < 5.1  # scaled with the speed at any time it is 6.4
    t2s.convert("kvlcc2-l7-mmg").save(tmp_path / "fit.toml")  # scaled with the speed at any time
    assert t2s.convention(tmp_path / "fit.toml").to_dict()["scaled_with_nominal_speed"] is False
    assert t2s.convention(written(tmp_path, S175)).to_dict()["scaled_with_nominal_speed"] is None


def test_sizes_that_a_table_lacks_are_assumed_and_said_so(tmp_path: Path) -> None:
    lines = [line for line in S175.splitlines() if not line.startswith(("beam_m", "draught_m", "displacement_kg"))]
    found = t2s.convention(written(tmp_path, "\n".join(lines)))
    assert list(found.to_dict()["assumed"]) == ["beam_m", "draught_m", "displacement_kg"]
    assert any(notice.startswith("ASSUMED") for notice in found.notices)
    first = found.readings[0]
    assert (first.rudder_sign, first.scaling, first.yaw_rate_terms) == ("starboard", "prime", "total")


def test_where_the_numbers_do_not_settle_the_origin_it_is_said_so(tmp_path: Path) -> None:
    found = t2s.convention(written(tmp_path, S175 + "centre_of_gravity_m,-3\n"))
    assert 0.5 < found.readings[0].probability < 0.9
    assert found.headline[0].startswith("UNCERTAIN")
    assert {entry.origin for entry in found.readings[:2]} == {"midships", "centre_of_gravity"}


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("Yv,-0.012035", "Yq,-0.012035", "Yq"),
        ("Yv,-0.012035\n", "", "Yv"),
        ("Yv,-0.012035", "Yv,none", "Yv"),
        ("length_m,175", "length_m,17500", "length_m"),
        ("length_m,175\n", "", "length_m"),
        ("displacement_kg,21752550", "displacement_kg,217525500", "displacement_kg"),
        ("Yv,-0.012035", "Yv,-0.012035\nY_v,-0.01", "Y_v"),
        ("mass,0.00792", "scaling,primal", "scaling"),
        ("Yv,-0.012035", "Yv", "Yv"),
    ],
)
def test_a_table_at_fault_is_refused_with_the_place(old: str, new: str, word: str, tmp_path: Path) -> None:
    assert old in S175
    path = written(tmp_path, S175.replace(old, new))
    with pytest.raises(InputError) as fault:
        t2s.convention(path)
    assert fault.value.source == str(path)
    assert word in f"{fault.value.place} {fault.value.problem}"
