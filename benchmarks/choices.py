"""What changes in results where a number that is the project's choice is halved or doubled.

For each constant of the page of project choices, the commands of its room run on made-up input in a fresh Python in
which the constant has half and twice its value. The largest change of any number of their JSON, against the value as
it is, goes to ``docs/static/project_choices.json``, from which the page takes its last two columns.

``python benchmarks/choices.py`` measures all (an hour of a core), ``python benchmarks/choices.py dynamics. gap.``
those whose names begin so. Numbers of layout and patience, which no result holds, are not measured.
"""

from __future__ import annotations

import ast
import contextlib
import importlib.abc
import importlib.machinery
import io
import json
import math
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import CodeType, ModuleType

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "static" / "project_choices.json"
ZIGZAG, TURN, HELD = "trials/zigzag.csv", "trials/turn.csv", "trials/held_out.csv"
IDENTIFY = f"identify mariner {ZIGZAG} {TURN} --holdout {HELD}"
COMMANDS = {
    "analysis.ensemble": ["simulate mariner --manoeuvre turn:35 --members 60", "stability mariner --members 40"],
    "analysis.heading": ["autopilot mariner --wave-yaw 0.5", "autopilot mariner --wave-filter 0.7"],
    "analysis.influence": ["influence mariner --figures criterion_C --figures advance_m@35"],
    "analysis.validation": [f"validate mariner {ZIGZAG} {HELD}"],
    "analysis": ["stability mariner", "stability kvlcc2-captive"],
    "apps.bridge": ["poster mariner -o poster.html"],
    "apps.rigs.glider": ["glide --angles 25"],
    "apps.rigs.tow": ["tow tows.csv --force-N 11.63 --mass-kg 2243"],
    "apps.rigs.yaw": ["yaw rig.csv"],
    "cards": [f"{IDENTIFY} -o new.toml", "simulate new.toml --manoeuvre turn:35 --members 20"],
    "dynamics": [
        *(f"simulate mariner --manoeuvre {word}" for word in ("turn:35", "pullout:20")),
        "simulate esso-osaka-estimated --manoeuvre stop",
        "simulate kvlcc2-captive --manoeuvre turn:35",
        "simulate effects.toml --manoeuvre zigzag:20/20",
    ],
    "gap": [
        f"gap current.toml {ZIGZAG} {TURN} --holdout {HELD} --black-box -o gap"
        " --effects current --effects wind --effects rudder_bias",
    ],
    "identification.captive": ["reduce campaign/campaign.toml"],
    "identification.trials.methods.kalman": [f"{IDENTIFY} --method kalman"],
    "identification.trials.methods.weak_form": [f"{IDENTIFY} --method equation_error"],
    "identification.trials": [IDENTIFY],
    "records.signals": [f"signals {ZIGZAG}"],
    "records.audit": ["audit faulty.csv", f"audit {ZIGZAG}"],
    "records": [f"{IDENTIFY}", "audit faulty.csv", "reduce campaign/campaign.toml"],
    "simulation.ensemble": ["simulate mariner --manoeuvre turn:35 --members 60"],
    "simulation.bands": ["simulate mariner --manoeuvre turn:35 --members 60"],
    "simulation": [
        *(f"simulate mariner --manoeuvre {word}" for word in ("turn:35", "zigzag:10/10", "spiral:15")),
        "simulate esso-osaka-estimated --manoeuvre stop",
        f"validate mariner {ZIGZAG} {HELD}",
    ],
}
"""Commands that use a room, by the beginning of the name: the first that fits. Rooms without commands (pages, command
line, patience with processes and clusters) have numbers on which no figure depends; they are not measured."""

LONGEST = 20
"""Entries of the longest list that is compared: histories and tracks are not."""

Number = float
Leaves = dict[str, list[Number] | str]


def constants() -> list[str]:
    """Names of the project's constants that are measured."""
    sys.path.insert(0, str(ROOT / "docs"))
    from generated import project_constants

    names = [constant.name for constant in project_constants()]
    return [name for name in names if name.startswith(tuple(f"{room}." for room in COMMANDS))]


def commands_of(name: str) -> list[str]:
    return next(commands for room, commands in COMMANDS.items() if name.startswith(f"{room}."))


# ---- in a fresh Python: one constant changed, commands run ----


