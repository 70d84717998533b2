"""NMEA 0183 as strangers record it: sentences that are spoilt, glued, unsummed, void, unknown, undated."""

from __future__ import annotations

import functools

import numpy as np
import pandas as pd
import pytest

from tank2sim.apps.logs.command import log
from tank2sim.apps.logs.reading import read_log
from tank2sim.errors import InputError
from tests.apps.logs.made_logs import T0, frame, nmea_lines, sentence, stream_of, texts

pytest.importorskip("pynmea2")

ROLLOVER_DAYS = 7168


@functools.cache
def whole() -> tuple[str, ...]:
    return tuple(nmea_lines())


def lines() -> tuple[str, ...]:
    """The first 200 s."""
    return whole()[:1600]


@functools.cache
def table() -> pd.DataFrame:
    return frame()[:400]


def body(line: str) -> str:
    return line[1:].partition("*")[0]


def cells(line: str) -> list[str]:
    return body(line).split(",")


def changed(kind: str, *others, of: tuple[str, ...] = ()) -> list[str]:
    """The lines, those of a kind replaced by what each function makes of their cells; None leaves the line."""
    out = []
    for line in of or lines():
        if line[3:6] == kind:
            out += [line if other is None else sentence(other(cells(line))) for other in others]
        else:
            out.append(line)
    return out


@pytest.fixture
def read(tmp_path):
    def read(content):
        path = tmp_path / "log.nmea"
        data = content if isinstance(content, bytes) else "\n".join([*content, ""]).encode("ascii")
        path.write_bytes(data)
        return read_log(path)

    return read


def test_a_cell_that_cannot_be_read_costs_its_sentence_alone(read) -> None:
    spoilt = [
        "WIMWV,,R,,N,A", "WIMWV,1,R,2,X,A", "WIMWV", "IIRPM,S,x,84,,A", "IIRPM,S", "GPZDA,aa,bb",
        "GPZDA,220000,32,13,2023,00,00", "HETHS,1", "GPGGA,1", "GPRMC,250000.00,A,5400.0,N,01012.0,E,1,2,141123,,,A",
        "GPRMC,xx,A,1,N,2,E,,,999999,,,A", "GPRMC,,A,5499.0,N,01012.0,E,1,2,141123,,,A", "HCHDG,1,2,X,3,Q",
        "IIXDR,A,b,D,RUDDER", "TIROT,1", "GPGLL,91,N,1", "IIVHW,x,T,,M,,N,,K", "GNGNS,1",
    ]  # fmt: skip
    mixed = list(lines())
    for place, text in enumerate(spoilt):
        mixed.insert(50 + 77 * place, sentence(text))
    found = read(mixed)
    assert found.counts["malformed"] == len(spoilt)
    for name in ("HDT.heading", "RSA.starboard_rudder"):
        column = "heading_deg" if "HDT" in name else "rudder_deg"
        assert stream_of(found, name).values == pytest.approx(table()[column], abs=0.051)
    assert stream_of(found, "RMC.latitude").values == pytest.approx(table()["latitude"][::2], abs=2e-7)
    assert not texts(found, "fault")


@pytest.mark.parametrize(("letter", "factor"), [("N", 1852 / 3600), ("K", 1 / 3.6), ("M", 1.0), ("S", 1609.344 / 3600)])
def test_a_wind_speed_is_in_the_unit_of_its_sentence(read, letter, factor) -> None:
    wind = [sentence(f"WIMWV,45.0,R,12.5,{letter},A")] * 2
    assert stream_of(read([*lines()[:40], *wind]), "MWV.relative_speed").values == pytest.approx(12.5 * factor)


@pytest.mark.parametrize(
    ("latitude", "longitude", "origin"),
    [
        ("0512.00,N", "100.00,E", (5.2, 1.0)),
        ("512.00,S", "1018.00,W", (-5.2, -10.3)),
        ("5424.00,N", "12.00,E", (54.4, 0.2)),
        ("5424.00,N", "17930.00,W", (54.4, -179.5)),
        ("5424,N", "01018,E", (54.4, 10.3)),
    ],
)
def test_degrees_stand_before_the_last_two_digits_before_the_point(read, latitude, longitude, origin) -> None:
    first = changed("RMC", lambda words: ",".join([*words[:3], latitude, longitude, *words[7:]]))[:40]
    found = read(first)
    values = [stream_of(found, f"RMC.{name}").values[0] for name in ("latitude", "longitude")]
    assert values == pytest.approx(origin, abs=1e-9)


