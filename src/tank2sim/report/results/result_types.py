"""Which command wrote a result: by its schema, and for files of versions without one by its keys."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tank2sim.errors import InputError


@dataclass(frozen=True)
class ResultType:
    """Results of one command.

    Parameters
    ----------
    command : str
        Which wrote it; ``poster`` stands for ``pilotcard``, too.
    title : str
        What it is, for the head of the page.
    keys : tuple of str
        What the JSON of this command has at its top, and that of no other has all of.
    headlines : tuple of str
        Paths of the values that the reader looks for first, with dots between keys; for those that are
        worked out see :mod:`tank2sim.report.results.headlines`.
    next to : str
        What the JSON has not, and where it is.
    """

    command: str
    title: str
    keys: tuple[str, ...]
    headlines: tuple[str, ...] = ()
    beside: str = ""


_BESIDE_GAP = (
    "Tracks and time histories are not in gap.json: they are in report.html, which tank2sim gap wrote next to it."
)

RESULT_TYPES = (
    ResultType("gap", "The missing effect", ("verdict", "could_hide"), beside=_BESIDE_GAP),
    ResultType("simulate", "Simulated manoeuvre", ("ship", "manoeuvre", "figures"), ("manoeuvre",)),
    ResultType(
        "stability",
        "Stability",
        ("stability_criterion", "nomoto"),
        ("stability_criterion.stable", "stability_criterion.C_prime"),
    ),
    ResultType(
        "autopilot", "Heading control", ("ship", "design", "gains"), ("design", "margins.at_design.phase_margin_deg")
    ),
    ResultType("influence", "Influence coefficients", ("influence_percent",), ()),
    ResultType("reduce", "Captive tests", ("campaign", "derivatives"), ("test.speed_mps",)),
    ResultType("identify", "Coefficients from trials", ("method", "derivatives", "misfit"), ("method",)),
    ResultType("tow", "Towed vehicle", ("tows", "methods", "mass_kg"), ("readings",)),
    ResultType("yaw", "Yaw rig", ("records", "added_inertia_kgm2"), ()),
    ResultType("audit", "Audit of trials", ("findings", "trials"), ()),
    ResultType("export", "FMU: export", ("platforms", "size_bytes"), ("fmi", "size_bytes")),
    ResultType("check", "FMU: check", ("validation", "max_error"), ("passed",)),
    ResultType("glide", "Underwater glider", ("glider", "states"), ()),
    ResultType("influence", "Steering catalogue", ("ship", "steady_turns", "manoeuvres"), ()),
    ResultType("influence", "Tuning to two turns", ("hull_factor", "rudder_factor"), ("hull_factor", "rudder_factor")),
    ResultType("gap", "Fleet", ("fleet", "ships"), ()),
    ResultType("ships", "Bundled ships", ("ships",), ()),
    ResultType("demo", "From tests to a checked simulator", ("towed_vehicle", "mariner"), ()),
    ResultType("compare", "Cards compared", ("cards", "coefficients", "trials"), ("summary",)),
    ResultType("validate", "Validation", ("verification", "counts", "figures"), ("verdict",)),
    ResultType("poster", "Bridge", ("turning_circles_deep", "telegraph"), ("rudder_deg",)),
    ResultType("signals", "Signals", ("trials", "spectra"), ()),
    ResultType("signals", "Signals", ("trials", "filter"), ()),
    ResultType("signals", "Signals", ("trials",), ()),
)
"""The results that are known, those with more particular keys first."""


_SCHEMA = re.compile(r"tank2sim/([a-z]+)/\d+")


def kind_of(result: Any, source: str) -> ResultType:
    """Which command wrote a result.

    Raises
    ------
    InputError
        It is no result of any.
    """
    if isinstance(result, Mapping):
        named = _SCHEMA.fullmatch(str(result.get("schema", "")))
        command = "poster" if named and named[1] == "pilotcard" else named and named[1]
        for kind in RESULT_TYPES:
            if command in (None, kind.command) and all(key in result for key in kind.keys):
                return kind
        if named:
            problem = f"says that it is a result of tank2sim {named[1]}, and lacks what such a result has"
            raise InputError(source, "schema", problem, "give the file as the command wrote it")
    remedy = "give what a command wrote with --json (or the gap.json of tank2sim gap)"
    raise InputError(source, "", "is no result of a tank2sim command", remedy)
