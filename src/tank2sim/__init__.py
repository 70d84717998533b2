"""From what a towing tank or a sea trial measured to a verified ship model inside a simulator.

``import tank2sim as t2s`` gives the names of :data:`__all__`; each is imported when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tank2sim.api.audit import AuditResult, audit
    from tank2sim.api.comparison import ComparisonResult, compare
    from tank2sim.api.fmu import CheckResult, ExportResult, check_fmu
    from tank2sim.api.gap import GapResult, find_gap
    from tank2sim.api.identification import IdentificationResult, identify
    from tank2sim.api.manoeuvre import ManoeuvreResult
    from tank2sim.api.reduction import ReductionResult, reduce
    from tank2sim.api.result import Result, ResultTable
    from tank2sim.api.schemas import json_schema
    from tank2sim.api.ship import Ship, load, ships
    from tank2sim.api.signals import SignalsResult, signals
    from tank2sim.api.stability import StabilityResult
    from tank2sim.api.tow import TowResult, tow
    from tank2sim.api.trial import TrialRecord, read_trial
    from tank2sim.api.validation import ValidationResult, validate
    from tank2sim.api.yaw import YawResult, simulate_yaw, yaw
    from tank2sim.errors import InputError

__version__ = "0.1.0"

_HOMES = {
    "AuditResult": "api.audit",
    "CheckResult": "api.fmu",
    "ComparisonResult": "api.comparison",
    "ExportResult": "api.fmu",
    "GapResult": "api.gap",
    "IdentificationResult": "api.identification",
    "InputError": "errors",
    "ManoeuvreResult": "api.manoeuvre",
    "ReductionResult": "api.reduction",
    "Result": "api.result",
    "ResultTable": "api.result",
    "Ship": "api.ship",
    "SignalsResult": "api.signals",
    "StabilityResult": "api.stability",
    "TowResult": "api.tow",
    "TrialRecord": "api.trial",
    "ValidationResult": "api.validation",
    "YawResult": "api.yaw",
    "audit": "api.audit",
    "check_fmu": "api.fmu",
    "compare": "api.comparison",
    "find_gap": "api.gap",
    "identify": "api.identification",
    "json_schema": "api.schemas",
    "load": "api.ship",
    "read_trial": "api.trial",
    "reduce": "api.reduction",
    "ships": "api.ship",
    "signals": "api.signals",
    "simulate_yaw": "api.yaw",
    "tow": "api.tow",
    "validate": "api.validation",
    "yaw": "api.yaw",
}

__all__ = [
    "AuditResult",
    "CheckResult",
    "ComparisonResult",
    "ExportResult",
    "GapResult",
    "IdentificationResult",
    "InputError",
    "ManoeuvreResult",
    "ReductionResult",
    "Result",
    "ResultTable",
    "Ship",
    "SignalsResult",
    "StabilityResult",
    "TowResult",
    "TrialRecord",
    "ValidationResult",
    "YawResult",
    "audit",
    "check_fmu",
    "compare",
    "find_gap",
    "identify",
    "json_schema",
    "load",
    "read_trial",
    "reduce",
    "ships",
    "signals",
    "simulate_yaw",
    "tow",
    "validate",
    "yaw",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"tank2sim.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
