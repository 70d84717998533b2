"""Draw mutants of chosen rooms and run the tests of each room: do the tests notice a wrong sign, bound or constant?

    python -m tests.mutants 60 --seed 1            # draw 60 mutants from all rooms
    python -m tests.mutants 5 --room waves --seed 2 --fast
    python -m tests.mutants --list

A mutant is one change of one expression: a comparison, an operator, a sign, a constant or a condition is turned.
Expressions that only choose words, units to show or nominal sizes are left alone. The package is copied to a temporary
folder; the checkout stays as it is. The fast tests of the room run first, then the slow ones; they must pass without a
mutant. Printed are the mutants that no test notices (they survive), with file, line and change, and their number. The
same seed draws the same mutants.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SELECTIONS = ("not slow and not long", "slow and not long")
PASSED = (0, 5)  # all tests pass, or none is selected

EFFECTS = "tests/dynamics/effects"

ROOMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "mmg": (("dynamics/mmg/*.py", "cards/mmg.py"), ("tests/dynamics/mmg", "tests/cards/test_mmg_card.py")),
    "waves": (
        ("dynamics/effects/waves.py", "analysis/wave_response.py"),
        (f"{EFFECTS}/test_ranges.py", f"{EFFECTS}/test_waves.py", "tests/analysis/test_wave_response.py"),
    ),
    "banks": (
        ("dynamics/effects/banks.py", "dynamics/effects/harbour.py"),
        (f"{EFFECTS}/test_ranges.py", f"{EFFECTS}/test_banks.py", f"{EFFECTS}/test_harbour.py"),
    ),
    "ships near": (("dynamics/effects/ships_near.py",), (f"{EFFECTS}/test_ranges.py", f"{EFFECTS}/test_ships_near.py")),
    "rudder and gear": (
        ("dynamics/effects/gear.py", "dynamics/effects/loaded_rudder.py"),
        (f"{EFFECTS}/test_ranges.py", f"{EFFECTS}/test_rudder_and_gear.py", f"{EFFECTS}/test_every_effect.py"),
    ),
    "propeller": (
        ("dynamics/effects/propeller.py", "dynamics/effects/controllable_pitch.py"),
        (
            f"{EFFECTS}/test_ranges.py",
            f"{EFFECTS}/test_propeller_and_hull.py",
            f"{EFFECTS}/test_controllable_pitch.py",
            f"{EFFECTS}/test_harbour.py",
        ),
    ),
    "small craft": (
        ("dynamics/small_craft.py", "cards/small_craft.py"),
        ("tests/dynamics/test_small_craft.py", "tests/analysis/heading/test_craft_autopilot.py"),
    ),
    "roll": (("dynamics/roll.py",), ("tests/dynamics/test_roll.py",)),
    "card check": (
        ("cards/examination.py", "cards/plausibility.py"),
        ("tests/cards/test_examination.py", "tests/identification/captive/test_warnings.py"),
    ),
    "guess": (("apps/guess/*.py",), ("tests/apps/guess",)),
    "logs": (
        ("apps/logs/clock.py", "apps/logs/voyage.py", "apps/logs/content.py", "apps/logs/quantities.py"),
        (
            "tests/apps/logs/test_clock.py",
            "tests/apps/logs/test_current.py",
            "tests/apps/logs/test_delays.py",
            "tests/apps/logs",
        ),
    ),
    "gap judge": (
        ("gap/proof/judge.py", "gap/proof/improvement.py", "gap/diagnosis/error_intervals.py"),
        (
            "tests/gap/test_judge_by_simulation.py",
            "tests/gap/test_improvement.py",
            "tests/gap/test_cross_check.py",
            "tests/gap/test_error_intervals.py",
            "tests/gap/test_workflow.py",
        ),
    ),
    "captive mmg": (("identification/captive_mmg/*.py",), ("tests/identification/captive_mmg",)),
    "other ships": (
        ("identification/trials/assessment/other_ship.py", "records/same_record.py"),
        ("tests/identification/trials/test_other_ship.py", "tests/records/test_same_record.py"),
    ),
    "simulator rules": (
        ("fmu/passport.py",),
        ("tests/fmu/test_simulator_rules.py", "tests/fmu/test_passport.py"),
    ),
    "lanes": (
        ("simulation/lane_runs.py", "simulation/lane_figures.py"),
        ("tests/simulation/test_lanes.py", "tests/simulation/test_stop.py"),
    ),
}
"""Room: its modules, and the tests that should notice a change in them."""

_COMPARED = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
_OPERATED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}


@dataclass(frozen=True)
class Mutant:
    """One change of one module: the expression before and after, and its room."""

    room: str
    path: Path
    line: int
    before: str
    after: str
    start: int
    end: int

    def text(self) -> str:
        """The module with the change."""
        whole = self.path.read_bytes()
        return (whole[: self.start] + self.after.encode() + whole[self.end :]).decode()

    def __str__(self) -> str:
        place = self.path.relative_to(ROOT)
        return f"{place}:{self.line}: {' '.join(self.before.split())[:70]}  ->  {' '.join(self.after.split())[:70]}"


def changes(node: ast.expr) -> Iterator[ast.expr]:
    """Each expression that a mutation makes of one."""
    match node:
        case ast.Compare(left, [operator], right) if type(operator) in _COMPARED:
            yield ast.Compare(left, [_COMPARED[type(operator)]()], right)
        case ast.BinOp(left, operator, right) if type(operator) in _OPERATED:
            yield ast.BinOp(left, _OPERATED[type(operator)](), right)
        case ast.UnaryOp(ast.USub(), operand):
            yield operand
        case ast.BoolOp(ast.And(), values):
            yield ast.BoolOp(ast.Or(), values)
        case ast.BoolOp(ast.Or(), values):
            yield ast.BoolOp(ast.And(), values)
        case ast.UnaryOp(ast.Not(), operand):
            yield operand
        case ast.IfExp(test, body, otherwise):
            yield ast.IfExp(test, otherwise, body)
        case ast.Constant(bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(float() as value) if value:
            yield ast.Constant(value * 1.5)
        case ast.Constant(int() as value) if value > 1:
            yield ast.Constant(value + 1)


def numbers_of(room: str, path: Path) -> list[Mutant]:
    """All mutants of a module; text, annotations and C are left alone."""
    source = path.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    tree, found = ast.parse(source), []
    left_alone = {id(child) for node in ast.walk(tree) for child in _not_changed(node)}
    for node in ast.walk(tree):
        if not isinstance(node, ast.expr) or id(node) in left_alone or node.end_lineno is None:
            continue
        start = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + (node.end_col_offset or 0)
        before = source[start:end].decode()
        for changed in changes(node):
            after = f"({ast.unparse(ast.fix_missing_locations(changed))})"
            found.append(Mutant(room, path, node.lineno, before, after, start, end))
    return found


_WORDS = {"description", "display_unit", "nominal", "problem", "remedy", "source", "text", "typical", "unit"}
"""Names of variables and arguments that hold words, or the sizes that scale what is shown or searched."""


def _not_changed(node: ast.AST) -> Iterator[ast.AST]:
    """Expressions that say nothing of the physics: annotations, formatted text, messages, words, nominal sizes."""
    match node:
        case ast.AnnAssign():
            yield from ast.walk(node.annotation)
        case ast.arg(annotation=ast.expr() as annotation):
            yield from ast.walk(annotation)
        case ast.FunctionDef(returns=ast.expr() as returns):
            yield from ast.walk(returns)
        case ast.JoinedStr() | ast.Raise() | ast.Assert():
            yield from ast.walk(node)
        case ast.Call(func=ast.Name("dataclass" | "lru_cache" | "zip" | "InputError" | "LogFinding")):
            yield from ast.walk(node)
        case ast.Assign(targets=[ast.Name(name)], value=value) | ast.keyword(arg=str(name), value=value):
            yield from ast.walk(value) if name in _WORDS else ()
        case ast.IfExp(body=ast.JoinedStr()) | ast.IfExp(orelse=ast.JoinedStr()):
            yield node
        case ast.IfExp(body=ast.Constant(str() as words)) if " " in words:
            yield node
        case ast.Compare(ast.BinOp(op=ast.Mult() | ast.Div()) as product, [_], [ast.Constant(0)]):
            yield product  # a product has the sign of the ratio


def pass_in(room: str, package: Path, selections: Sequence[str]) -> bool:
    """True if the tests of a room pass with a package; pytest ends a test that does not end by itself."""
    tests = [path for path in ROOMS[room][1] if (ROOT / path).exists()]
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", *tests, "-m"]
    environment = {**os.environ, "PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    for chosen in selections:
        run = subprocess.run([*command, chosen], cwd=ROOT, env=environment, capture_output=True, check=False)
        if run.returncode not in PASSED:
            return False
    return True


def survives(mutant: Mutant, package: Path, selections: Sequence[str]) -> bool:
    """True if the tests of its room pass with the mutant."""
    target = package / mutant.path.relative_to(ROOT / "src" / "tank2sim")
    original = target.read_text()
    target.write_text(mutant.text())
    try:
        return pass_in(mutant.room, package, selections)
    finally:
        target.write_text(original)


def main() -> None:
    """Draw, run and report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("number", type=int, nargs="?", default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--room", choices=ROOMS, action="append")
    parser.add_argument("--fast", action="store_true", help="without the slow tests")
    parser.add_argument("--list", action="store_true", help="print the drawn mutants and run nothing")
    asked = parser.parse_args()
    generator = random.Random(asked.seed)
    rooms = asked.room or list(ROOMS)
    pool = {
        room: [
            mutant
            for pattern in ROOMS[room][0]
            for path in sorted((ROOT / "src" / "tank2sim").glob(pattern))
            for mutant in numbers_of(room, path)
        ]
        for room in rooms
    }
    drawn = [generator.choice(pool[rooms[place % len(rooms)]]) for place in range(asked.number)]
    if asked.list:
        print("\n".join(f"{mutant.room}: {mutant}" for mutant in drawn))
        return
    survivors = []
    with tempfile.TemporaryDirectory() as folder:
        package = Path(folder) / "src" / "tank2sim"
        shutil.copytree(ROOT / "src" / "tank2sim", package, ignore=shutil.ignore_patterns("__pycache__"))
        for name in ("models", "fmu_templates", "LICENSE"):
            os.symlink(ROOT / name, Path(folder) / name)
        selections = SELECTIONS[:1] if asked.fast else SELECTIONS
        if broken := [room for room in {one.room: 0 for one in drawn} if not pass_in(room, package, selections)]:
            parser.error(f"tests fail without a mutant: {', '.join(broken)}")
        for count, mutant in enumerate(drawn, 1):
            alive = survives(mutant, package, selections)
            survivors += [mutant] if alive else []
            print(f"{count}/{len(drawn)} {'SURVIVES' if alive else 'noticed'} {mutant.room}: {mutant}", flush=True)
    print(f"{len(survivors)} of {len(drawn)} mutants survive (seed {asked.seed})")


if __name__ == "__main__":
    main()
