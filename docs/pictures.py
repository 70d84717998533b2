"""The picture of the first page: the bundled Mariner turns, drawn as the manual is built.

A page asks for it by ``<!-- picture: turn -->``.
"""

from __future__ import annotations

import math

import numpy as np
from sphinx.application import Sphinx

from tank2sim.analysis.ensemble.results import EnsembleRequest, manoeuvre_bands
from tank2sim.arrays import Array
from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.dynamics import build
from tank2sim.simulation.manoeuvres import Turn
from tank2sim.simulation.run import simulate

MEMBERS = 200
SECONDS = {35.0: 265.0, 20.0: 295.0, 10.0: 395.0}  # by rudder angle, deg: half a circle
SCALE = 0.2  # of a metre in the units of the drawing

_BOW = ((0.5, 0.0), (0.33, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.33, -0.5))  # outline, in lengths and beams


def turn() -> str:
    """Turning circles of the Mariner to both sides, each with the band in which nine of ten such ships stay."""
    card = read_card("mariner")
    assert isinstance(card, ManoeuvringCard)
    parts = [_circle(card, side * rudder, seconds) for rudder, seconds in SECONDS.items() for side in (-1, 1)]
    parts += [_ships(card, side * max(SECONDS)) for side in (-1, 1)]
    parts += ['<path class="approach" d="M0 20V60"/>', _length(500.0)]
    label = "Turning circles of the Mariner at 35, 20 and 10 degrees of rudder, with the bands of an ensemble."
    inside = "\n".join(parts)
    return f'<svg class="turning" viewBox="-345 -212 690 277" role="img" aria-label="{label}">\n{inside}\n</svg>'


def _circle(card: ManoeuvringCard, rudder_deg: float, seconds: float) -> str:
    found = manoeuvre_bands(card, Turn(math.radians(rudder_deg)), (seconds, seconds), EnsembleRequest(MEMBERS))
    track = found.track
    assert track is not None
    low, middle, high = (line[: track.count] for line in (track.low_m, track.middle_m, track.high_m))
    band = np.concatenate([low, high[::-1]])
    east, south = _chart(middle[-1:])[0]
    text = f'<text x="{east:.0f}" y="{south + 16:.0f}" text-anchor="middle">{abs(rudder_deg):g}°</text>'
    return f'<path class="band" d="{_path(band)}Z"/>\n<path class="track" d="{_path(middle)}"/>\n{text}'


def _ships(card: ManoeuvringCard, rudder_deg: float) -> str:
    """The ship each minute of a turn."""
    seconds = SECONDS[abs(rudder_deg)]
    run = simulate(build(card), Turn(math.radians(rudder_deg)), duration_s=seconds).trajectory
    assert card.ship.beam_m is not None
    outline = np.array(_BOW) * [card.ship.length_m, card.ship.beam_m]
    shapes = []
    for time in np.arange(0.0, seconds, 60.0):
        x, y, psi = (float(np.interp(time, run.t, run[f"motion.{name}"])) for name in ("x", "y", "psi"))
        turned = outline @ np.array([[math.cos(psi), math.sin(psi)], [-math.sin(psi), math.cos(psi)]])
        shapes.append(f'<path class="ship" d="{_path(turned + np.array([x, y]))}Z"/>')
    return "\n".join(shapes)


def _length(metres: float) -> str:
    end = metres * SCALE
    bar = f'<path class="scale" d="M40 56h{end}m0-4v8m-{end}-8v8"/>'
    return f'{bar}<text x="{40 + end / 2}" y="48" text-anchor="middle">{metres:g} m</text>'


def _chart(points: Array) -> Array:
    """x and y (n, 2), m, on a chart: east to the right, north up."""
    return points[:, ::-1] * [SCALE, -SCALE]


def _path(points: Array) -> str:
    return "M" + "L".join(f"{east:.1f} {south:.1f}" for east, south in _chart(points))


def _fill(app: Sphinx, page: str, source: list[str]) -> None:
    if "<!-- picture: turn -->" in source[0]:
        source[0] = source[0].replace("<!-- picture: turn -->", turn())


def setup(app: Sphinx) -> dict[str, bool]:
    """Draw as pages are read."""
    app.connect("source-read", _fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