def changed(value: object, factor: float) -> object:
    """A number times `factor`, and numbers in sequences and mappings likewise; a count stays a count of at least 1."""
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return value
    if isinstance(value, int):
        return max(1, round(value * factor))
    if isinstance(value, dict):
        return {key: changed(inner, factor) for key, inner in value.items()}
    if isinstance(value, tuple | list | frozenset):
        return type(value)(changed(inner, factor) for inner in value)
    return value * factor if isinstance(value, float) or hasattr(value, "dtype") else value


class Changing(importlib.abc.MetaPathFinder):
    """Imports the module that defines the constant with its value changed, and everything else as it is."""

    def __init__(self, name: str, factor: float) -> None:
        self.module, self.targets = re.fullmatch(r"(.*?)\.(\w+|\(.*\))", name).groups()  # type: ignore[union-attr]
        self.factor = factor

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> object:
        if name != f"tank2sim.{self.module}":
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path)
        assert spec is not None and spec.origin is not None
        spec.loader = _Loader(name, spec.origin, self)
        return spec

    def tree(self, source: str) -> ast.Module:
        tree = ast.parse(source)
        for node in tree.body:
            target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
            if target is not None and ast.unparse(target) == self.targets and getattr(node, "value", None):
                call = ast.parse(f"__import__('choices').changed(0, {self.factor})", mode="eval").body
                assert isinstance(call, ast.Call)
                call.args[0] = node.value  # type: ignore[attr-defined]
                node.value = call  # type: ignore[attr-defined]
        return ast.fix_missing_locations(tree)


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: str, changing: Changing) -> None:
        super().__init__(name, path)
        self.changing = changing

    def get_code(self, fullname: str) -> CodeType:
        return compile(self.changing.tree(Path(self.path).read_text(encoding="utf-8")), self.path, "exec")


def run_commands(commands: Sequence[str]) -> dict[str, object]:
    """The JSON of each command, or its exit code where it gives none."""
    from tank2sim.cli import main

    results: dict[str, object] = {}
    for command in commands:
        out = Path("result.json")
        out.unlink(missing_ok=True)
        sys.argv = ["tank2sim", *command.split(), "--json", str(out)]
        code: object = 0
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            try:
                main()
            except SystemExit as error:
                code = error.code
        results[command] = json.loads(out.read_text()) if out.exists() else f"exit {code}"
    return results


# ---- comparing ----


