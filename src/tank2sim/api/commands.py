"""Commands by name: verbs of the core, and by entry points those of the apps and of other packages."""

from __future__ import annotations

from typing import Any

from tank2sim.api.verbs import Verb
from tank2sim.plugins import Registry

CORE = {
    "audit": "tank2sim.api.audit:audit",
    "autopilot": "tank2sim.api.autopilot:autopilot",
    "check": "tank2sim.api.fmu:check_fmu",
    "compare": "tank2sim.api.comparison:compare",
    "export": "tank2sim.api.fmu:make_fmu_file",
    "reduce": "tank2sim.api.reduction:reduce",
    "report": "tank2sim.api.report:make_report",
    "ships": "tank2sim.api.bundled_ships:list_ships",
    "validate": "tank2sim.api.validation:validate",
}
"""Commands of the core, and their functions."""


def _verb_of(function: Any) -> Any:
    return getattr(function, "verb", function)


VERBS: Registry[Verb] = Registry("tank2sim.commands", CORE, Verb, value_of=_verb_of)
"""All commands; a function with :func:`tank2sim.api.verbs.verb` is what an entry point gives."""
