"""The audit of trials: what is wrong with the data, found by consistency alone."""

from tank2sim.records.audit.finding import Finding
from tank2sim.records.audit.noise import estimated_noise
from tank2sim.records.audit.run import audit, audited, mended

__all__ = ["Finding", "audit", "audited", "estimated_noise", "mended"]
