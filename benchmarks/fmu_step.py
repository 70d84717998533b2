"""How fast an FMU steps: fmi2DoStep and fmi3DoStep, called from C, against the same ship written by hand in C.

The FMUs of the bundled Mariner and a classical Runge-Kutta step written by hand (``fmu_step/mariner.c``, all 65 terms,
coefficients read at run time as in an FMU, whose parameters can be tuned) run in one process by turns, compiled with
the same flags. The trajectories must agree to 1e-9. Then a fleet of instances in one process, stepped in turn, against
one instance that takes as many steps.

    python benchmarks/fmu_step.py
"""

from __future__ import annotations

import io
import statistics
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import fmpy

from tank2sim.cards import read_card
from tank2sim.dynamics import Model, build
from tank2sim.fmu.export import ExportedFmu, write_fmu
from tank2sim.native.compiler import FLAGS, require_compiler

HERE = Path(__file__).parent / "fmu_step"
REPETITIONS, STEPS, SHIPS = 301, 4_000, 1000
AIM, FLEET_AIM = 1.15, 1.2
AGREEMENT = 1e-9


def ship_numbers(model: Model) -> list[float]:
    """The numbers of ``Ship`` in mariner.h, from the model's parameters."""
    p = {variable.name: variable.start for variable in model.parameters}
    half_rho, length = 0.5 * p["ship.water_density"], p["ship.length"]
    return [
        *(length, p["ship.speed"], p["ship.water_density"]),
        *(p["ship.mass"] / (half_rho * length**3), p["ship.x_G"] / length),
        p["ship.yaw_inertia"] / (half_rho * length**5),
        *(p["steering.time_constant"], p["steering.max_rate"], p["steering.max_angle"]),
        *(value for name, value in p.items() if name.startswith("derivatives.")),
    ]


def library_of(fmu: ExportedFmu, folder: Path) -> Path:
    with zipfile.ZipFile(io.BytesIO(fmu.content)) as archive:
        (name,) = (name for name in archive.namelist() if name.startswith("binaries/"))
        return Path(archive.extract(name, folder / f"fmi{fmu.fmi}"))


def measure(folder: Path) -> tuple[list[list[float]], float]:
    """Nanoseconds a step of each repetition, and the largest difference of the states.

    By hand, FMI 2, FMI 3; one instance and the fleet of FMI 2; the same of FMI 3.
    """
    model = build(read_card("mariner"))
    fmus = [write_fmu(model, folder / f"mariner{fmi}.fmu", fmi=fmi) for fmi in (2, 3)]
    driver = folder / "driver"
    headers = Path(fmpy.__file__).parent / "c-code"
    sources = [str(HERE / name) for name in ("driver.c", "mariner.c")]
    compiler = [*require_compiler("the benchmark"), *FLAGS, f"-I{headers}"]
    subprocess.run([*compiler, *sources, "-o", str(driver), "-ldl", "-lm"], check=True)
    libraries = [part for fmu in fmus for part in (str(library_of(fmu, folder)), fmu.token)]
    numbers = [repr(number) for number in ship_numbers(model)]
    command = [str(driver), *libraries, str(REPETITIONS), str(STEPS), str(SHIPS), *numbers]
    *lines, last = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return [[float(word) for word in line.split()] for line in lines], float(last)


def main() -> int:
    with tempfile.TemporaryDirectory() as name:
        times, difference = measure(Path(name))
    hand, fmi2, fmi3, _, fleet2, _, fleet3 = (statistics.median(column) for column in zip(*times, strict=True))
    # Ratios within a repetition, a few milliseconds long: what else the machine does then slows both alike.
    ratios = [statistics.median(row[place] / row[0] for row in times) for place in (1, 2)]
    fleets = [statistics.median(row[place] / row[place - 1] for row in times) for place in (4, 6)]
    print(f"Mariner, {STEPS} steps of 0.1 s, {REPETITIONS} repetitions by turns; medians")
    print(f"  written by hand {hand:7.1f} ns a step")
    print(f"  fmi2DoStep      {fmi2:7.1f} ns a step, {ratios[0]:.3f} times")
    print(f"  fmi3DoStep      {fmi3:7.1f} ns a step, {ratios[1]:.3f} times   (aim {AIM})")
    print(f"  {SHIPS} ships in turn, FMI 2 {fleet2:7.1f} ns a step, {fleets[0]:.3f} times one ship")
    print(f"  {SHIPS} ships in turn, FMI 3 {fleet3:7.1f} ns a step, {fleets[1]:.3f} times one ship   (aim {FLEET_AIM})")
    print(f"  largest difference of the states {difference:.1e} relative (must be below {AGREEMENT})")
    return 0 if difference < AGREEMENT and max(ratios) <= AIM and max(fleets) <= FLEET_AIM else 1


if __name__ == "__main__":
    sys.exit(main())
