"""Small logs that the tests write: readers of CSV, NMEA 0183, NMEA 2000 and telemetry against what was written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.clock import utc_text
from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.nmea0183 import read_nmea0183
from tank2sim.apps.logs.quantities import QUANTITIES, quantity_of_name, sign_of_name, unit_of_signal_k
from tank2sim.apps.logs.reading import read_log
from tank2sim.apps.logs.reference import local_metres
from tank2sim.apps.logs.table import read_table_log
from tank2sim.errors import InputError
from tank2sim.records.spelt_units import split_unit
from tests.apps.logs.made_logs import T0, candump_lines, frame, nmea_lines, rmc, sentence, voyage
from tests.marks import first_fast


def stream_of(found, quantity):
    return next(stream for stream in found.streams if stream.quantity == quantity)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("sog_kn", "kn"),
        ("SOG [knots]", "kn"),
        ("ground_speed_m_s", "m/s"),
        ("rate_of_turn_deg_min", "deg/min"),
        ("yaw_rate_rad_s", "rad/s"),
        ("Heading (deg)", "deg"),
        ("wind_speed_rel_mps", "m/s"),
        ("shaft_rpm", "rpm"),
        ("heading", ""),
        ("Ruderlage (Bb +)", ""),
    ],
)
def test_units_in_names(name, unit) -> None:
    assert split_unit(name)[1] == unit


@pytest.mark.parametrize(
    ("name", "quantity"),
    [
        ("Fahrt ü. Grund", "sog"),
        ("Kurs ü. Grund", "cog"),
        ("Steuerkurs", "heading"),
        ("Länge", "longitude"),
        ("/ship/rudder/command", "rudder_order"),
        ("/usv/thrusters/left/rpm", "rpm_port"),
        ("/usv/thrusters/right/cmd", "thrust_order_starboard"),
        ("STW", "u_water"),
        ("app_wind_dir", "wind_rel_direction"),
        ("magnetic heading", "magnetic_heading"),
        ("battery voltage", ""),
        ("e_heading", ""),
        ("u_speed", ""),
        ("Obroty śruby", "rpm"),
        ("Kąt steru", "rudder_angle"),
        ("Zadany kąt steru", "rudder_order"),
        ("Prędkość nad dnem", "sog"),
        ("Długość geograficzna", "longitude"),
        ("Ângulo do leme", "rudder_angle"),
        ("Rotações do hélice", "rpm"),
        ("Girhastighet", "yaw_rate"),
        ("Varvtal babord", "rpm_port"),
        ("Omdrejninger", "rpm"),
        ("Peräsinkulma", "rudder_angle"),
        ("Kierrosluku", "rpm"),
        ("Tuulen suunta", "wind_rel_direction"),
        ("Dümen komutu", "rudder_order"),
        ("Yere göre hız", "sog"),
        ("Recorder rudder", "rudder_angle"),
        ("GPS1_LAT", "latitude"),
        ("SPD_WATER_LONG", "u_water"),
        ("ROT1", "yaw_rate"),
        ("RUD_ORD", "rudder_order"),
        ("Consigne de barre", "rudder_order"),
        ("Rumbo sobre el fondo", "cog"),
        ("Rumbo verdadero", "heading"),
        ("Toerental stuurboord", "rpm_starboard"),
        ("Giri motore sinistro", "rpm_port"),
        ("Ønsket rorvinkel", "rudder_order"),
        ("Drehgeschwindigkeit", "yaw_rate"),
        ("navigation.courseOverGroundTrue", "cog"),
        ("set course", ""),
        ("left battery", ""),
        ("wind temp", ""),
    ],
)
def test_quantities_of_names(name, quantity) -> None:
    assert quantity_of_name(name) == quantity


def test_paths_of_signal_k_are_in_si() -> None:
    assert unit_of_signal_k("propulsion.port.revolutions", "rpm_port") == "1/s"
    assert unit_of_signal_k("navigation.speedOverGround", "sog") == "m/s"
    assert not unit_of_signal_k("speedOverGround", "sog")


def test_signs_of_names() -> None:
    assert sign_of_name("Barre (+ bâbord)") == -1
    assert sign_of_name("Timone (dritta +)") == 1
    assert sign_of_name("Ruderlage (Bb +)") == -1
    assert sign_of_name("rudder angle, starboard positive") == 1
    assert sign_of_name("rudder_deg") == 0


def test_factors_of_units_are_those_of_their_definitions() -> None:
    assert QUANTITIES["sog"].units["kn"] == pytest.approx(0.5144444, rel=1e-6)
    assert QUANTITIES["yaw_rate"].units["deg/min"] == pytest.approx(2.908882e-4, rel=1e-6)
    assert QUANTITIES["rpm"].units["rpm"] == pytest.approx(0.1047198, rel=1e-6)


def test_local_metres_follow_the_arcs_of_the_ellipsoid() -> None:
    """Arcs of one minute of latitude at 54.3 deg, and of longitude there (WGS 84: 1855.2 m, 1085.1 m)."""
    x, y = local_metres(np.array([54.3 + 1 / 60, 54.3]), np.array([10.2, 10.2 + 1 / 60]), (54.3, 10.2))
    assert x[0] == pytest.approx(1855.19, abs=0.1) and y[1] == pytest.approx(1085.06, abs=0.1)
    assert abs(y[0]) < 1e-6 and abs(x[1]) < 0.3


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_table_with_any_separator_is_read(tmp_path, separator) -> None:
    path = tmp_path / "log.txt"
    frame().to_csv(path, index=False, sep=separator)
    found = read_table_log(path)
    assert np.allclose(stream_of(found, "heading").values, frame().heading_deg)
    assert stream_of(found, "latitude").time_s[0] == pytest.approx(T0, abs=1e-6)


@pytest.mark.parametrize("separator", ["\t", ";", ","])
def test_cells_that_are_missing_shift_no_column(tmp_path, separator) -> None:
    table = frame()
    lost = np.random.default_rng(1).random((len(table), 3)) < 0.02
    for place, name in enumerate(("latitude", "longitude", "rot_deg_min")):
        table[name] = table[name].round(7).mask(lost[:, place])
    table.to_csv(tmp_path / "gaps.csv", sep=separator, index=False)
    found = {stream.name: stream.values for stream in read_log(tmp_path / "gaps.csv").streams}
    for name, values in found.items():
        np.testing.assert_allclose(values, table[name].to_numpy())
    assert {"latitude", "longitude"} <= {
        c.quantity for c in log(tmp_path / "gaps.csv").voyage.channels.channels if c.use
    }


def test_a_clock_with_another_decimal_sign_than_the_table_is_read(tmp_path) -> None:
    table = frame().drop(columns="utc")
    text = table.to_csv(sep=";", decimal=",", index=False).splitlines()
    lines = [f"t [s];{text[0]}", *(f"{0.5 * k:.2f};{line}" for k, line in enumerate(text[1:]))]
    (tmp_path / "mixed.csv").write_text("\n".join(lines), encoding="utf-8")
    stream = read_log(tmp_path / "mixed.csv").streams[0]
    np.testing.assert_allclose(stream.time_s, 0.5 * np.arange(len(table)))


def test_an_order_of_unknown_unit_is_sure_only_where_an_angle_shows_it(tmp_path) -> None:
    table = frame().drop(columns="rudder_deg")
    order = np.degrees(voyage().rudder)
    for name, columns, expected in (
        ("alone", {"rudder order": order * 100 / 35}, ("deg", 1.0, False)),
        ("percent", {"rudder order": order * 100 / 35, "rudder_deg": order}, ("deg", 0.35, False)),
        ("degrees", {"rudder order": order, "rudder_deg": order}, ("deg", 1.0, True)),
    ):
        table.assign(**columns).to_csv(tmp_path / f"{name}.csv", index=False)
        channel = log(tmp_path / f"{name}.csv").voyage.channels.used("rudder_order")
        unit, scale, sure = expected
        assert channel.unit == unit
        assert channel.scale == pytest.approx(scale, rel=0.02)
        assert (channel.confidence >= 0.9) is sure


def test_of_two_rudders_the_one_that_holds_its_values_is_the_order(saved) -> None:
    made = voyage()
    table = frame().rename(columns={"rudder_deg": "rudder one"})
    table["rudder two"] = np.degrees(made.rudder).round(-1)
    channels = log(saved(table, "two.csv")).voyage.channels
    assert channels.used("rudder_angle").stream == "rudder one"
    assert channels.used("rudder_order").stream == "rudder two"


def test_decimal_commas_a_row_of_units_and_a_local_time(tmp_path) -> None:
    path = tmp_path / "logbuch.csv"
    rows = ["Datum;Uhrzeit (MESZ);Breite;Länge;Fahrt ü. Grund;Steuerkurs", ";;°;°;kn;°"]
    rows += [f"15.11.2023;00:{k // 60:02d}:{k % 60:02d},50;54,3000{k % 10};10,20000;11,6;40,5" for k in range(100)]
    path.write_bytes("\r\n".join(rows).encode("cp1252"))
    found = read_table_log(path)
    sog = stream_of(found, "sog")
    assert (sog.unit, sog.values[0]) == ("kn", 11.6)
    assert utc_text(sog.time_s[0]) == "2023-11-14T22:00:00.500Z"


@pytest.mark.parametrize("factor", [1.0, 1e3, 1e6, 1e9])
def test_epochs_of_any_resolution(saved, factor) -> None:
    table = frame()
    table["utc"] = [f"{round((T0 + t) * factor):d}" for t in voyage().time]
    times = stream_of(read_table_log(saved(table, "epochs.csv")), "heading").time_s
    assert times[0] == pytest.approx(T0, abs=0.5) and times[-1] - times[0] == pytest.approx(899.5, abs=1.0)


def test_seconds_from_the_beginning_give_trials_without_a_date(saved) -> None:
    table = frame().drop(columns="utc")
    table.insert(0, "time_s", voyage().time)
    result = log(saved(table, "seconds.csv"))
    assert result.cuts and not any("begins:" in cut.text for cut in result.cuts)
    assert result.to_dict()["begins_utc"] is None


def test_dates_that_may_be_day_or_month_are_refused(tmp_path) -> None:
    path = tmp_path / "dates.csv"
    path.write_text("time,heading_deg\n" + "".join(f"03/04/2023 10:00:{k:02d},{k}\n" for k in range(50)))
    with pytest.raises(InputError, match="day/month or month/day"):
        read_table_log(path)


def test_a_local_time_of_unknown_zone_is_marked(saved) -> None:
    table = frame().rename(columns={"utc": "local time"})
    table["local time"] = table["local time"].str.replace("T", " ").str.rstrip("Z")
    path = saved(table, "local.csv")
    assert any("unknown zone" in mark for mark in log(path).cautions)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
def test_a_preamble_above_the_names_is_passed_over(tmp_path, encoding) -> None:
    path = tmp_path / "preamble.csv"
    head = ["Schiff: Möwe", "Reise 12; 3. Wache", ""]
    table = ["utc;latitude;heading_deg"]
    table += [f"2023-11-14T22:{k // 60:02d}:{k % 60:02d}Z;54,{k:04d};{k},5" for k in range(100)]
    path.write_text("\n".join([*head, *table]), encoding=encoding)
    found = read_log(path)
    assert stream_of(found, "heading").values == pytest.approx(np.arange(100) + 0.5)
    assert found.counts["rows"] == 100 and found.counts["skipped"] == 0


def test_positions_in_degrees_and_minutes(tmp_path) -> None:
    path = tmp_path / "minutes.csv"
    rows = [f"2023-11-14T22:{k // 60:02d}:{k % 60:02d}Z,54 18.{k:04d} N,010 12.0000 W,40" for k in range(100)]
    path.write_text("\n".join(["time,latitude,longitude,heading_deg", *rows]))
    found = read_table_log(path)
    assert stream_of(found, "latitude").values[5] == pytest.approx(54 + 18.0005 / 60)
    assert stream_of(found, "longitude").values[0] == pytest.approx(-10.2)


@pytest.fixture
def nmea_file(tmp_path: Path) -> Path:
    pytest.importorskip("pynmea2")
    path = tmp_path / "voyage.nmea"
    path.write_text("\n".join(nmea_lines()) + "\n", encoding="ascii")
    return path


def test_sentences_without_time_stamps_get_the_time_of_their_neighbours(nmea_file) -> None:
    found = read_nmea0183(nmea_file)
    heading = stream_of(found, "heading")
    made = voyage()
    assert len(heading.values) == len(made.time)
    late = heading.time_s - T0 - made.time
    assert np.abs(late - late.mean()).max() < 0.26 and abs(late.mean()) < 0.26
    position = stream_of(found, "latitude")
    assert np.array_equal(position.time_s - T0, made.time[::2])
    assert np.abs(position.values - frame().latitude[::2]).max() < 1e-8


def test_time_stamps_of_the_recorder_are_used(tmp_path) -> None:
    pytest.importorskip("pynmea2")
    path = tmp_path / "stamped.nmea"
    lines, second = [], -1
    for line in nmea_lines()[:2000]:
        second += "RMC" in line
        lines.append(f"{(T0 + 7.25 + second) * 1000:.0f} {line}")
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    heading = stream_of(read_log(path), "heading")
    assert heading.time_s[0] == pytest.approx(T0, abs=0.01)  # the shift of 7.25 s is that of the recorder's clock


def test_midnight_passes(saved) -> None:
    pytest.importorskip("pynmea2")
    midnight = 86400 - T0 % 86400
    lines = []
    for k in range(60):
        lines += [rmc(midnight - 30 + k, 54.3 + 1e-5 * k, 10.2), sentence(f"HEHDT,{k}.0,T")]
    found = read_log(saved(lines, "midnight.nmea"))
    times = stream_of(found, "latitude").time_s
    assert times[-1] - times[0] == pytest.approx(59.0) and not found.findings


def test_a_talker_that_takes_over_is_the_same_instrument(saved) -> None:
    pytest.importorskip("pynmea2")
    lines = [rmc(k, 54.3 + 1e-5 * k, 10.2, talker="GP" if k < 100 else "GN") for k in range(200)]
    path = saved(lines, "talkers.nmea")
    latitudes = [stream for stream in read_log(path).streams if stream.quantity == "latitude"]
    assert [len(stream.values) for stream in latitudes] == [200]


def test_a_log_of_nmea_2000_holds_what_was_written(tmp_path) -> None:
    pytest.importorskip("nmea2000")
    path = tmp_path / "voyage.log"
    path.write_text("\n".join([*candump_lines(), "(1700000000.5) can0 09F8"]) + "\n", encoding="ascii")
    found = read_log(path)
    made, table = voyage(), frame()
    assert found.counts["corrupted"] == 1
    heading = stream_of(found, "heading")
    assert np.abs(heading.values - np.radians(table.heading_deg)).max() < 0.51e-4
    assert np.allclose(heading.time_s - T0, made.time, atol=1e-5)
    assert np.abs(stream_of(found, "rudder_angle").values - made.rudder).max() < 0.51e-4
    assert np.abs(stream_of(found, "yaw_rate").values - made.rate).max() < 2e-8
    assert np.abs(stream_of(found, "latitude").values - table.latitude[::2]).max() < 0.51e-7
    assert [stretch.kind.value for stretch in log(path).found if stretch.kind.excites] == ["zigzag", "turn"]


@first_fast("form", ["canboat", "actisense", "gateway"])
def test_a_log_of_nmea_2000_is_the_same_in_every_form(tmp_path, form) -> None:
    pytest.importorskip("nmea2000")
    begin = 86400 - T0 % 86400 - 300  # midnight falls into the log
    lines = []
    for line in candump_lines():
        stamp_s, _, frame_hex = line.split()
        number, data = int(frame_hex[:8], 16), bytes.fromhex(frame_hex[9:])
        pgn, source = number >> 8 & 0x1FFFF, number & 0xFF  # all are broadcast
        moment = pd.Timestamp(float(stamp_s[1:-1]) + begin, unit="s")
        milli = f"{moment.microsecond // 1000:03d}"
        lines.append(
            {
                "canboat": f"{moment:%Y-%m-%dT%H:%M:%S}.{milli}Z,2,{pgn},{source},255,{len(data)},"
                + ",".join(f"{byte:02x}" for byte in data),
                "actisense": f"A{moment:%H%M%S}.{milli} {source:02X}FF2 {pgn:05X} {data.hex().upper()}",
                "gateway": f"{moment:%H:%M:%S}.{milli} R {number:08X} " + " ".join(f"{byte:02X}" for byte in data),
            }[form]
        )
    (tmp_path / "voyage.log").write_text("\n".join(lines) + "\n", encoding="ascii")
    (tmp_path / "candump.log").write_text("\n".join(candump_lines()) + "\n", encoding="ascii")
    found, expected = read_log(tmp_path / "voyage.log"), read_log(tmp_path / "candump.log")
    assert found.dated == (form == "canboat")
    assert {one.name for one in found.streams} == {one.name for one in expected.streams}
    for quantity in ("heading", "rudder_angle", "latitude"):
        one, other = stream_of(found, quantity), stream_of(expected, quantity)
        assert np.array_equal(one.values, other.values)
        assert one.time_s - one.time_s[0] == pytest.approx(other.time_s - other.time_s[0], abs=1.1e-3)


def test_a_telemetry_log_holds_what_was_written(tmp_path) -> None:
    pytest.importorskip("pymavlink")
    import struct

    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    path = tmp_path / "voyage.tlog"
    made, table = voyage(), frame()
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as file:

        def put(time_s, message) -> None:
            file.write(struct.pack(">Q", round((T0 + time_s) * 1e6)) + message.pack(link))

        for name, value in (("SERVO1_FUNCTION", 26.0), ("SERVO1_MIN", 1100.0), ("SERVO1_MAX", 1900.0)):
            put(0.0, mavlink.MAVLink_param_value_message(name.encode(), value, 9, 3, 0))
        for k, t in enumerate(made.time):
            place = round(table.latitude[k] * 1e7), round(table.longitude[k] * 1e7)
            put(t, mavlink.MAVLink_global_position_int_message(round(t * 1000), *place, 0, 0, 0, 0, 0, 65535))
            yaw = float((made.heading[k] + np.pi) % (2 * np.pi) - np.pi)
            put(t, mavlink.MAVLink_attitude_message(round(t * 1000), 0.0, 0.0, yaw, 0.0, 0.0, float(made.rate[k])))
            pulse = round(1500 + 400 * np.degrees(made.rudder[k]) / 35)
            servos = [pulse, *[0] * 7]
            put(t, mavlink.MAVLink_servo_output_raw_message(round(t * 1e6) % 2**32, 0, *servos))
    found = read_log(path)
    assert np.abs(stream_of(found, "yaw_rate").values - made.rate).max() < 1e-7
    assert np.abs(stream_of(found, "latitude").values - table.latitude).max() < 0.51e-7
    result = log(path)
    order = result.voyage.series["rudder_order"]
    assert np.degrees(np.abs(order.values - np.interp(order.time_s - T0, made.time, made.rudder))).max() < 0.06
    assert any("35 deg" in mark for mark in result.cautions)  # the full rudder is not in the log


def test_streams_without_names_are_found_by_their_content(saved) -> None:
    table = frame()
    table.columns = ["utc", "latitude", "longitude", *(f"ch{k}" for k in range(len(table.columns) - 3))]
    table["ch9"] = np.random.default_rng(2).normal(12.6, 0.1, len(table))  # a battery
    path = saved(table, "nameless.csv")
    channels = {channel.quantity: channel for channel in log(path).voyage.channels.channels if channel.use}
    assert {key: channels[key].stream for key in ("yaw_rate", "rudder_angle")} == {
        "yaw_rate": "ch3",
        "rudder_angle": "ch4",
    }
    assert (channels["yaw_rate"].unit, channels["rudder_angle"].unit) == ("deg/min", "deg")
    assert channels["heading"].stream == "ch2" and channels["cog"].stream == "ch1"
    assert all(channel.confidence < 0.9 for channel in channels.values() if channel.stream.startswith("ch"))


def test_position_heading_and_rudder_alone_suffice(saved) -> None:
    result = log(saved(frame()[["utc", "latitude", "longitude", "heading_deg", "rudder_deg"]].iloc[::2], "few.csv"))
    assert [stretch.kind.value for stretch in result.found if stretch.kind.excites] == ["zigzag", "turn"]
    assert {"delta_rad", "psi_rad", "x_m", "y_m"} <= set(result.cuts[0].trial.signals)


@pytest.mark.slow
def test_a_log_of_a_day_at_2_hz_is_read_in_seconds(saved) -> None:
    table = pd.concat([frame()] * 90, ignore_index=True)
    table["utc"] = [str(T0 + 0.5 * k) for k in range(len(table))]
    import time

    begin = time.monotonic()
    read_log(saved(table, "day.csv"))
    assert time.monotonic() - begin < 20


def test_a_table_without_names_is_named_by_a_channels_file(tmp_path) -> None:
    path = tmp_path / "rows.csv"
    frame().to_csv(path, index=False, header=False)
    found = read_table_log(path)
    assert [stream.name for stream in found.streams][:2] == ["column 2", "column 3"]
    assert len(found.streams[0].values) == len(frame())
    channels = tmp_path / "channels.toml"
    text = 'format = "tank2sim-channels/1"\n'
    for number, quantity, unit in ((6, "heading", "deg"), (8, "rudder_angle", "deg")):
        text += f'[[channels]]\nquantity = "{quantity}"\nstream = "column {number}"\nunit = "{unit}"\n'
    channels.write_text(text)
    result = log(path, channels=channels)
    assert [stretch.kind.value for stretch in result.found if stretch.kind.excites] == ["zigzag", "turn"]
