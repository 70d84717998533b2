"""From what a towing tank or a sea trial measured to a verified ship model inside a simulator.

``import tank2sim as t2s`` gives the names of :data:`__all__`; each is imported when it is first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tank2sim.api.audit import AuditResult, audit
    from tank2sim.api.autopilot import AutopilotResult
    from tank2sim.api.bridge import PilotCardResult, PosterResult
    from tank2sim.api.bundled_ships import ShipsResult
    from tank2sim.api.comparison import ComparisonResult, compare
    from tank2sim.api.convention import ConventionResult, convention
    from tank2sim.api.conversion import ConversionResult, convert
    from tank2sim.api.craft_identification import CraftIdentificationResult, identify_craft
    from tank2sim.api.demo import DemoResult, run_demo
    from tank2sim.api.design import CampaignDesignResult, TrialDesignResult, design_campaign, design_trial
    from tank2sim.api.fmu import CheckResult, ExportResult, check_fmu
    from tank2sim.api.gap import GapResult, find_gap
    from tank2sim.api.glide import GlideResult
    from tank2sim.api.guess import GuessResult, guess
    from tank2sim.api.identification import IdentificationResult, identify
    from tank2sim.api.influence import InfluenceResult, TuningResult
    from tank2sim.api.log import LogResult, log
    from tank2sim.api.manoeuvre import ManoeuvreResult
    from tank2sim.api.mmg_reduction import MmgReductionResult, reduce_to_mmg
    from tank2sim.api.reduction import ReductionResult, reduce
    from tank2sim.api.report import ReportResult, make_report
    from tank2sim.api.result import Result, ResultTable
    from tank2sim.api.schemas import json_schema
    from tank2sim.api.ship import Ship, load, ships
    from tank2sim.api.signals import SignalsResult, signals
    from tank2sim.api.stability import StabilityResult
    from tank2sim.api.steering_models import SteeringModelsResult, steering_models
    from tank2sim.api.steering_page import SteeringPageResult
    from tank2sim.api.tow import TowResult, tow
    from tank2sim.api.trial import TrialRecord, read_trial
    from tank2sim.api.turn_tuning import TurnTuningResult
    from tank2sim.api.validation import ValidationResult, validate
    from tank2sim.api.yaw import YawResult, simulate_yaw, yaw
    from tank2sim.errors import InputError

__version__ = "0.1.0"

_HOMES = {
    "AuditResult": "api.audit",
    "AutopilotResult": "api.autopilot",
    "CampaignDesignResult": "api.design",
    "CaptiveRunResult": "api.captive_run",
    "CheckResult": "api.fmu",
    "ComparisonResult": "api.comparison",
    "ConventionResult": "api.convention",
    "ConversionResult": "api.conversion",
    "CraftIdentificationResult": "api.craft_identification",
    "DemoResult": "api.demo",
    "ExportResult": "api.fmu",
    "GapResult": "api.gap",
    "GlideResult": "api.glide",
    "GuessResult": "api.guess",
    "IdentificationResult": "api.identification",
    "InfluenceResult": "api.influence",
    "InputError": "errors",
    "LogResult": "api.log",
    "ManoeuvreResult": "api.manoeuvre",
    "MmgReductionResult": "api.mmg_reduction",
    "PilotCardResult": "api.bridge",
    "PosterResult": "api.bridge",
    "ReductionResult": "api.reduction",
    "ReportResult": "api.report",
    "Result": "api.result",
    "ResultTable": "api.result",
    "Ship": "api.ship",
    "ShipsResult": "api.bundled_ships",
    "SignalsResult": "api.signals",
    "StabilityResult": "api.stability",
    "SteeringModelsResult": "api.steering_models",
    "SteeringPageResult": "api.steering_page",
    "TowResult": "api.tow",
    "TrialDesignResult": "api.design",
    "TrialRecord": "api.trial",
    "TuningResult": "api.influence",
    "TurnTuningResult": "api.turn_tuning",
    "ValidationResult": "api.validation",
    "YawResult": "api.yaw",
    "audit": "api.audit",
    "check_fmu": "api.fmu",
    "compare": "api.comparison",
    "convention": "api.convention",
    "convert": "api.conversion",
    "design_campaign": "api.design",
    "design_trial": "api.design",
    "find_gap": "api.gap",
    "guess": "api.guess",
    "identify": "api.identification",
    "identify_craft": "api.craft_identification",
    "json_schema": "api.schemas",
    "load": "api.ship",
    "log": "api.log",
    "make_report": "api.report",
    "read_trial": "api.trial",
    "reduce": "api.reduction",
    "reduce_runs": "api.captive_run",
    "reduce_to_mmg": "api.mmg_reduction",
    "run_demo": "api.demo",
    "ships": "api.ship",
    "signals": "api.signals",
    "simulate_yaw": "api.yaw",
    "steering_models": "api.steering_models",
    "tow": "api.tow",
    "validate": "api.validation",
    "yaw": "api.yaw",
}

__all__ = [
    "AuditResult",
    "AutopilotResult",
    "CampaignDesignResult",
    "CaptiveRunResult",
    "CheckResult",
    "ComparisonResult",
    "ConventionResult",
    "ConversionResult",
    "CraftIdentificationResult",
    "DemoResult",
    "ExportResult",
    "GapResult",
    "GlideResult",
    "GuessResult",
    "IdentificationResult",
    "InfluenceResult",
    "InputError",
    "LogResult",
    "ManoeuvreResult",
    "MmgReductionResult",
    "PilotCardResult",
    "PosterResult",
    "ReductionResult",
    "ReportResult",
    "Result",
    "ResultTable",
    "Ship",
    "ShipsResult",
    "SignalsResult",
    "StabilityResult",
    "SteeringModelsResult",
    "SteeringPageResult",
    "TowResult",
    "TrialDesignResult",
    "TrialRecord",
    "TuningResult",
    "TurnTuningResult",
    "ValidationResult",
    "YawResult",
    "audit",
    "check_fmu",
    "compare",
    "convention",
    "convert",
    "design_campaign",
    "design_trial",
    "find_gap",
    "guess",
    "identify",
    "identify_craft",
    "json_schema",
    "load",
    "log",
    "make_report",
    "read_trial",
    "reduce",
    "reduce_runs",
    "reduce_to_mmg",
    "run_demo",
    "ships",
    "signals",
    "simulate_yaw",
    "steering_models",
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
