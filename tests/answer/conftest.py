import json

import pytest
from altair.utils.schemapi import SchemaBase

from tank2sim.answer.charts import picture as kit_charts
from tests.answer.example import every_chart, example_page


@pytest.fixture(autouse=True, scope="session")
def equal_charts_are_compared_with_the_schema_once():
    """What is equal to something that was valid is valid: most parts of charts, and many charts, are made again."""
    compare, valid = SchemaBase.validate, set()

    def validate(cls, instance, schema=None):
        one = (cls, json.dumps(instance, default=str), schema is None)
        if one not in valid:
            compare.__func__(cls, instance, schema)
            if schema is None:
                valid.add(one)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SchemaBase, "validate", classmethod(validate))
        yield


@pytest.fixture(autouse=True)
def charts_are_checked_against_the_schema(monkeypatch):
    monkeypatch.setattr(kit_charts, "CHECKED_AGAINST_SCHEMA", True)


@pytest.fixture(scope="session")
def charts():
    return every_chart()


@pytest.fixture(scope="session")
def page():
    return example_page()
