"""A warning on captive tests."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Caution:
    """A warning.

    Parameters
    ----------
    kind : str
        Subject, such as ``"frequency parameter"``.
    message : str
        One sentence, with figures and source.
    runs : tuple of str
        The runs concerned; empty for the whole campaign.
    missing : str
        The missing key that prevents the check; empty if the check was made.
    """

    kind: str
    message: str
    runs: tuple[str, ...] = ()
    missing: str = ""


def lacking(kind: str, what: str, key: str) -> Caution:
    """A caution on a check that lacks a key: the unknown, and the key."""
    return Caution(kind, f"Not known: {what}; give {key}.", missing=key)
