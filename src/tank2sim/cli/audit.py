"""``tank2sim audit``: what is wrong with the data of free-running trials."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from tank2sim.arrays import Array
from tank2sim.cli.console import json_option, json_text, screen, show_notices, show_table
from tank2sim.files import write_whole
from tank2sim.records.audit import Finding, audit, record_noise
from tank2sim.records.reading import read_trial
from tank2sim.records.signals.columns import SignalName
from tank2sim.records.thinning import drawn_columns
from tank2sim.records.trials import Trial, sampling_step
from tank2sim.units import from_si


@click.command("audit")
@click.argument("trials", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="TRIAL...")
@json_option
def command(trials: tuple[Path, ...], json_file: Path | None) -> None:
    """Say what is wrong with the columns of each TRIAL (a CSV, or a SIMMAN .dat), by their consistency alone."""
    judged = [_judged(path) for path in trials]
    if json_file:
        result = {
            "findings": [entry for one in judged for finding in one.findings for entry in finding.as_json()],
            "trials": [one.as_json() for one in judged],
        }
        write_whole(json_file, json_text(result), inputs=trials)
    for one in judged:
        _show(one)


MEASURED_SAMPLES = 400
"""Samples of each trial in the JSON, for charts; the record itself is the file."""


@dataclass(frozen=True)
class _Judged:
    trial: Trial
    findings: tuple[Finding, ...]
    noise: dict[str, float]

    def as_json(self) -> dict[str, Any]:
        """Summary of the file; noise in SI, by signal; what was measured, thinned to draw."""
        return {
            "file": str(self.trial.path),
            "duration_s": float(self.trial.time_s.max() - self.trial.time_s.min()),
            "step_s": sampling_step(self.trial),
            "rows": len(self.trial.time_s),
            "columns": [self.trial.heading(name) for name in self.trial.signals],
            "noise": {
                name: {"sigma": sigma, "from": "file" if name in self.trial.noise else "estimated"}
                for name, sigma in self.noise.items()
            },
            "notices": list(self.trial.notices),
            "histories": drawn_columns(
                {"t_s": self.trial.time_s, **_columns(self.trial)}, MEASURED_SAMPLES, peaks=True
            ),
        }


def _columns(trial: Trial) -> dict[str, Array]:
    """Signals by their columns in a trial file."""
    names = {name: SignalName(name) for name in trial.signals}
    return {own.file: own.factor * trial.signals[name] for name, own in names.items()}


def _judged(path: Path) -> _Judged:
    trial = read_trial(path, rising=False)
    return _Judged(trial, audit(trial), record_noise(trial))


def _show(one: _Judged) -> None:
    trial, summary = one.trial, one.as_json()
    screen.print(
        f"{trial.path.name}: {summary['duration_s']:.5g} s, {summary['rows']} rows, step {summary['step_s']:.4g} s; "
        f"columns {', '.join(summary['columns'])}",
        soft_wrap=True,
        markup=False,
    )
    # in the units of the file
    messages = [
        f"{trial.heading(name)} {from_si(trial.heading(name), sigma):.2g}{'' if name in trial.noise else '*'}"
        for name, sigma in one.noise.items()
    ]
    screen.print(f"noise (* estimated): {', '.join(messages)}", soft_wrap=True, markup=False)
    show_notices(trial.notices)
    if not one.findings:
        screen.print("nothing is found wrong\n")
        return
    rows = [[found.kind, found.column, found.what, found.likely_truth] for found in one.findings]
    show_table("Findings", ["", "column", "what", "likely truth"], rows)
    screen.print()
