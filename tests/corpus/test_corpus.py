"""A corpus of 3 000 mutated inputs over all commands: no fault, no hang, no memory, and refusals that name the file.

A hundred of them run with every change, 400 more with ``-m slow``, all with ``-m long``. The jobs of a command are
numbered; a failure tells command and number, and ``python -m tests.corpus COMMAND NUMBER DIR`` writes its files.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.corpus.crew import Crew
from tests.corpus.jobs import SHARES, job
from tests.corpus.worker import MEMORY, Job, Outcome

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="memory is limited and measured by RLIMIT_DATA and /proc, as Linux has them"
)


@pytest.fixture(scope="session")
def crew() -> Iterator[Crew]:
    crew = Crew()
    yield crew
    crew.close()


def fault(each: Job, outcome: Outcome) -> str | None:
    """What is wrong with how a job ended; None if nothing is."""
    error, lines = outcome.error, outcome.error.strip().splitlines()
    if outcome.code not in each.exits or "a fault of the program" in error or "Traceback" in error:
        return f"fault (exit {outcome.code}): {error[-1500:]}"
    if "Warning" in error + outcome.screen:
        return f"a warning on the screen: {(error + outcome.screen)[-600:]}"
    if outcome.peak > MEMORY:
        return f"takes {outcome.peak / 2**30:.1f} GiB"
    if outcome.code == 2 and len(lines) != 1:
        return f"refused in {len(lines)} lines: {error[-600:]}"
    if outcome.code == 2 and outcome.written:
        return f"refused, and left {outcome.written}: {error}"
    names = [Path(name).name for name in each.files] + [each.changed]
    of_an_option = each.changed.startswith("--")  # its number is at fault, and no file
    if outcome.code == 2 and not of_an_option and not any(name in error for name in names):
        return f"the refusal names no input: {error}"
    return None


def check(crew: Crew, command: str, numbers: range) -> None:
    jobs = [job(command, number, crew.made) for number in numbers]
    outcomes = crew.all(jobs)
    print(command, len(jobs), dict(Counter(outcome.code for outcome in outcomes)))
    faults = [
        f"{each}\n  {reported}"
        for each, outcome in zip(jobs, outcomes, strict=True)
        if (reported := fault(each, outcome))
    ]
    assert not faults, f"{len(faults)} of {len(jobs)}:\n" + "\n".join(faults)


def part(command: str, of: int) -> int:
    """How many jobs of a command are in a slice of the corpus of this size; at least one."""
    return max(1, round(SHARES[command] * of / sum(SHARES.values())))


QUICK = [
    command
    for command in SHARES
    if command not in ("gap", "export", "check", "compare", "identify", "validate", "report")
]


def test_the_corpus_has_3000_jobs_and_they_are_the_same_again(crew: Crew) -> None:
    assert sum(SHARES.values()) == 3000
    assert [job("audit", number, crew.made) for number in range(20)] == [
        job("audit", number, crew.made) for number in range(20)
    ]


LENGTHY = ("autopilot", "design", "glide", "influence")


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(command, marks=[pytest.mark.slow, pytest.mark.essential] if command in LENGTHY else [])
        for command in QUICK
    ],
)
def test_a_hundred_bad_inputs(crew: Crew, command: str) -> None:
    check(crew, command, range(part(command, 110)))


@pytest.mark.slow
@pytest.mark.parametrize("command", SHARES)
def test_four_hundred_bad_inputs(crew: Crew, command: str) -> None:
    begin = part(command, 110)
    check(crew, command, range(begin, begin + part(command, 400)))


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("command", SHARES)
def test_three_thousand_bad_inputs(crew: Crew, command: str) -> None:
    check(crew, command, range(SHARES[command]))
