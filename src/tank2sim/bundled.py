"""The one locator of what comes with the program: ``models/`` and ``fmu_templates/``.

In a checkout and an editable install both are at the root of the project; in a wheel they are inside the package.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_ROOTS = (_PACKAGE / "_bundled", _PACKAGE.parent.parent)


def bundled(*parts: str) -> Path:
    """Path of a bundled file or folder, for example ``bundled("models", "mariner", "ship.toml")``.

    Raises
    ------
    FileNotFoundError
        The installation is damaged: the file is in neither place.
    """
    for root in _ROOTS:
        path = root.joinpath(*parts)
        if path.exists():
            return path
    raise FileNotFoundError(f"tank2sim is not installed completely: {'/'.join(parts)} is missing; reinstall it")


def bundled_cards() -> dict[str, Path]:
    """The bundled cards: folder name (as used on the command line) to the path of its ``ship.toml``."""
    return {path.parent.name: path for path in sorted(bundled("models").glob("*/ship.toml"))}
