"""Cards that are wrong by much more than they say: how closely the improved card follows trials held out.

Made-up trials of several ships at 2 Hz (seven to fit, six held out) with one hidden effect or none. Every hydrodynamic
derivative of the card is off by a normal error of 10 % of its value, and the card says 2 %. Prints the names by `gap`
and the misfit of the fitted trials and of those held out in units of the noise (1 is noise), before and after.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other

import argparse
import re
import tempfile
from pathlib import Path

from gap_truth import Made, Setting, make, sampled, write, wrong_card
from gap_truth.manoeuvres import FIT, HOLDOUT

from tank2sim.cards import ManoeuvringCard, read_card
from tank2sim.gap.workflow import GapOptions, run_gap_workflow
from tank2sim.identification.trials.problem.prepare_trials import measured

HERTZ, OFF, STATED = 2, 0.10, 0.02
CASES = (
    Setting(("rudder_bias",), 3, ship="mariner"),
    Setting(("cubic_yaw_damping",), 4, ship="mariner"),
    Setting(("current",), 5, ship="tanker"),
    Setting(("rudder_rate_limit",), 6, ship="container"),
    Setting((), 7, ship="mariner"),
    Setting(("gyro_bias",), 8, ship="model"),
)
SOUGHT = ("rudder_bias", "current", "linear_yaw_damping", "gyro_bias", "wind")
"""Effects that are sought, in addition to the hidden one."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    workers = parser.parse_args().workers
    worst = max(_case(sampled(made, HERTZ), workers) for made in make(CASES))
    print(f"worst misfit of trials held out: {worst:.2f}")


def _case(made: Made, workers: int) -> float:
    """Print a case, and return the misfit of its trials held out after the search."""
    hidden = made.setting.effects
    with tempfile.TemporaryDirectory() as folder:
        write(made, folder := Path(folder))
        (folder / "ship.toml").write_text(_overconfident(wrong_card(made, OFF)), encoding="utf-8")
        card = read_card(folder / "ship.toml")
        assert isinstance(card, ManoeuvringCard)
        groups = ([name for name in made.trials if name in of] for of in (FIT, HOLDOUT))
        fitted, held = (measured([folder / f"{name}.csv" for name in names], card) for names in groups)
        effects = tuple(dict.fromkeys((*hidden, *SOUGHT)))
        gap = run_gap_workflow(card, fitted, held, GapOptions(workers=workers, effects=effects))
    named = " + ".join(effect.name for effect in gap.effects) or "-"
    misfits = [gap.misfit(version, held_out=out) for out in (False, True) for version in ("before", "after")]
    of_fitted, of_held = ("{:.2f}, {:.2f}".format(*pair) for pair in (misfits[:2], misfits[2:]))
    print(f"{made.setting.ship}, hidden: {' + '.join(hidden) or 'none'}   said: {gap.verdict}, {named}")
    print(f"   misfit before, after: fitted {of_fitted}; held out {of_held}", flush=True)
    return float(misfits[3] or 0.0)


def _overconfident(card: str) -> str:
    """The card with standard errors of `STATED` in place of `OFF`."""
    numbers, _, errors = card.partition("[uncertainty]")
    smaller = re.sub(r"= (\S+)", lambda found: f"= {STATED / OFF * float(found[1]):.6g}", errors)
    return f"{numbers}[uncertainty]{smaller}"


if __name__ == "__main__":
    main()
