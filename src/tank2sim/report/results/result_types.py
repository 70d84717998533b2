"""Which command wrote a result, told by its keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tank2sim.errors import InputError


@dataclass(frozen=True)
class ResultType:
    """Results of one command.

    Parameters
    ----------
    title : str
        What it is, for the head of the page.
    keys : tuple of str
        What the JSON of this command has at its top, and that of no other has all of.
    headlines : tuple of str
        Paths of the values that the reader looks for first, with dots between keys; for those that are
        worked out see :mod:`tank2sim.report.results.headlines`.
    beside : str
        What the JSON has not, and where it is.
    """

    title: str
    keys: tuple[str, ...]
    headlines: tuple[str, ...] = ()
    beside: str = ""


_BESIDE_GAP = (
    "Tracks and time histories are not in gap.json: they are in report.html, which tank2sim gap wrote beside it."
)

RESULT_TYPES = (
    ResultType("The missing effect", ("verdict", "could_hide"), beside=_BESIDE_GAP),
    ResultType("Simulated manoeuvre", ("ship", "manoeuvre", "figures"), ("manoeuvre",)),
    ResultType(
        "Stability", ("stability_criterion", "nomoto"), ("stability_criterion.stable", "stability_criterion.C_prime")
    ),
    ResultType("Heading control", ("ship", "design", "gains"), ("design", "margins.at_design.phase_margin_deg")),
    ResultType("Influence coefficients", ("influence_percent",), ()),
    ResultType("Captive tests", ("campaign", "derivatives"), ("test.speed_mps",)),
    ResultType("Coefficients from trials", ("method", "derivatives", "misfit"), ("method",)),
    ResultType("Towed vehicle", ("tows", "methods", "mass_kg"), ("readings",)),
    ResultType("Yaw rig", ("records", "added_inertia_kgm2"), ()),
    ResultType("Audit of trials", ("findings", "trials"), ()),
    ResultType("FMU: export", ("platforms", "size_bytes"), ("fmi", "size_bytes")),
    ResultType("FMU: check", ("validation", "max_error"), ("passed",)),
    ResultType("Underwater glider", ("glider", "states"), ()),
    ResultType("Steering catalogue", ("ship", "steady_turns", "manoeuvres"), ()),
    ResultType("Tuning to two turns", ("hull_factor", "rudder_factor"), ("hull_factor", "rudder_factor")),
    ResultType("Fleet", ("fleet", "ships"), ()),
    ResultType("Bundled ships", ("ships",), ()),
    ResultType("From tests to a checked simulator", ("towed_vehicle", "mariner"), ()),
    ResultType("Cards compared", ("cards", "coefficients", "trials"), ("summary",)),
    ResultType("Validation", ("verification", "counts", "figures"), ("verdict",)),
    ResultType("Bridge", ("turning_circles_deep", "telegraph"), ("rudder_deg",)),
    ResultType("Signals", ("trials", "spectra"), ()),
    ResultType("Signals", ("trials", "filter"), ()),
    ResultType("Signals", ("trials",), ()),
)
"""The results that are known, those with more particular keys first."""


def kind_of(result: Any, source: str) -> ResultType:
    """Which command wrote a result.

    Raises
    ------
    InputError
        It is no result of any.
    """
    if isinstance(result, Mapping):
        for kind in RESULT_TYPES:
            if all(key in result for key in kind.keys):
                return kind
    remedy = "give what a command wrote with --json (or the gap.json of tank2sim gap)"
    raise InputError(source, "", "is no result of a tank2sim command", remedy)
