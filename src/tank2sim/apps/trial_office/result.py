"""Result of ``trials``: the report of a sea trial, its forms, and the cards of the ship in both conditions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from tank2sim.answer.charts.motion import TrackData, track_chart
from tank2sim.answer.parts import Cell, Illustration, KeyFigure, Section, Table, Verdict, table
from tank2sim.answer.result import Result
from tank2sim.apps.trial_office.study import CURRENT_CHANGES, TrialOffice
from tank2sim.apps.trial_office.verdict import LOADING_HOLDS, CriterionVerdict
from tank2sim.dynamics.effects.loading import LOADING
from tank2sim.results.ensembles import members_frame
from tank2sim.units import in_words

if TYPE_CHECKING:
    import pandas as pd

    from tank2sim.apps.bridge.study import DataBasis
    from tank2sim.cards.card import ManoeuvringCard

MODEL_AGREES = 0.8
"""Share of the figures of the trial that the model follows within its errors, from which the sheets of the bridge may
use it in that loading condition. Project choice: intervals of 95 % of a right model leave out a few of twenty."""

_LONGEST = 24
"""Letters of the name of a record in the legend; of a longer one the last, by which records mostly differ."""

_VERDICTS = {"pass": Verdict.PASSED, "fail": Verdict.FAILED}


@dataclass(frozen=True, eq=False, repr=False)
class TrialOfficeResult(Result[TrialOffice]):
    """The report of a sea trial.

    Parameters
    ----------
    study : TrialOffice
    as_tried, full_load : ManoeuvringCard, optional
        Cards of the ship in both conditions; None if the result was read from its JSON.
    """

    study: TrialOffice
    as_tried: ManoeuvringCard | None = None
    full_load: ManoeuvringCard | None = None
    command: ClassVar[str] = "trials"

    @cached_property
    def members(self) -> pd.DataFrame:
        """The ships of the ensemble, one row each: the numbers drawn, by the dotted keys of the card and as its file
        has them; figures named ``trial, as tried: figure`` and ``trial, at full load: figure``; and whether any trial
        could be run (``usable``).

        The errors of the formulas for the loading are drawn on top of these numbers.

        Raises
        ------
        InputError
            There are no members, or the result was read from its JSON.
        """
        return members_frame(self.study.drawn, self.study.members)

    @property
    def title(self) -> str:
        """The ship."""
        return f"{self.study.ship}: sea trials"

    @property
    def subtitle(self) -> str:
        """Place, date, and loading condition."""
        study, state = self.study, self.study.state
        condition = f"tried at {state.draught_m:.3g} m, full load {state.full_load_draught_m:.3g} m"
        return ", ".join(part for part in (study.place, study.date, condition) if part)

    @property
    def headline(self) -> tuple[str, ...]:
        """Verdicts at full load, and the corrections."""
        study = self.study
        lines = [self._first_line]
        for words, verdict in (("Not met", "fail"), ("Undecided", "undecided")):
            if names := [_named(one) for one in study.tried if one.verdict.startswith(verdict)]:
                lines.append(f"{words}: {'; '.join(names)}.")
        if study.conditions_not_met:
            lines.append(f"Conditions not met: {study.conditions_not_met}.")
        lines += self._current_line
        known = self._agreements
        if known and not study.tested_at_full_load:
            lines.append(f"In the condition of the trial the model agrees with {sum(known)} of {len(known)} figures.")
        if not study.applies:
            lines.append("The ship is shorter than 100 m: the standards do not bind it.")
        return tuple(lines)

    @property
    def _current_line(self) -> list[str]:
        """The current, and how it was found; empty without one."""
        study, current = self.study, self.study.current
        if current is None:
            return []
        how = f"separated from the wind {current.separated}" if current.separated else "together with any wind"
        if any(one.measured.spread_mps is None for one in study.drifts):
            how += ", by a circle in a moving frame (a turn of less than 540 deg)"
        if (spread := current.spread_mps or 0.0) > CURRENT_CHANGES:
            how += f"; it changes during a turn (spread {spread:.3f} m/s)"
        return [f"Current {current.words}, {how}."]

    @property
    def _first_line(self) -> str:
        """How many criteria are met, or that they are not certified."""
        study = self.study
        if not study.tried:
            return "No criterion of MSC.137(76) was tried."
        if study.not_certified == study.tried:
            return "No criterion is certified: full load is EXTRAPOLATED from the condition of the trial."
        passed = sum(one.verdict == "pass" for one in study.tried)
        share = f"{passed} of {len(study.tried)}"
        text = f"At full load in calm water, {share} criteria of MSC.137(76) that were tried are met"
        if study.not_certified:
            text += f", and {len(study.not_certified)} not certified (EXTRAPOLATED)"
        return f"{text}."

    @property
    def key_figures(self) -> Sequence[KeyFigure]:
        """The criteria that were tried, at full load."""
        return [
            KeyFigure(
                one.name,
                one.full_load if one.full_load is not None else "undecided",
                one.unit if one.full_load is not None else "",
                limit=one.allowed,
                verdict=_VERDICTS.get(one.verdict, Verdict.CAUTION),
                note=_chance(one),
            )
            for one in self.study.tried
        ]

    @property
    def sections(self) -> Sequence[Section]:
        """Verdict, conditions, current, figures, and the form."""
        return [self._verdicts(), self._conditions(), self._current(), self._figures(), self._form()]

    def _verdicts(self) -> Section:
        rows: list[list[Cell]] = []
        for one in self.study.criteria:
            as_run = one.as_run, one.verdict_as_run, _share(one.probability_as_run)
            at_load = one.full_load, one.verdict, _share(one.probability)
            rows.append([f"{one.name} ({one.unit})", one.allowed, *as_run, *at_load])
        heads = ("criterion", "allowed", "as run", "trial as run", "P as run", "full load", "ship at full load", "P")
        return Section(
            "Verdict",
            text="The trial as it was run, and the ship at full load, on even keel, in calm water. The worse side "
            "counts. P is the probability of meeting the criterion; between 0.05 and 0.95 it is undecided.",
            tables=[table("Criteria of IMO MSC.137(76)", heads, rows, digits=3)],
        )

    def _conditions(self) -> Section:
        rows: list[list[Cell]] = [
            [one.name, one.required, one.found or None, str(one.met), one.source] for one in self.study.conditions
        ]
        heads = ("condition", "required", "found", "met", "source")
        return Section(
            "Conditions of the trial",
            text="A trial is reported whether or not its conditions were met.",
            tables=[table("Conditions", heads, rows)],
        )

    def _current(self) -> Section:
        study = self.study
        rows: list[list[Cell]] = []
        for one in study.drifts:
            spread, residual = one.measured.spread_mps, one.measured.residual_m
            wind = one.by_wind_north_mps, one.by_wind_east_mps
            drift = one.measured.north_mps, one.measured.east_mps
            rows.append([one.trial, one.measured.method, *drift, spread, residual, *wind])
        heads = [
            *("turn", "method", "north (m/s)", "east (m/s)", "spread (m/s)", "residual of the circle (m)"),
            *("by wind, north (m/s)", "by wind, east (m/s)"),
        ]
        charts = []
        if study.tracks:
            tracks = [
                data
                for one in study.tracks
                for name in [one.trial if len(one.trial) <= _LONGEST else f"…{one.trial[1 - _LONGEST :]}"]
                for data in (
                    TrackData(f"{name}, as run", x_m=one.x_m, y_m=one.y_m, measured=True),
                    TrackData(f"{name}, without current", x_m=one.x_without_current_m, y_m=one.y_without_current_m),
                )
            ]
            charts.append(Illustration(track_chart(tracks, title="Turning circles"), caption="From the execute."))
        return Section(
            "Current and wind",
            text="Positions one full turn apart show the drift of a circle (MSC/Circ.1053, 3.4.2). A constant wind "
            "drifts it, too, with almost no spread, and to opposite sides for turns to port and starboard: the mean "
            "of both sides is the current. A large residual of the circle shows the wind.",
            tables=[table("Drift of the turning circles", heads, rows, digits=3)] if rows else [],
            charts=charts,
        )

    def _figures(self) -> Section:
        heads = ("record", "figure", "as run", "full load", "2.5 %", "97.5 %")
        steps = ("record", "manoeuvre", "side", "figure", "without current", "standard error", "in calm water")
        checks = ("record", "figure", "measured T", "model as tried B", "agrees", "model at full load F", "R = T F/B")
        rows: list[list[Cell]] = []
        by_step: list[list[Cell]] = []
        checked: list[list[Cell]] = []
        for one in self.study.figures:
            words, unit = in_words(one.name)
            name = f"{words} ({unit})"
            rows.append([one.trial, name, one.as_run, one.full_load, one.low, one.high])
            by_step.append(
                [one.trial, one.manoeuvre, one.side, name, one.without_current, one.error or None, one.calm],
            )
            if one.model_as_tried is not None:
                agrees = None if one.model_agrees is None else "yes" if one.model_agrees else "no"
                by_model = (one.model_as_tried, agrees, one.model_full_load, one.full_load)
                checked.append([one.trial, name, one.without_current, *by_model])
        tables = [
            table("Figures as run and at full load", heads, rows),
            table("Corrections, step by step", steps, by_step, on_screen=False),
        ]
        if checked:
            tables.append(table("The model in the condition of the trial", checks, checked, on_screen=False))
        return Section(
            "Figures",
            text="The wind is taken off by the model: times its figure in calm water over that in the wind. At full "
            "load R = T F/B (MSC/Circ.1053): measured T, and simulated F at full load and B as tried, of the same "
            "member of the ensemble, so that errors of both cancel. Where the model as tried agrees with the trial, "
            "its own figures F at full load may be used instead (option 2): simulate full-load.toml.",
            tables=tables,
        )

    def _form(self) -> Section:
        from tank2sim.apps.trial_office.form import form_boxes

        tables: list[Table] = []
        for box in form_boxes(self.study):
            width = max(len(row.values) for row in box.rows)
            values = [[None if value is None else str(value) for value in row.values] for row in box.rows]
            rows = [
                [row.label, *cells, *[""] * (width - len(cells))] for row, cells in zip(box.rows, values, strict=True)
            ]
            tables.append(table(box.title, ("", *(box.heads or [""] * width)), rows, on_screen=False))
        return Section("Form for reporting to IMO", tables=tables, folded=True)

    def files(self, folder: Path) -> dict[Path, str | bytes]:
        """Return the report's files in a `folder` by path: page, PDF, form, poster, pilot card, JSON, both cards."""
        from tank2sim.apps.bridge.command import sheet_data
        from tank2sim.apps.bridge.result import PilotCardResult, PosterResult
        from tank2sim.apps.trial_office.form import form_page
        from tank2sim.apps.trial_office.paper import report_pdf
        from tank2sim.dynamics.vessel import Vessel

        found: dict[Path, str | bytes] = {
            folder / "report.html": self.page(),
            folder / "form.html": form_page(self.study),
            folder / "report.pdf": report_pdf(self),
            folder / "trials.json": self.to_json(),
        }
        if self.as_tried is None or self.full_load is None:
            return found
        state = self.study.state
        light = not self.study.tested_at_full_load and state.draught_m < state.full_load_draught_m
        other = Vessel(self.as_tried) if light else None
        sheet = sheet_data(Vessel(self.full_load), other, {}, *self._bases())
        found[folder / "poster.html"] = PosterResult(*sheet).page()
        found[folder / "pilotcard.html"] = PilotCardResult(*sheet).page()
        for name, card in (("as-tried.toml", self.as_tried), ("full-load.toml", self.full_load)):
            found |= card.files(folder / name)
        return found

    def _bases(self) -> tuple[DataBasis, DataBasis]:
        """Draughts of the sheets at full load and as tried, and how many figures agree with the trial."""
        from tank2sim.apps.bridge.study import DataBasis

        state, known = self.study.state, self._agreements
        checked = f"estimated; {sum(known)} of {len(known)} agree with the trial" if known else "estimated"
        full = checked if self.study.tested_at_full_load else "estimated"
        agrees = bool(known) and sum(known) >= MODEL_AGREES * len(known)
        holds = (LOADING.name,) if agrees and self.study.loading_validity >= LOADING_HOLDS else ()
        return (
            DataBasis(state.full_load_draught_m, state.full_load_draught_m, full),
            DataBasis(*state.draughts_at_ends_m, checked, holds),
        )

    @property
    def _agreements(self) -> list[bool]:
        return [one.model_agrees for one in self.study.figures if one.model_agrees is not None]


def _share(probability: float | None) -> str | None:
    """A probability as it can be said: never 0 or 1."""
    if probability is None:
        return None
    return "< 0.01" if probability < 0.01 else "> 0.99" if probability > 0.99 else f"{probability:.2f}"


def _named(one: CriterionVerdict) -> str:
    """A criterion with its chance, and the reason why it is not certified."""
    _, _, reason = _chance(one).partition(", ")
    return f"{one.name} ({reason or 'no figure at full load'})"


def _chance(one: CriterionVerdict) -> str:
    if (shown := _share(one.probability)) is None:
        return one.verdict
    return f"{one.verdict}, P {shown if shown[0] in '<>' else f'= {shown}'}"
