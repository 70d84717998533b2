"""Tables as strangers write them: clocks in digits, coarse times, numbers for none, rudders with another zero."""

from __future__ import annotations

import functools

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.channel_search import find_channels
from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.reading import read_log
from tank2sim.apps.logs.recorded import without_missing
from tank2sim.apps.logs.streams import LogStream
from tank2sim.errors import InputError
from tests.apps.logs.made_logs import T0, frame, voyage
from tests.marks import first_fast

MIDNIGHT = 1_700_006_400.0


@functools.cache
def table() -> pd.DataFrame:
    return frame()


def moments(begin_s: float = T0) -> pd.Series:
    return pd.Series(pd.to_datetime((1000 * (begin_s + voyage().time)).round(), unit="ms"))


@pytest.fixture
def written(tmp_path):
    def written(times: dict[str, object], drop: tuple[str, ...] = (), rows: slice = slice(None)):
        rest = table().drop(columns=["utc", *drop])
        path = tmp_path / "log.csv"
        pd.concat([pd.DataFrame(times), rest], axis=1)[rows].to_csv(path, index=False)
        return path

    return written


def day(begin_s: float, unit: str) -> pd.Series:
    text = moments(begin_s)
    return (
        text.dt.strftime("%H%M%S.%f").str[:-4]
        if unit == "s"
        else text.dt.strftime("%H%M%S%f").str[: {"cc": -4, "ms": -3}[unit]]
    )


def fraction(begin_s: float) -> np.ndarray:
    return (begin_s + voyage().time) % 86400 / 86400


CLOCKS = {
    "hhmmss.ss": (lambda b: {"utc_time": day(b, "s")}, False),
    "hhmmsscc": (lambda b: {"time": day(b, "cc")}, False),
    "hhmmssmmm": (lambda b: {"Zeit": day(b, "ms")}, False),
    "fraction": (lambda b: {"time": fraction(b)}, False),
    "ddmmyy hhmmss": (lambda b: {"date": moments(b).dt.strftime("%d%m%y"), "time": day(b, "s")}, True),
    "yyyymmdd hhmmss": (lambda b: {"date": moments(b).dt.strftime("%Y%m%d"), "time": day(b, "s")}, True),
    "yymmdd": (lambda b: {"date_yymmdd": moments(b).dt.strftime("%y%m%d"), "time": day(b, "s")}, True),
    "text and hhmmss": (lambda b: {"date": moments(b).dt.strftime("%d.%m.%Y"), "time": day(b, "s")}, True),
    "text and fraction": (lambda b: {"date": moments(b).dt.strftime("%Y-%m-%d"), "time": fraction(b)}, True),
    "sheet": (lambda b: {"date": 25569 + (b + voyage().time) // 86400, "time": fraction(b)}, True),
    "yyyymmddhhmmss": (lambda b: {"time": moments(b).dt.strftime("%Y%m%d%H%M%S")}, True),
    "yyyymmddhhmmssmmm": (lambda b: {"time": moments(b).dt.strftime("%Y%m%d%H%M%S%f").str[:-3]}, True),
}


@pytest.mark.parametrize("form", CLOCKS)
def test_a_clock_in_digits_is_a_clock(written, form) -> None:
    make, dated = CLOCKS[form]
    begin = T0 if dated or form == "hhmmss.ss" else MIDNIGHT - 400.5  # over midnight where no date helps
    found = read_log(written(make(begin)))
    expected = begin + voyage().time - (0.0 if dated else begin // 86400 * 86400)
    if form == "yyyymmddhhmmss":
        expected = np.floor(expected) + np.tile([0.0, 0.5], 900)  # two rows a second are spread
    assert found.dated == dated
    np.testing.assert_allclose(found.streams[0].time_s, expected, rtol=0, atol=6e-3)


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("time", 1e3),
        ("t", 1e6),
        ("time", 1.0),
        ("elapsed time [min]", 1 / 60),
        ("time_h", 1 / 3600),
        ("time (ms)", 1e3),
    ],
)
def test_a_count_is_in_the_unit_that_the_track_or_its_name_shows(written, name, factor) -> None:
    found = read_log(written({name: np.round(voyage().time * factor, 9)}))
    assert not found.dated and found.streams[0].time_s == pytest.approx(voyage().time, abs=1e-3)


def test_a_count_that_nothing_explains_is_marked(written) -> None:
    found = read_log(written({"time": np.round(voyage().time * 1e3)}, drop=("latitude", "longitude")))
    assert found.streams[0].time_s == pytest.approx(voyage().time)
    assert any(finding.kind == "fault" and "states no unit" in finding.text for finding in found.findings)


def test_rows_every_ten_seconds_stay_so(written) -> None:
    found = read_log(written({"time": voyage().time}, rows=slice(None, None, 20)))
    assert np.diff(found.streams[0].time_s) == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("form", "begin"), [("%Y-%m-%d %H:%M", 0), ("%d.%m.%Y %H:%M", 37), ("%H:%M", 5), ("%Y-%m-%dT%H:%M:%SZ", 0)]
)
def test_rows_of_a_coarse_clock_are_spread_between_its_times(written, form, begin) -> None:
    found = read_log(written({"time": moments().dt.strftime(form)}, rows=slice(begin, None)))
    time = found.streams[0].time_s
    exact = voyage().time[begin:] + (T0 if found.dated else T0 % 86400)
    np.testing.assert_allclose(time, exact, rtol=0, atol=1e-6)
    assert any("spread evenly" in finding.text for finding in found.findings)


