"""Public names of tank2sim, each imported when it is first used."""

from .answer.parts import Table as Table
from .answer.result import Result as Result
from .api.audit import audit as audit
from .api.captive_run import reduce_runs as reduce_runs
from .api.fmu import check_fmu as check_fmu
from .api.gap import find_gap as find_gap
from .api.identification import identify as identify
from .api.reduction import reduce as reduce
from .api.reduction import reduce_to_mmg as reduce_to_mmg
from .api.report import make_report as make_report
from .api.results import json_schema as json_schema
from .api.trial import TrialRecord as TrialRecord
from .api.trial import read_trial as read_trial
from .api.validation import compare as compare
from .api.validation import validate as validate
from .apps.ardupilot.command import serve as serve
from .apps.ardupilot.result import ServeResult as ServeResult
from .apps.bridge.result import PilotCardResult as PilotCardResult
from .apps.bridge.result import PosterResult as PosterResult
from .apps.demo.command import run_demo as run_demo
from .apps.demo.result import DemoResult as DemoResult
from .apps.design.command import (
    design_campaign as design_campaign,
)
from .apps.design.command import (
    design_trial as design_trial,
)
from .apps.design.result import CampaignDesignResult as CampaignDesignResult
from .apps.design.result import TrialDesignResult as TrialDesignResult
from .apps.fleet.command import find_gaps as find_gaps
from .apps.fleet.result import FleetResult as FleetResult
from .apps.guess.command import guess as guess
from .apps.guess.result import GuessResult as GuessResult
from .apps.logs.command import log as log
from .apps.logs.result import LogResult as LogResult
from .apps.programs.convention import convention as convention
from .apps.programs.convention_result import ConventionResult as ConventionResult
from .apps.programs.convert import convert as convert
from .apps.programs.convert_result import ConversionResult as ConversionResult
from .apps.rigs.glider.result import GlideResult as GlideResult
from .apps.rigs.tow.command import tow as tow
from .apps.rigs.tow.result import TowResult as TowResult
from .apps.rigs.yaw.command import simulate_yaw as simulate_yaw
from .apps.rigs.yaw.command import yaw as yaw
from .apps.rigs.yaw.result import YawResult as YawResult
from .apps.signals.command import signals as signals
from .apps.signals.result import SignalsResult as SignalsResult
from .apps.steering.result import SteeringPageResult as SteeringPageResult
from .apps.steering_cards.command import (
    steering_models as steering_models,
)
from .apps.steering_cards.result import SteeringModelsResult as SteeringModelsResult
from .apps.steering_cards.tuning_result import TurnTuningResult as TurnTuningResult
from .apps.trial_office.command import trial_office as trial_office
from .apps.trial_office.result import TrialOfficeResult as TrialOfficeResult
from .errors import InputError as InputError
from .results.audit import AuditResult as AuditResult
from .results.autopilot import AutopilotResult as AutopilotResult
from .results.autopilot import CraftAutopilotResult as CraftAutopilotResult
from .results.captive_run import CaptiveRunResult as CaptiveRunResult
from .results.comparison import ComparisonResult as ComparisonResult
from .results.craft_identification import (
    CraftIdentificationResult as CraftIdentificationResult,
)
from .results.fmu import CheckResult as CheckResult
from .results.fmu import ExportResult as ExportResult
from .results.gap import GapResult as GapResult
from .results.identification import IdentificationResult as IdentificationResult
from .results.influence import InfluenceResult as InfluenceResult
from .results.influence import TuningResult as TuningResult
from .results.manoeuvre import ManoeuvreResult as ManoeuvreResult
from .results.mmg_reduction import MmgReductionResult as MmgReductionResult
from .results.reduction import ReductionResult as ReductionResult
from .results.ships import ShipsResult as ShipsResult
from .results.stability import StabilityResult as StabilityResult
from .results.validation import ValidationResult as ValidationResult
from .ship import Ship as Ship
from .ship import load as load
from .ship import ships as ships

__version__: str
