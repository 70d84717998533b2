"""Results of the analysis as JSON, in the units of the columns of a trial file."""

from __future__ import annotations

from typing import Any

from tank2sim.records.signals.analysis import ColumnAnalysis, Randomness, Steering, TrialAnalysis
from tank2sim.records.signals.columns import DIRECTION_COLUMNS, SignalName
from tank2sim.records.signals.effect import FilterEffect
from tank2sim.records.signals.spectra import Averaging
from tank2sim.records.signals.statistics import UnitRootTests


def analysis_as_json(analysis: TrialAnalysis) -> dict[str, Any]:
    """One trial: ``columns`` by name in the trial format, ``rudder_to_yaw_rate`` and ``notices``."""
    return {
        "trial": analysis.trial.path,
        "columns": {SignalName(column.series.name).file: _column(column) for column in analysis.columns},
        "rudder_to_yaw_rate": _steering(analysis.steering) if analysis.steering else None,
        "notices": analysis.notices,
    }


def effect_as_json(effect: FilterEffect) -> dict[str, Any]:
    """What a filter does."""
    return {
        "explanation": effect.sentence,
        "frequency_hz": effect.frequency_hz,
        "gain": effect.gain,
        "phase_rad": effect.phase_rad,
        "group_delay_s": effect.delay_s,
        "begin_distorted_s": effect.ends_s[0],
        "end_distorted_s": effect.ends_s[1],
    }


def _column(column: ColumnAnalysis) -> dict[str, Any]:
    name = SignalName(column.series.name)
    content: dict[str, Any] = {
        "unit": name.unit,
        "samples": len(column.series.values),
        "step_s": column.series.step_s,
        "mean": name.factor * column.mean,
        "standard_deviation": name.factor * column.standard_deviation,
        "on_circle": column.series.name in DIRECTION_COLUMNS,
        "constant": column.randomness is None,
    }
    return content | (_random(column.randomness, name) if column.randomness else {})


def _random(found: Randomness, name: SignalName) -> dict[str, Any]:
    factor, square = name.factor, name.factor**2
    steady, normal, density, spectrum = found.stationarity, found.normality, found.density, found.spectrum
    peak = spectrum.peak
    return {
        "correlation_time_s": found.correlation.correlation_time_s,
        "effective_count": found.correlation.effective_count,
        "autocorrelation": {"lag_s": found.correlation.lag_s, "coefficient": found.correlation.coefficient},
        "stationarity": {
            "verdict": steady.verdict.value,
            "meaning": steady.verdict.meaning,
            "p_values": {"about_level": _p_values(steady.level), "about_trend": _p_values(steady.trend)},
            "samples_averaged": steady.block,
            "mean_of_halves": [factor * value for value in steady.mean],
            "variance_of_halves": [square * value for value in steady.variance],
        },
        "normality": {
            "verdict": normal.verdict,
            "normal": normal.normal,
            "p_values": normal.p_values,
            "independent_samples": normal.count,
            "skewness": normal.skewness,
            "excess_kurtosis": normal.excess_kurtosis,
        },
        "probability_density": {
            "values": factor * density.values,
            "density": density.density / factor,
            "normal": density.normal / factor,
        },
        "spectrum": {
            "frequency_hz": spectrum.frequency_hz,
            "density": square * spectrum.density,
            "low": square * spectrum.low,
            "high": square * spectrum.high,
            "unit": f"({name.unit})^2/Hz",
            **_averaging(spectrum.averaging),
            "peak_in_words": spectrum.peak_in_words,
            "peak": None
            if peak is None
            else {
                "frequency_hz": peak.frequency_hz,
                "density": square * peak.density,
                "distinct": peak.distinct,
                "at_lowest_frequency": peak.lowest,
            },
        },
    }


def _steering(found: Steering) -> dict[str, Any]:
    lag, coefficient = found.correlation.largest
    transfer = found.transfer
    return {
        "rudder": SignalName(found.rudder).file,
        "cross_correlation": {
            "lag_s": found.correlation.lag_s,
            "coefficient": found.correlation.coefficient,
            "bound_if_independent": found.correlation.bound,
            "lag_of_largest_s": lag,
            "largest": coefficient,
        },
        "frequency_hz": transfer.frequency_hz,
        "gain_per_s": transfer.gain,
        "phase_rad": transfer.phase_rad,
        "coherence": transfer.coherence,
        "coherence_by_chance": transfer.significant,
        "sure": transfer.sure,
        "relative_error_of_gain": transfer.error,
        "error_of_phase_rad": transfer.error,
        "half_width_95": transfer.half_width,
        "cross_density_real": transfer.cross_density.real,
        "cross_density_imaginary": transfer.cross_density.imag,
        **_averaging(transfer.averaging),
        "notices": found.notices,
    }


def _p_values(tests: UnitRootTests) -> dict[str, float]:
    return {"dickey_fuller": tests.dickey_fuller, "kpss": tests.kpss}


def _averaging(averaging: Averaging) -> dict[str, Any]:
    return {
        "segments": averaging.segments,
        "samples_in_segment": averaging.samples,
        "degrees_of_freedom": averaging.freedom,
    }
