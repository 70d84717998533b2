"""What a table of derivatives with unstated conventions may mean."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tank2sim.analysis.conversion.readings import (
    RankedReading,
    Reading,
    possible_readings,
    read_as,
    read_card_text,
    scaled_with_nominal_speed,
    weigh,
    with_diameter,
    with_probabilities,
)
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.ship import Ship
from tank2sim.cards import ManoeuvringCard
from tank2sim.cards.coefficient_table import CoefficientTable, read_coefficients
from tank2sim.cards.reading import parse_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError
from tank2sim.simulation.manoeuvres import Turn, Zigzag
from tank2sim.simulation.run import simulate

SURE_READING = 0.9
"""Probability from which the first reading is taken without a mark. Project choice; ``benchmarks/convention.py`` prints
how often a first reading with it is the true one."""

_SIMULATED = 1e-3
"""Probability from which a reading is simulated: others cannot become the first (project choice)."""
_SHOWN, _LEAST_SHOWN, _MOST_SHOWN = 1e-3, 4, 8
_ALIKE = 0.05
"""Relative difference of figures up to which two readings are one ship in practice (project choice)."""

_WORDS = {
    "rudder_sign": {"starboard": "rudder positive to starboard", "port": "rudder positive to port"},
    "scaling": {"prime": "prime system", "prime_ii": "prime system with L d", "bis": "bis system", "dimensional": "SI"},
    "yaw_rate_terms": {"hydrodynamic": "yaw-rate terms without inertia", "total": "yaw-rate terms with inertia"},
    "origin": {"midships": "origin midships", "centre_of_gravity": "origin in the centre of gravity"},
}


@dataclass(frozen=True)
class ReadingFigures:
    """Figures of a ship by a reading; None where they were not simulated or not reached.

    Parameters
    ----------
    advance_lengths, tactical_diameter_lengths : float or None
        Of a turn with 35 deg (or the gear's most), over L.
    overshoot_1_deg : float or None
        Of the 10/10 zigzag.
    """

    advance_lengths: float | None = None
    tactical_diameter_lengths: float | None = None
    overshoot_1_deg: float | None = None


class ConventionResult(OldResult):
    """Readings of a table, the most probable first.

    Parameters
    ----------
    table : CoefficientTable
    readings : list of RankedReading
    figures : mapping
        Reading to its :class:`ReadingFigures`.
    """

    command = "convention"

    def __init__(
        self,
        table: CoefficientTable,
        readings: list[RankedReading],
        figures: Mapping[Reading, ReadingFigures],
    ) -> None:
        self.table, self.readings, self.figures = table, readings, figures
        self.notices = self._notices()

    @property
    def ship(self) -> Ship:
        """The ship by the first reading, with estimates of the accelerations that the table lacks."""
        text = read_card_text(self.table, self.readings[0])
        return Ship(parse_card(text, self.table.source))

    def files(self, path: str | Path) -> dict[Path, str | bytes]:
        """The card of the first reading, at `path`."""
        return {Path(path): read_card_text(self.table, self.readings[0])}

    def alike(self, first: RankedReading, second: RankedReading) -> bool:
        """Whether two readings are one ship in practice: both stable or neither, and every simulated figure within 5 %.

        Parameters
        ----------
        first, second : RankedReading
            Of this result.
        """
        if (first.criterion > 0) != (second.criterion > 0):
            return False
        simulated = [vars(self.figures.get(entry.reading, ReadingFigures())) for entry in (first, second)]
        pairs = [
            (a, b)
            for a, b in zip(*(each.values() for each in simulated), strict=True)
            if a is not None and b is not None
        ]
        return bool(pairs) and all(abs(a - b) <= _ALIKE * max(abs(a), abs(b)) for a, b in pairs)

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        return {
            "source": self.table.source,
            "stated": dict(self.table.conventions),
            "readings": [
                {
                    **vars(entry.reading),
                    "probability": entry.probability,
                    "C_prime": entry.criterion,
                    "turning_index": entry.turning_index,
                    **vars(self.figures.get(entry.reading, ReadingFigures())),
                    "vanished": list(entry.ship.vanished),
                    "against": list(entry.against),
                }
                for entry in self.readings
            ],
            "assumed": list(self.table.assumed),
            "scaled_with_nominal_speed": scaled_with_nominal_speed(self.table),
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """The first reading with its probability."""
        first = self.readings[0]
        open_keys = [key for key in _WORDS if len({getattr(entry.reading, key) for entry in self.readings}) > 1]
        read = ", ".join(_WORDS[key][getattr(first.reading, key)] for key in _WORDS)
        mark = "" if first.probability >= SURE_READING else "UNCERTAIN: "
        lines = [f"{mark}{Path(self.table.source).name}: {read}: probability {first.probability:.2g}"]
        if not open_keys:
            lines = [f"{Path(self.table.source).name}: every convention is stated"]
        doubtful = [key for key in open_keys if self._share(key) < SURE_READING]
        if doubtful:
            shares = [
                f"{_WORDS[key][getattr(first.reading, key)]} by {100 * self._share(key):.0f} %" for key in doubtful
            ]
            lines.append(f"Not settled by the numbers: {', '.join(shares)}")
        return tuple(lines)

    def _share(self, key: str) -> float:
        first = getattr(self.readings[0].reading, key)
        return math.fsum(entry.probability for entry in self.readings if getattr(entry.reading, key) == first)

    @property
    def tables(self) -> tuple[Table, ...]:
        """Readings with probability and figures, and what speaks against each."""
        shown = [
            (number, entry)
            for number, entry in enumerate(self.readings[:_MOST_SHOWN], start=1)
            if entry.probability >= _SHOWN or number <= _LEAST_SHOWN
        ]
        rows = []
        for number, entry in shown:
            figures = self.figures.get(entry.reading, ReadingFigures())
            rows.append(
                [
                    number,
                    float(f"{100 * entry.probability:.2g}"),
                    ", ".join(getattr(entry.reading, key).replace("_", " ") for key in _WORDS),
                    entry.criterion > 0,
                    entry.turning_index and float(f"{entry.turning_index:.3g}"),
                    figures.tactical_diameter_lengths and float(f"{figures.tactical_diameter_lengths:.3g}"),
                    figures.overshoot_1_deg and float(f"{figures.overshoot_1_deg:.3g}"),
                ]
            )
        columns = ("", "%", "rudder, scaling, yaw-rate terms, origin", "stable", "P", "DT/L", "10/10 (deg)")
        notes = (
            "P: heading by rudder after one length (Norrbin); DT: tactical diameter at 35 deg; 10/10: first overshoot",
        )
        against = [[number, "; ".join(entry.against)] for number, entry in shown if entry.against]
        found = [screen_table("Readings", columns, rows, notes)]
        if against:
            found.append(screen_table("What speaks against them", ("", "unlike a ship of these dimensions"), against))
        return tuple(found)

    def _notices(self) -> tuple[str, ...]:
        first, found = self.readings[0], []
        if self.table.assumed:
            sizes = ", ".join(f"{key} = {getattr(self.table, key):.4g}" for key in self.table.assumed)
            found.append(f"ASSUMED, for the table does not have them: {sizes}")
        if first.against:
            found.append(f"even the first reading is unlike a ship of these dimensions: {'; '.join(first.against)}")
        if self.table.left_out:
            found.append(f"not read, and not on the card of a reading: {', '.join(self.table.left_out)}")
        if scaled_with_nominal_speed(self.table):
            found.append(
                "terms by Du' are those of forces by u v, u r and u^2 delta scaled with u0 (Yvu = Yv, Ydu = 2 Yd): "
                'speed_scale = "nominal", by which speed counts once'
            )
            if self.table.speed_scale == "instantaneous":
                found.append('the file states speed_scale = "instantaneous", by which speed counts twice')
        if len(self.readings) > 1 and self.alike(first, self.readings[1]) and first.probability < SURE_READING:
            found.append("the first two readings are one ship in practice: their figures differ by less than 5 %")
        if first.ship.vanished:
            found.append(f"by the first reading {', '.join(first.ship.vanished)} vanish to the printed digits")
        return tuple(found)


@checked
def convention(table: str | Path) -> ConventionResult:
    """Say what a table of derivatives with unstated conventions may mean: readings ranked with probabilities.

    Parameters
    ----------
    table : str or path
        ``.toml`` like a ship card, in which conventions may be missing, or rows ``name,value`` with ``length_m``,
        ``speed_mps``, at least Yv, Yr, Nv, Nr, and what else there is (``beam_m``, ``draught_m``, ``displacement_kg``
        or ``block_coefficient``, ``mass``, ``yaw_inertia``, ``centre_of_gravity_m`` forward of midships).

    Raises
    ------
    InputError
        The table is at fault, or no reading of it is a ship.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> from pathlib import Path
    >>> rows = ["length_m,175", "beam_m,25.4", "draught_m,8.5", "displacement_kg,21752550", "speed_mps,7"]
    >>> rows += ["Yv,-0.012035", "Yr,-0.00522", "Yd,-0.002578", "Nv,-0.0038436", "Nr,-0.00243", "Nd,0.00126"]
    >>> _ = Path("s175.csv").write_text("\\n".join(rows))
    >>> t2s.convention("s175.csv").readings[0].reading.yaw_rate_terms
    'total'
    """
    read = read_coefficients(table)
    weighed = with_probabilities([weigh(read, reading) for reading in possible_readings(read)])
    if not math.isfinite(weighed[0].weight):
        raise InputError(read.source, "", "no reading of it is a ship", "check its sizes and units")
    figures = {
        entry.reading: _figures(read, entry) for entry in weighed if entry.probability > _SIMULATED and _moves(read)
    }
    ranked = [
        with_diameter(entry, figures[entry.reading].tactical_diameter_lengths) if entry.reading in figures else entry
        for entry in weighed
    ]
    return ConventionResult(read, with_probabilities(ranked), figures)


def _moves(table: CoefficientTable) -> bool:
    """True if it has what a turn takes: surge that holds a speed, the rudder, terms beyond the linear."""
    ship = read_as(table, possible_readings(table)[0])
    return {"Xu", "Nd"} <= {name for name, value in ship.derivatives.items() if value}


def _figures(table: CoefficientTable, entry: RankedReading) -> ReadingFigures:
    try:
        card = parse_card(read_card_text(table, entry), table.source)
        assert isinstance(card, ManoeuvringCard)
        model = build(card)
        turn = simulate(model, Turn(math.radians(35))).figures
        zigzag = simulate(model, Zigzag(math.radians(10), math.radians(10))).figures
    except InputError:  # no mass matrix, or a motion without bounds: not a ship
        return ReadingFigures()
    overshoots = zigzag["overshoots_deg"]
    first = overshoots[0] if isinstance(overshoots, list) and overshoots else None
    L = table.length_m

    def lengths(name: str) -> float | None:
        value = turn.get(name)
        return float(value) / L if isinstance(value, int | float) and value > 0 else None

    return ReadingFigures(lengths("advance_m"), lengths("tactical_diameter_m"), first)
