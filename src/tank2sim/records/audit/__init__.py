"""The audit of trials: what is wrong with the data, found by consistency alone."""

from tank2sim.records.audit.finding import Finding
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.audit.run import audit, audit_and_repair, repair_trial

__all__ = ["Finding", "audit", "audit_and_repair", "record_noise", "repair_trial"]
