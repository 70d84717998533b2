"""The physics of ArduPilot's SITL: packets byte by byte, lock-step, a fake SITL, and another program's boat."""

from __future__ import annotations

import json
import math
import re
import socket
import struct
import threading

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.ardupilot.parameters import boat_parameters
from tank2sim.apps.ardupilot.physics import SitlShip
from tests.cards.made_craft import craft_card


@pytest.fixture(scope="module")
def boat() -> t2s.Ship:
    """Masses 60 and 137 kg, inertia 39 kg m2, 60 N of each thruster: the boat of the other program."""
    derivatives = {"Xudot": -5.0, "Yvdot": -82.0, "Nrdot": -24.0, "Xu": -78.0, "Yvabsv": -300.0, "Nr": -41.0}
    thrust = {"ahead_Ns2": 0.006, "astern_Ns2": 0.006, "max_radps": 100.0, "max_astern_radps": 100.0}
    more = "valid_speed_mps = [0.0, 3.0]"
    return t2s.Ship(craft_card(55.0, 15.0, derivatives, speed_mps=1.5, more=more, **thrust))


def packet(count: int, left: int, right: int, rate: int = 400, *, wide: bool = False) -> bytes:
    """Little-endian and packed, written out by hand: 18458 is 0x481a, 29569 0x7381."""
    head = (b"\x81\x73" if wide else b"\x1a\x48") + rate.to_bytes(2, "little") + count.to_bytes(4, "little")
    pulses = [left, 0, right] + [0] * (29 if wide else 13)
    return head + b"".join(pulse.to_bytes(2, "little") for pulse in pulses)


def motion(reply: bytes) -> dict:
    text = reply.decode("ascii")
    assert text.startswith("\n{") and text.endswith("}\n") and text.count("\n") == 2 and " " not in text
    assert re.search(r"-?nan|inf", text) is None and len(text) < 1400
    assert text.index('"velocity"') > text.index('"attitude"')
    return json.loads(text)


def test_packets_are_those_of_sitl(boat: t2s.Ship) -> None:
    assert (len(packet(0, 1500, 1500)), len(packet(0, 1500, 1500, wide=True))) == (40, 72)
    ship = SitlShip(boat.model)
    for wide in (False, True):
        assert ship.answer(packet(int(wide), 2000, 2000, wide=wide)) is not None
    for wrong in (
        b"",
        packet(5, 1, 1)[:-1],
        packet(5, 1, 1) + b"\0",
        b"\0\0" + packet(5, 1, 1)[2:],
        packet(5, 1, 1, 0),
    ):
        assert ship.answer(wrong) is None
    assert ship.frame == 1


def test_a_step_has_the_length_of_the_frame_and_a_repeated_frame_none(boat: t2s.Ship) -> None:
    ship = SitlShip(boat.model)
    first = ship.answer(packet(10, 2000, 2000))
    assert motion(first)["timestamp"] == pytest.approx(1 / 400)
    assert ship.answer(packet(10, 1000, 1000)) == first and ship.repeated == 1
    assert motion(ship.answer(packet(11, 2000, 2000, rate=50)))["timestamp"] == pytest.approx(1 / 400 + 1 / 50)
    assert motion(ship.answer(packet(3, 2000, 2000)))["timestamp"] == pytest.approx(1 / 400)
    assert ship.restarts == 1


def test_a_disarmed_boat_rests_and_more_thrust_at_port_turns_to_starboard(boat: t2s.Ship) -> None:
    ship = SitlShip(boat.model)
    for count in range(400):
        rest = motion(ship.answer(packet(count, 0, 0)))
    assert rest["position"] == [0, 0, 0] and rest["imu"]["accel_body"] == [0, 0, -9.80665]
    for count in range(400, 800):
        turning = motion(ship.answer(packet(count, 2000, 1500)))
    assert turning["imu"]["gyro"][2] > 0 and turning["attitude"][2] > 0 and turning["position"][1] > 0


def test_the_motion_is_that_of_another_programs_boat(boat: t2s.Ship, simulator) -> None:
    theirs, ours = simulator("ardupilot/boat.py").Boat(), SitlShip(boat.model)
    for count in range(4000):
        left, right = (1.0, 0.5) if count < 2000 else (-0.5, 1.0)
        reply = ours.answer(packet(count, 1500 + round(500 * left), 1500 + round(500 * right)))
        for _ in range(20):  # Euler's steps are short
            theirs.step(1 / 8000, math.copysign(left**2, left), math.copysign(right**2, right))
    here, there = motion(reply), json.loads(theirs.reply())
    assert here["timestamp"] == pytest.approx(there["timestamp"])
    for key in ("position", "velocity", "attitude"):
        assert here[key] == pytest.approx(there[key], rel=2e-3, abs=2e-3)
    assert here["imu"]["accel_body"] == pytest.approx(there["imu"]["accel_body"], rel=5e-3, abs=2e-3)
    assert here["imu"]["gyro"] == pytest.approx(there["imu"]["gyro"], rel=2e-3, abs=1e-4)


