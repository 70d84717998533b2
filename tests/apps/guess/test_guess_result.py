"""The result of a guess: its chart and tables hold the numbers of the study."""

from __future__ import annotations

from tank2sim.apps.guess.result import GuessResult
from tank2sim.apps.guess.study import GuessedFigure, GuessedNumber, GuessStudy
from tank2sim.notices import Notice
from tank2sim.simulation.bands import Band
from tests.answer.drawn import rows_of

STUDY = GuessStudy(
    ship="tanker",
    dimensions={"length_m": 320.0, "beam_m": 58.0, "draught_m": 20.8, "block": 0.81, "speed_kn": 15.5},
    members=200,
    seed=0,
    figures={
        "tactical_diameter_m@35": GuessedFigure(
            unit="m",
            given=980.0,
            standard_error=49.0,
            by_dimensions=Band(700.0, 1000.0, 1400.0, 200.0, 200),
            found=Band(900.0, 980.0, 1060.0, 50.0, 200),
        ),
        "overshoot_1_deg@10/10": GuessedFigure(
            unit="deg",
            given=None,
            standard_error=None,
            by_dimensions=Band(4.0, 8.0, 16.0, 3.0, 200),
            found=Band(6.0, 9.0, 12.0, 2.0, 200),
        ),
    },
    parameters={
        "Nd": GuessedNumber(
            by_dimensions=-1e-3, by_dimensions_standard_error=2e-4, value=-1.1e-3, standard_error=1e-4, settled=True
        )
    },
    next_figures={"overshoot_1_deg@10/10": 0.6},
    notices=(Notice("a guess"),),
)


def test_the_chart_shows_bands_and_figures_given_over_the_median_found() -> None:
    (chart,) = GuessResult(STUDY)._charts().values()
    rows = rows_of(chart)
    assert [(row["run"], row["low"], row["high"]) for row in rows if "low" in row] == [
        ("by dimensions", 700 / 980, 1400 / 980),
        ("with the figures", 900 / 980, 1060 / 980),
        ("by dimensions", 4 / 9, 16 / 9),
        ("with the figures", 6 / 9, 12 / 9),
    ]
    assert [(row["run"], row["v"]) for row in rows if "v" in row] == [("given", 1.0)]


def test_the_tables_hold_figures_numbers_and_the_next_figure() -> None:
    result = GuessResult(STUDY)
    figures, prior, numbers, further = (each.df for each in result.tables)
    assert prior["95 %"].to_list() == [1400.0, 16.0]
    assert figures["given"].to_list()[0] == 980.0 and figures["50 %"].to_list() == [980.0, 9.0]
    assert numbers["found"].to_list() == [-1.1e-3] and further["variance removed (%)"].to_list() == [60.0]
    assert result.figures.loc["overshoot_1_deg@10/10", "by_dimensions_p95"] == 16.0


def test_the_headline_says_how_much_narrower_the_other_intervals_are() -> None:
    (line,) = GuessResult(STUDY).headline
    assert "Nd" in line and "50 %" in line
