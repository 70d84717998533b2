"""One warning on captive tests."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Caution:
    """One warning.

    Parameters
    ----------
    kind : str
        What it is about, such as ``"frequency parameter"``.
    message : str
        One sentence, with figures and source.
    runs : tuple of str
        The runs concerned; empty if it is the campaign.
    missing : str
        The key without which the warning cannot be given; empty if it is given.
    """

    kind: str
    message: str
    runs: tuple[str, ...] = ()
    missing: str = ""


def lacking(kind: str, what: str, key: str) -> Caution:
    """A caution that cannot be given: what stays unknown, and the key it takes."""
    return Caution(kind, f"Not known is {what}; it takes {key}.", missing=key)
