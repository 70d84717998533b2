"""A model as a Functional Mock-up Unit: interface, C generation, packaging, verification."""

from tank2sim.fmu.check import CheckReport, check_fmu
from tank2sim.fmu.export import Documents, ExportedFmu, write_fmu
from tank2sim.fmu.unpacking import embedded_card

__all__ = ["CheckReport", "Documents", "ExportedFmu", "check_fmu", "embedded_card", "write_fmu"]
