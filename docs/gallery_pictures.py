"""Runs the scripts of the manual's gallery and makes their pictures, ``docs/static/gallery/``.

Each picture is the one that its script draws, made smaller. ``python docs/gallery_pictures.py [NAME ...]`` makes all,
or those that are named; it needs Pillow.
"""

from __future__ import annotations

import contextlib
import re
import shutil
import sys
import tempfile
from pathlib import Path

PAGE = Path(__file__).parent / "gallery.md"
FOLDER = Path(__file__).parent / "static" / "gallery"
MODELS = Path(__file__).parent.parent / "models"
WIDTH_PX, COLOURS = 720, 64

_SCRIPT = re.compile(r"```python\n(.*?)```\n\n!\[[^\]]+\]\(static/gallery/(\w+)\.png\)", re.DOTALL)


def scripts() -> dict[str, str]:
    """Name of the picture to its script, in the order of the page."""
    return {name: code for code, name in _SCRIPT.findall(PAGE.read_text(encoding="utf-8"))}


def drawn(name: str, code: str, folder: Path) -> Path:
    """Run a script in a folder that has the bundled models; the picture that it writes."""
    if not (folder / "models").exists():
        shutil.copytree(MODELS, folder / "models")
    with contextlib.chdir(folder):
        exec(compile(code, name, "exec"), {})
    return folder / f"{name}.png"


def main(names: list[str]) -> None:
    """Make the pictures."""
    from PIL import Image

    FOLDER.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, code in scripts().items():
            if names and name not in names:
                continue
            with Image.open(drawn(name, code, Path(folder))) as picture:
                height = round(picture.height * WIDTH_PX / picture.width)
                small = picture.convert("RGB").resize((WIDTH_PX, height), Image.Resampling.LANCZOS)
            small.quantize(COLOURS).save(FOLDER / f"{name}.png", optimize=True)
            print(name, (FOLDER / f"{name}.png").stat().st_size)


if __name__ == "__main__":
    main(sys.argv[1:])