def leaves(value: object, path: str = "") -> Iterator[tuple[str, object]]:
    """Numbers, short lists of numbers and texts by their dotted path; histories are left out."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and len(value) > LONGEST:
        return
    elif isinstance(value, list) and not all(isinstance(inner, int | float) for inner in value):
        for place, inner in enumerate(value):
            yield from leaves(inner, f"{path}[{place}]")
    else:
        yield path, value


def difference(before: object, after: object) -> tuple[float, str]:
    """The largest relative change of a number, and where: infinite where something appears, vanishes or is refused."""
    old, new = dict(leaves(before)), dict(leaves(after))
    worst, where = 0.0, ""
    for path in old.keys() | new.keys():
        a, b = old.get(path), new.get(path)
        change = 0.0 if a == b else _change(a, b)
        if change > worst:
            worst, where = change, path
    return worst, where


def _change(a: object, b: object) -> float:
    if isinstance(a, str) and isinstance(b, str):
        return 0.0 if re.sub(r"[-\d.e+]+", "", a) == re.sub(r"[-\d.e+]+", "", b) else 1e-12
    first, second = (value if isinstance(value, list) else [value] for value in (a, b))
    if len(first) != len(second) or not all(isinstance(v, int | float) for v in (*first, *second)):
        return math.inf
    scale = max(map(abs, (*first, *second)), default=0.0)
    return max((abs(x - y) for x, y in zip(first, second, strict=True)), default=0.0) / scale if scale else 0.0


def words(worst: float, where: str, commands: Sequence[str]) -> str:
    """A cell of the page."""
    command = next((command for command in commands if where.startswith(f"{command}.")), "")
    if worst <= 1e-9:
        return "messages" if worst else "nothing"
    size = "other entries" if math.isinf(worst) else f"{100 * worst:.0f} %" if worst > 0.01 else f"{100 * worst:.1g} %"
    return f"{size}, `{where.removeprefix(f'{command}.')}` of `{command.split()[0]}`" if command else "refused"


# ---- all constants ----


def prepare(folder: Path) -> None:
    """Made-up trials, a campaign, printed tows, a yaw-rig record, a faulty record and cards, in `folder`."""
    import tank2sim as t2s

    for script, *arguments in (("make_trials.py", "trials", "current"), ("make_campaign.py", "campaign")):
        subprocess.run([sys.executable, ROOT / "docs" / "examples" / script, *arguments], check=True, cwd=folder)
    ship = t2s.load("mariner")
    text = ship.card.text
    (folder / "current.toml").write_text(text)
    effects = ("current", "speed_mps = 0.5, direction_deg = 90.0"), ("wind", "speed_mps = 8.0, direction_deg = 45.0")
    tables = "".join(f'\n[[effects]]\nname = "{name}"\nparameters = {{ {values} }}\n' for name, values in effects)
    (folder / "effects.toml").write_text(text + tables)
    lines = (folder / ZIGZAG).read_text().splitlines()
    head = next(place for place, line in enumerate(lines) if line.startswith("t_s"))
    columns = lines[head].split(",")
    for place in range(head + 40, len(lines), 170):
        cells = lines[place].split(",")
        cells[columns.index("psi_deg")] = "77"
        lines[place] = ",".join(cells)
    (folder / "faulty.csv").write_text("\n".join(lines) + "\n")
    (folder / "tows.csv").write_bytes((ROOT / "models" / "wilinski-zellman" / "tows.csv").read_bytes())
    command = "yaw rig.csv --simulate alyshev --noise 0.003 --inertia-kgm2 0.01796"
    subprocess.run([sys.executable, "-m", "tank2sim", *command.split()], check=True, cwd=folder, capture_output=True)


def probe(folder: Path, name: str, factor: float, commands: Sequence[str]) -> dict[str, object]:
    task = json.dumps([name, factor, list(commands)])
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT / "benchmarks")}
    with tempfile.TemporaryDirectory() as place:
        subprocess.run(["cp", "-r", f"{folder}/.", place], check=True)
        call = [sys.executable, __file__, "--probe", task]
        done = subprocess.run(call, cwd=place, env=environment, capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    return dict(json.loads(lines[-1])) if lines and not done.returncode else dict.fromkeys(commands, "fault")


def steady(first: dict[str, object], second: dict[str, object]) -> dict[str, object]:
    """The leaves that two runs of the same program share: without times of clocks and paths."""
    a, b = dict(leaves(first)), dict(leaves(second))
    return {path: value for path, value in a.items() if path in b and b[path] == value}


def main() -> int:
    if sys.argv[1:2] == ["--probe"]:
        name, factor, commands = json.loads(sys.argv[2])
        if name:
            sys.meta_path.insert(0, Changing(name, factor))
        print(json.dumps(run_commands(commands)))
        return 0
    names = constants()
    chosen = [name for name in names if not sys.argv[1:] or name.startswith(tuple(sys.argv[1:]))]
    table = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    table = {name: cells for name, cells in table.items() if name in names}
    with tempfile.TemporaryDirectory() as place, ThreadPoolExecutor(int(os.environ.get("WORKERS", "2"))) as threads:
        folder = Path(place)
        prepare(folder)
        sets = sorted({tuple(commands_of(name)) for name in chosen})
        plain = list(threads.map(lambda commands: [probe(folder, "", 1.0, commands) for _ in range(2)], sets))
        references = {commands: steady(*pair) for commands, pair in zip(sets, plain, strict=True)}
        for commands, pair in zip(sets, plain, strict=True):
            for command in commands:
                if isinstance(pair[0][command], str):
                    print(f"{command}: {pair[0][command]}: nothing to compare")

        def cells(name: str) -> list[str]:
            commands = tuple(commands_of(name))
            reference = references[commands]
            found = []
            for factor in (0.5, 2.0):
                after = dict(leaves(probe(folder, name, factor, commands)))
                kept = {path: after.get(path) for path in reference}
                found.append(words(*difference(reference, kept), commands))
            return found

        for name, row in zip(chosen, threads.map(cells, chosen), strict=True):
            table[name] = row
            print(f"{name}: half: {row[0]}; twice: {row[1]}", flush=True)
            RESULTS.write_text(json.dumps(dict(sorted(table.items())), indent=1, ensure_ascii=False) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