def test_two_vessels_in_one_table_are_not_spread(saved) -> None:
    other = table().assign(latitude=table()["latitude"] + 0.01)
    result = log(saved(pd.concat([table(), other]).sort_values("utc", kind="stable"), "two.csv"))
    assert any("two instruments in one" in mark for mark in result.cautions)


def test_a_clock_that_spans_years_is_refused(written) -> None:
    years = moments().dt.strftime("%Y-%m-%dT%H:%M:%SZ").where(moments().index > 0, "1980-01-06T00:00:00Z")
    with pytest.raises(InputError, match="span"):
        log(written({"time": years}))


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_log_of_few_instants_is_refused_or_has_no_trial(written, rows) -> None:
    seconds = T0 + 0.1 * np.minimum(np.arange(1800), rows - 1)
    try:
        result = log(written({"time": seconds}))
    except InputError:
        return
    assert result.cuts == ()


# Numbers for missing values ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("quantity", "column", "number"),
    [
        ("heading", "heading_deg", -999.0), ("heading", "heading_deg", 511.0), ("heading", "heading_deg", -99.0),
        ("rudder_angle", "rudder_deg", -999.0), ("rudder_angle", "rudder_deg", 9999.0),
        ("yaw_rate", "rot_deg_min", 128.0), ("yaw_rate", "rot_deg_min", 32767.0), ("yaw_rate", "rot_deg_min", -128.0),
        ("sog", "sog_kn", 102.3), ("sog", "sog_kn", 99.9), ("rpm", "shaft_rpm", 65535.0), ("cog", "cog_deg", 360.0),
        ("latitude", "latitude", 0.0), ("latitude", "latitude", 91.0), ("longitude", "longitude", 181.0),
    ],
)  # fmt: skip
def test_a_number_that_stands_for_none_is_none(quantity, column, number) -> None:
    values = table()[column].to_numpy(copy=True)
    lost = np.random.default_rng(3).choice(len(values), 60, replace=False)
    if quantity == "cog":
        lost = lost[np.abs((values[lost] + 180) % 360 - 180) > 30]
    values[lost] = number
    known, findings = without_missing(LogStream(column, voyage().time, values, "", quantity, "name"))
    assert set(np.flatnonzero(np.isnan(known.values))) == set(lost) and len(findings) == 1


@pytest.mark.parametrize(
    "column", ["heading_deg", "cog_deg", "rudder_deg", "rot_deg_min", "sog_kn", "shaft_rpm", "latitude"]
)
def test_values_stay(column) -> None:
    quantity = {"heading_deg": "heading", "cog_deg": "cog", "rot_deg_min": "yaw_rate", "sog_kn": "sog"}.get(
        column, column
    )
    stream = LogStream(column, voyage().time, table()[column].to_numpy(), "", quantity, "name")
    assert without_missing(stream) == (stream, [])


def test_orders_of_99_and_courses_of_360_stay() -> None:
    order = np.repeat([0.0, 99.0, 50.0, 99.0], 450)
    course = np.where(np.arange(1800) % 3 == 0, 360.0, 0.1)
    for quantity, values in (("rpm_order", order), ("cog", course)):
        stream = LogStream("x", voyage().time, values, "", quantity, "name")
        assert without_missing(stream)[1] == []


# Rudders, velocities ----------------------------------------------------------------------------------------------


def steering(saved, **columns):
    return log(saved(table().drop(columns="rudder_deg").assign(**columns), "log.csv"))


def rudder(degrees: bool = True) -> np.ndarray:
    return np.degrees(voyage().rudder) if degrees else voyage().rudder


@first_fast(
    ("name", "values", "zero"),
    [
        ("rudder_angle_deg", lambda: 90 + rudder(), 90.0),
        ("rudder_command", lambda: 180 + np.round(rudder()), 180.0),
        ("rudder_angle_deg", lambda: 90 - rudder(), 90.0),
        ("rudder_rad", lambda: 1.57 + rudder(degrees=False), 1.57),
        ("rudder_deg", lambda: -20 + rudder(), -20.0),
        ("rudder_percent", lambda: 50 + rudder() / 35 * 50, 50.0),
    ],
)
def test_a_rudder_with_another_zero_is_taken_from_there_and_marked(saved, name, values, zero) -> None:
    result = steering(saved, **{name: values()})
    (channel,) = (channel for channel in result.voyage.channels.channels if "rudder" in channel.quantity)
    assert channel.use and channel.offset == pytest.approx(zero, abs=0.01)
    found = result.voyage.series[channel.quantity]
    made = np.interp(found.time_s - T0, voyage().time, voyage().rudder)
    assert np.degrees(np.abs(found.values - made)).max() < 1.1
    assert any(f"{zero:g} on straight legs" in mark for mark in result.cautions)
    assert [cut.stretches[0].kind.value for cut in result.cuts] == ["zigzag", "turn"]


