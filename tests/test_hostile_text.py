"""No text of a card leaves its place in any file that is made of it: each is read by a parser of its language."""

from __future__ import annotations

import ast
import json
import keyword
import re
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest

import tank2sim as t2s
from tank2sim.apps.programs.robotics import gazebo_text, vrx_text
from tank2sim.apps.steering.page import PageShip, steering_page
from tank2sim.bundled import bundled
from tank2sim.cards import Card
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.escaping import json_in_html
from tank2sim.fmu.c99 import plain_ship
from tank2sim.fmu.export import description_text
from tank2sim.fmu.osp import osp_system
from tank2sim.fmu.templates import c_identifier
from tests.cli.command_line import tank2sim
from tests.hostile_text import HOSTILE, TOGETHER, Outline, hostile_card
from tests.marks import first_fast

BENIGN = "A plain ship"

_MATLAB = re.compile(
    r"function \[xdot, U\] = [a-z]\w{0,62}\(x, ui, p\)|function value = if_else_zero\(condition, value\)"
    r"|if nargin < [23], (ui|p) = \[[-+.e\d ]*\]'; end|xdot = zeros\(\d+, 1\);|if ~condition, value = 0; end|end|"
    r"|w\d+ = [-+*/^().,<>=~&|\s\w]+;|xdot\(\d+\) = w\d+;|U = hypot\(x\(\d+\), x\(\d+\)\);"
)
"""A line of code of a function for MATLAB; every other is a comment."""

MATLAB_KEYWORDS = {"end", "for", "while", "if", "function", "switch", "case", "try", "return", "class", "global"}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], t2s.Ship]:
    """The ship of a bundled card with a text as its name, source and notes."""
    folder = tmp_path_factory.mktemp("cards")

    def ship(card: str, text: str) -> t2s.Ship:
        path = folder / f"{card}-{hash(text)}.toml"
        return t2s.load(hostile_card(path, bundled("models") / card / "ship.toml", text))

    return ship


Made = Callable[[str, str], t2s.Ship]


@pytest.mark.parametrize("text", HOSTILE)
def test_a_function_for_matlab_has_code_and_comments_alone(text: str, made: Made) -> None:
    lines = re.split(r"\r\n|[\n\r\x0b\x0c\x1c-\x1e\x85\u2028\u2029]", t2s.convert(made("mariner", text), "mss").text)
    assert all(line.startswith("% ") or _MATLAB.fullmatch(line) for line in lines)
    assert not any(line.strip() in ("%{", "%}") for line in lines)
    name = re.match(r"function \[xdot, U\] = (\w+)", lines[0])[1]
    code = "\n".join(line for line in lines[1:] if not line.startswith("%"))
    assert name not in MATLAB_KEYWORDS and name not in re.findall(r"\w+", code)


def _shape(program: str) -> str:
    """The syntax tree of a program, without what its texts say, its numbers, and the name of its class."""
    tree = ast.parse(program)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant):
            node.value, node.kind = type(node.value).__name__, None
        if isinstance(node, ast.ClassDef):
            assert not keyword.iskeyword(node.name)
            node.name = "Ship"
    return ast.dump(tree)


@first_fast("language, card", [("pvs", "mariner"), ("shipmmg", "kvlcc2-mmg"), ("mmgdynamics", "kvlcc2-mmg")])
def test_a_program_in_python_is_the_same_whatever_the_texts(language: str, card: str, made: Made) -> None:
    expected = _shape(t2s.convert(made(card, BENIGN), language).text)
    for text in TOGETHER:
        program = t2s.convert(made(card, text), language).text
        assert _shape(program) == expected, text
        if text.isprintable():
            assert " ".join(text.split()) in " ".join(ast.get_docstring(ast.parse(program)).split())


@pytest.mark.parametrize("text", ["math", "class", "list", "np"])
def test_a_class_hides_no_name_that_its_module_uses(text: str, made: Made) -> None:
    space: dict[str, object] = {}
    exec(t2s.convert(made("mariner", text), "pvs").text, space)
    (vehicle,) = (one for one in space.values() if isinstance(one, type))
    ship = vehicle(r=10.0)
    nu, _ = ship.dynamics([0.0] * 6, ship.nu, ship.u_actual, ship.stepInput(1.0), 0.1)
    assert nu[0] > 7


