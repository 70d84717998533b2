"""Commands by name: verbs of the core, and by entry points commands of the apps and of other packages."""

from __future__ import annotations

from typing import Any

from tank2sim.api.verbs import Verb
from tank2sim.plugins import Registry

CORE = {
    "audit": "tank2sim.api.audit:audit",
    "autopilot": "tank2sim.api.autopilot:autopilot",
    "check": "tank2sim.api.fmu:check_fmu",
    "compare": "tank2sim.api.validation:compare",
    "export": "tank2sim.api.fmu:make_fmu_file",
    "gap": "tank2sim.api.gap:find_gap",
    "identify": "tank2sim.api.identification:identify",
    "influence": "tank2sim.api.influence:find_influence",
    "open": "tank2sim.api.report:open_page",
    "reduce": "tank2sim.api.reduction:reduce",
    "report": "tank2sim.api.report:make_report",
    "run": "tank2sim.api.captive_run:reduce_runs",
    "ships": "tank2sim.api.bundled_ships:list_ships",
    "simulate": "tank2sim.api.manoeuvre:simulate_manoeuvre",
    "stability": "tank2sim.api.stability:judge_stability",
    "validate": "tank2sim.api.validation:validate",
}
"""Commands of the core, and their functions."""


def _verb_of(function: Any) -> Any:
    return getattr(function, "verb", function)


VERBS: Registry[Verb] = Registry("tank2sim.commands", CORE, Verb, value_of=_verb_of)
"""All commands; a function with :func:`tank2sim.api.verbs.verb` is what an entry point gives."""

VARIANTS: Registry[Verb] = Registry("tank2sim.variants", {}, Verb, value_of=_verb_of)
"""Further variants of commands by ``command.flag``: an app or a package adds its question to a command of the core."""


def variants_of(command: Verb) -> dict[str, Verb]:
    """Variants of a command by flag; those that take a kind of first argument come first."""
    own = {flag: _verb_of(function) for flag, function in command.variants.items()}
    added = {name.partition(".")[2]: VARIANTS[name] for name in VARIANTS if name.startswith(f"{command.name}.")}
    return dict(sorted((own | added).items(), key=lambda item: item[1].takes is None))
