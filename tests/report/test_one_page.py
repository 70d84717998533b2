"""A result has one page: the command's ``--page`` and ``report`` of its JSON give the same bytes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tank2sim as t2s
from tank2sim.api.result import Result
from tank2sim.bundled import bundled
from tank2sim.report.kit.page import render_page
from tank2sim.report.results.page import result_page
from tests.yaw_truth import Truth, record, written


def _yaw(folder: Path) -> Result:
    truth = Truth(humps=1)
    return t2s.yaw(written(folder / "water.csv", truth, record(truth)), inertia_kgm2=0.0204)


def _validation(folder: Path) -> Result:
    t2s.load("mariner").zigzag(20, 20).to_csv(folder / "zigzag.csv")
    return t2s.validate("mariner", folder, members=3)


def _signals(folder: Path) -> Result:
    t2s.load("mariner").zigzag(20, 20).to_csv(folder / "zigzag.csv")
    return t2s.signals(folder / "zigzag.csv", "r_degps", filter="lowpass:0.1")


RESULTS: dict[str, Callable[[Path], Result]] = {
    "stability": lambda _: t2s.load("esso-osaka").stability(),
    "stability of an ensemble": lambda _: t2s.load("kvlcc2").stability(spirals=False, members=3),
    "tow": lambda _: t2s.tow(bundled("models", "wilinski-zellman", "tows.csv")),
    "tow without size": lambda _: t2s.tow(bundled("models", "wilinski-zellman", "tows.csv"), terms="B3"),
    "yaw": _yaw,
    "glide": lambda _: t2s.load("kulikovsky-velikanov").glide([-30, -45], as_printed=True),
    "steering card": lambda _: t2s.steering_models("poznyakov-yudin"),
    "validate": _validation,
    "signals": _signals,
    "simulate": lambda _: t2s.load("mariner").turn(35),
}


@pytest.mark.parametrize("subject", RESULTS)
def test_the_command_and_report_give_the_same_page(subject: str, tmp_path: Path) -> None:
    found = RESULTS[subject](tmp_path)
    path = tmp_path / "result.json"
    found.to_json(path)
    page = found.page()
    assert t2s.make_report(path).page() == page
    # Nothing but the JSON is read: the page does not depend on the file's name either.
    assert render_page(result_page(json.loads(path.read_text(encoding="utf-8")), "elsewhere.json")) == page
    assert np.all([len(section.heading) > 0 for section in found.layout().sections])
