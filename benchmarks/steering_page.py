"""Frames of the page of ``steer`` in a headless Chromium: the Esso Osaka in the bundled channel with twenty members.

The ship sails on autopilot while the page predicts 6 minutes; frames are counted by the clock of the browser, for each
pace and width. There is no graphics processor: Chromium draws with the processor, which is the harder case. `work` is
the time of one frame in the page's own code, stepping and drawing commands; a frame of 50 in a second has 20 ms. The
same is measured with the view from the bridge (``--view-3d``) in place of the chart. Needs
Chromium and the extra `platforms`::

    python benchmarks/steering_page.py
"""

from __future__ import annotations

import http.server
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np

from tank2sim.apps.steering.command import make_steering_page
from tank2sim.ship import load

SECONDS = 12
PACES = (5, 50)
SIZES = {"1400": (1400, 900), "400": (500, 900)}  # Chromium has no narrower window; the page is in a frame of 400 px
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
FLAGS = (
    "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --hide-scrollbars"
).split()
WEBGL = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # drawn by the processor

MEASURE = """<script>{
  const asked = window.requestAnimationFrame.bind(window);
  const [began, work] = [[], []];
  window.requestAnimationFrame = (draw) => asked((now) => {
    const before = performance.now();
    draw(now);
    began.push(before);
    work.push(performance.now() - before);
  });
  const ready = setInterval(() => {
    if (document.documentElement.dataset.ship !== "ready") return;
    clearInterval(ready);
    const at = (name) => document.getElementById(name);
    at("factor").value = "PACE";
    at("ahead").value = "360";
    at("course").value = "000";
    at("autopilot").click();
    at("view-3d")?.click();
    at("run").click();
    setTimeout(() => {
      const members = [...document.querySelectorAll("#members")].filter((one) => one.checked).length;
      const found = { began, work, members, said: at("said").textContent, width: innerWidth };
      fetch("/frames", { method: "POST", body: JSON.stringify(found) });
    }, SECONDS * 1000);
  }, 20);
}</script>"""


def frames(page: str, pace: int, size: tuple[int, int], width: int) -> dict[str, object]:
    """What a browser found out about its frames at a pace."""
    script = MEASURE.replace("PACE", str(pace)).replace("SECONDS", str(SECONDS))
    page = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page)
    shown = page.replace("<body>", "<body>" + script).encode()
    outer = f'<body style="margin:0"><iframe src="/page" style="border:0;width:{width}px;height:{size[1]}px">'.encode()
    found: list[dict[str, object]] = []
    done = threading.Event()

    class Answer(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = shown if self.path == "/page" else outer
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(body)

        def do_POST(self) -> None:
            found.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()
            done.set()

        def log_message(self, format: str, *values: object) -> None:
            pass

    with (
        http.server.ThreadingHTTPServer(("127.0.0.1", 0), Answer) as server,
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
    ):
        threading.Thread(target=server.serve_forever, daemon=True).start()
        flags = [flag for flag in FLAGS if flag != "--disable-gpu"] + [*WEBGL] if 'id="view-3d"' in page else FLAGS
        words = [f"--user-data-dir={profile}", f"--window-size={size[0]},{size[1]}", "--remote-debugging-port=0"]
        address = f"http://127.0.0.1:{server.server_port}/"
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        with subprocess.Popen([str(CHROMIUM), *flags, *words, address], **quiet) as browser:
            done.wait(SECONDS + 60)
            browser.terminate()
        server.shutdown()
    return found[0] if found else {}


def main() -> int:
    """Print the frames; 2 where Chromium or the compiler is missing."""
    ship = load("esso-osaka-ship")
    result = make_steering_page(ship, scenario="channel")
    if CHROMIUM is None or result.library is None:
        print("needs Chromium and the extra platforms")
        return 2
    model = next((line.split(":")[1].strip() for line in _processor() if line.startswith("model name")), "")
    print(
        f"{platform.machine()}, {model}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; "
        "no graphics processor"
    )
    print(f"{len(result.members)} members, 6 minutes predicted")
    print_frames("chart", result.page())
    print_frames("view from the bridge", make_steering_page(ship, scenario="channel", view_3d=True).page())
    return 0


def print_frames(shown: str, page: str) -> None:
    """Print the size of a page, and its frames at each width and pace."""
    print(f"{shown}: a page of {len(page.encode()) / 1e3:.0f} kB")
    for name, size in SIZES.items():
        for pace in PACES:
            found = frames(page, pace, size, int(name))
            if not found:
                print(f"{name} px, {pace} times: the browser did not answer")
                continue
            gaps = np.diff(np.array(found["began"]))[20:]
            work = np.array(found["work"])[20:]
            print(
                f"{found['width']} px, {pace:2} times real time: {1000 / np.mean(gaps):4.1f} frames a second "
                f"(gap median {np.median(gaps):.1f}, 95 % {np.percentile(gaps, 95):.1f} ms); "
                f"work median {np.median(work):.1f}, 95 % {np.percentile(work, 95):.1f} ms"
            )


def _processor() -> list[str]:
    file = Path("/proc/cpuinfo")
    return file.read_text(encoding="utf-8").splitlines() if file.exists() else []


if __name__ == "__main__":
    sys.exit(main())