@pytest.mark.parametrize(
    "written",
    [
        lambda text: "".join(a + b + "\n" for a, b in zip(text[::2], text[1::2], strict=True)).encode("ascii"),
        lambda text: "".join("".join(text[k : k + 5]) + "\n" for k in range(0, len(text), 5)).encode("ascii"),
        lambda text: "\r".join(text).encode("ascii"),
        lambda text: "\r\n".join(["# a comment", *text]).encode("utf-8-sig"),
        lambda text: "\n".join(text).encode("utf-16"),
        lambda text: "\n".join(text).encode("utf-16-le"),
    ],
)
def test_sentences_are_read_wherever_lines_end(read, written) -> None:
    found, usual = read(written(lines())), read(lines())
    for name in ("HDT.heading", "RMC.latitude", "RSA.starboard_rudder"):
        np.testing.assert_array_equal(stream_of(found, name).values, stream_of(usual, name).values)
        np.testing.assert_allclose(stream_of(found, name).time_s, stream_of(usual, name).time_s, rtol=0, atol=1e-6)


def test_a_time_stamp_may_stand_behind_its_sentence(read) -> None:
    found = read([f"{line},{T0 + 0.125 * place:.3f}" for place, line in enumerate(lines())])
    assert np.diff(stream_of(found, "HDT.heading").time_s) == pytest.approx(0.5, abs=0.13)


def test_a_kind_without_checksums_is_read_and_named_and_cut_sentences_are_not(read) -> None:
    unsummed = [line.partition("*")[0] if line[3:6] == "RSA" else line for line in lines()]
    found = read([*unsummed, "$HEHDT,12", "$IIRPM,S"])
    assert stream_of(found, "RSA.starboard_rudder").values == pytest.approx(table()["rudder_deg"], abs=0.051)
    assert found.counts["corrupted"] == 2 and "AGRSA has no checksum" in texts(found)


def test_a_kind_whose_checksums_are_all_wrong_is_a_fault(read) -> None:
    found = read([line[:-2] + "00" if line[3:6] == "RSA" else line for line in lines()])
    assert "RSA have a wrong checksum" in texts(found, "fault")


def test_a_refusal_says_that_checksums_are_wrong(read) -> None:
    with pytest.raises(InputError, match="wrong checksum"):
        read([line[:-2] + "00" for line in lines()])


def gll(words: list[str], status: str = "A", mode: str = "A") -> str:
    return ",".join(["GPGLL", *words[3:7], words[1], status, mode])


def gns(words: list[str], mode: str = "AN") -> str:
    return ",".join(["GNGNS", words[1], *words[3:7], mode, "8,1.0,5,40,,"])


def gga(words: list[str]) -> str:
    return ",".join(["GPGGA", words[1], *words[3:7], "1,8,1.0,5,M,40,M,,"])


def zda(words: list[str]) -> str:
    return f"GPZDA,{words[1]},{words[9][:2]},{words[9][2:4]},20{words[9][4:]},00,00"


@pytest.mark.parametrize("position", [gll, gns, gga])
@pytest.mark.parametrize("dated", [True, False])
def test_positions_are_read_from_every_sentence_that_has_one(read, position, dated) -> None:
    found = read(changed("RMC", position, zda) if dated else changed("RMC", position))
    latitude = next(stream for stream in found.streams if stream.quantity == "latitude")
    assert latitude.values == pytest.approx(table()["latitude"][::2], abs=2e-7) and found.dated == dated
    begin = T0 if dated else T0 % 86400
    assert latitude.time_s == pytest.approx(begin + np.arange(200.0), abs=0.2)


def test_one_sentence_without_a_date_does_not_decide_about_the_clock(read) -> None:
    words = cells(lines()[0])
    found = read([sentence(",".join([*words[:9], "", *words[10:]])), *changed("RMC", gll, zda)])
    assert found.dated and stream_of(found, "HDT.heading").time_s[0] == pytest.approx(T0, abs=0.3)


@pytest.mark.parametrize(
    ("kind", "void"),
    [
        ("VTG", lambda words: "GPVTG,0.00,T,,M,0.00,N,0.00,K,N"),
        ("GLL", lambda words: gll(words, mode="N")),
        ("GLL", lambda words: gll(words, status="V")),
        ("GNS", lambda words: gns(words, "NN")),
    ],
)
def test_a_sentence_that_is_not_valid_holds_no_value_and_is_named(read, kind, void) -> None:
    found = read(changed("RMC", None, void))
    assert not [stream for stream in found.streams if stream.name.startswith(kind)]
    assert f"{kind} hold no valid value" in texts(found, "note")


@pytest.mark.parametrize(
    ("wording", "name", "quantity"),
    [
        ("IIXDR,A,{},D,RUDDER,A,1.0,D,PTCH", "XDR.RUDDER", "rudder_angle"),
        ("AGROR,{},A,,V,B", "ROR.starboard_order", "rudder_order"),
        ("PABC,RUD,{},A", "PABC.2", ""),
        ("IIXYZ,{},A", "XYZ.1", ""),
    ],
)
def test_a_rudder_is_found_in_other_sentences(read, wording, name, quantity) -> None:
    found = read(changed("RSA", lambda words: wording.format(words[1])))
    stream = stream_of(found, name)
    assert stream.quantity == quantity and stream.values == pytest.approx(table()["rudder_deg"], abs=0.051)
    if not quantity:
        assert f"400 {name.partition('.')[0]}" in texts(found) and found.counts["unknown"] == 400


