"""Numbers that a paper prints beside those found: what the benchmarks of the five papers share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class Number(NamedTuple):
    """One number: what it is, as printed (or computed by others), as found, and whether it agrees."""

    what: str
    printed: float
    found: float
    verdict: str


@dataclass
class PaperNumbers:
    """Prints numbers one a line, and remembers them and those that should agree and do not."""

    numbers: list[Number] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    def __call__(self, what: str, printed: float, found: float, tolerance: float | None = None, why: str = "") -> None:
        """A number. With a tolerance (absolute) it must agree; without one, `why` tells what is known of it."""
        if tolerance is not None and not abs(found - printed) <= tolerance:
            self.failed.append(what)
            verdict = "DIFFERS"
        else:
            verdict = "agrees" if tolerance is not None else f"not reproduced: {why}" if why else ""
        self.numbers.append(Number(what, printed, found, verdict))
        print(f"  {what:58} {printed:13.6g} {found:13.6g}  {verdict}")

    def heading(self, words: str) -> None:
        """What the next numbers are of."""
        print(f"{words:60} {'expected':>13} {'found':>13}")

    def end(self) -> int:
        """Say what differs; the exit code."""
        print("all agree that should" if not self.failed else f"differ: {', '.join(self.failed)}")
        return 1 if self.failed else 0
