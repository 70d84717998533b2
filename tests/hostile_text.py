"""Text that tries to leave its place in files of other languages, and cards that carry it; shared by several tests."""

from __future__ import annotations

import html.parser
import json
import re
from pathlib import Path

ENDS_OF_LINES = ("\n", "\r", "\r\n", "\x0b", "\x0c", "\x1c", "\x1d", "\x1e", "\x85", "\u2028", "\u2029")

HOSTILE = [
    *(f"Mariner{end}system('touch MARK');%{end}import os; MARK(){end}#" for end in ENDS_OF_LINES),
    "Mariner */ MARK(); /* ??/\n MARK ??=define ??/",
    "Mariner \"\"\" + MARK() + \"\"\" ' ''' MARK '''",
    'Mariner "); MARK(); // \\',
    "Mariner \\",
    'Mariner \\" \\\\" MARK "',
    "Mariner -- > --> <MARK/> <!-- ---> -----",
    "Mariner ]]> <![CDATA[ <MARK> ]]> &MARK; &#0; <?MARK ?>",
    "Mariner </script><script>MARK()</script> <!--<script> <img src=x onerror=MARK()>",
    "Mariner\n%{\nMARK\n%}\n",
    "%{",
    "Mariner\x00MARK\x1b]0;MARK\x07\x1b[2J\x7f\ufeff\u202eMARK\ufffe",
    "../../MARK",
    "/tmp/MARK/..",
    'M/V "A/B"',
    "$(touch MARK) `touch MARK` ; touch MARK | MARK & ${MARK} %MARK% {{ MARK }} {% MARK %} #{MARK}",
    "=MARK() +MARK @MARK",
    "class",
    "end",
    "math",
    "xdot",
    "w12",
    "con",
    "2",
    "船",
    "-",
    ".",
    "'",
    "M" * 300,
    '[ship]\nname = "MARK"\n',
]
"""Names of ships. MARK is what must never stand outside a comment or a text."""

TOGETHER = ["".join(HOSTILE[:11]), "".join(HOSTILE[11:]), "../../MARK", "\\", "class"]
"""The same at once, for what takes long."""


def hostile_card(path: Path, card: Path, text: str) -> Path:
    """A card of the ship of `card` with `text` as its name, source and notes, written without the program's writers."""
    quoted = json.dumps(text).replace("\x7f", "\\u007f")
    before, ship, after = re.split(
        r"(?m)(^\[ship\]\n(?:[^\[\n].*\n|\n)*)", card.read_text(encoding="utf-8"), maxsplit=1
    )
    ship = re.sub(r"(?m)^(name|source|notes) = .*$\n", "", ship)
    content = before + ship.rstrip() + f"\nname = {quoted}\nsource = {quoted}\nnotes = {quoted}\n\n" + after
    comment = "".join(letter if letter == "\t" or (letter >= " " and letter != "\x7f") else "?" for letter in text)
    path.write_text(re.sub(r"(?m)^(length_m = \S+).*$", lambda found: f"{found[1]}  # {comment}", content, count=1))
    return path


class Outline(html.parser.HTMLParser):
    """The elements of a page with the names of their attributes, and what its scripts hold."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[object] = []
        self.scripts: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, [name for name, _ in attrs if not name.startswith("class")]))
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag: str) -> None:
        self.elements.append(f"/{tag}")

    def handle_comment(self, data: str) -> None:
        self.elements.append("comment")

    def handle_decl(self, decl: str) -> None:
        self.elements.append("declaration")

    def unknown_decl(self, data: str) -> None:
        self.elements.append("unknown declaration")

    def handle_pi(self, data: str) -> None:
        self.elements.append("instruction")

    def handle_data(self, data: str) -> None:
        if self.lasttag == "script" and self.scripts and self.elements[-1] != "/script":
            self.scripts[-1] += data
