"""The steering page driven in a browser."""

import csv
import io
import json
import re
from html import unescape

import numpy as np
import pytest

from tests.answer.opened_page import CHROMIUM, opened

in_browser = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed to open the page in"),
]

# Frames by the clock, for a headless browser draws none that nobody asks for.
FRAMES = "<script>window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);</script>"

# Keeps what the page saves; then does `steps` one after the other and tells what came of it.
DRIVE = """<script>{{
  const saved = [];
  const made = URL.createObjectURL;
  URL.createObjectURL = (blob) => {{ saved.push(blob.text()); return made.call(URL, blob); }};
  const at = (name) => document.getElementById(name);
  const click = (name) => at(name).click();
  const put = (name, value, kind) => {{
    at(name).value = value;
    at(name).dispatchEvent(new Event(kind, {{ bubbles: true }}));
  }};
  const press = (key, rest) =>
    document.body.dispatchEvent(new KeyboardEvent("keydown", {{ key, bubbles: true, ...rest }}));
  const ready = setInterval(async () => {{
    if (document.documentElement.dataset.ship !== "ready") return;
    clearInterval(ready);
    const seen = {{}};
    {steps}
    const read = (one) => at(one).textContent;
    seen.said = read("said");
    for (const one of document.querySelectorAll("[id^=read-], output")) seen[one.id] = read(one.id);
    document.body.dataset.seen = JSON.stringify({{ ...seen, saved: await Promise.all(saved) }});
  }}, 50);
}}</script>"""


def sailed(html, folder, steps, *flags):
    """What the page reported after these steps, and the voyages that it saved."""
    html = html.replace("<body>", "<body>" + FRAMES).replace("</body>", DRIVE.format(steps=steps) + "</body>")
    seen, console = opened(html, folder, *flags)
    assert console == [], console
    seen = json.loads(unescape(re.search(r'data-seen="(.*?)"', seen)[1]))
    voyages = []
    for text in seen.pop("saved"):
        lines = [one for one in text.splitlines() if not one.startswith("#")]
        rows = list(csv.DictReader(io.StringIO("\n".join(lines))))
        voyages.append({name: np.array([float(row[name]) for row in rows]) for name in rows[0]})
    return seen, voyages


def data_of(html):
    return json.loads(re.search(r'id="ship">(.*?)</script>', html, re.DOTALL)[1])