@first_fast("name", ["rudder_raw", "rudder_adc"])
def test_counts_of_a_converter_have_a_zero_and_no_unit(saved, name) -> None:
    result = steering(saved, **{name: np.round(512 + (2 if name == "rudder_raw" else 8) * rudder())})
    assert result.cuts == () and any(name in mark for mark in result.cautions)


def test_a_small_helm_stays_and_a_larger_one_is_marked(saved) -> None:
    for helm, marked in ((2.0, False), (6.0, True)):
        result = steering(saved, rudder_deg=rudder() + helm)
        series = result.voyage.series["rudder_angle"]
        assert np.degrees(series.values[0]) == pytest.approx(helm, abs=0.1)
        assert any("straight legs" in mark for mark in result.cautions) == marked


def test_an_order_whose_zero_differs_from_that_of_the_angle_follows_the_angle(saved) -> None:
    result = steering(saved, rudder=rudder(), rudder_command=40 + np.round(rudder()))
    order = next(channel for channel in result.voyage.channels.channels if channel.quantity == "rudder_order")
    assert order.use and order.offset == 40.0 and order.unit == "deg"


def test_the_second_rudder_is_named(saved) -> None:
    columns = {"rudder port [deg]": rudder(), "rudder starboard [deg]": rudder() - 3}
    notes = steering(saved, **columns).notices
    assert any("rudder starboard [deg]" in note and "3 deg apart" in note for note in notes)


@pytest.mark.parametrize("name", ["VEL.", "/twist.linear."])
def test_a_velocity_is_refused_with_both_components_or_not_at_all(name) -> None:
    made, streams = voyage(), []
    for axis, values in (("latitude", table()["latitude"]), ("longitude", table()["longitude"])):
        streams.append(LogStream(axis, made.time, values.to_numpy(), "deg", axis, "format"))
    streams.append(LogStream("HDT", made.time, made.heading % (2 * np.pi), "rad", "heading", "format"))
    north, east = np.gradient(made.x, made.time), np.gradient(made.y, made.time)
    ahead, starboard = (
        north * np.cos(made.heading) + east * np.sin(made.heading),
        east * np.cos(made.heading) - north * np.sin(made.heading),
    )
    for pair, used in (((ahead, starboard), True), ((north, starboard), False)):
        velocity = [
            LogStream(f"{name}{quantity}", made.time, values, "m/s", quantity, "format")
            for quantity, values in zip(("u_ground", "v_ground"), pair, strict=True)
        ]
        found = find_channels([*streams, *velocity])
        assert [found.used(quantity) is not None for quantity in ("u_ground", "v_ground")] == [used, used]


def test_revolutions_astern_while_the_vessel_goes_ahead_are_not_used(saved) -> None:
    for sign in (1, -1):
        result = steering(saved, rudder_deg=rudder(), shaft_rpm=sign * table()["shaft_rpm"])
        used = {channel.quantity for channel in result.voyage.channels.channels if channel.use}
        assert ("rpm" in used) == (sign > 0) and any("shaft_rpm" in mark for mark in result.cautions) == (sign < 0)
        assert [stretch.kind.value for stretch in result.found] == ["steady", "zigzag", "steady", "turn", "steady"]


def test_a_vessel_that_makes_way_with_its_engine_stopped_does_not_rest(saved) -> None:
    result = steering(saved, rudder_deg=rudder(), shaft_rpm=np.zeros(1800))
    assert "rest" not in {stretch.kind.value for stretch in result.found}


def test_a_speed_that_stays_at_0_while_the_vessel_moves_is_not_used(saved) -> None:
    result = steering(saved, rudder_deg=rudder(), stw_kn=np.zeros(1800))
    assert any("stw_kn" in mark for mark in result.cautions) and "u_water" not in result.voyage.series


def test_a_time_in_ms_without_positions_is_known_by_the_turn(tmp_path) -> None:
    rows = np.arange(600)
    heading = 90 + 40 * np.sin(rows / 30)
    lines = [f"{50 * row + 1234},{angle:.2f}" for row, angle in zip(rows, heading, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["timestamp,heading", *lines]) + "\n")
    made = read_log(path)
    (stream,) = [stream for stream in made.streams if stream.name == "heading"]
    assert np.median(np.diff(stream.time_s)) == pytest.approx(0.05)
    assert any("ms" in finding.text for finding in made.findings)
