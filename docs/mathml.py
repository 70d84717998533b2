"""Formulas as MathML, which browsers show by themselves; MathJax and KaTeX would need a network or 2 MB of script.

The translation is that of Docutils. What it does not know is a warning with the place of the formula, which ends a
strict build.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

logger = logging.getLogger(__name__)


def mathml(formula: str, node: nodes.Node, block: bool) -> str:
    """The MathML of a formula; the formula itself as code, and a warning, where it is not understood."""
    try:
        # Fractions in an array of equations are as large as in one equation.
        return str(tex2mathml(formula, as_block=block)).replace("<mtable", '<mtable displaystyle="true"')
    except MathError as error:
        logger.warning("formula not understood: %s: %s", error, formula, location=node)
        return f"<code>{nodes.unescape(formula)}</code>"


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
