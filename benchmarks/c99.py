"""What a ship in plain C99 needs of a machine: size, stack, symbols, time of a step against the FMU's.

For bundled cards in both precisions: code and constants of ``ship.o`` (``gcc -Os`` and ``-O2``), largest stack of a
function (``-fstack-usage``; calls are at most three deep), bytes of an instance, functions that it calls, and
nanoseconds of a step with its outputs over those of ``fmi2DoStep`` with ``fmi2GetReal`` of the outputs, and over
``fmi2DoStep`` alone, which calculates none. Needs gcc, nm and size.

    python benchmarks/c99.py
"""

from __future__ import annotations

import io
import shutil
import statistics
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import fmpy

from tank2sim.cards import Card, read_card
from tank2sim.dynamics import build
from tank2sim.dynamics.simulator_interface import with_simulator_interface
from tank2sim.fmu.c99 import PlainShip, plain_ship
from tank2sim.fmu.export import make_fmu
from tank2sim.fmu.interface import interface
from tank2sim.native.compiler import FLAGS

DRIVER = Path(__file__).parent / "c99" / "driver.c"
CARDS = ("mariner", "kvlcc2-mmg", "container", "esso-osaka-ship", "otter")
STEPS, REPETITIONS = 2_000, 51
LARGEST_OBJECT, MARINER = 64 * 1024, "mariner"


def output_of(*words: str, folder: Path) -> str:
    return subprocess.run(words, cwd=folder, check=True, capture_output=True, text=True).stdout


def object_sizes(made: PlainShip, folder: Path, flags: list[str]) -> tuple[dict[str, int], int, set[str]]:
    """Bytes of code and constants by optimisation, largest stack of a function, undefined symbols."""
    sizes = {}
    for level in ("-Os", "-O2"):
        compiling = ["gcc", "-std=c99", level, "-ffp-contract=off", "-fstack-usage", *flags]
        output_of(*compiling, "-c", "ship.c", folder=folder)
        sizes[level] = int(output_of("size", "ship.o", folder=folder).split("\n")[1].split()[0])
    stack = [int(line.split("\t")[1]) for line in (folder / "ship.su").read_text().splitlines()]
    return sizes, max(stack), {line.split()[-1] for line in output_of("nm", "-u", "ship.o", folder=folder).splitlines()}


def step_ratios(card: Card, made: PlainShip, folder: Path, flags: list[str]) -> list[float]:
    """Median time of a step (ns), and its ratio to a step of the FMU with and without outputs."""
    model = with_simulator_interface(build(card))
    described = interface(model)
    fmu = make_fmu(model)
    with zipfile.ZipFile(io.BytesIO(fmu.content)) as archive:
        (name,) = (name for name in archive.namelist() if name.startswith("binaries/"))
        library = archive.extract(name, folder)
    headers = Path(fmpy.__file__).parent / "c-code"
    output_of("gcc", *FLAGS, "-fvisibility=default", *flags, "-shared", "ship.c", "-o", "ship.so", "-lm", folder=folder)
    single = ["-DSINGLE"] if flags else []
    output_of("gcc", *FLAGS, f"-I{headers}", *single, str(DRIVER), "-o", "driver", "-ldl", folder=folder)
    numbers = (described.outputs.begin, described.indicators.begin - 1, model.step_s, STEPS, REPETITIONS)
    ship = (str(folder / "ship.so"), made.prefix, str(sum(made.counts.values())))
    rows = output_of("./driver", *ship, library, fmu.token, *map(str, numbers), folder=folder).splitlines()
    times = [[float(word) for word in row.split()] for row in rows]
    with_outputs, alone = (statistics.median(row[0] / row[place] for row in times) for place in (2, 1))
    return [statistics.median(row[0] for row in times), with_outputs, alone]


def main() -> int:
    if any(shutil.which(tool) is None for tool in ("gcc", "nm", "size")):
        print("needs gcc, nm and size")
        return 0
    failed = 0
    print("card              real    code -Os  -O2 (bytes)  stack  instance  ns a step  over FMU with outputs, without")
    for name in CARDS:
        card = read_card(name)
        made = plain_ship(card)
        for single in (False, True):
            flags = [f"-D{made.prefix.upper()}_SINGLE"] if single else []
            with tempfile.TemporaryDirectory() as temporary:
                folder = Path(temporary)
                for file, text in made.files.items():
                    (folder / file).write_text(text)
                sizes, stack, symbols = object_sizes(made, folder, flags)
                nanoseconds, with_outputs, alone = step_ratios(card, made, folder, flags)
            print(
                f"{name:17s} {'float' if single else 'double':6s} {sizes['-Os']:9d} {sizes['-O2']:9d} {stack:9d} "
                f"{made.instance_bytes(single=single):9d} {nanoseconds:10.0f} {with_outputs:15.2f} {alone:12.2f}   "
                f"{' '.join(sorted(symbols))}"
            )
            failed += name == MARINER and sizes["-O2"] > LARGEST_OBJECT
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
