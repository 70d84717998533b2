"""Study of a captive campaign: derivatives, how they were found and how far they hold, and the data of its charts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tank2sim.arrays import Array, Number, Unbounded
from tank2sim.identification.captive.consistency import Asymmetry, Repeats, repeats
from tank2sim.identification.captive.harmonics import ReducedRun
from tank2sim.identification.captive.oscillation import CubicByTwoWays, OscillationDerivatives
from tank2sim.identification.captive.plot_data import ForcePlot, HarmonicsPlot, LoopPlot, reduction_plots
from tank2sim.identification.captive.reduction import ForceResult, Reduction, is_resistance, terms_of_heel
from tank2sim.identification.captive.regression import LeftOut
from tank2sim.identification.captive.result_card import Contents
from tank2sim.identification.captive.selection import Choice, Trend
from tank2sim.identification.captive.stepwise import Disagreement, Stepwise
from tank2sim.identification.captive.systematic import AlignmentEstimate, DelayEstimate, SystematicError
from tank2sim.identification.captive.uncertainty_budget import UncertaintyBudget, uncertainty_budget
from tank2sim.notices import Notice
from tank2sim.records.campaigns import Campaign

_SectionValues = dict[str, bool | float | str | list[str] | None]


@dataclass(frozen=True, kw_only=True)
class PrimeValue:
    """A prime value and its standard error."""

    value: float
    standard_error: float


@dataclass(frozen=True, kw_only=True)
class Stepped(PrimeValue):
    """A derivative by the paper's order, and the type of run behind it."""

    found_in: str


@dataclass(frozen=True, kw_only=True)
class ReducedDerivative(PrimeValue):
    """A derivative, prime."""

    origin: str  # ``measured`` or ``estimated``
    source: str = ""  # Source of an estimate
    type_a: float | None = None  # Standard error from the scatter of the campaign
    type_b: dict[str, float]  # Source of a stated uncertainty or a systematic error to its standard error
    paper_order: Stepped | None = None  # The same by the paper's order; None if it does not give it


@dataclass(frozen=True, kw_only=True)
class DerivativeConventions:
    """Conventions of the derivatives, as a card states them."""

    scaling: str = "prime"
    speed_scale: str = "instantaneous"
    yaw_rate_terms: str = "hydrodynamic"
    rudder_sign: str = "starboard"
    speed_mps: float


@dataclass(frozen=True, kw_only=True)
class ReducedBody:
    """The rigid body, prime."""

    mass: float
    yaw_inertia: float
    x_G: float


@dataclass(frozen=True, eq=False, kw_only=True)
class WeightedRegression:
    """The regression of one force over the whole campaign, prime."""

    names: tuple[str, ...]  # Terms
    values: Array
    standard_errors: Array
    covariance: Array  # (terms, terms)
    condition: Unbounded  # Scaled condition number
    variance_inflation: Array
    held_within: dict[str, float]  # Term to the standard deviation of its prior about zero


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceMethods:
    """The two methods for one force, and the terms on which they differ."""

    regression: WeightedRegression
    paper_order: Stepwise
    disagreements: tuple[Disagreement, ...]


@dataclass(frozen=True, kw_only=True)
class RunSpread:
    """Scatter of the runs of one force."""

    noise_factor: float  # Variance of the noise within runs over its estimate from each run
    # `zero_error_prime`, `zero_error_si`: Zero error from run to run, prime and in N or N m
    zero_error_prime: float
    zero_error_si: float
    gain_error: float  # Relative gain error from run to run
    by_type: dict[str, float]  # Type of run to its further zero error, prime


@dataclass(frozen=True, kw_only=True)
class PredictionError:
    """Error of the runs of a type, each predicted from the others, prime."""

    rms: float
    largest: float
    range: float  # Range of the measured force in these runs
    relative: Number  # Root mean square over range; NaN without a range
    runs: int


@dataclass(frozen=True, kw_only=True)
class RunSummary:
    """A run with its motion and its harmonics, prime with its own speed."""

    name: str
    type: str
    speed_mps: float
    frequency_radps: float
    periods: int
    v_amplitude_mps: float
    r_amplitude_radps: float
    v_mean_mps: float
    rudder_rad: float
    harmonics: dict[str, dict[str, PrimeValue]]  # Force to harmonic to value