def test_a_fake_sitl_over_loopback_is_answered_in_lock_step(tmp_path) -> None:
    """With a packet of the wrong size and a lost reply; the parameter file is there before the first frame."""
    found: list[t2s.ServeResult] = []
    file = tmp_path / "boat.parm"

    def run() -> None:
        found.append(t2s.serve("otter", file, instance=61, silence_s=2.0))

    thread = threading.Thread(target=run)
    thread.start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sitl:
        sitl.settimeout(0.5)
        times, count = [], 0
        for _ in range(200):
            sitl.sendto(packet(count, 1800, 1800), ("127.0.0.1", 9002 + 610))
            try:
                times.append(motion(sitl.recvfrom(2048)[0])["timestamp"])
            except TimeoutError:
                continue  # the port is not open yet: the frame is sent again
            count += 1
            if count == 100:
                break
        assert file.exists()
        sitl.sendto(b"short", ("127.0.0.1", 9002 + 610))
    thread.join()
    study = found[0].study
    assert np.diff(times) == pytest.approx(1 / 400, abs=2e-6)
    assert (study.answered - study.repeated, study.refused) == (100, 1)


def test_the_parameter_file_has_the_steady_figures_of_the_card(boat: t2s.Ship) -> None:
    """By hand: 78 u = 2 60 s^2 ahead; at full steering 60 N and -15 N, a turn whose three forces balance."""
    given = boat_parameters(boat.model)
    assert given.cruise_speed_mps == pytest.approx(2 * 60 * 0.25 / 78, rel=1e-4)
    rows = dict(line.split() for line in given.text.splitlines())
    assert (rows["SERVO1_FUNCTION"], rows["SERVO3_FUNCTION"], rows["FRAME_CLASS"]) == ("73", "74", "2")
    assert float(rows["ATC_STR_RAT_FF"]) == pytest.approx(1 / given.rate_at_full_steering_radps, rel=1e-3)
    ship = boat_parameters(t2s.load("kvlcc2-l7-mmg").model)
    rows = dict(line.split() for line in ship.text.splitlines())
    assert (rows["SERVO1_FUNCTION"], rows["SERVO3_FUNCTION"]) == ("26", "70")
    assert 0 < ship.lateral_g < 0.1


def test_wind_of_the_card_moves_the_boat_and_not_its_parameters() -> None:
    calm = t2s.load("otter")
    wind = [{"name": "wind", "parameters": {"speed_mps": 8.0, "direction_deg": 90.0}}]
    windy = calm.replace({"effects": wind}).model
    still = calm.replace({"effects": [{"name": "wind", "parameters": {"speed_mps": 0.0, "direction_deg": 90.0}}]}).model
    assert boat_parameters(windy) == boat_parameters(still)
    ship = SitlShip(windy)
    for count in range(400):
        drifting = motion(ship.answer(packet(count, 1500, 1500)))
    assert drifting["position"][1] < -0.01  # wind from the east


def test_a_boat_that_steering_turns_the_other_way_is_refused() -> None:
    wrong = t2s.load("kvlcc2-l7").replace({"derivatives.Nd": -2.3e-3, "derivatives.Yd": 4.7e-3})
    with pytest.raises(t2s.InputError, match="steering to starboard"):
        boat_parameters(wrong.model)


def test_what_cannot_be_steered_and_a_port_that_is_taken_are_refused() -> None:
    for name in ("mariner", "alyshev", "kulikovsky-velikanov"):  # a rudder, and no engine; neither
        with pytest.raises(t2s.InputError, match="thrusters"):
            t2s.serve(name, silence_s=0.1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 9002 + 620))
        with pytest.raises(t2s.InputError) as fault:
            t2s.serve("otter", instance=62, silence_s=0.1)
    assert fault.value.source == "instance"


def test_the_magic_numbers_are_those_of_struct() -> None:
    assert struct.unpack("<H", b"\x1a\x48")[0] == 18458 and struct.unpack("<H", b"\x81\x73")[0] == 29569
