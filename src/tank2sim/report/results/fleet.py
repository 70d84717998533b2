"""The page of a fleet from its ``fleet.json`` alone, which may lie far from the pages of the ships."""

from __future__ import annotations

from dataclasses import replace

from tank2sim.gap.fleet.summary import REPORT_FILE, FleetSummary, ShipSummary
from tank2sim.report.gap.fleet_page import fleet_page
from tank2sim.report.kit.json_values import Json
from tank2sim.report.kit.page import Link, Page, PageSection, PageTable

_WHERE = f"Each ship has a page of its own, {REPORT_FILE}, in the folder of its name next to fleet.json."


def told_fleet_page(result: Json) -> Page:
    """The fleet's own page, the ships by the names of their folders without ways to their pages."""
    names = ("name", "verdict", "misfit", "trials", "fault")
    ships = tuple(
        ShipSummary(
            folder=one["folder"],
            effects=tuple(one.get("effects") or ()),
            alternatives=tuple(one.get("alternatives") or ()),
            **{name: one[name] for name in names if name in one},
        )
        for one in result["ships"]
    )
    page = fleet_page(FleetSummary(name=str(result["fleet"]), ships=ships, notices=tuple(result.get("notices") or ())))
    return replace(page, sections=[_without_links(section) for section in page.sections])


def _without_links(section: PageSection) -> PageSection:
    tables = [_plain(table) for table in section.tables]
    linked = any(isinstance(cell, Link) for table in section.tables for row in table.rows for cell in row)
    text = f"{section.text} {_WHERE}".strip() if linked else section.text
    return replace(section, text=text, tables=tables)


def _plain(table: PageTable) -> PageTable:
    rows = [[cell.text if isinstance(cell, Link) else cell for cell in row] for row in table.rows]
    return replace(table, rows=rows)
