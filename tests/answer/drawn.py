"""Data that a chart draws, read from its specification."""

from __future__ import annotations

from typing import Any

from tank2sim.answer.charts.picture import chart_specification


def rows_of(chart: Any) -> list[dict[str, Any]]:
    """All rows of data of a chart."""
    return [row for rows in chart_specification(chart)["datasets"].values() for row in rows]


def rows(specification: dict[str, Any], layer: dict[str, Any]) -> list[dict[str, Any]]:
    """Rows of data of one layer of a specification."""
    found: list[dict[str, Any]] = specification["datasets"][layer["data"]["name"]]
    return found


def rows_of_layer(chart: Any, number: int = 0) -> list[dict[str, Any]]:
    """Rows of data of a layer of a chart of one panel, by its number."""
    specification = chart_specification(chart)
    return rows(specification, specification["layer"][number])


def line(chart: Any, up: str, run: str | None = None) -> list[float]:
    """Values of one line in its order."""
    rows = {row["i"]: row[up] for row in rows_of(chart) if {up, "i"} <= set(row) and run in (None, row.get("run"))}
    return [rows[place] for place in sorted(rows)]


def whole_panel(chart: Any, number: int) -> list[dict[str, Any]]:
    """Rows of all layers of one of the panels under each other."""
    specification = chart_specification(chart)
    layers = specification["vconcat"][number]["layer"]
    return [row for layer in layers for row in rows(specification, layer)]


def panels(chart: Any) -> dict[str, list[dict[str, Any]]]:
    """Title of each panel to the rows of its first layer."""
    specification = chart_specification(chart)
    found = {}
    for panel in specification["vconcat"]:
        title = panel["layer"][0]["encoding"]["y"]["title"]
        found[title] = rows(specification, panel["layer"][0])
    return found
