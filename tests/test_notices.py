"""Levels of notices: kept behind a subject, in a pickle and in JSON; the first lines and the exit code follow them."""

from __future__ import annotations

import pickle
from dataclasses import dataclass

import pytest

from tank2sim.answer.result import Result
from tank2sim.answer.study import read_study, study_schema, study_values
from tank2sim.notices import Level, Notice, caution, foremost

FAILED = Notice("errors beyond the limits", Level.STOP)
DOUBT = caution("the record is short")
REMARK = Notice("read from a.csv")


@dataclass(frozen=True)
class Study:
    notices: tuple[Notice, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Answer(Result[Study]):
    """A result that has notices alone."""

    study: Study
    title = "A study"
    headline = ("Done.",)
    sections = ()


@pytest.mark.parametrize("notice", [FAILED, DOUBT, REMARK])
def test_the_level_stays_behind_a_subject_and_in_a_pickle(notice: Notice) -> None:
    assert notice.of("a.csv") == f"a.csv: {notice}" and notice.of("a.csv").level is notice.level
    assert pickle.loads(pickle.dumps(notice)).level is notice.level


def test_json_has_level_and_text_and_is_read_back() -> None:
    values = study_values(Study((DOUBT, REMARK)))
    assert values["notices"][0] == {"level": "caution", "text": "the record is short"}
    again = read_study(Study, values, "study.json").notices
    assert [(notice, notice.level) for notice in again] == [(DOUBT, Level.CAUTION), (REMARK, Level.INFO)]
    described = study_schema(Study)["properties"]["notices"]["items"]
    assert set(described["properties"]) == {"level", "text"} == set(described["required"])


def test_a_stop_is_before_cautions_and_each_is_shown_once() -> None:
    assert foremost([REMARK, DOUBT, FAILED, DOUBT, "a cell", 1.0]) == [FAILED, DOUBT]
    assert repr(Answer(Study((REMARK, DOUBT, FAILED)))).splitlines() == [FAILED.line, DOUBT.line, "Done."]


@pytest.mark.parametrize(("notices", "code"), [((), 0), ((REMARK, DOUBT), 0), ((REMARK, FAILED), 1)])
def test_the_exit_code_follows_the_highest_level(notices: tuple[Notice, ...], code: int) -> None:
    assert Answer(Study(notices)).exit_code == code
