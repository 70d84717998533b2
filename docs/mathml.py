"""Formulas as MathML, which browsers show by themselves; MathJax and KaTeX would need a network or 2 MB of script.

The translation is that of Docutils; two of its habits are corrected here. What it does not know is a warning with the
place of the formula, which ends a strict build.
"""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

logger = logging.getLogger(__name__)

_NAMESPACE = "http://www.w3.org/1998/Math/MathML"
_ACCENTS = frozenset("ˆ˙¨ˉ˜¯´`ˇ˘⃗→")
_APPLY = "\N{FUNCTION APPLICATION}"
_THIN = "0.1667em"  # of TeX, about the name of a function

ElementTree.register_namespace("", _NAMESPACE)


def mathml(formula: str, node: nodes.Node, block: bool) -> str:
    """The MathML of a formula; the formula itself as code, and a warning, where it is not understood."""
    try:
        return corrected(str(tex2mathml(formula, as_block=block)))
    except MathError as error:
        logger.warning("formula not understood: %s: %s", error, formula, location=node)
        return f"<code>{nodes.unescape(formula)}</code>"


def corrected(text: str) -> str:
    """MathML of Docutils with subscripts next to an accented symbol, not under it, and room about functions."""
    root = ElementTree.fromstring(text.replace("&ApplyFunction;", _APPLY))
    for element in list(root.iter()):
        if element.tag == _tag("mtable"):
            element.set("displaystyle", "true")  # fractions in an array of equations are as large as in one equation
        if element.tag == _tag("munderover") and (element[2].text or "") in _ACCENTS:
            _accented(element)
    for element in list(root.iter()):
        _give_room(element)
    return ElementTree.tostring(root, encoding="unicode")


def _tag(name: str) -> str:
    return f"{{{_NAMESPACE}}}{name}"


def _accented(element: Element) -> None:
    """A symbol with an accent above and something beneath becomes an accented symbol with a subscript."""
    symbol, below, accent = element
    element.tag = _tag("msub")
    element[:] = []
    over = SubElement(element, _tag("mover"), accent="true")
    over.extend((symbol, accent))
    element.append(below)


def _give_room(parent: Element) -> None:
    """Thin spaces as TeX has them: before the name of a function, and after it where no bracket opens."""
    children = list(parent)
    if not any(child.text == _APPLY for child in children):
        return
    spaced: list[Element] = []
    for place, child in enumerate(children):
        after = children[place + 1] if place + 1 < len(children) else None
        before = children[place - 1] if place else None
        named = after is not None and after.text == _APPLY
        if named and before is not None and before.text != _APPLY and (before.tag != _tag("mo") or before.text == ")"):
            spaced.append(Element(_tag("mspace"), width=_THIN))
        spaced.append(child)
        if child.text == _APPLY and after is not None and not _opens(after):
            spaced.append(Element(_tag("mspace"), width=_THIN))
    parent[:] = spaced


def _opens(element: Element) -> bool:
    first = element
    while first.tag == _tag("mrow") and len(first):
        first = first[0]
    return first.tag == _tag("mo") and first.text in ("(", "[", "{")


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(mathml(node.astext(), node, block=False))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(writer.starttag(node, "div", CLASS="math"))
    writer.body.append(mathml(node.astext(), node, block=True))
    if node["number"]:
        writer.body.append(f'<span class="eqno">({get_node_equation_number(writer, node)})</span>')
    writer.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Make this a renderer of formulas that ``html_math_renderer`` may name."""
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
