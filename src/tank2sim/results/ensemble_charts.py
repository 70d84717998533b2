"""Charts of bands over the members of an ensemble: steady turns by rudder, Bode diagram, step of the rudder."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tank2sim.analysis.ensemble.steering import BodeBands, CurveBand, SteeringBands, StepBands, TurningBands
from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart, curve_panels
from tank2sim.answer.charts.vega import ChartSpec, PlotAxis
from tank2sim.answer.parts import Illustration
from tank2sim.arrays import Array

_WIDTH = 680
_APART = 1e-6
"""Share of the largest yaw rate by which the two branches of a steering diagram are apart at least."""
_SHOWN = {"v:Q": "this ship", "low:Q": "5 %", "high:Q": "95 %"}


def curve_charts(curves: SteeringBands) -> list[Illustration]:
    """Stable turns, Bode diagram and step of the rudder, each with its band."""
    turning, bode, step = curves.steady_turning, curves.bode, curves.step
    shaded = f"Line: this ship. Shaded: nine of ten of {curves.members} members."
    loop, with_loop, turns = turning.loop_width_deg, turning.with_loop, shaded
    if with_loop and loop:
        none = "" if with_loop == curves.members else " (none counted as 0)"
        turns += (
            f" {with_loop} of them have a hysteresis loop, {loop.p5:.3g} to {loop.p95:.3g} deg of rudder wide{none}; "
            "in the loop a ship keeps turning to the side that it comes from."
        )
    return [
        Illustration(chart=turns_chart(turning, title="Stable turns over the ensemble"), caption=turns),
        Illustration(chart=_bode_chart(bode, title="Bode diagram over the ensemble"), caption=shaded),
        Illustration(chart=_step_chart(step, title="Step of the rudder over the ensemble"), caption=shaded),
    ]


def turns_chart(turning: TurningBands, *, title: str = "") -> ChartSpec:
    """Yaw rate of stable turns against the rudder, coming from starboard turn and, where it differs, from port."""
    rudder = turning.rudder_deg
    starboard, port = turning.yaw_rate_from_starboard_degps, turning.yaw_rate_from_port_degps
    apart = np.zeros(len(rudder), dtype=bool)
    for key in ("p5", "p50", "p95", "own"):
        from_starboard, from_port = getattr(starboard, key), getattr(port, key)
        apart |= np.abs(from_starboard - from_port) > _APART * np.nanmax(np.abs(from_starboard), initial=0.0)
    # With their neighbours, so that the branches meet.
    apart = apart | np.roll(apart, 1) | np.roll(apart, -1)
    series = [_banded("from starboard turn", rudder, starboard), _banded("from port turn", rudder, port, apart)]
    if not apart.any():
        series = [_banded("stable turns", rudder, starboard)]
    return curve_chart(
        Plot(series=series, up=PlotAxis(title="yaw rate (deg/s)")),
        PlotAxis(title="rudder angle, starboard positive (deg)", nice=False, zero=True),
        title=title,
        width_px=_WIDTH,
        window=["x"],
        described="Yaw rate of stable turns against the rudder, with its band over an ensemble.",
        shown=_SHOWN,
    )


def _bode_chart(bode: BodeBands, *, title: str) -> ChartSpec:
    """Magnitude and phase of the yaw rate by the rudder angle."""
    plots = [
        Plot(
            series=[_banded("yaw rate by rudder angle", bode.omega_radps, band)],
            up=PlotAxis(title=name),
            height_px=180,
        )
        for name, band in (("magnitude (dB)", bode.magnitude_dB), ("phase (deg)", bode.phase_deg))
    ]
    across = PlotAxis(title="angular frequency (rad/s)", log=True, nice=False, form="~g")
    described = "Bode diagram of yaw rate by rudder angle, with its band over an ensemble."
    return curve_panels(plots, across, title=title, width_px=_WIDTH, described=described, shown=_SHOWN)


def _step_chart(step: StepBands, *, title: str) -> ChartSpec:
    """Yaw rate after a step of one degree of rudder."""
    series = [_banded("yaw rate", step.time_s, step.step_per_s)]
    return curve_chart(
        Plot(series=series, up=PlotAxis(title="yaw rate per degree of rudder (deg/s)"), height_px=240),
        PlotAxis(title="time after the step (s)", nice=False),
        title=title,
        width_px=_WIDTH,
        window=["x"],
        described="Yaw rate after a step of the rudder, with its band over an ensemble.",
        shown=_SHOWN,
    )


def _banded(label: str, x: Array, band: CurveBand, shown: NDArray[np.bool_] | None = None) -> PlotSeries:
    """The line of the ship itself, in the band of the 5 and 95 % quantiles; gaps where it is not shown."""
    own, low, high = (
        values if shown is None else np.where(shown, values, np.nan) for values in (band.own, band.p5, band.p95)
    )
    return PlotSeries(label=label, x=x, y=own, low=low, high=high)
