"""The audit of trials: what is wrong with the data, found by consistency alone."""

from tank2sim.records.audit.finding import Finding
from tank2sim.records.audit.noise import record_noise
from tank2sim.records.audit.run import audit_and_repair, audit_trial, repair_trial

__all__ = ["Finding", "audit_and_repair", "audit_trial", "record_noise", "repair_trial"]
