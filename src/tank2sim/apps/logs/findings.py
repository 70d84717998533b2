"""Findings: what the reader of a log must know of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from tank2sim.arrays import Number


@dataclass(frozen=True)
class LogFinding:
    """Something that the reader of a log must know.

    Parameters
    ----------
    kind : str
        ``fault``: the log or a stream is not what it seems, and the result is marked; ``note``: a gap, lost sentences.
    text : str
        One sentence.
    stream : str
        The stream or channel that it is about; empty if it is the log as a whole.
    evidence : mapping
        Figures, the unit in the name.
    """

    kind: str
    text: str
    stream: str = ""
    evidence: Mapping[str, Number] = field(default_factory=dict)


def note(text: str, stream: str = "", **evidence: float) -> LogFinding:
    """A finding on a `stream`, or on the log as a whole, with `evidence`; the result stays as it is."""
    return LogFinding("note", text, stream, evidence)


def fault(text: str, stream: str = "", **evidence: float) -> LogFinding:
    """A finding on a `stream`, or on the log as a whole, with `evidence`, that marks the result."""
    return LogFinding("fault", text, stream, evidence)


def not_used(words: str, kinds: Mapping[str, int]) -> list[LogFinding]:
    """A note that counts what was not used, `words` are ``sentences`` or such, by `kinds`; none without any."""
    listed = ", ".join(f"{number} {kind}" for kind, number in sorted(kinds.items()))
    return [LogFinding("note", f"{words} that are not used: {listed}", evidence=dict(kinds))] if kinds else []


def merged_findings(findings: Iterable[LogFinding]) -> list[LogFinding]:
    """Findings; several streams with the same one are counted in a single finding."""
    groups: dict[str, list[LogFinding]] = {}
    for finding in findings:
        key = finding.text.removeprefix(f"{finding.stream}: ") if finding.stream else finding.text
        groups.setdefault(key, []).append(finding)
    return [
        group[0] if len(group) == 1 else replace(group[0], text=f"{len(group)} streams: {key}", stream="")
        for key, group in groups.items()
    ]