@dataclass(frozen=True, eq=False, kw_only=True)
class ReductionStudy:
    """A reduced campaign: prime, instantaneous, "hydrodynamic", starboard-positive, expanded at the test speed."""

    campaign: str  # File of the campaign
    # `model`, `test`: Keys of these sections of the file to values
    model: _SectionValues
    test: _SectionValues
    card_scale: float | None  # Length of the card's ship over the length of the model; None: the card is of the model
    conventions: DerivativeConventions
    rigid_body: ReducedBody
    derivatives: dict[str, ReducedDerivative]  # Derivatives of the card
    heel_derivatives: dict[str, ReducedDerivative]  # Derivatives of the heel, which the card does not have
    uncertainty_budget: UncertaintyBudget
    missing: tuple[str, ...]  # Essential derivatives that are neither measured nor estimated
    notices: tuple[Notice, ...]
    # `methods`, `selection`, `spread`, `symmetry`, `leave_one_out`: By force: methods, choice of terms, scatter of the
    # runs, test of the symmetry (on request), predicted runs
    methods: dict[str, ForceMethods]
    selection: dict[str, tuple[Choice, ...]]
    spread: dict[str, RunSpread]
    systematic_errors: tuple[SystematicError, ...]  # Errors common to many runs that the campaign shows
    force_delay: DelayEstimate | None
    alignment: AlignmentEstimate | None
    trends: tuple[Trend, ...]  # Trends with frequency
    symmetry: dict[str, Asymmetry]
    leave_one_out: dict[str, tuple[LeftOut, ...]]
    prediction_errors: dict[str, dict[str, PredictionError]]  # Type of run to force to error
    oscillations: tuple[OscillationDerivatives, ...]
    third_order: tuple[CubicByTwoWays, ...]
    runs: tuple[RunSummary, ...]  # Runs that are used
    not_used: dict[str, str]  # Run to the reason
    faults: tuple[str, ...]
    repeats: Repeats | None
    # ``X0``, if it is the resistance of a model without a propeller and so not on the card
    resistance: dict[str, PrimeValue]
    plots: dict[str, ForcePlot | HarmonicsPlot | LoopPlot]  # Data of the charts by name

    @property
    def choices(self) -> list[Choice]:
        """Decisions on the candidate terms of all forces."""
        return [choice for choices in self.selection.values() for choice in choices]


def study_reduction(
    reduction: Reduction, card: Contents, notices: tuple[Notice, ...] = (), card_scale: float | None = None
) -> ReductionStudy:
    """The study of a reduction.

    `card`: Contents of its card; `notices`: Messages for the user, in sentences; `card_scale`: As of
    :class:`ReductionStudy`.
    """
    campaign, forces, found = reduction.campaign, reduction.forces, reduction.derivatives
    resistance = ["X0"] if is_resistance(campaign) and "X0" in found else []
    corrected = any(error.corrected for error in reduction.systematic)
    return ReductionStudy(
        campaign=str(campaign.path),
        model=campaign.model.model_dump(exclude_none=True),
        test=campaign.test.model_dump(exclude_none=True),
        card_scale=card_scale,
        conventions=DerivativeConventions(speed_mps=campaign.test.speed_mps),
        rigid_body=ReducedBody(mass=card.mass, yaw_inertia=card.yaw_inertia, x_G=card.x_G),
        derivatives={name: _derivative(reduction, card, name) for name in card.entries},
        heel_derivatives={
            name: _measured(reduction, name, found[name].value, found[name].standard_error)
            for name in terms_of_heel(reduction)
        },
        uncertainty_budget=uncertainty_budget(reduction),
        missing=card.missing,
        notices=notices,
        methods={force: _methods(result) for force, result in forces.items()},
        selection={force: result.selection.choices for force, result in forces.items()},
        spread={force: _spread(result) for force, result in forces.items()},
        systematic_errors=reduction.systematic,
        force_delay=replace(reduction.delay, corrected=corrected) if reduction.delay else None,
        alignment=reduction.alignment,
        trends=tuple(trend for result in forces.values() for trend in result.trends),
        symmetry={force: result.asymmetry for force, result in forces.items() if result.asymmetry},
        leave_one_out={force: result.left_out for force, result in forces.items()},
        prediction_errors=prediction_errors(reduction),
        oscillations=reduction.oscillations,
        third_order=reduction.cubics,
        runs=tuple(_run(campaign, run) for run in reduction.runs),
        not_used=dict(reduction.not_used),
        faults=tuple(map(str, reduction.faults)),
        repeats=repeats(campaign, reduction.runs),
        resistance={
            name: PrimeValue(value=found[name].value, standard_error=found[name].standard_error) for name in resistance
        },
        plots=reduction_plots(reduction),
    )


