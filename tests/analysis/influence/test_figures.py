from __future__ import annotations

import math

import pytest

from tank2sim.analysis.influence.figures import FIGURE_KINDS, forms, parse_figure
from tank2sim.analysis.tuning.targets import parse_target
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Turn, Zigzag


def test_figures_are_read_with_their_rudder_and_heading() -> None:
    assert parse_figure("steady_radius_m@-20").angles == pytest.approx((-math.radians(20.0),))
    assert parse_figure("overshoot_2_deg@10/5").manoeuvre == Zigzag(math.radians(10.0), math.radians(5.0))
    assert parse_figure("advance_m@35").manoeuvre == Turn(math.radians(35.0))
    assert parse_figure("criterion_C").manoeuvre is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("steady_radius", ["did you mean", "steady_radius_m"]),
        ("nonsense", ["criterion_C", "@20/20"]),
        ("steady_radius_m", ["steady_radius_m@20"]),
        ("steady_radius_m@20/20", ["steady_radius_m@20"]),
        ("overshoot1_deg@20/20", ["did you mean overshoot_1_deg?"]),
        ("initial_turning_m@20/20", ["did you mean initial_turning_"]),
        ("overshoot_1_deg@20", ["overshoot_1_deg@20/20"]),
        ("overshoot_1_deg@20/-20", ["out of bounds"]),
        ("advance_m@0", ["out of bounds"]),
        ("advance_m@95", ["out of bounds"]),
        ("criterion_C@20", ["no argument"]),
        ("criterion_C@", ["no argument"]),
        ("advance_m@nan", ["advance_m@35"]),
    ],
)
def test_what_is_no_figure_is_refused_with_what_there_is(text, words) -> None:
    with pytest.raises(InputError) as error:
        parse_figure(text)
    assert all(word in str(error.value) for word in words), error.value


def test_the_help_names_every_figure() -> None:
    assert all(name in forms() for name in FIGURE_KINDS)


def test_both_ways_to_write_a_target_mean_the_same() -> None:
    one, other = parse_target("steady_radius_m=424@20"), parse_target("steady_radius_m@20=424")
    assert (one.figure.kind, one.figure.angles, one.value) == (other.figure.kind, other.figure.angles, other.value)
    assert one.text == "steady_radius_m@20=424"
    limit = parse_target("overshoot_1_deg@20/20<=25")
    assert (limit.relation, limit.value, limit.figure.text) == ("<=", 25.0, "overshoot_1_deg@20/20")


@pytest.mark.parametrize(
    "text", ["steady_radius_m@20", "steady_radius_m@20=424@20", "T_s=fast", "T_s=nan", "=3", "T_s<3"]
)
def test_what_is_no_target_is_refused(text) -> None:
    with pytest.raises(InputError):
        parse_target(text)
