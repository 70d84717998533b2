"""Answer the benchmark of missing effects with three baselines: stepwise regression, SINDy, and a random forest.

    python benchmarks/missing_effect/answer_baselines.py FOLDER -o FOLDER_OF_ANSWERS [--train N]

All three see the same regression (regression.py). Stepwise regression adds the effect that lowers the Bayesian
information criterion most until none does. SINDy is the sequentially thresholded least squares of PySINDy on all
columns at once. The random forest of scikit-learn is a black box: trained on other cases of the same draw (another
seed), it sees how much each effect would explain and answers with the set of names that it saw most often.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from cases import draw_cases, write_case, write_rows
from regression import Array, Regression, read_regression

COLUMNS = ("case", "verdict", "effects")
MOST = 4
"""Effects that are named at most."""

THRESHOLD = 0.05
"""Of SINDy: least root mean square of an effect's part, over the noise."""

TRAINED = 400
TRAINING_SEED = 977


def explained(regression: Regression, names: tuple[str, ...]) -> float:
    """Sum of squares that these effects explain."""
    columns = np.concatenate([regression.columns[name] for name in names], axis=1)
    found = np.linalg.lstsq(columns, regression.residual, rcond=None)[0]
    return float(regression.residual @ regression.residual - np.sum((regression.residual - columns @ found) ** 2))


def stepwise(regression: Regression) -> tuple[str, ...]:
    """Forward selection by the Bayesian information criterion."""
    rows, named = len(regression.residual), ()
    total = float(regression.residual @ regression.residual)

    def criterion(names: tuple[str, ...]) -> float:
        count = sum(regression.columns[name].shape[1] for name in names)
        left = total - (explained(regression, names) if names else 0.0)
        return rows * float(np.log(left / rows)) + count * float(np.log(rows))

    while len(named) < MOST:
        best = min(((*named, name) for name in regression.columns if name not in named), key=criterion)
        if criterion(best) >= criterion(named):
            break
        named = best
    return named


def sindy(regression: Regression) -> tuple[str, ...]:
    """Sequentially thresholded least squares on all columns, each scaled to a root mean square of one."""
    import pysindy

    columns = np.concatenate(list(regression.columns.values()), axis=1)
    size = np.sqrt(np.mean(columns**2, axis=0))
    size[size == 0] = 1.0
    optimizer = pysindy.STLSQ(threshold=THRESHOLD, alpha=1e-3)
    optimizer.fit(columns / size, regression.residual[:, None])
    kept = np.abs(np.ravel(optimizer.coef_)) > 0
    named, place = [], 0
    for name, group in regression.columns.items():
        if kept[place : place + group.shape[1]].any():
            named.append(name)
        place += group.shape[1]
    return tuple(named)


def features(regression: Regression) -> Array:
    """Logarithm of what each effect explains alone, and of the whole residual, per row."""
    rows = len(regression.residual)
    alone = [explained(regression, (name,)) / rows for name in regression.columns]
    return np.log(1e-4 + np.maximum(0.0, [*alone, float(regression.residual @ regression.residual) / rows]))


def random_forest(count: int) -> Callable[[Regression], str]:
    """A forest trained on `count` other cases; it answers with effects joined by +, ``none`` or ``outside``."""
    from sklearn.ensemble import RandomForestClassifier

    rows, labels = [], []
    with tempfile.TemporaryDirectory() as name:
        for case in draw_cases(count, TRAINING_SEED):
            truth = write_case(case, Path(name))
            rows.append(features(read_regression(Path(name) / case.name)))
            labels.append(truth["effects"] or truth["verdict"])
    forest = RandomForestClassifier(500, random_state=1).fit(np.array(rows), labels)
    return lambda regression: str(forest.predict(features(regression)[None, :])[0])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--train", type=int, default=TRAINED, metavar="N", help=f"cases for the forest ({TRAINED})")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    regressions = {path.parent.name: read_regression(path.parent) for path in sorted(args.folder.glob("*/ship.toml"))}
    for method in (stepwise, sindy):
        answers = {case: method(regression) for case, regression in regressions.items()}
        rows = [
            {"case": case, "verdict": "missing" if names else "none", "effects": "+".join(names)}
            for case, names in answers.items()
        ]
        write_rows(args.output / f"{method.__name__}.csv", COLUMNS, rows)
    forest = random_forest(args.train)
    rows = []
    for case, regression in regressions.items():
        said = forest(regression)
        missing = said not in ("none", "outside")
        rows.append({"case": case, "verdict": "missing" if missing else said, "effects": said if missing else ""})
    write_rows(args.output / "random_forest.csv", COLUMNS, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
