"""The manual's gallery shows the pages that ``docs/page_pictures.py`` makes, each with the command that writes it."""

from __future__ import annotations

import importlib.util
import re

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
