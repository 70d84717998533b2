"""The manual's gallery shows the pages that ``docs/page_pictures.py`` makes, each with the command that writes it."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from .examples import MANUAL


def test_the_gallery_has_each_page_with_its_command_and_picture() -> None:
    found = importlib.util.spec_from_file_location("page_pictures", MANUAL / "page_pictures.py")
    assert found is not None and found.loader is not None
    made = importlib.util.module_from_spec(found)
    found.loader.exec_module(made)
    text = (MANUAL / "pages.md").read_text(encoding="utf-8")
    shown = re.findall(r"\(static/pages/(\w+)\.png\)\n.*?`([^`]+)`", text)
    assert dict(shown) == made.PAGES
    assert all((MANUAL / "static" / "pages" / f"{stem}.png").is_file() for stem in made.PAGES)


def gallery() -> ModuleType:
    """The module that makes the pictures of the scripts."""
    found = importlib.util.spec_from_file_location("gallery_pictures", MANUAL / "gallery_pictures.py")
    assert found is not None and found.loader is not None
    made = importlib.util.module_from_spec(found)
    found.loader.exec_module(made)
    return made


def test_thirty_short_scripts_have_a_picture_each() -> None:
    text = (MANUAL / "gallery.md").read_text(encoding="utf-8")
    scripts = gallery().scripts()
    assert len(scripts) >= 30 and len(scripts) == text.count("```python") == text.count("![")
    pictures = {path.stem for path in (MANUAL / "static" / "gallery").glob("*.png")}
    assert pictures == set(scripts)
    for name, code in scripts.items():
        assert len(code.strip().splitlines()) <= 8 and code.count(f'.plot("{name}.png"') == 1, name


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=() if one == "zigzag" else pytest.mark.slow) for one in gallery().scripts()]
)
def test_a_script_of_the_gallery_draws_its_picture(name: str, tmp_path: Path) -> None:
    made = gallery()
    assert made.drawn(name, made.scripts()[name], tmp_path).read_bytes().startswith(b"\x89PNG")
