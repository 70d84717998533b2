"""Writers of the logs that the tests make."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import pandas as pd
import pytest


@pytest.fixture
def saved(tmp_path: Path) -> Callable[..., Path]:
    """Writes a table as CSV, or lines as text, and returns the path."""

    def write(content: pd.DataFrame | Iterable[str], name: str = "voyage.csv") -> Path:
        path = tmp_path / name
        if isinstance(content, pd.DataFrame):
            content.to_csv(path, index=False)
        else:
            path.write_text("\n".join([*content, ""]), encoding="ascii")
        return path

    return write
