"""``--set KEY=VALUE``: values in place of a card's."""

from __future__ import annotations

from collections.abc import Iterable

import tomlkit
from tomlkit.exceptions import TOMLKitError

from tank2sim.errors import InputError


def parse_changes(settings: Iterable[str]) -> dict[str, object]:
    """``("derivatives.Yv=-0.012", ...)`` as a mapping; a value is read as TOML, or is text if it is none.

    Raises
    ------
    InputError
        A setting has no key or no value.
    """
    changes: dict[str, object] = {}
    for setting in settings:
        key, sign, text = setting.partition("=")
        key, text = key.strip(), text.strip()
        if not sign or not all(key.split(".")) or not text:
            remedy = "give section.key=value, for example --set derivatives.Yv=-0.012"
            raise InputError("--set", setting, "is not of the form KEY=VALUE", remedy)
        try:
            changes[key] = tomlkit.parse(f"value = {text}").unwrap()["value"]
        except (TOMLKitError, ValueError, RecursionError):
            changes[key] = text
    return changes
