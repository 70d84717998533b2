"""Notices of a result: sentences with a level, which decides where they are shown and how a command ends."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Any, Self

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema


class Level(StrEnum):
    """How much a notice limits the result: it explains, it calls for a second look, or the result has failed."""

    INFO = "info"
    CAUTION = "caution"
    STOP = "stop"


_HEADS = {Level.INFO: "", Level.CAUTION: "CHECK: ", Level.STOP: "FAILED: "}


class Notice(str):
    """A sentence to the user with its level; in JSON an object with `level` and `text`.

    Examples
    --------
    >>> notice = Notice("the trial ends before the ship has turned", Level.CAUTION)
    >>> notice.of("turn.csv").line
    'CHECK: turn.csv: the trial ends before the ship has turned'
    """

    level: Level

    def __new__(cls, text: str, level: Level = Level.INFO) -> Self:
        """Make a notice of a text."""
        notice = super().__new__(cls, text)
        notice.level = level
        return notice

    def of(self, subject: str) -> Notice:
        """The notice with its subject before it, a file or a part of the study."""
        return Notice(f"{subject}: {self}", self.level)

    @property
    def line(self) -> str:
        """The notice as it is shown: its level in a word, then the text."""
        return f"{_HEADS[self.level]}{self}"

    @property
    def leads(self) -> bool:
        """Whether the notice is shown before the result itself."""
        return self.level is not Level.INFO

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        keys = {"level": handler(Level), "text": core_schema.str_schema()}
        values = core_schema.typed_dict_schema(
            {key: core_schema.typed_dict_field(schema) for key, schema in keys.items()}, extra_behavior="forbid"
        )
        return core_schema.no_info_after_validator_function(
            lambda read: cls(**read),
            values,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda notice: {"level": notice.level, "text": str(notice)}, return_schema=values
            ),
        )


def caution(text: str) -> Notice:
    """Return a notice of a result that needs a second look: its data do not carry it, or contradict each other."""
    return Notice(text, Level.CAUTION)


def foremost(texts: Iterable[object]) -> list[Notice]:
    """Return the notices that are shown before the result, each once, the most serious first."""
    found = dict.fromkeys(text for text in texts if isinstance(text, Notice) and text.leads)
    return sorted(found, key=lambda notice: notice.level is not Level.STOP)
