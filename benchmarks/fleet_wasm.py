"""Whether vectors of WebAssembly (SIMD128) pay for the twenty ships next to the own one on the page of ``steer``.

The page has each as an instance of the FMU's library, which it steps one after the other. Next to that: a loop over
twenty ships of the same Runge-Kutta step alone, compiled for one number at a time, and for the two of a vector with
``-msimd128``. Node runs all by turns, and the processor time of a step of the fleet is printed.

    python benchmarks/fleet_wasm.py [--steps N] [--rounds N]
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from tank2sim.apps.steering.members import PAGE_MEMBERS
from tank2sim.apps.steering.ship import TOKEN, WEB
from tank2sim.cards import read_card
from tank2sim.dynamics import build
from tank2sim.fmu.interface import interface
from tank2sim.fmu.sources import c_sources
from tank2sim.native.cross import CompileTarget, cross_compiled
from tank2sim.native.lanes import VECTORS, lane_function
from tank2sim.simulation.scheme import step_and_constants

FLEET = """
enum {{ SHIPS = {ships}, NX = {nx}, NU = {nu}, NP = {np}, NC = {nc} }};
static V x[SHIPS / LANES][NX], u[NU], p[NP], c[NC + 1], h[1];
void begin(double order) {{
  static const double p0[] = {{ {p} }}, u0[] = {{ {u} }}, x0[] = {{ {x} }};
  for (int i = 0; i < NP; ++i) p[i] = all(p0[i]);
  for (int i = 0; i < NU; ++i) u[i] = all(u0[i]);
  u[{rudder}] = all(order);
  for (int k = 0; k < SHIPS / LANES; ++k) for (int i = 0; i < NX; ++i) x[k][i] = all(x0[i]);
  h[0] = all({h});
  const V *const arg[1] = {{p}}; V *const res[1] = {{c}};
  constants(arg, res);
}}
void steps(int count) {{
  V next[NX];
  for (int n = 0; n < count; ++n) for (int k = 0; k < SHIPS / LANES; ++k) {{
    const V *const arg[5] = {{x[k], u, p, c, h}};
    V *const res[1] = {{next}};
    step(arg, res);
    for (int i = 0; i < NX; ++i) x[k][i] = next[i];
  }}
}}
double state(int i) {{ return LANE(x[0][i], 0); }}
"""

# The FMU's ships are begun and stepped as ship.js does it.
SCRIPT = """
const fs = require("fs");
const {h, ships, token, steps, rounds, nx, order, command} = JSON.parse(process.argv[2]);
const load = (name) => new WebAssembly.Instance(new WebAssembly.Module(fs.readFileSync(name)), {}).exports;
const kernels = ["one.wasm", "two.wasm"].map(load);
for (const kernel of kernels) { kernel._initialize?.(); kernel.begin(order); }
const library = load("fmu.wasm");
library._initialize();
const text = (letters) => {
  const at = library.malloc(letters.length + 1);
  new Uint8Array(library.memory.buffer).set(new TextEncoder().encode(`${letters}\\0`), at);
  return at;
};
const room = library.malloc(64), fleet = [];
for (let k = 0; k < ships; ++k) {
  const ship = library.fmi3InstantiateCoSimulation(text("ship"), text(token), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
  const memory = new DataView(library.memory.buffer);
  memory.setUint32(room, command, true);
  memory.setFloat64(room + 8, order, true);
  let bad = library.fmi3SetFloat64(ship, room, 1, room + 8, 1);
  bad |= library.fmi3EnterInitializationMode(ship, 0, 0, 0, 0, 0) | library.fmi3ExitInitializationMode(ship);
  if (bad) throw new Error("a ship cannot begin");
  fleet.push(ship);
}
let time = 0;
const instances = (count) => {
  for (let n = 0; n < count; ++n, time += h)
    for (const ship of fleet)
      if (library.fmi3DoStep(ship, time, h, 0, room + 16, room + 17, room + 18, room + 24)) throw new Error("step");
};
const jobs = [instances, kernels[0].steps, kernels[1].steps], taken = jobs.map(() => []);
for (let round = 0; round <= rounds; ++round)
  jobs.forEach((job, place) => {
    const before = process.cpuUsage();
    job(steps);
    const used = process.cpuUsage(before);
    if (round) taken[place].push((used.user + used.system) / steps);
  });
const states = kernels.map((kernel) => [...Array(nx).keys()].map((i) => kernel.state(i)));
console.log(JSON.stringify({taken, states}));
"""


class Kernel(CompileTarget):
    """WebAssembly with vectors or without them."""

    vectors = False

    @property
    def flags(self) -> tuple[str, ...]:
        return (*super().flags, *(["-msimd128"] if self.vectors else []))


class VectorKernel(Kernel):
    vectors = True


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--steps", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=15)
    asked = parser.parse_args()
    node = shutil.which("node")
    if node is None:
        print("skipped: node is not installed")
        return 0
    model = build(read_card("esso-osaka-ship"))
    step, constants = step_and_constants(model)
    p = model.parameter_values()
    values = {"p": p, "u": model.input_values(), "x": np.array(model.initial(p))}
    numbers = {name: ", ".join(map(repr, np.ravel(row).tolist())) for name, row in values.items()}
    sizes = {"nx": len(model.states), "nu": step.size1_in(1), "np": step.size1_in(2), "nc": constants.size1_out(0)}
    rudder = model.input_names.index("rudder.command")
    fleet = FLEET.format(ships=PAGE_MEMBERS, h=model.step_s, rudder=rudder, **sizes, **numbers)
    code = VECTORS, lane_function(step, "step"), lane_function(constants, "constants"), fleet
    face = interface(model)
    asking = {"h": model.step_s, "ships": PAGE_MEMBERS, "token": TOKEN, "steps": asked.steps, "rounds": asked.rounds}
    asking |= {"nx": len(model.states), "order": 0.3, "command": face.by_name["rudder.command"].reference}
    with tempfile.TemporaryDirectory() as name:
        folder, exports = Path(name), ("begin", "steps", "state")
        for lanes, file, kind in ((1, "one.wasm", Kernel), (2, "two.wasm", VectorKernel)):
            source = "\n".join([f"#define LANES {lanes}", *code])
            (folder / file).write_bytes(cross_compiled({"fleet.c": source}, kind(WEB.triple, WEB.suffix, exports)))
        (folder / "fmu.wasm").write_bytes(cross_compiled(c_sources(model, face, 3, TOKEN), WEB))
        (folder / "run.js").write_text(SCRIPT)
        command = [node, "run.js", json.dumps(asking)]
        found = json.loads(subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout)
    instances, one, two = (np.array(times) for times in found["taken"])
    off = np.max(np.abs(np.subtract(*found["states"])) / (1e-9 + np.abs(found["states"][0])))
    print(f"a step of {PAGE_MEMBERS} ships in WebAssembly, processor time, medians of {asked.rounds} rounds by turns")
    print(f"  instances of the FMU, as the page has them {np.median(instances):6.1f} us")
    print(f"  loop, a number at a time                   {np.median(one):6.1f} us")
    faster = f"{np.median(one / two):.2f} times as fast"
    print(f"  loop, vectors of two (-msimd128)           {np.median(two):6.1f} us, {faster}")
    print(f"  states of both loops at the end differ by {off:.1e} relative")
    share = 1e-4 * np.median(instances) / model.step_s  # per cent, of us in s
    print(f"  the page's ships take {share:.3f} % of a processor at real time, {50 * share:.2f} % at 50 times that")
    return 0


if __name__ == "__main__":
    sys.exit(main())
