"""The ship in the page: JavaScript of the model's equations, run by Node and compared with the simulation."""

from __future__ import annotations

import json
import shutil
import subprocess

import casadi as ca
import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.apps.steering.ship import ship_equations, ship_tables
from tank2sim.bundled import bundled
from tank2sim.native.javascript import javascript_function
from tank2sim.simulation.integrator import Integrator
from tank2sim.simulation.running import Running

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="Node, which runs JavaScript, is not installed")


def run(script: str, folder) -> object:
    path = folder / "script.js"
    path.write_text(script, encoding="utf-8")
    done = subprocess.run([NODE, path], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


SAIL = """
const data = {data};
const ship = new Ship(data);
const read = ship.reader({names});
ship.begin({start});
const rows = [];
for (let step = 0; step < {steps}; ++step) {{
  if (step === {steps} / 2) ship.set("{input}", {order});
  if (step % 100 === 0) rows.push([...read()]);
  ship.step(step * {h}, {h});
}}
rows.push([...read()]);
console.log(JSON.stringify(rows));
"""


@pytest.mark.parametrize(
    ("card", "order"), [("mariner", 0.6), ("kvlcc2-l7-mmg", -0.3), ("esso-osaka-ship", 0.4), ("container", 0.2)]
)
def test_a_ship_sails_as_in_the_simulation_to_twelve_digits(card: str, order: float, tmp_path) -> None:
    model = t2s.load(card).model
    names = ["motion.x", "motion.y", "motion.psi", "motion.u", "motion.r", "rudder.angle", "motion.beta", "validity"]
    steps, h = 2000, model.step_s
    script = ship_equations(model) + bundled_script() + SAIL.format(
        data=json.dumps(ship_tables(model)), names=json.dumps(names), start="{}", steps=steps, input="rudder.command",
        order=order, h=h,
    )  # fmt: skip
    found = np.array(run(script, tmp_path))
    running = Running(Integrator(model))
    running.run(steps / 2 * h)
    running.order({"rudder.command": order})
    running.run(steps / 2 * h)
    truth = running.trajectory()
    for place, name in enumerate(names):
        expected = np.interp(np.arange(0, steps + 1, 100) * h, truth.t, truth[name])
        scale = np.abs(expected).max() or 1.0
        assert found[:, place] == pytest.approx(expected, rel=1e-9, abs=1e-11 * scale + 1e-12)


def bundled_script() -> str:
    from tank2sim.answer.page import resource_text

    return resource_text("apps/steering/ship.js").replace('"use strict";', "")


def test_what_cannot_be_set_and_a_motion_without_bounds_are_refused(tmp_path) -> None:
    model = t2s.load("mariner").model
    script = (
        ship_equations(model)
        + bundled_script()
        + f"""
const ship = new Ship({json.dumps(ship_tables(model))});
const tried = (what) => {{ try {{ what(); return ""; }} catch (error) {{ return error.message; }} }};
const found = [];
ship.begin({{}});
found.push(tried(() => ship.set("rudder.command", NaN)));
found.push(tried(() => ship.set("initial.u", 1e9)));
found.push(tried(() => ship.begin({{ "initial.u": NaN }})));
ship.begin({{}});
ship.keep();
const before = ship.get("motion.x");
ship.step(0, 0.1);
const moved = ship.get("motion.x");
ship.back();
found.push([before, moved, ship.get("motion.x")]);
ship.x[0] = 1e250;
found.push(tried(() => ship.step(0, 0.1)));
console.log(JSON.stringify(found));
"""
    )
    refused, far, none, (before, moved, again), beyond = run(script, tmp_path)  # type: ignore[misc]
    assert refused == "rudder.command cannot be NaN"
    assert "initial.u" in far and "initial.u" in none
    assert moved > before == again
    assert "leaves all bounds" in beyond


def test_every_operation_has_the_value_of_casadi(tmp_path) -> None:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    operations = [
        *(a + b, a - b, a * b, a / b, ca.fmod(a, b), -a, 1 / a, a * a, 2 * a, ca.if_else(a < b, a, b)),
        *(a < b, a <= b, a == b, a != b, ca.logic_and(a, b), ca.logic_or(a, 0), ca.logic_not(a), ca.fabs(a)),
        *(ca.sqrt(ca.fabs(a)), ca.sign(a), ca.fmin(a, b), ca.fmax(a, b), ca.sin(a), ca.cos(a), ca.tan(a)),
        *(ca.asin(a / 9), ca.acos(a / 9), ca.atan(a), ca.atan2(a, b), ca.exp(a), ca.log(ca.fabs(a)), ca.floor(a)),
        *(ca.ceil(a), ca.sinh(a), ca.cosh(a), ca.tanh(a), ca.fabs(a) ** b, ca.copysign(a, b), ca.hypot(a, b)),
        *(ca.log1p(ca.fabs(a)), ca.expm1(a), a**3),
    ]
    function = ca.Function("f", [ca.vertcat(a, b)], [ca.densify(ca.vertcat(*operations))])
    points = [[1.3, -0.4], [-2.5, 1.75], [0.0, 3.0], [2.0, 2.0]]
    script = javascript_function(function, "f") + (
        f"const found = {json.dumps(points)}.map((point) => {{ const out = new Array({len(operations)}); f(point, out);"
        " return out.map((one) => Number.isFinite(one) ? one : String(one)); });console.log(JSON.stringify(found));"
    )
    for point, values in zip(points, run(script, tmp_path), strict=True):  # type: ignore[call-overload]
        found = [float(str(one).replace("Infinity", "inf")) for one in values]
        assert found == pytest.approx(np.array(function(point)).ravel().tolist(), rel=1e-14, nan_ok=True)


def test_the_page_needs_nothing_but_what_is_installed(tmp_path) -> None:
    page = t2s.load("otter").steering_page().page()
    assert "EQUATIONS" in page and "WebAssembly" not in page
    assert bundled("models", "otter").is_dir()
