"""Docstrings in plain English with formulas in plain text, made fit for Sphinx's markup.

An indented block is a formula or a table and stays as it is; a bar, a star or a trailing underscore outside of code is
itself and no markup.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref, pending_xref_condition
from sphinx.application import Sphinx

_CODE = re.compile(r"(``.+?``|:\w+(?::\w+)?:`[^`]+`|`[^`]+`)")
_MARKUP = re.compile(r"([|*]|(?<=\w)_(?!\w)|\\)")
_UNDERLINE = re.compile(r"^-{3,}$")


def plain(lines: list[str]) -> list[str]:
    """The lines of a docstring as reStructuredText, before numpydoc's sections are read."""
    done: list[str] = []
    literal = sections = False
    code_open = False
    for number, line in enumerate(lines):
        indented = line.startswith("    ")
        if number + 1 < len(lines) and _UNDERLINE.match(lines[number + 1]):
            sections = True
        if not sections and indented and not literal and done and not done[-1].strip():
            done += ["::", ""]
            literal = True
        elif literal and line.strip() and not indented:
            if done[-1].strip():
                done.append("")
            literal = False
        if literal:
            done.append(line)
            continue
        parts = re.split(r"(``)", line) if code_open or line.count("``") % 2 else None
        if parts is not None:  # code that runs on from one line to the next
            for place, part in enumerate(parts):
                if part == "``":
                    code_open = not code_open
                elif not code_open:
                    parts[place] = _escaped(part)
            done.append("".join(parts))
            continue
        done.append(_escaped(line))
    return done


def _escaped(line: str) -> str:
    pieces = _CODE.split(line)
    return "".join(piece if place % 2 else _MARKUP.sub(r"\\\1", piece) for place, piece in enumerate(pieces))


def _process(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    lines[:] = plain(lines)


def _forget_foreign_types(app: Sphinx, tree: nodes.document) -> None:
    """Types that are not of this package stay words: looking for each `float` takes half the time of a build."""
    for link in list(tree.findall(pending_xref)):
        if link.get("refdomain") != "py" or not link.get("refspecific"):
            continue
        if "tank2sim" in link["reftarget"]:
            link["refspecific"] = False  # its name is complete: no search
        else:
            short = [one for one in link.findall(pending_xref_condition) if one["condition"] == "resolved"]
            link.replace_self(short[0].children if short else link.children)


def setup(app: Sphinx) -> dict[str, bool]:
    """Ahead of napoleon, which has priority 500."""
    app.connect("autodoc-process-docstring", _process, priority=400)
    app.connect("doctree-read", _forget_foreign_types)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
