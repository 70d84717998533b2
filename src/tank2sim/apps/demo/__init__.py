"""The whole way on bundled data: five measured tows and the Mariner, from numbers on paper to verified FMUs."""

PAGE = "report.html"
"""Name of the page."""

DEMO_STEPS = 18
"""How often the demo reports the step that begins."""
