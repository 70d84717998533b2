"""Which command wrote a result, told by its keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tank2sim.errors import InputError


@dataclass(frozen=True)
class Kind:
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

KINDS = (
    Kind("The missing effect", ("verdict", "could_hide"), beside=_BESIDE_GAP),
    Kind("Simulated manoeuvre", ("ship", "manoeuvre", "figures"), ("manoeuvre",)),
    Kind("Stability", ("stability_criterion", "nomoto"), ("stability_criterion.stable", "stability_criterion.C_prime")),
    Kind("Heading control", ("ship", "design", "gains"), ("design", "margins.at_design.phase_margin_deg")),
    Kind("Influence coefficients", ("influence_percent",), ()),
    Kind("Captive tests", ("campaign", "derivatives"), ("test.speed_mps",)),
    Kind("Coefficients from trials", ("method", "derivatives", "misfit"), ("method",)),
    Kind("Towed vehicle", ("tows", "methods", "mass_kg"), ("readings",)),
    Kind("Yaw rig", ("records", "added_inertia_kgm2"), ()),
    Kind("Audit of trials", ("findings", "trials"), ()),
    Kind("FMU: export", ("platforms", "size_bytes"), ("fmi", "size_bytes")),
    Kind("FMU: check", ("validation", "max_error"), ("passed",)),
    Kind("Underwater glider", ("glider", "states"), ()),
    Kind("Steering catalogue", ("ship", "steady_turns", "manoeuvres"), ()),
    Kind("Tuning to two turns", ("hull_factor", "rudder_factor"), ("hull_factor", "rudder_factor")),
    Kind("Fleet", ("fleet", "ships"), ()),
    Kind("Bundled ships", ("ships",), ()),
    Kind("From tests to a checked simulator", ("towed_vehicle", "mariner"), ()),
    Kind("Cards compared", ("cards", "coefficients", "trials"), ("summary",)),
    Kind("Validation", ("verification", "counts", "figures"), ("verdict",)),
    Kind("Bridge", ("turning_circles_deep", "telegraph"), ("rudder_deg",)),
    Kind("Signals", ("trials", "spectra"), ()),
    Kind("Signals", ("trials", "filter"), ()),
    Kind("Signals", ("trials",), ()),
)
"""The results that are known, those with more particular keys first."""


def kind_of(result: Any, source: str) -> Kind:
    """Which command wrote a result.

    Raises
    ------
    InputError
        It is no result of any.
    """
    if isinstance(result, Mapping):
        for kind in KINDS:
            if all(key in result for key in kind.keys):
                return kind
    remedy = "give what a command wrote with --json (or the gap.json of tank2sim gap)"
    raise InputError(source, "", "is no result of a tank2sim command", remedy)
