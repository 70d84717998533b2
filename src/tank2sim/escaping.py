"""Text of others (names, sources, notes of a card) inside files of other languages: it never leaves its place there."""

from __future__ import annotations

import json
import re

from markupsafe import Markup


def one_line(text: str) -> str:
    """The text on one line, for a comment that ends with its line, a cell, or a screen.

    Whatever a reader may take for the end of a line or for an order to the terminal becomes a space: control and format
    characters, separators of lines and paragraphs, halves of characters.
    """
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def python_text(text: str) -> str:
    """The text within quotes of Python, single or triple, double ones: one line that ends no string."""
    return one_line(text).replace("\\", "\\\\").replace('"', '\\"')


def xml_text(text: str) -> str:
    """The text without characters that XML 1.0 cannot hold (control characters, surrogates), a space for each."""
    return re.sub(r"[^\t\n\r\x20-\uD7FF\uE000-\uFFFD\U00010000-\U0010FFFF]", " ", text)


def xml_comment(text: str) -> str:
    """The text within a comment of XML, which it neither ends nor makes invalid."""
    return re.sub("-(?=-|$)", "- ", xml_text(one_line(text)))


def json_in_html(value: object) -> Markup:
    """Return the JSON of a value, for a script element of a page."""
    # Inside <script> the reader of HTML looks for "</script" and "<!--" even within strings of JSON.
    text = json.dumps(value, allow_nan=False, sort_keys=True, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def file_name(name: str) -> str:
    """A name of a file that resembles `name`, and that leads to no other folder."""
    plain = re.sub(r'[<>:"/\\|?*]', "_", one_line(name)).strip(". ")
    return plain or "_"


def c_comment(text: str) -> str:
    """The text within a comment of C, which it does not end: one line of ASCII without trigraphs."""
    plain = one_line(text).encode("ascii", "replace").decode("ascii")
    return re.sub(r"\?(?=\?)", "? ", plain.replace("\\", "/")).replace("*/", "* /").replace("/*", "/ *")
