"""Public names of tank2sim, each imported when it is first used."""

from .answer.parts import Table as Table
from .answer.result import Result as Result
from .api.audit import audit as audit
from .api.captive_run import reduce_runs as reduce_runs
from .api.comparison import compare as compare
from .api.convention import convention as convention
from .api.conversion import convert as convert
from .api.demo import run_demo as run_demo
from .api.design import (
    design_campaign as design_campaign,
)
from .api.design import (
    design_trial as design_trial,
)
from .api.fmu import check_fmu as check_fmu
from .api.gap import find_gap as find_gap
from .api.gap import find_gaps as find_gaps
from .api.guess import guess as guess
from .api.identification import identify as identify
from .api.log import log as log
from .api.reduction import reduce as reduce
from .api.reduction import reduce_to_mmg as reduce_to_mmg
from .api.report import make_report as make_report
from .api.results import json_schema as json_schema
from .api.ship import Ship as Ship
from .api.ship import load as load
from .api.ship import ships as ships
from .api.signals import signals as signals
from .api.steering_models import (
    steering_models as steering_models,
)
from .api.tow import tow as tow
from .api.trial import TrialRecord as TrialRecord
from .api.trial import read_trial as read_trial
from .api.validation import validate as validate
from .api.yaw import simulate_yaw as simulate_yaw
from .api.yaw import yaw as yaw
from .errors import InputError as InputError
from .results.audit import AuditResult as AuditResult
from .results.autopilot import AutopilotResult as AutopilotResult
from .results.autopilot import CraftAutopilotResult as CraftAutopilotResult
from .results.bridge import PilotCardResult as PilotCardResult
from .results.bridge import PosterResult as PosterResult
from .results.captive_run import CaptiveRunResult as CaptiveRunResult
from .results.comparison import ComparisonResult as ComparisonResult
from .results.convention import ConventionResult as ConventionResult
from .results.conversion import ConversionResult as ConversionResult
from .results.craft_identification import (
    CraftIdentificationResult as CraftIdentificationResult,
)
from .results.demo import DemoResult as DemoResult
from .results.design import CampaignDesignResult as CampaignDesignResult
from .results.design import TrialDesignResult as TrialDesignResult
from .results.fmu import CheckResult as CheckResult
from .results.fmu import ExportResult as ExportResult
from .results.gap import GapResult as GapResult
from .results.gap_fleet import FleetResult as FleetResult
from .results.glide import GlideResult as GlideResult
from .results.guess import GuessResult as GuessResult
from .results.identification import IdentificationResult as IdentificationResult
from .results.influence import InfluenceResult as InfluenceResult
from .results.influence import TuningResult as TuningResult
from .results.log import LogResult as LogResult
from .results.manoeuvre import ManoeuvreResult as ManoeuvreResult
from .results.mmg_reduction import MmgReductionResult as MmgReductionResult
from .results.reduction import ReductionResult as ReductionResult
from .results.ships import ShipsResult as ShipsResult
from .results.signals import SignalsResult as SignalsResult
from .results.stability import StabilityResult as StabilityResult
from .results.steering_models import SteeringModelsResult as SteeringModelsResult
from .results.steering_page import SteeringPageResult as SteeringPageResult
from .results.tow import TowResult as TowResult
from .results.turn_tuning import TurnTuningResult as TurnTuningResult
from .results.validation import ValidationResult as ValidationResult
from .results.yaw import YawResult as YawResult

__version__: str
