"""A model as a Functional Mock-up Unit: interface, C generation, packaging, verification."""

from tank2sim.fmu.export import CARD_IN_FMU, Documents, ExportedFmu, write_fmu

__all__ = ["CARD_IN_FMU", "Documents", "ExportedFmu", "write_fmu"]
