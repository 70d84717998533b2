"""Drawings of the wheelhouse poster: turning circles and stopping tracks, as lines and words in mm of paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tank2sim.analysis.practice.bridge import Mark, ShipTrack
from tank2sim.report.thinning import thin_line
from tank2sim.units import KNOT_MPS

_MARGIN_MM = 5.0
_POINTS = 400


@dataclass(frozen=True)
class Line:
    """A line: SVG points in mm, and the style class that it has."""

    points: str
    style: str


@dataclass(frozen=True)
class Word:
    """Words at a place (mm), `anchor` start, middle or end."""

    x: float
    y: float
    text: str
    anchor: str = "middle"
    style: str = "word"


@dataclass(frozen=True)
class Drawing:
    """All of one drawing, `width` x `height` mm, and what it shows in words."""

    width: float
    height: float
    lines: tuple[Line, ...]
    dots: tuple[tuple[float, float], ...]
    words: tuple[Word, ...]
    description: str


@dataclass(frozen=True)
class _Frame:
    """Metres to millimetres of paper, one scale for both: ahead is up, starboard to the right."""

    width: float
    height: float
    low: tuple[float, float]
    high: tuple[float, float]

    @property
    def scale(self) -> float:
        across = max(self.high[0] - self.low[0], 1e-9)
        up = max(self.high[1] - self.low[1], 1e-9)
        return min((self.width - 2 * _MARGIN_MM) / across, (self.height - 2 * _MARGIN_MM) / up)

    def place(self, starboard: float, ahead: float) -> tuple[float, float]:
        middle = (self.low[0] + self.high[0]) / 2, (self.low[1] + self.high[1]) / 2
        x = self.width / 2 + self.scale * (starboard - middle[0])
        return round(x, 2), round(self.height / 2 - self.scale * (ahead - middle[1]), 2)

    def points(self, starboard: Sequence[float], ahead: Sequence[float]) -> str:
        pairs = (self.place(a, b) for a, b in zip(starboard, ahead, strict=True))
        return " ".join(f"{x:g},{y:g}" for x, y in pairs)


def clock(seconds: float) -> str:
    """Minutes and seconds: ``4:18``."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d}"


def knots(speed_mps: float) -> str:
    """Speed in knots, a tenth; two decimals for models."""
    speed = speed_mps / KNOT_MPS
    return f"{speed:.1f}" if speed >= 2 else f"{speed:.2f}"


def metres(distance: float) -> str:
    """Whole metres, or with decimals where they are few."""
    return f"{distance:.0f}" if abs(distance) >= 100 else f"{distance:.1f}"


def circles_drawing(
    circles: Sequence[ShipTrack], length_m: float, beam_m: float | None, *, width: float, height: float
) -> Drawing:
    """Both turning circles over a grid, with heading, time and speed at each quarter, and the ship at the order.

    Her outline is to scale, and left out where the card has no beam.
    """
    across = [float(one) for path in circles for one in path.starboard_m]
    up = [float(one) for path in circles for one in path.ahead_m]
    low = min(across), min(*up, -length_m / 2)
    frame = _Frame(width, height, low, (max(across), max(up)))
    grid, numbers = _grid(frame)
    lines, dots, words = list(grid), [], list(numbers)
    for path in circles:
        kept = thin_line([path.starboard_m, path.ahead_m], _POINTS)
        points = frame.points(path.starboard_m[kept].tolist(), path.ahead_m[kept].tolist())
        lines.append(Line(points, f"track {path.name}"))
        side = 1 if path.name == "starboard" else -1
        for place, mark in enumerate(path.marks):
            at = frame.place(mark.starboard_m, mark.ahead_m)
            dots.append(at)
            words += _label(mark, at, place, side)
    if beam_m:
        lines.append(Line(_outline(frame, length_m, beam_m), "ship"))
    told = "; ".join(f"to {path.name}" for path in circles)
    return Drawing(width, height, tuple(lines), tuple(dots), tuple(words), f"Turning circles {told}.")