def _tokens(text: str, prefix: str) -> list[str]:
    """What a compiler of C reads of a file, without comments, numbers, hashes and the prefix of its names."""
    code = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
    code = re.sub(r'"[0-9a-f]{64}"', '""', code)
    return re.sub(rf"(?<!\w){prefix}_", "PREFIX_", code, flags=re.IGNORECASE).split()


def test_the_c_of_a_ship_is_the_same_whatever_the_texts(made: Made) -> None:
    plain = plain_ship(made("mariner", BENIGN).card)
    for text in [*TOGETHER, "2", "船", "-", "M" * 300, "Mariner */ MARK(); /* ??/\n MARK ??=define ??/"]:
        ship = plain_ship(made("mariner", text).card)
        assert re.fullmatch("[a-z][a-z0-9_]*", ship.prefix)
        for name, content in ship.files.items():
            assert content.isascii() and "??" not in content and "\\" not in content.replace("\\n", "")
            assert not re.search(r"/\*(?:(?!\*/).)*/\*", content, re.DOTALL)
            assert _tokens(content, ship.prefix) == _tokens(plain.files[name], plain.prefix), (text, name)


def _elements(text: str) -> list[tuple[str, list[str]]]:
    """Elements of XML with the names of their attributes and, of comments, only that they are there."""
    builder = ElementTree.TreeBuilder(insert_comments=True)
    root = ElementTree.fromstring(text, ElementTree.XMLParser(target=builder))
    return [(one.tag, list(one.attrib)) if isinstance(one.tag, str) else ("comment", []) for one in root.iter()]


@pytest.mark.parametrize("write", [gazebo_text, vrx_text])
def test_a_plugin_of_a_simulator_of_robots_is_xml_with_the_same_elements(
    write: Callable[[Card, str], str], made: Made
) -> None:
    def elements(text: str) -> list[tuple[str, list[str]]]:
        return _elements(f"<sdf>{write(made('otter', text).card, 'inertial')}</sdf>")

    expected = elements(BENIGN)
    for text in HOSTILE:
        assert elements(text) == expected, text


@first_fast(
    "language, card",
    [("abkowitz", "mariner"), ("small_craft", "otter"), ("mmg", "kvlcc2-mmg"), ("abkowitz", "kvlcc2-mmg")],
)
def test_a_card_keeps_every_text_as_it_is(language: str, card: str, made: Made) -> None:
    scaling = {"small_craft": "prime"}.get(language, "prime")

    def content(text: str) -> dict[str, object]:
        return tomllib.loads(t2s.convert(made(card, text), language, scaling=scaling).text)

    expected = content(BENIGN)
    for text in TOGETHER:
        found = content(text)
        assert found["ship"]["name"] == text
        assert found["ship"]["source"].startswith(text) and found["ship"]["notes"].startswith(text)
        for key in ("name", "source", "notes"):
            found["ship"][key] = expected["ship"][key]
        assert found == expected


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_model_description_has_the_same_elements(fmi: int, made: Made) -> None:
    expected = _elements(description_text(made("mariner", BENIGN).model, fmi=fmi))
    for text in TOGETHER:
        assert _elements(description_text(made("mariner", text).model, fmi=fmi)) == expected, text


def test_the_files_for_osp_lie_next_to_the_fmu(made: Made) -> None:
    for text in TOGETHER:
        model = with_simulator_interface(made("mariner", text).model)
        for name, content in osp_system(model, "ship.fmu", c_identifier(text)).items():
            assert Path(name).name == name and name.isprintable() and not re.search(r'[\\/:*?"<>|]', name), name
            _elements(content)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("text", TOGETHER[:3])
