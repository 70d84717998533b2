"""A page with one of everything, of data made up but shaped like a ship's."""

import numpy as np

from tank2sim.answer.charts.analysis import (
    FrequencyResponse,
    OutputError,
    PolesZeros,
    bode_chart,
    error_chart,
    pole_zero_chart,
)
from tank2sim.answer.charts.curves import Plot, PlotSeries, curve_chart
from tank2sim.answer.charts.motion import (
    History,
    Signal,
    TrackData,
    history_chart,
    spiral_chart,
    track_chart,
)
from tank2sim.answer.charts.vega import PlotAxis
from tank2sim.answer.page import Page
from tank2sim.answer.parts import Column, Illustration, KeyFigure, Section, Table, Verdict

TIME = np.arange(0.0, 600.0, 0.1)
HEADING = 0.01 * TIME


def circle(label: str, radius_m: float = 300.0, measured: bool = False) -> TrackData:
    x, y = radius_m * np.sin(HEADING), radius_m * (1 - np.cos(HEADING))
    return TrackData(label, x_m=x, y_m=y, time_s=TIME, measured=measured)


def every_chart():
    heading = Signal("motion.psi", "heading", "rad")
    run = History("simulated", time_s=TIME, values={"motion.psi": HEADING})
    model = PlotSeries("tow 1", x=TIME, y=np.tanh(TIME / 10))
    tow = Plot([model, PlotSeries("tow 1", x=[0, 5], y=[0, 0.5], points=True)], up=PlotAxis("speed (m/s)"))
    omega = np.logspace(-3, 1, 50)
    return {
        "track": track_chart([circle("simulated"), circle("trial", 310.0, measured=True)], title="Turning circle"),
        "history": history_chart([run], [heading], title="Heading"),
        "tow": curve_chart(tow, PlotAxis("time (s)"), title="Tows"),
        "bode": bode_chart([FrequencyResponse("yaw", omega_radps=omega, response=1 / (1j * omega))], title="Bode"),
        "pole_zero": pole_zero_chart([PolesZeros("yaw", poles=[-0.1, -0.01], zeros=[-0.05])], title="Poles"),
        "error": error_chart(
            [OutputError(kind="FMI 2 CS", output="motion.x", error=1e-12, limit=1e-9)], title="Errors"
        ),
        "spiral": spiral_chart([5.0, -5.0], [0.5, -0.5]),
    }


def example_page(title: str = "Mariner class") -> Page:
    columns = [Column("Run"), Column("Advance", "m"), Column("Verdict")]
    rows = [["port", -1234.567, Verdict.PASSED], ["starboard", 87.2, Verdict.FAILED], ["unknown", None, None]]
    return Page(
        title=title,
        subtitle="Turning and steering",
        figures=[KeyFigure("Tactical diameter", 561.24, "m", verdict=Verdict.PASSED, note="3.5 lengths")],
        sections=[
            Section(
                "Turning circle",
                text="First paragraph.\n\nSecond paragraph.",
                notes=["Outside the valid speeds."],
                tables=[Table(caption="Figures of the circle.", columns=columns, rows=rows)],
            ),
            Section(
                "Charts",
                charts=[Illustration(chart, caption=f"Caption of {name}.") for name, chart in every_chart().items()],
            ),
        ],
    )