def prediction_errors(reduction: Reduction) -> dict[str, dict[str, PredictionError]]:
    """Leave-one-condition-out errors: type of run to force to error."""
    found: dict[str, dict[str, PredictionError]] = {}
    for force, result in reduction.forces.items():
        for kind in dict.fromkeys(row.type for row in result.left_out):
            rows = [row for row in result.left_out if row.type == kind]
            errors = np.array([row.error for row in rows])
            span = float(np.ptp([row.measured for row in rows]))
            rms = float(np.sqrt(np.mean(errors**2)))
            found.setdefault(kind, {})[force] = PredictionError(
                rms=rms,
                largest=float(np.max(np.abs(errors))),
                range=span,
                relative=rms / span if span > 0 else np.nan,
                runs=len(rows),
            )
    return found


def _derivative(reduction: Reduction, card: Contents, name: str) -> ReducedDerivative:
    entry = card.entries[name]
    value, error = float(entry.value), float(entry.standard_error)
    if name in card.estimated:
        return ReducedDerivative(value=value, standard_error=error, origin="estimated", source=entry.how, type_b={})
    return _measured(reduction, name, value, error)


def _measured(reduction: Reduction, name: str, value: float, error: float) -> ReducedDerivative:
    derivative, steps = reduction.derivatives[name], reduction.forces[name[0]].stepwise
    stepped = None
    if name in steps.names:
        place = steps.names.index(name)
        stepped = Stepped(
            value=float(steps.values[place]),
            standard_error=float(steps.standard_errors[place]),
            found_in=steps.found_in[place],
        )
    return ReducedDerivative(
        value=value,
        standard_error=error,
        origin="measured",
        type_a=derivative.type_a,
        type_b=dict(derivative.type_b),
        paper_order=stepped,
    )


def _methods(result: ForceResult) -> ForceMethods:
    solution = result.solution
    prior: Mapping[str, float] = result.selection.equations.prior
    return ForceMethods(
        regression=WeightedRegression(
            names=solution.names,
            values=solution.values,
            standard_errors=solution.standard_errors,
            covariance=solution.covariance,
            condition=float(solution.condition),
            variance_inflation=solution.inflation,
            held_within=dict(prior),
        ),
        paper_order=result.stepwise,
        disagreements=result.disagreements,
    )


def _spread(result: ForceResult) -> RunSpread:
    spread, unit = result.selection.spread, result.selection.equations.unit
    zero = float(np.sqrt(spread.zero_variance))
    return RunSpread(
        noise_factor=float(spread.noise),
        zero_error_prime=zero,
        zero_error_si=float(zero * unit),
        gain_error=float(np.sqrt(spread.gain_variance)),
        by_type={kind: float(np.sqrt(variance)) for kind, variance in spread.by_type.items()},
    )


def _run(campaign: Campaign, run: ReducedRun) -> RunSummary:
    motion = run.motion
    harmonics = {}
    for force, fit in run.fits.items():
        unit = campaign.scales_at(motion.mean_speed_mps).unit(force)
        errors = np.sqrt(np.diag(fit.covariance))
        harmonics[force] = {
            label: PrimeValue(value=float(value / unit), standard_error=float(error / unit))
            for label, value, error in zip(run.labels, fit.coefficients, errors, strict=True)
        }
    return RunSummary(
        name=run.run.name,
        type=run.run.type,
        speed_mps=motion.mean_speed_mps,
        frequency_radps=motion.frequency_radps,
        periods=motion.periods,
        v_amplitude_mps=motion.amplitude(motion.v_mps),
        r_amplitude_radps=motion.amplitude(motion.r_radps),
        v_mean_mps=float(np.mean(motion.v_mps)),
        rudder_rad=float(np.mean(motion.delta_rad)),
        harmonics=harmonics,
    )