def test_an_fmu_and_its_system_have_the_same_files_and_elements(
    text: str, fmi: int, made: Made, tmp_path: Path
) -> None:
    def contents(ship: t2s.Ship, folder: Path) -> dict[str, bytes]:
        folder.mkdir()
        options = ("--ssp", "s.ssp", "--osp", "--fmi", str(fmi), "-o", "s.fmu")
        done = tank2sim("export", ship.card.source, *options, cwd=folder)
        assert done.returncode == 0, done.stderr
        found = {re.sub(".*(?=_Osp)", "", path.name): path.read_bytes() for path in folder.iterdir()}
        assert set(tmp_path.iterdir()) <= {tmp_path / "plain", tmp_path / "hostile"}
        for name in ("s.ssp", "s.fmu"):
            with zipfile.ZipFile(folder / name) as archive:
                assert all(not entry.startswith(("/", "..")) for entry in archive.namelist())
                found |= {re.sub(r"binaries/\S+", "binary", entry): archive.read(entry) for entry in archive.namelist()}
        return found

    plain = contents(made("mariner", BENIGN), tmp_path / "plain")
    hostile = contents(made("mariner", text), tmp_path / "hostile")
    assert set(plain) == set(hostile)
    for name, content in hostile.items():
        if name.endswith((".xml", ".ssd")):
            assert _elements(content.decode()) == _elements(plain[name].decode()), name
        elif name.endswith(".html"):
            assert Outline(content.decode()).elements == Outline(plain[name].decode()).elements, name
        elif name.endswith(".json"):
            json.loads(content)
        elif name.endswith(".toml"):
            assert tomllib.loads(content.decode())["ship"]["name"] == text
        elif name.endswith((".c", ".h")) and name != "sources/model.h":  # which holds the token of the whole
            assert content == plain[name], name
            assert b"MARK" not in content


def _pages(ship: t2s.Ship) -> Iterator[tuple[str, str]]:
    yield "simulate", ship.turn(35, duration_s=60.0).page()


def _diagrams(ship: t2s.Ship) -> Iterator[tuple[str, str]]:
    yield "stability", ship.stability(spirals=False).page()
    yield "autopilot", ship.autopilot().page()


def _waters(ship: t2s.Ship) -> Iterator[tuple[str, str]]:
    yield "steer", steering_page(PageShip(model=ship.model, library="AA=="), notices=[ship.name])


def _sheets(ship: t2s.Ship) -> Iterator[tuple[str, str]]:
    yield "poster", ship.poster().page()
    yield "pilot card", ship.pilot_card().page()


@pytest.mark.slow
@pytest.mark.parametrize("pages", [_pages, _diagrams, _waters, _sheets])
def test_a_page_has_the_same_elements_and_its_data_are_json(
    pages: Callable[[t2s.Ship], Iterator[tuple[str, str]]], made: Made
) -> None:
    expected = {name: Outline(page).elements for name, page in pages(made("mariner", BENIGN))}
    for text in TOGETHER[:2]:
        for name, page in pages(made("mariner", text)):
            outline = Outline(page)
            assert outline.elements == expected[name], name
            if outline.scripts:
                json.loads(outline.scripts[0])
            assert "MARK" not in "".join(outline.scripts[1:])


def test_the_data_of_a_page_neither_end_their_script_nor_begin_a_comment() -> None:
    for text in HOSTILE:
        page = f'<script type="application/json">{json_in_html({text: [text]})}</script><p>'
        outline = Outline(page)
        assert [one[0] for one in outline.elements] == ["script", "/", "p"]
        assert json.loads(outline.scripts[0]) == {text: [text]}


def test_the_screen_gets_no_orders_to_the_terminal(made: Made, tmp_path: Path) -> None:
    for text in TOGETHER:
        ship = made("mariner", text)
        done = tank2sim("convert", ship.card.source, "--to", "abkowitz", "-o", "x.toml", cwd=tmp_path)
        assert done.returncode == 0 and len(done.stdout.split("\n")) == 3
        assert done.stdout.replace("\n", "").isprintable()


def test_pictures_stay_in_their_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from dataclasses import dataclass

    from tank2sim.answer.result import Result
    from tank2sim.cli.console import write_outputs

    @dataclass(frozen=True)
    class Nothing:
        notices: tuple[str, ...] = ()

    @dataclass(frozen=True, eq=False, repr=False)
    class Drawn(Result[Nothing]):
        """A result whose charts have names from outside."""

        study: Nothing
        title = ""
        headline, sections = (), ()
        chart_names = ("10/10 zigzag",)

        def pictures(self) -> dict[str, bytes]:
            return dict.fromkeys(["../../MARK", "/MARK", "10/10 zigzag", "a\nb", ".."], b"\x89PNG")

        def page(self) -> str:
            return "<!doctype html>"

    folder = tmp_path / "a" / "b"
    folder.parent.mkdir()
    write_outputs(Drawn(Nothing()), {}, [], page=None, plot=folder, json=None)
    assert [path for path in tmp_path.rglob("*") if path.is_file() and path.parent != folder] == []
    assert len(list(folder.iterdir())) == 6
