"""The models of a steering card compared, as a result."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from tank2sim.analysis.catalogue.comparison import SteeringComparison, compare_steering_models
from tank2sim.analysis.turning.two_point_tuning import TwoPointTuning
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import AngleArgument, checked
from tank2sim.api.result import PagedResult, screen_table
from tank2sim.api.turn_tuning import stability_change, turn_table
from tank2sim.cards.steering_card import SteeringCard, read_steering_card

if TYPE_CHECKING:
    import pandas as pd


class SteeringModelsResult(PagedResult):
    """The models of a steering card: steady turns, influence coefficients, manoeuvres, and what is not known.

    Parameters
    ----------
    card : SteeringCard
    found : SteeringComparison
        SI and radians.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> found = t2s.steering_models("poznyakov-yudin")
    >>> float(found.coefficients.loc["C_m_w", "inoue-hirano"].round(1))
    7.1
    """

    command = "influence"

    def __init__(self, card: SteeringCard, found: SteeringComparison) -> None:
        self.card, self.found = card, found
        self.notices = tuple(f"{name}: {text}" for name, texts in found.missing.items() for text in texts)

    @property
    def turns(self) -> pd.DataFrame:
        """Steady turns of every complete model: rudder (deg), radius (m), yaw rate (deg/min), drift (deg), speed."""
        import pandas as pd

        return pd.DataFrame(
            [{"model": each.model, **turn.as_json()} for each in self.found.turns for turn in each.turns]
        )

    @property
    def coefficients(self) -> pd.DataFrame:
        """K %, the change of the radius for 10 % more of a coefficient (rows), by model (columns)."""
        import pandas as pd

        return pd.DataFrame({each.model: dict(each.K_percent) for each in self.found.influence})

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return self.found.as_json()

    @property
    def headline(self) -> tuple[str, ...]:
        """Name of the ship and number of models; why a tuning is absent, or its effect on the stability."""
        tuning = self.found.tuning
        lines = [f"{self.found.ship}: {len(self.card.models)} steering models"]
        if isinstance(tuning, str):
            lines.append(f"No tuning to the measured points: {tuning}")
        if isinstance(tuning, TwoPointTuning):
            lines += stability_change(tuning)
        return tuple(lines)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Steady turns, coefficients, joint variation, manoeuvres, tuning."""
        found = self.found
        keys = ("rudder_deg", "radius_m", "yaw_rate_degpmin", "drift_deg")
        tables = [
            screen_table(
                f"Steady turns, {turns.title}",
                ("rudder (deg)", "radius (m)", "rate (deg/min)", "drift (deg)"),
                [[turn.as_json()[key] for key in keys] for turn in turns.turns],
            )
            for turns in found.turns
            if turns.model in found.runs
        ]
        names = list(dict.fromkeys(name for each in found.influence for name in each.K_percent))
        tables.append(
            screen_table(
                f"K %: change of the radius at {found.rudder_deg:g} deg for 10 % more",
                ("", *(self.card.models[each.model].title for each in found.influence)),
                [[name, *(each.K_percent.get(name) for each in found.influence)] for name in names],
            )
        )
        if found.predictions:
            columns = ("by", "to", "change (%)", "radius (m)")
            tables.append(screen_table("Joint variation of all coefficients", columns, self._prediction_rows()))
        tables.append(self._manoeuvre_table())
        if isinstance(found.tuning, TwoPointTuning):
            tables.append(turn_table(found.tuning))
        return tuple(tables)

    def _prediction_rows(self) -> list[list[object]]:
        rows: list[list[object]] = []
        for name, found in self.found.predictions.items():
            title = self.card.models[name].title
            direct, misread = (
                100 * (radius / found.radius_m - 1) for radius in (found.direct_m, found.direct_misread_m)
            )
            rows += [
                ["printed K, right pairs", title, found.percent, found.predicted_m],
                ["printed K, as the source pairs them", title, found.misread_percent, found.misread_m],
                ["K computed here", title, found.own_percent, found.own_m],
                ["the model itself", title, direct, found.direct_m],
                ["the model with the source's slip", title, misread, found.direct_misread_m],
            ]
        return rows

    def _manoeuvre_table(self) -> Table:
        keys = ("advance_m", "transfer_m", "tactical_diameter_m", "steady_diameter_m")
        rows = []
        for name, runs in self.found.runs.items():
            overshoots = runs.zigzag_figures["overshoots_deg"]
            first = overshoots[:2] if isinstance(overshoots, list) else []
            figures = (runs.turn_figures[key] for key in keys)
            rows.append([self.card.models[name].title, *figures, [float(value) for value in first]])
        heads = (f"{key.removesuffix('_m').replace('_', ' ')} (m)" for key in keys)
        title = f"Turning circle at {self.found.rudder_deg:g} deg, zigzag"
        return screen_table(title, ("model", *heads, "10/10 overshoots (deg)"), rows)


@checked
def steering_models(card: str | Path, rudder_deg: AngleArgument | None = None) -> SteeringModelsResult:
    """Compare the models of a steering card.

    Parameters
    ----------
    card : str or path
        File, or name of a bundled steering card (``poznyakov-yudin``).
    rudder_deg : float, optional
        Rudder of influence and turning circle; by default that of the card, else 20.

    Raises
    ------
    InputError
        It is not a steering card, no model of it is complete, or a model has no steady turn at a rudder of Table 1.
    """
    found = read_steering_card(card)
    return SteeringModelsResult(found, compare_steering_models(found, rudder_deg))
