import pytest

from tests.report.example import every_chart, example_page


@pytest.fixture(scope="session")
def charts():
    return every_chart()


@pytest.fixture(scope="session")
def page():
    return example_page()
