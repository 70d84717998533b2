"""A model as a Functional Mock-up Unit: interface, C generation, packaging, verification."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tank2sim.fmu.check import CheckReport, compare_with_model
    from tank2sim.fmu.documents import Documents
    from tank2sim.fmu.export import ExportedFmu, write_fmu
    from tank2sim.fmu.unpacking import embedded_card

__all__ = ["CheckReport", "Documents", "ExportedFmu", "compare_with_model", "embedded_card", "write_fmu"]

_MODULES = {
    **dict.fromkeys(("CheckReport", "check_fmu"), "check"),
    "Documents": "documents",
    **dict.fromkeys(("ExportedFmu", "write_fmu"), "export"),
    "embedded_card": "unpacking",
}


def __getattr__(name: str) -> object:
    """Imported when it is asked for: the processes that drive an FMU need neither CasADi nor the cards."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
