"""Draws the README's pictures into ``docs/static/``, from bundled ships and made-up trials only.

The turning circles are the manual's (``docs/pictures.py``) in colours for a light background. The page on which a ship
is steered is drawn by ``docs/screenshot.py``. The poster needs Chromium; the others need nothing::

    python docs/readme_pictures.py [turning identify gap fmu stability poster]
"""

from __future__ import annotations

import io
import math
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import altair as alt
import numpy as np
import pandas as pd
import pictures
import vl_convert
from examples import make_trials
from fmpy import simulate_fmu
from PIL import Image

import tank2sim as t2s

STATIC = Path(__file__).parent / "static"
WIDTH, HEIGHT = 640, 400  # of a picture, pixels
BLUE, ORANGE, GREY = "#0b5cad", "#d1570a", "#6b7280"
STYLE = f"""<style>
.band {{ fill: {BLUE}; opacity: 0.18; }}
.track {{ fill: none; stroke: {BLUE}; stroke-width: 2; }}
.ship {{ fill: #1f2937; }}
.scale, .approach {{ fill: none; stroke: {GREY}; stroke-width: 1.5; }}
.approach {{ stroke-dasharray: 4 3; }}
text {{ fill: #374151; font: 20px sans-serif; }}
</style><rect x="-365" y="-222" width="730" height="300" fill="white"/>"""


def turning(folder: Path) -> bytes:
    """Turning circles of the Mariner with the bands of an ensemble."""
    _, inside = pictures.turn().split("\n", 1)
    # Letters are larger than the manual's: those of the innermost circle are moved inwards to have room.
    inside = re.sub(r'x="(-?)(\d+)"([^>]*>35°)', lambda text: f'x="{text[1]}{int(text[2]) - 14}"{text[3]}', inside)
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="730" height="300" viewBox="-365 -222 730 300">'
    return small(vl_convert.svg_to_png(f"{head}\n{STYLE}{inside}", scale=2.0))


def identify(folder: Path) -> bytes:
    """Error of the heading in a zigzag held out, by the card before and as identified from two other trials."""
    make_trials.write(folder, "damping")
    fit = t2s.identify("mariner", [folder / "zigzag.csv", folder / "turn.csv"], hold=["Xuuu"], members=0)
    measured = pd.read_csv(folder / "held_out.csv")
    errors = []
    for name, ship in {"card before": t2s.load("mariner"), "identified": fit.ship}.items():
        run = ship.steer(measured[["t_s", "delta_order_deg"]], duration_s=300.0).df
        error = np.interp(measured.t_s, run.t_s, run.psi_deg) - measured.psi_deg
        errors.append(pd.DataFrame({"t_s": measured.t_s, "error": error, "of": name}))
    line = chart(pd.concat(errors).iloc[::2]).mark_line(strokeWidth=3)
    return drawn(colours(line, "t_s", "error", ["card before", "identified"]), "t (s)", "error of heading (°)")


def gap(folder: Path) -> bytes:
    """Track of a zigzag held out: measured, by the card, by the card with the effect that was found."""
    make_trials.write(folder, "current")
    trials = [folder / "zigzag.csv", folder / "turn.csv"]
    found = t2s.find_gap("mariner", trials, holdout=[folder / "held_out.csv"], max_effects=1)
    if set(found.effects.reset_index()["effect"]) != {"current"}:
        raise SystemExit(f"the gap's picture shows a current, but found was\n{found}")
    orders = pd.read_csv(folder / "held_out.csv")
    ships = {"card": t2s.load("mariner"), "card with the current found": found.ship}
    steered = orders[["t_s", "delta_order_deg"]]
    frames = [ship.steer(steered, duration_s=299.0).df.assign(of=name) for name, ship in ships.items()]
    line = chart(pd.concat(frames).iloc[::10]).mark_line(strokeWidth=3).encode(order="t_s:Q")
    track = dots(orders.iloc[::12], "x_m", "y_m") + colours(line, "x_m", "y_m", list(ships))
    return drawn(track, "north (m)", "east (m)")


def fmu(folder: Path) -> bytes:
    """Yaw rate of the FMU in FMPy on that of the card's model."""
    ship = t2s.load("mariner")
    made = ship.to_fmu(folder / "mariner.fmu", fmi=3)
    run = ship.zigzag(20, 20, duration_s=300.0).df
    types = [("time", float), ("rudder.command", float)]
    orders = np.array(list(zip(run.t_s, np.radians(run.delta_order_deg), strict=True)), dtype=types)
    steps = {"output_interval": 0.1, "stop_time": 300.0, "fmi_type": "CoSimulation"}
    motion = simulate_fmu(str(made.path), input=orders, output=["motion.r"], **steps)
    shown = pd.DataFrame({"t_s": motion["time"], "r_degps": np.degrees(motion["motion.r"])}).iloc[::60]
    model = chart(run.assign(of="model of the card").iloc[::5]).mark_line(strokeWidth=3)
    return drawn(
        colours(model, "t_s", "r_degps", ["model of the card"]) + dots(shown, "t_s", "r_degps", "FMU in FMPy"),
        "t (s)",
        "r (°/s)",
    )