def _label(mark: Mark, at: tuple[float, float], place: int, side: int) -> list[Word]:
    """Two lines inside the circle, where there is room; none at the full turn, which is back among other lines."""
    beside = "end" if side > 0 else "start"
    moves = ((0.0, 4.0, "middle"), (-1.8 * side, -0.4, beside), (0.0, -4.6, "middle"))
    if place >= len(moves):
        return []
    dx, dy, anchor = moves[place]
    x, y = at[0] + dx, at[1] + dy
    texts = f"{round(mark.heading_deg)}°  {clock(mark.time_s)}", f"{knots(mark.speed_mps)} kn"
    return [Word(x, y + 2.8 * line, text, anchor) for line, text in enumerate(texts)]


def _outline(frame: _Frame, length: float, beam: float) -> str:
    half, bow = beam / 2, length / 2
    corners = ((0.0, bow), (half, 0.3 * length), (half, -bow), (-half, -bow), (-half, 0.3 * length), (0.0, bow))
    return frame.points([one[0] for one in corners], [one[1] for one in corners])


def _grid(frame: _Frame) -> tuple[tuple[Line, ...], tuple[Word, ...]]:
    """Lines at a round number of metres over the whole drawing, with their distances along two sides."""
    step = _round_step(15.0 / frame.scale)
    lines, words = [], []
    middle = (frame.low[0] + frame.high[0]) / 2, (frame.low[1] + frame.high[1]) / 2
    reach = frame.width / 2 / frame.scale, frame.height / 2 / frame.scale
    for number in range(math.ceil((middle[0] - reach[0]) / step), math.floor((middle[0] + reach[0]) / step) + 1):
        x, _ = frame.place(number * step, 0.0)
        lines.append(Line(f"{x:g},0 {x:g},{frame.height:g}", "grid" if number else "axis"))
        if 8 < x < frame.width - 12:
            words.append(Word(x, frame.height - 1.2, f"{number * step:g}", "middle", "grid-word"))
    for number in range(math.ceil((middle[1] - reach[1]) / step), math.floor((middle[1] + reach[1]) / step) + 1):
        _, y = frame.place(0.0, number * step)
        lines.append(Line(f"0,{y:g} {frame.width:g},{y:g}", "grid" if number else "axis"))
        if 3 < y < frame.height - 5:
            words.append(Word(1.2, y - 0.8, f"{number * step:g}", "start", "grid-word"))
    words.append(Word(frame.width - 1.2, frame.height - 1.2, "m", "end", "grid-word"))
    return tuple(lines), tuple(words)


def _round_step(wanted: float) -> float:
    decade = 10.0 ** math.floor(math.log10(wanted))
    return next(one * decade for one in (1, 2, 5, 10) if one * decade >= wanted * (1 - 1e-9))


def stops_drawing(stops: Sequence[ShipTrack], *, width: float, height: float) -> Drawing:
    """Stopping tracks side by side from one line, with time and speed along them; one scale for all, ahead is up."""
    longest = max(float(path.ahead_m.max()) for path in stops)
    aside = max(float(abs(path.starboard_m).max()) for path in stops)
    base, top = height - 9.0, 6.0
    column = width / len(stops)
    scale = min((base - top) / longest, (column / 2 - 20.0) / aside if aside > 0 else math.inf)
    lines = [Line(f"0,{base:g} {width:g},{base:g}", "axis")]
    dots, words = [], []
    for number, path in enumerate(stops):
        zero = (number + 0.3) * column
        kept = thin_line([path.starboard_m, path.ahead_m], _POINTS)
        pairs = zip(path.starboard_m[kept], path.ahead_m[kept], strict=True)
        lines.append(Line(" ".join(f"{zero + scale * a:.2f},{base - scale * b:.2f}" for a, b in pairs), "track stop"))
        last = -math.inf
        # The marks crowd together where the ship is slow: the last one counts, so they are told from the end.
        for mark in reversed(path.marks):
            x, y = zero + scale * mark.starboard_m, base - scale * mark.ahead_m
            dots.append((round(x, 2), round(y, 2)))
            if y - last >= 3.2:
                text = f"{clock(mark.time_s)}  {metres(mark.ahead_m)} m  {knots(mark.speed_mps)} kn"
                words.append(Word(x + 2.0, y + 0.9, text, "start"))
                last = y
        words.append(Word(zero - 0.2 * column, height - 2.0, path.name, "start", "title"))
    return Drawing(width, height, tuple(lines), tuple(dots), tuple(words), "Stopping tracks with time and speed.")
