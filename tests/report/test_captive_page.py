"""The page of a reduction says what the reduction found."""

from __future__ import annotations

import pytest

import tank2sim as t2s
from tank2sim.answer.page import render_page


@pytest.mark.slow
def test_every_derivative_and_chart_of_a_campaign_is_on_its_page(data, tmp_path) -> None:
    found = t2s.reduce(data / "data" / "pmm_synthetic_11" / "campaign.toml")
    card, charts, page = found.contents, found.charts(), found.layout()
    (table,) = page.sections[0].tables
    shown = {row[0]: (row[1], row[2]) for row in table.rows}
    assert shown == {name: (1e5 * e.value, 1e5 * e.standard_error) for name, e in card.entries.items()}
    assert sum(len(section.charts) for section in page.sections) == len(charts) >= 6
    against = [section for section in page.sections if "against motion" in section.heading]
    assert against and all(section.charts and "95 % band" in section.text for section in against)
    text = render_page(page)
    assert "Yvdot" in text and text.count("<script src") == 0
    found.to_json(tmp_path / "reduced.json")
    assert t2s.make_report(tmp_path / "reduced.json").page() == text