def stability(folder: Path) -> bytes:
    """Steady turning of the KVLCC2, which is unstable on a straight course: the loop and the branch through it."""
    turns = t2s.load("kvlcc2").stability(spirals=False).study.turning
    assert turns is not None
    curve = pd.DataFrame({"delta": np.degrees(turns.rudder_rad), "r": np.degrees(turns.yaw_rate_radps)})
    curve["of"] = np.where(turns.stable, "stable", "unstable")
    curve["piece"] = (curve["of"] != curve["of"].shift()).cumsum()
    line = chart(curve[curve.delta.abs() <= 15.0]).mark_line(strokeWidth=4).encode(detail="piece:N", order="r:Q")
    return drawn(colours(line, "delta", "r", ["stable", "unstable"], [BLUE, ORANGE]), "rudder (°)", "yaw rate (°/s)")


def poster(folder: Path) -> bytes:
    """The first part of the Mariner's wheelhouse poster as a browser shows it."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("Chromium, which opens the poster, is not installed")
    command = Path(sys.executable).with_name("tank2sim")
    subprocess.run([command, "poster", "mariner", "-o", "poster.html"], cwd=folder, check=True, capture_output=True)
    flags = "--headless --no-sandbox --disable-gpu --no-first-run --hide-scrollbars --window-size=1587,1123".split()
    taken = [f"--user-data-dir={folder / 'profile'}", f"--screenshot={folder / 'page.png'}"]
    page = (folder / "poster.html").as_uri()
    subprocess.run([chromium, *flags, *taken, page], check=True, capture_output=True, timeout=120)
    return small((folder / "page.png").read_bytes(), (0, 30, 760, 605))


def chart(frame: pd.DataFrame) -> alt.Chart:
    """A chart of a table without limit on its rows."""
    return alt.Chart(alt.Data(values=frame.to_dict("records")))


def dots(frame: pd.DataFrame, x: str, y: str, name: str = "measured (made up)") -> alt.Chart:
    """What was measured, as grey rings with their name in the legend."""
    shape = alt.Shape("of:N", scale=alt.Scale(domain=[name], range=["circle"]), title=None)
    rings = chart(frame.assign(of=name)).mark_point(size=70, strokeWidth=2, color=GREY)
    return rings.encode(x=alt.X(f"{x}:Q"), y=alt.Y(f"{y}:Q"), shape=shape)


def colours(line: alt.Chart, x: str, y: str, names: list[str], colour: list[str] | None = None) -> alt.Chart:
    """A line for each name."""
    pens = alt.Scale(domain=names, range=colour or ([ORANGE, BLUE] if len(names) > 1 else [BLUE]))
    axes = {"x": alt.X(f"{x}:Q", scale=alt.Scale(zero=False)), "y": alt.Y(f"{y}:Q", scale=alt.Scale(zero=False))}
    return line.encode(**axes, color=alt.Color("of:N", scale=pens, title=None))


def drawn(layers: alt.Chart, x: str, y: str) -> bytes:
    """A chart as PNG with letters that are readable when it is small."""
    layers = layers.resolve_legend(color="independent", shape="independent") if hasattr(layers, "layer") else layers
    sized = layers.properties(width=WIDTH - 90, height=HEIGHT - 130, background="white")
    specification = sized.configure_axis(
        labelFontSize=20, titleFontSize=20, titleFontWeight="normal", tickCount=5, gridColor="#e5e7eb"
    ).configure_legend(
        orient="top", direction="horizontal", labelFontSize=20, labelLimit=400, symbolSize=250, symbolStrokeWidth=4
    )
    content = specification.to_dict()
    for layer in content.get("layer", [content]):
        layer["encoding"]["x"]["title"], layer["encoding"]["y"]["title"] = x, y
    return small(vl_convert.vegalite_to_png(content, scale=1.5))


def small(png: bytes, part: tuple[int, int, int, int] | None = None) -> bytes:
    """The picture, or a part of it (left, top, right, bottom, pixels), with at most 128 colours."""
    picture = Image.open(io.BytesIO(png)).convert("RGB").crop(part)
    target = io.BytesIO()
    picture.quantize(128, dither=Image.Dither.NONE).save(target, "PNG", optimize=True)
    return target.getvalue()


DRAWINGS = {
    "turning": turning,
    "identify": identify,
    "gap": gap,
    "fmu": fmu,
    "stability": stability,
    "poster": poster,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or DRAWINGS:
        with tempfile.TemporaryDirectory() as own:
            target = STATIC / f"{name}.png"
            target.write_bytes(DRAWINGS[name](Path(own)))
        print(f"{target}: {math.ceil(target.stat().st_size / 1000)} kB")