def test_a_rudder_in_a_sentence_that_nobody_knows_is_found_by_content(read, tmp_path) -> None:
    read(changed("RSA", lambda words: f"PABC,RUD,{words[1]},A", of=whole()))
    result = log(tmp_path / "log.nmea")
    assert [cut.stretches[0].kind.value for cut in result.cuts] == ["zigzag", "turn"] and "PABC.2" in result.cautions[0]


def test_a_known_kind_that_is_not_used_is_named(read) -> None:
    found = read([*lines(), sentence("SDDPT,12.5,0.0,"), sentence("GPGSA,A,3,1,2,3,,,,,,,,,,1,1,1")])
    assert "1 DPT, 1 GSA" in texts(found) and found.counts["unused"] == 2


@pytest.mark.parametrize(
    ("text", "name"), [("VWVHW,,T,,M,,N,{:.3f},K", "VHW.speed_water"), ("GPVTG,4.0,T,,M,,N,{:.3f},K,A", "VTG.sog")]
)
def test_a_speed_in_km_h_alone_is_read(read, text, name) -> None:
    stream = stream_of(read([*lines()[:40], *[sentence(text.format(18.52))] * 2]), name)
    assert stream.unit == "kn" and stream.values == pytest.approx(10.0)


def test_a_compass_with_its_variation_is_a_true_heading(read) -> None:
    def hdg(words: list[str]) -> str:
        return f"HCHDG,{(float(words[1]) + 15) % 360:.2f},5.0,W,10.0,W"

    def hdm(words: list[str]) -> str:
        return f"HCHDM,{(float(words[1]) + 10) % 360:.2f},M"

    def by_rmc(words: list[str]) -> str:
        return ",".join([*words[:10], "10.0", "W", *words[12:]])

    with_rmc = [sentence(by_rmc(cells(line))) if line[3:6] == "RMC" else line for line in changed("HDT", hdm)]
    for text, name in ((changed("HDT", hdg), "HDG.true_heading"), (with_rmc, "HDM.true_heading")):
        stream = stream_of(read(text), name)
        error = (stream.values - table()["heading_deg"].to_numpy() + 180) % 360 - 180
        assert stream.quantity == "heading" and np.abs(error).max() < 0.011
    assert "HDM.true_heading" not in {stream.name for stream in read(changed("HDT", hdm)).streams}


def shifted(words: list[str], days: int) -> str:
    date = pd.to_datetime(words[9], format="%d%m%y") + pd.Timedelta(days=days)
    return ",".join([*words[:9], date.strftime("%d%m%y"), *words[10:]])


def stamped(text: list[str], offset_s: float = 0.0) -> list[str]:
    """Lines with the time of the voyage before them, by the clock of RMC."""
    out, second = [], -1
    for line in text:
        second += line[3:6] == "RMC"
        out.append(f"{T0 + max(second, 0) + offset_s:.3f} {line}")
    return out


@pytest.mark.parametrize("turns", [1, 2])
def test_a_receiver_that_is_1024_weeks_late_has_the_date_of_the_recorder(read, turns) -> None:
    found = read(stamped(changed("RMC", lambda words: shifted(words, -turns * ROLLOVER_DAYS))))
    assert stream_of(found, "RMC.latitude").time_s[0] == pytest.approx(T0, abs=1.0)
    assert "1024 weeks" in texts(found) or "2048 weeks" in texts(found)


def test_a_recorder_that_was_not_set_has_the_date_of_the_receiver_and_that_is_said(read) -> None:
    found = read(stamped(list(lines()), offset_s=-1e8))
    assert stream_of(found, "RMC.latitude").time_s[0] == pytest.approx(T0, abs=1.0)
    assert any(finding.kind == "note" and "days" in finding.evidence for finding in found.findings)


def test_time_stamps_of_the_recorder_are_a_clock_of_their_own(read) -> None:
    found = read([line for line in stamped(list(lines())) if "RMC" not in line])
    assert found.dated and stream_of(found, "HDT.heading").time_s[-1] == pytest.approx(T0 + 199.5, abs=1.0)


def _of_year(year: str) -> list[str]:
    return changed("RMC", lambda words: ",".join([*words[:9], words[9][:4] + year, *words[10:]]))[:60]


@pytest.mark.parametrize(("year", "full"), [("98", 1998), ("80", 1980), ("24", 2024), ("79", 2079)])
def test_years_of_two_digits_from_80_on_are_of_the_last_century(read, year, full) -> None:
    found = read(_of_year(year))
    assert pd.Timestamp(stream_of(found, "HDT.heading").time_s[0], unit="s").year == full


def test_a_clock_before_the_first_fix_does_not_date_the_log(read) -> None:
    early = [sentence("GPRMC,000012.00,V,,,,,,,060180,,,N")] * 5
    found = read([*early, *lines()])
    assert stream_of(found, "RMC.latitude").time_s[0] == pytest.approx(T0, abs=0.1) and not texts(found, "fault")
