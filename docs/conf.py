"""The manual: Sphinx with MyST. Formulas become MathML when the pages are written, so that no page needs a network."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from docutils import nodes
from sphinx.application import Sphinx

from tank2sim import __version__

project = "tank2sim"
author = "the authors of tank2sim"
project_copyright = "MIT licence"
release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "mathml",
    "plain_docstrings",
    "generated",
    "pictures",
    "architecture",
]
myst_enable_extensions = ["attrs_block", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "auto"  # the notebooks have no outputs of their own; -D nb_execution_mode=off leaves them so
nb_execution_in_temp = True
nb_execution_timeout = 300
nb_execution_raise_on_error = True
html_math_renderer = "mathml"
math_number_all = False

default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_default_options = {"members": True, "ignore-module-all": True}
python_use_unqualified_type_names = True
toc_object_entries = False
napoleon_google_docstring = False
napoleon_use_param = False  # types are words for people; each would be looked up as a name
napoleon_use_rtype = False
add_module_names = False

_LIVE = Path(__file__).parent / "live"  # what page_pictures.py wrote, if it was run
exclude_patterns = ["_build", "live", "packaging"]
html_extra_path = ["llms.txt", *([str(_LIVE)] if _LIVE.is_dir() else [])]
html_theme = "furo"
html_title = "tank2sim"
html_static_path = ["static"]
html_css_files = ["manual.css"]
html_copy_source = False
html_show_sphinx = False
pygments_style = "friendly"

# Short names of classes may be the same in two packages (Motion, Fit); a link by such a name is left to the reader.
suppress_warnings = ["ref.python"]


def _tables_of_the_program(app: Sphinx, tree: nodes.document) -> None:
    """Outputs with a table are marked: on a narrow screen they are scrolled, their lines not broken."""
    for block in tree.findall(nodes.literal_block):
        if "━" in block.astext():
            block["classes"].append("drawn")


def _thumbnails_open_pages(app: Sphinx, tree: nodes.document) -> None:
    """A thumbnail of the gallery leads to the page that it is of, if that is there."""
    for image in list(tree.findall(nodes.image)):
        path = Path(image["uri"])
        if path.parent.name == "pages" and (_LIVE / "pages" / f"{path.stem}.html").is_file():
            link = nodes.reference(refuri=f"pages/{path.stem}.html")
            image.replace_self(link)
            link += image


def setup(app: Sphinx) -> None:
    """What is done to every page."""
    app.connect("doctree-read", _thumbnails_open_pages)
    app.connect("doctree-read", _tables_of_the_program)
