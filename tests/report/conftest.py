import pytest

from tank2sim.report.kit import charts as kit_charts
from tests.report.example import every_chart, example_page


@pytest.fixture(autouse=True)
def charts_are_checked_against_the_schema(monkeypatch):
    monkeypatch.setattr(kit_charts, "CHECKED_AGAINST_SCHEMA", True)


@pytest.fixture(scope="session")
def charts():
    return every_chart()


@pytest.fixture(scope="session")
def page():
    return example_page()
