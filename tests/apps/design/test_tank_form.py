"""Tanks that contradict themselves or the model are refused, with the key at fault."""

import pytest

import tank2sim as t2s
from tank2sim.apps.design.tank_form import TankFile, refuse_contradictions
from tank2sim.errors import InputError


@pytest.mark.parametrize(
    ("content", "key"),
    [
        ({"tank": {"length_m": 200.0}, "carriage": {"length_m": 240.0}}, "carriage.length_m"),
        ({"tank": {"length_m": 200.0}}, "carriage.length_m"),
        ({"tank": {"breadth_m": 0.5}}, "tank.breadth_m"),
        ({"tank": {"depth_m": 0.1}}, "tank.depth_m"),
        (
            {"mechanism": {"lowest_frequency_radps": 2.0, "highest_frequency_radps": 1.0}},
            "mechanism.lowest_frequency_radps",
        ),
    ],
)
def test_a_tank_that_contradicts_itself_or_the_model_is_refused(content, key):
    with pytest.raises(InputError) as fault:
        refuse_contradictions(TankFile.model_validate(content), "tank.toml", 4.0, 0.576, 0.186)
    assert (fault.value.source, fault.value.place) == ("tank.toml", key)


def test_a_tank_that_holds_the_model_is_taken():
    tank = {"tank": {"length_m": 240.0, "breadth_m": 0.6, "depth_m": 0.2}, "carriage": {"length_m": 240.0}}
    refuse_contradictions(TankFile.model_validate(tank), "tank.toml", 4.0, 0.576, 0.186)


def test_the_file_of_the_tank_is_named_and_the_beam_is_that_of_the_model(tmp_path):
    (tmp_path / "tank.toml").write_text("[tank]\nbreadth_m = 0.5\n", encoding="utf-8")
    options = {"figures": "K_prime", "draws": 0, "tank": tmp_path / "tank.toml", "largest": (10, 20, 0.5)}
    with pytest.raises(InputError, match=r"0\.5 m.*0\.576 m") as fault:  # 4 m by 23.165/160.93
        t2s.design_campaign("mariner", **options)
    assert fault.value.source == str(tmp_path / "tank.toml")


@pytest.mark.parametrize(
    "errors",
    [
        {"noise_share": 0.0, "zero_share": 0.0, "gain_relative": 0.0},
        {"noise_share": 2e-6, "zero_share": 0.0},
        {f"{force}_{kind}_{unit}": 1e-9 for force, unit in (("X", "N"), ("Y", "N"), ("N", "Nm"))
         for kind in ("noise", "zero")},
    ],
)  # fmt: skip
def test_gauges_without_an_error_are_refused(errors):
    tank = TankFile.model_validate({"gauges": errors})
    with pytest.raises(InputError, match="no error of X") as fault:
        t2s.design_campaign("esso-osaka", figures="K_prime", draws=0, tank=tank, largest=(10, 20, 0.5))
    assert fault.value.place == "gauges"
