"""The ending of a file's name decides what is written, or is refused with those that are possible, before any work."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest

import tank2sim as t2s
from tank2sim.api.commands import VERBS
from tank2sim.api.results import result_classes
from tank2sim.cli import COMMANDS
from tank2sim.cli import tank2sim as group
from tank2sim.cli.derived import OutputFile
from tank2sim.files import write_together
from tests.cli.command_line import refused, tank2sim

CONTENTS: dict[str, bytes] = {
    ".html": b"<!DOCTYPE html><p>x",
    ".png": b"\x89PNG\r\n\x1a\n",
    ".svg": b'<svg xmlns="http://www.w3.org/2000/svg"/>',
    ".pdf": b"%PDF-1.4",
    ".json": b'{"schema": 1}',
    ".fmu": b"PK\x03\x04x",
    ".toml": b'# a card\n\nformat = "tank2sim-ship/1"\n',
    ".m": b"function [xdot, U] = ship(x)\n",
}


@pytest.mark.parametrize("ending", CONTENTS)
def test_no_file_has_the_ending_of_another_kind(ending: str, tmp_path: Path) -> None:
    for other in CONTENTS:
        for name in (f"x{other}", f"x{other.upper()}"):
            if other == ending:
                write_together({tmp_path / name: CONTENTS[ending]})
            else:
                with pytest.raises(t2s.InputError, match=re.escape(other)) as caught:
                    write_together({tmp_path / "good": b"1", tmp_path / f"un-{name}": CONTENTS[ending]})
                assert ending in caught.value.remedy
    for name in ("x", "x.dat", "x.out", f"x.csv{ending}"):
        write_together({tmp_path / name: CONTENTS[ending]})
    assert not list(tmp_path.glob("un-*")) and not (tmp_path / "good").exists()


@pytest.mark.parametrize(
    "command",
    [
        "simulate mariner --manoeuvre turn:35 --page x.pdf",
        "simulate mariner --manoeuvre turn:35 --page x.json",
        "simulate mariner --manoeuvre turn:35 --plot x.html",
        "simulate mariner --manoeuvre turn:35 --plot x.jpg",
        "simulate mariner --manoeuvre turn:35 --json x.html",
        "simulate mariner --manoeuvre turn:35 -o x.xlsx",
        "simulate mariner --manoeuvre turn:35 -o x.json",
        "stability mariner -o x.png",
        "stability mariner --json x.csv",
        "poster mariner -o x.pdf",
        "pilotcard mariner -o x.svg",
        "steer mariner -o x.pdf",
        "report r.json -o x.pdf",
        "export mariner -o x.zip",
        "export mariner -o x.fmu --ssp x.zip",
        "autopilot mariner --export x.ssp",
        "convert mariner --to mss -o x.py",
        "convert mariner --to pvs -o x.m",
        "convert mariner --to abkowitz -o x.csv",
        "convert otter --to gazebo -o x.toml",
        "identify mariner zigzag.csv -o x.csv",
        "influence mariner -o x.json",
        "guess --length 1 --beam 1 --draught 1 --block 1 --speed 1 -o x.html",
        "reduce captive.toml --budget x.toml",
        "run zigzag.csv --cycle x.json",
        "signals zigzag.csv -o x.toml",
        "tow tows.csv -o x.csv",
        "yaw water.csv -o x.json",
        "design mariner -o x.toml",
        "design mariner --campaign x.csv",
        "design mariner --orders x.csv",
        "log voyage.csv -o x.csv",
        "gap mariner zigzag.csv -o x.toml",
        "demo -o x.html",
    ],
)
def test_an_ending_of_another_kind_is_refused(command: str, tmp_path: Path) -> None:
    refused(tank2sim(*command.split(), cwd=tmp_path), "x.", "ends in")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf", ".PDF", ""])
def test_a_picture_is_what_its_ending_says(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{ending}"
    t2s.load("mariner").turn(35, duration_s=60.0).plot(path)
    begins = {".svg": b"<svg", ".pdf": b"%PDF-", ".PDF": b"%PDF-"}.get(ending, b"\x89PNG")
    assert path.read_bytes().startswith(begins)
    if ending == ".svg":
        ElementTree.fromstring(path.read_text())


@pytest.mark.slow
def test_the_command_line_draws_what_the_ending_says(tmp_path: Path) -> None:
    options = ("--duration", "60", "--plot", "x.svg", "--page", "x.htm", "--json", "x.json", "-o", "x.csv")
    assert tank2sim("simulate", "mariner", "--manoeuvre", "turn:35", *options, cwd=tmp_path).returncode == 0
    ElementTree.parse(tmp_path / "x.svg")
    json.loads((tmp_path / "x.json").read_text())
    assert tank2sim("report", "x.json", "-o", "y.html", "--plot", "y.pdf", cwd=tmp_path).returncode == 0
    assert (tmp_path / "y.pdf").read_bytes().startswith(b"%PDF-")


def test_a_command_whose_results_have_no_chart_does_not_offer_to_draw_one(tmp_path: Path) -> None:
    commands = {name: group.get_command(click.Context(group), name) for name in COMMANDS if VERBS[name].results}
    without = {
        name
        for name, command in commands.items()
        if command and not any("--plot" in option.opts for option in command.params)
    }
    assert without == {"convention", "convert", "demo", "export", "serve", "ships", "steer"}
    for name in without:
        for kind in result_classes(name):
            assert "charts" not in inspect.getsource(kind), kind
    refused(tank2sim("ships", "--plot", "x.png", cwd=tmp_path), "--plot")
    assert not list(tmp_path.iterdir())


def test_results_refuse_the_ending_of_another_kind(tmp_path: Path) -> None:
    ship = t2s.load("mariner")
    run = ship.turn(35, duration_s=20.0)
    for write in (
        lambda: run.to_html(tmp_path / "x.pdf"),
        lambda: run.to_json(tmp_path / "x.html"),
        lambda: run.to_csv(tmp_path / "x.json"),
        lambda: run.plot(tmp_path / "x.html"),
        lambda: run.plot(tmp_path / "x.jpg"),
        lambda: ship.to_fmu(tmp_path / "x.zip"),
        lambda: ship.save(tmp_path / "x.json"),
        lambda: ship.pilot_card().to_html(tmp_path / "x.pdf"),
        lambda: t2s.convert(ship, "mss").save(tmp_path / "x.py"),
    ):
        with pytest.raises(t2s.InputError, match="ends in"):
            write()
    with pytest.raises(t2s.InputError, match=r"\.png or \.svg or \.pdf"):
        run.plot(tmp_path / "x.jpg")
    assert not list(tmp_path.iterdir())


def test_every_option_for_a_file_that_is_written_checks_its_ending() -> None:
    written = {"--page", "--plot", "-o", "--ssp", "--budget", "--cycle", "--orders", "--export", "--out"}
    for name in COMMANDS:
        command = group.get_command(click.Context(group), name)
        assert command is not None
        for option in command.params:
            if written & set(option.opts) and (name, option.opts[0]) not in {("convert", "-o"), ("glide", "--budget")}:
                assert isinstance(option.type, OutputFile), (name, option.opts)
