"""Drawings of the wheelhouse poster: turning circles and stopping tracks, as lines and words in mm of paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tank2sim.apps.bridge.ship_track import ShipTrack, TrackMark
from tank2sim.records.thinning import thin_line
from tank2sim.units import KNOT_MPS, rounded_up

_MARGIN_MM = 5.0
_POINTS = 400
_CHARACTER_MM, _LINE_MM = 1.55, 2.8
"""Width of a character of a label and height of a line, rather too much than too little."""
_OFFSETS_MM = (1.6, 3.4, 5.5)
"""Distances of a label from its point, the nearest preferred."""
_FULL_TURN_DEG = 350.0
"""From here on a circle is back among other lines: its label would be read as theirs, and the table has the time."""


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


@dataclass(frozen=True)
class _Block:
    """A rectangle of paper, mm."""

    left: float
    top: float
    width: float
    height: float

    def meets(self, block: _Block) -> bool:
        """True if both have paper in common."""
        across = self.left < block.left + block.width and block.left < self.left + self.width
        return across and self.top < block.top + block.height and block.top < self.top + self.height

    def holds(self, x: float, y: float) -> bool:
        """True if the point lies in it."""
        return 0 <= x - self.left <= self.width and 0 <= y - self.top <= self.height


@dataclass
class _Labels:
    """Places labels one by one: none over another, within the paper, and over as little of the tracks as may be."""

    paper: _Block
    points: list[tuple[float, float]]
    taken: list[_Block]

    def place(self, at: tuple[float, float], texts: Sequence[str], style: str = "word") -> list[Word]:
        """The lines of a label near a point; none without room, for the table has the numbers."""
        width, height = _CHARACTER_MM * max(map(len, texts)), _LINE_MM * len(texts)
        best: tuple[float, _Block] | None = None
        for distance in _OFFSETS_MM:
            for step in range(16):
                angle = math.tau * step / 16
                across, up = math.sin(angle), math.cos(angle)
                middle = (at[0] + (distance + width / 2) * across, at[1] - (distance + height / 2) * up)
                block = _Block(middle[0] - width / 2, middle[1] - height / 2, width, height)
                if not self._is_free(block):
                    continue
                cost = sum(block.holds(*point) for point in self.points) + 3 * distance
                if best is None or cost < best[0]:
                    best = cost, block
        if best is None:
            return []
        block = best[1]
        self.taken.append(block)
        x, y = block.left + width / 2, block.top + 0.8 * _LINE_MM
        return [Word(x, y + _LINE_MM * line, text, "middle", style) for line, text in enumerate(texts)]

    def _is_free(self, block: _Block) -> bool:
        paper = self.paper
        across = paper.left <= block.left and block.left + block.width <= paper.left + paper.width
        within = across and paper.top <= block.top and block.top + block.height <= paper.top + paper.height
        return within and not any(block.meets(block_taken) for block_taken in self.taken)


def circles_drawing(
    circles: Sequence[ShipTrack], length_m: float, beam_m: float | None, *, width: float, height: float
) -> Drawing:
    """Both turning circles over a grid, with heading, time and speed at each quarter, and the ship at the order.

    A track ends where it leaves the card's range, and says so. Its outline is to scale, and left out where the card has
    no beam.
    """
    across = [float(distance) for path in circles for distance in path.starboard_m[: path.inside]]
    up = [float(distance) for path in circles for distance in path.ahead_m[: path.inside]]
    frame = _Frame(width, height, (min(across), min(*up, -length_m / 2)), (max(across), max(*up, length_m / 2)))
    grid, numbers = _grid(frame)
    lines, dots = list(grid), []
    captions: list[tuple[tuple[float, float], list[str], str]] = []
    for path in circles:
        ahead, starboard = path.ahead_m[: path.inside], path.starboard_m[: path.inside]
        kept = thin_line([ahead, starboard], _POINTS)
        lines.append(Line(frame.points(starboard[kept].tolist(), ahead[kept].tolist()), f"track {path.name}"))
        for mark in path.marks:
            if not path.outside(mark):
                at = frame.place(mark.starboard_m, mark.ahead_m)
                dots.append(at)
                if mark.heading_change_deg < _FULL_TURN_DEG:
                    captions.append((at, _mark_lines(mark), "word"))
        if path.range_exit and path.inside < len(path.ahead_m):
            at = frame.place(path.range_exit.starboard_m, path.range_exit.ahead_m)
            dots.append(at)
            captions.append((at, ["range of the card ends", *_mark_lines(path.range_exit)], "warn"))
    labels = _Labels(_Block(0, 0, width, height), _sampled(frame, circles), _blocks(numbers, dots))
    words = [*numbers, *(word for at, texts, style in captions for word in labels.place(at, texts, style))]
    if beam_m:
        lines.append(Line(_outline(frame, length_m, beam_m), "ship"))
    sides = "; ".join(f"to {path.name}" for path in circles)
    return Drawing(width, height, tuple(lines), tuple(dots), tuple(words), f"Turning circles {sides}.")


def _mark_lines(mark: TrackMark) -> list[str]:
    return [f"{round(mark.heading_change_deg)}°  {clock(mark.time_s)}", f"{knots(mark.speed_mps)} kn"]


def _sampled(frame: _Frame, circles: Sequence[ShipTrack]) -> list[tuple[float, float]]:
    """Points along the tracks, on paper."""
    points = []
    for path in circles:
        every = max(1, path.inside // _POINTS)
        pairs = zip(path.starboard_m[: path.inside : every], path.ahead_m[: path.inside : every], strict=True)
        points += [frame.place(float(across), float(up)) for across, up in pairs]
    return points


def _blocks(words: Sequence[Word], dots: Sequence[tuple[float, float]]) -> list[_Block]:
    """Areas covered by numbers of the grid and dots."""
    found = [_Block(x - 1, y - 1, 2, 2) for x, y in dots]
    for word in words:
        width = _CHARACTER_MM * len(word.text)
        start = word.x - {"start": 0.0, "middle": width / 2, "end": width}[word.anchor]
        found.append(_Block(start, word.y - 2.2, width, _LINE_MM))
    return found


def _outline(frame: _Frame, length: float, beam: float) -> str:
    half, bow = beam / 2, length / 2
    corners = ((0.0, bow), (half, 0.3 * length), (half, -bow), (-half, -bow), (-half, 0.3 * length), (0.0, bow))
    return frame.points([corner[0] for corner in corners], [corner[1] for corner in corners])


def _grid(frame: _Frame) -> tuple[tuple[Line, ...], tuple[Word, ...]]:
    """Lines at a round number of metres over the whole drawing, with their distances along two sides."""
    step = rounded_up(15.0 / frame.scale)
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


def stops_drawing(stops: Sequence[ShipTrack], *, width: float, height: float) -> Drawing:
    """Stopping tracks side by side from one line, with time and speed along them; one scale for all, ahead is up.

    Each ends where it leaves the card's range, and says so.
    """
    longest = max(float(path.ahead_m[: path.inside].max()) for path in stops) or 1.0
    aside = max(float(abs(path.starboard_m[: path.inside]).max()) for path in stops)
    base, top = height - 9.0, 6.0
    column = width / len(stops)
    scale = min((base - top) / longest, (column / 2 - 20.0) / aside if aside > 0 else math.inf)
    lines = [Line(f"0,{base:g} {width:g},{base:g}", "axis")]
    dots, words = [], []
    for number, path in enumerate(stops):
        zero = (number + 0.3) * column
        starboard, ahead = path.starboard_m[: path.inside], path.ahead_m[: path.inside]
        kept = thin_line([starboard, ahead], _POINTS)
        pairs = zip(starboard[kept], ahead[kept], strict=True)
        lines.append(Line(" ".join(f"{zero + scale * a:.2f},{base - scale * b:.2f}" for a, b in pairs), "track stop"))
        last, right = -math.inf, zero + scale * float(starboard.max())
        # The marks crowd together where the ship is slow: the last one counts, so they are reported from the end.
        ends = [(path.range_exit, "warn")] if path.range_exit else []
        within = [(mark, "word") for mark in reversed(path.marks) if not path.outside(mark)]
        for mark, style in (*ends, *within):
            x, y = zero + scale * mark.starboard_m, base - scale * mark.ahead_m
            dots.append((round(x, 2), round(y, 2)))
            if y - last >= 3.2:
                text = f"{clock(mark.time_s)}  {metres(mark.ahead_m)} m  {knots(mark.speed_mps)} kn"
                words.append(Word(right + 2.0, y + 0.9, text, "start", style))
                last = y
                if style == "warn":
                    words.append(Word(right + 2.0, y - 2.2, "range of the card ends", "start", style))
        words.append(Word(zero - 0.2 * column, height - 2.0, path.name, "start", "title"))
    return Drawing(width, height, tuple(lines), tuple(dots), tuple(words), "Stopping tracks with time and speed.")
