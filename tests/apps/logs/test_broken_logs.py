"""Broken logs end in a refusal of one line, or are marked; never in a traceback or a wrong file."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.reading import read_log
from tank2sim.apps.logs.result import LogResult
from tank2sim.errors import InputError
from tank2sim.records.reading import read_trial_file
from tests.apps.logs.made_logs import frame, nmea_lines, rmc, sentence, used, voyage
from tests.marks import first_fast


@pytest.fixture
def nmea(saved):
    pytest.importorskip("pynmea2")
    return lambda lines: saved(lines, "voyage.nmea")


def signals_of(result: LogResult) -> set[str]:
    return {name for cut in result.cuts for name in cut.trial.signals}


def test_a_good_log_has_no_mark(saved) -> None:
    result = log(saved(frame()))
    assert result.cautions == () and {"heading", "rudder_angle", "yaw_rate", "sog", "latitude"} <= set(used(result))


def exchanged(table: pd.DataFrame, one: str, other: str) -> pd.DataFrame:
    return table.assign(**{one: table[other], other: table[one]})


def noisy_course(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(cog_deg=table.cog_deg + np.random.default_rng(1).normal(0, 1.0, len(table)))


FALSE_CHANNELS = {
    "heading off by 90 deg": (lambda t: t.assign(heading_deg=(t.heading_deg + 90) % 360), "off by 9", {"heading"}),
    "mirrored heading": (lambda t: t.assign(heading_deg=-t.heading_deg % 360), "", {"heading"}),
    "latitude for longitude": (lambda t: exchanged(t, "latitude", "longitude"), "", {"latitude", "longitude"}),
    "longitude of the wrong sign": (
        lambda t: t.assign(longitude=-t.longitude),
        "wrong sign of the second",
        {"longitude"},
    ),
    "rate of turn in deg/s": (lambda t: t.assign(rot_deg_min=t.rot_deg_min / 60), "deg/s", {"yaw_rate"}),
    "speed in m/s": (lambda t: t.assign(sog_kn=t.sog_kn * 1852 / 3600), "m/s", {"sog"}),
    "rudder against its name": (
        lambda t: t.rename(columns={"rudder_deg": "rudder (port +) [deg]"}),
        "contradicts the sign",
        {"rudder_angle"},
    ),
    "heading for course": (
        lambda t: exchanged(noisy_course(t), "heading_deg", "cog_deg"),
        "exchanged",
        {"heading", "cog"},
    ),
    "rudder order for its angle": (
        lambda t: t.assign(rudder_order_deg=t.rudder_deg, rudder_deg=np.degrees(voyage().rudder).round(0)),
        "as an order does",
        {"rudder_angle", "rudder_order"},
    ),
}
"""What is wrong: how, words of its mark, and the quantities that are left out."""


@pytest.mark.parametrize("wrong", FALSE_CHANNELS)
def test_a_channel_that_the_motion_contradicts_is_marked_and_left_out(saved, wrong) -> None:
    change, words, left_out = FALSE_CHANNELS[wrong]
    result = log(saved(change(frame())))
    assert any(words in mark for mark in result.cautions) and result.cautions[0].startswith("UNCONFIRMED")
    assert not left_out & set(used(result))
    assert "heading" in left_out or "heading" in used(result)
    signals = {"heading": "psi_rad", "latitude": "x_m"}
    assert not {signals[name] for name in left_out & signals.keys()} & signals_of(result)
    assert all(cut.text.startswith("# UNCONFIRMED") for cut in result.cuts)


def test_a_rudder_that_is_positive_to_port_is_turned(saved) -> None:
    table = frame()
    table["rudder_deg"] = -table["rudder_deg"]
    result = log(saved(table))
    assert any("positive to port" in notice for notice in result.notices)
    rudder = result.voyage.series["rudder_angle"]
    made = voyage()
    at = np.interp(rudder.time_s - rudder.time_s[0], made.time, made.rudder)
    assert np.degrees(np.abs(rudder.values - at)).max() < 1.0


@pytest.mark.parametrize("back_s", [30.0, 3600.0])
def test_a_clock_set_back_is_marked_and_runs_on(saved, back_s) -> None:
    table = frame()
    moments = pd.to_datetime(table["utc"])
    moments[1000:] -= pd.Timedelta(seconds=back_s)
    table["utc"] = moments.dt.strftime("%Y-%m-%dT%H:%M:%S.%fZ")
    result = log(saved(table))
    assert any("clock falls" in mark for mark in result.cautions)
    assert result.voyage.end_s - result.voyage.begin_s == pytest.approx(voyage().time[-1], abs=1.0)
    assert [stretch.kind.value for stretch in result.found if stretch.kind.excites] == ["zigzag", "turn"]


def test_a_receiver_whose_clock_is_set_back_is_marked(nmea) -> None:
    lines = nmea_lines()
    table, made = frame(), voyage()
    kept = []
    second = -1
    for line in lines:
        if "RMC" in line:
            second += 1
            place = table.latitude[2 * second], table.longitude[2 * second]
            kept.append(rmc(made.time[2 * second] - (60.0 if second > 500 else 0.0), *place))
        else:
            kept.append(line)
    result = log(nmea(kept))
    assert any("clock falls by 59" in mark for mark in result.cautions)
    assert result.voyage.end_s - result.voyage.begin_s == pytest.approx(made.time[-1], abs=2.0)


def test_half_a_sentence_and_spoilt_ones_are_counted(nmea) -> None:
    lines = nmea_lines()
    lines[100] = lines[100].replace("HDT", "HDX") if "HDT" in lines[100] else lines[100][:-1] + "Z"
    path = nmea([*lines, "$HEHDT,12"])
    found = read_log(path)
    assert found.counts["corrupted"] == 2 and found.counts["lines"] == len(lines) + 1
    assert any("2 of" in finding.text for finding in found.findings)


@pytest.mark.parametrize(("talker", "words"), [("GL", "two receivers"), ("GP", "two instruments in one")])
def test_two_receivers_are_two_and_the_result_is_marked(nmea, talker, words) -> None:
    table, made = frame(), voyage()
    lines, row = [], -2
    for line in nmea_lines():
        lines.append(line)
        if "RMC" in line:
            row += 2
            lines.append(rmc(made.time[row], table.latitude[row] + 5e-4, table.longitude[row], talker=talker))
    result = log(nmea(lines))
    assert any(words in mark for mark in result.cautions)
    if talker == "GL":  # no leaps between the two, which are 56 m apart
        assert np.abs(np.diff(result.voyage.series["x"].values)).max() < 20


def test_a_pause_of_the_recorder_is_reported_and_nothing_is_bridged(saved) -> None:
    table = frame().drop(range(300, 420))
    result = log(saved(table))
    assert any("60.5 s" in notice for notice in result.notices)
    for cut in result.cuts:
        columns = read_values(cut.text)
        clock = columns["t_s"] + cut.begins_s - result.voyage.begin_s
        inside = (clock > 150.5) & (clock < 209.5)
        assert np.isnan(columns["psi_deg"][inside]).all()


def read_values(text: str) -> dict[str, np.ndarray]:
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    rows = [[float(cell) if cell else math.nan for cell in line.split(",")] for line in lines[1:]]
    return dict(zip(lines[0].split(","), np.array(rows).T, strict=True))


def test_repeated_rows_are_counted_and_left_out(saved) -> None:
    table = frame()
    doubled = pd.concat([table.iloc[:500], table.iloc[480:]])
    result = log(saved(doubled))
    assert result.voyage.counts["voyage.csv"]["repeated_rows"] == 20 and result.cautions == ()


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("empty.csv", b"", "is empty"),
        ("words.txt", b"hello\nworld\nagain\n", "no column of time"),
        ("noise.bin", bytes(range(256)) * 20, "of no known format"),
        ("cut.bag", b"#ROSBAG V2.0\nnothing", "cut off"),
        ("cut.mcap", b"\x89MCAP0\r\nnothing at all", "cut off"),
        ("cut.ulg", b"ULog\x01\x12\x35\x01" + bytes(8), "no topic of it is understood"),
        ("rows.csv", b"1,2,3\n4,5,6\n7,8,9\n", "no channel of it is understood"),
    ],
)
def test_what_is_no_log_is_refused(tmp_path, name, content, problem) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    for library, ending in (("rosbags", (".bag", ".mcap")), ("pyulog", (".ulg",))):
        if name.endswith(ending):
            pytest.importorskip(library)
    with pytest.raises(InputError, match=problem) as refusal:
        log(path)
    assert "\n" not in str(refusal.value) and refusal.value.source == str(path)


@pytest.mark.parametrize("name", ["voyage.bag", "voyage.mcap", "voyage.bin", "voyage.ulg", "voyage.nmea", "voyage.csv"])
@first_fast("share", [0.35, 0.02, 0.8])
def test_a_file_that_is_cut_off_is_refused_or_read_to_its_end(data, tmp_path, name, share) -> None:
    source = data / "data" / "logs" / "ship_21" / name
    if not source.is_file():
        pytest.skip(f"made-up logs are missing: no {source}")
    content = source.read_bytes()
    path = tmp_path / name
    path.write_bytes(content[: int(share * len(content))])
    try:
        result = log(path)
    except InputError as refusal:
        assert refusal.source == str(path) and "\n" not in str(refusal)
        return
    assert result.voyage.end_s - result.voyage.begin_s < 1200 * share * 1.3 + 60
    for cut in result.cuts:
        target = tmp_path / cut.trial.path.name
        target.write_text(cut.text, encoding="utf-8")
        read_trial_file(target)


def test_a_missing_library_is_asked_for_in_one_line(nmea, monkeypatch) -> None:
    import builtins
    import sys

    path = nmea([sentence("HEHDT,12.0,T"), sentence("HEHDT,12.0,T")])
    monkeypatch.delitem(sys.modules, "pynmea2", raising=False)
    original = builtins.__import__

    def refuse(name, *arguments, **more):
        if name == "pynmea2":
            raise ImportError(name)
        return original(name, *arguments, **more)

    monkeypatch.setattr(builtins, "__import__", refuse)
    monkeypatch.setattr("importlib.import_module", refuse)
    with pytest.raises(InputError, match=r"pip install 'tank2sim\[logs\]'"):
        read_log(path)


def test_a_log_that_was_encoded_twice_is_refused_without_a_warning(tmp_path, recwarn) -> None:
    path = tmp_path / "voyage.csv"
    text = "\n".join(nmea_lines())
    path.write_bytes(text.encode("utf-16").decode("latin-1").encode("utf-16"))
    with pytest.raises(InputError):
        read_log(path)
    assert not [warning for warning in recwarn if issubclass(warning.category, pd.errors.ParserWarning)]
