"""The tows of Table 1 of the paper, read once."""

from __future__ import annotations

import pytest

from tank2sim.apps.rigs.tow.records import Tows, read_tows
from tank2sim.bundled import bundled


@pytest.fixture(scope="package")
def table_1() -> Tows:
    return read_tows(bundled("models", "wilinski-zellman", "tows.csv"))
