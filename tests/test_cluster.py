"""A cluster on the loopback whose workers share nothing with this process: results to the bit, and what is lost."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tank2sim import cluster
from tank2sim.analysis.ensemble.draws import draws_of
from tank2sim.analysis.ensemble.questions import OfManoeuvre, ShipText
from tank2sim.cards import ManoeuvringCard, parse_card
from tank2sim.cluster import Cluster, installed
from tank2sim.errors import InputError
from tank2sim.executors import executing, processes_to_begin
from tank2sim.gap.inference.fit_all import Fitting, HypothesisCache, Proposal
from tank2sim.gap.inference.prior import likelihood_from_card
from tank2sim.identification.trials.assessment.model_selection import cross_validate, yaw_rate_error
from tank2sim.identification.trials.assessment.prediction_intervals import (
    bootstrap,
    disturbances_of,
    generators,
)
from tank2sim.identification.trials.methods.equation_error import equation_error
from tank2sim.identification.trials.problem.prepare_trials import Measured
from tank2sim.identification.trials.problem.problem_from_card import problem_from_card as pose_problem
from tank2sim.simulation.ensemble import ensemble
from tank2sim.simulation.lane_figures import Pace
from tank2sim.simulation.manoeuvres import Turn
from tests.dask_cluster import Killing, LoopbackCluster, loopback_cluster
from tests.identification.trials import made_up_ship

pytestmark = [
    pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="dask[distributed] is missing"),
    pytest.mark.slow,
]


HELD = tuple(name for name in made_up_ship.ESTIMATED if name not in ("Nv", "Nr", "Nd"))
TASKS = lambda dask_scheduler: len(dask_scheduler.tasks)  # noqa: E731 - sent as it is; the scheduler has no tests


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LoopbackCluster]:
    with loopback_cluster(tmp_path_factory.mktemp("cluster")) as one:
        yield one


@pytest.fixture
def two(begun: LoopbackCluster) -> LoopbackCluster:
    return begun.with_workers(2)


@pytest.fixture(scope="module")
def card() -> ManoeuvringCard:
    read = parse_card(made_up_ship.CARD, "a/path/of/this/machine.toml")
    assert isinstance(read, ManoeuvringCard)
    return read


@pytest.fixture(scope="module")
def trials() -> Measured:
    made = [
        made_up_ship.trial(made_up_ship.zigzag(angle), name=f"zigzag {angle}", duration=120, step=0.5)
        for angle in (10, 20)
    ]
    return Measured(tuple(made), "angle", ())


def test_an_ensemble_is_the_local_one_to_the_bit_when_a_worker_is_lost(mariner_card, two) -> None:
    draws, _ = draws_of(mariner_card, 11)
    question = OfManoeuvre(ShipText.of(mariner_card), Turn(np.radians(20.0)), 600.0, np.linspace(0, 600, 31))
    here = ensemble(question, draws, 150)
    with executing(two.option) as executor:
        there = ensemble(question, draws, 150, Killing(executor, two.workers[0], after=3), batch=3)
    assert two.workers[0].wait(10) != 0, "the worker was killed"
    np.testing.assert_array_equal(there.figures["advance_m"], here.figures["advance_m"])
    assert set(there.figures) == set(here.figures) and there.unusable == here.unusable
    np.testing.assert_array_equal(there.histories, here.histories)


def test_tasks_of_thousands_of_ships_at_the_fastest_pace_are_the_local_ones_to_the_bit(mariner_card, two) -> None:
    draws, _ = draws_of(mariner_card, 12)
    usual = OfManoeuvre(ShipText.of(mariner_card), Turn(np.radians(35.0)), 150.0, np.linspace(0, 150, 4))
    question = replace(usual, pace=Pace(6, single=True))
    here = ensemble(question, draws, 6500)
    with executing(two.option) as executor:
        there = ensemble(question, draws, 6500, executor, batch=2048)
    assert set(there.figures) == set(here.figures) and np.isfinite(here.figures["advance_m"]).all()
    for name, values in here.figures.items():
        np.testing.assert_array_equal(there.figures[name], values, err_msg=name)
    np.testing.assert_array_equal(there.histories, here.histories)


def test_an_identification_is_the_local_one_to_the_bit_when_a_worker_is_lost(card, trials, two) -> None:
    """The folds of its cross-validation, and its bootstrap."""
    problem = pose_problem(card, trials.trials, "angle", hold=HELD)
    estimate = equation_error(problem)
    work = problem, estimate, equation_error, disturbances_of(problem, estimate.values), generators(8)
    folds, members = cross_validate(problem, equation_error, yaw_rate_error), bootstrap(*work)
    with executing(two.option) as executor:
        folds_there = cross_validate(problem, equation_error, yaw_rate_error, executor)
        members_there = bootstrap(*work, Killing(executor, two.workers[0], after=3))
    assert two.workers[0].wait(10) != 0, "the worker was killed"
    assert len(members) > 1 and members.std(axis=0).all()
    np.testing.assert_array_equal(members_there, members)
    np.testing.assert_array_equal(folds_there.errors, folds.errors)


def test_explanations_of_a_gap_are_the_local_ones_to_the_bit_when_a_worker_is_lost(card, trials, two) -> None:
    likelihood = likelihood_from_card(card, trials)
    starts = {"gyro_bias": np.array([0.001]), "current": np.array([0.2, 1.0]), "rudder_bias": np.array([0.01])}
    proposals = [Proposal({name: starts[name]}, [likelihood.belief.logs], (0, 3)) for name in starts]
    proposals += [Proposal(starts, [likelihood.belief.logs], (0, 3)), Proposal({}, [likelihood.belief.logs], (0, 3))]
    here = Fitting(likelihood, HypothesisCache(likelihood.none), lambda text: None, None)
    here.fit(proposals)
    with executing(two.option) as executor:
        killing = Killing(executor, two.workers[0], after=2)
        there = Fitting(likelihood, HypothesisCache(likelihood.none), lambda text: None, killing)
        there.fit(proposals)
    assert two.workers[0].wait(10) != 0, "the worker was killed"
    assert list(there.found) == list(here.found)
    for effects, one in here.found.items():
        assert there.found[effects].score == one.score
        for name in ("theta", "covariance", "logs", "change"):
            np.testing.assert_array_equal(getattr(there.found[effects], name), getattr(one, name))


def test_work_on_a_cluster_begins_no_processes_and_tells_its_errors_whole(two) -> None:
    with executing(two.option) as executor:
        assert executor.submit(processes_to_begin, 3).result(30) == 1
        with pytest.raises(InputError, match=r"far\.toml") as caught:
            executor.submit(parse_card, "no card", "far.toml").result(30)
    assert caught.value.source == "far.toml"


def test_a_worker_with_other_versions_is_refused(two) -> None:
    there = installed()
    other = rf"worker tcp://.*: has numpy {there['numpy']}, but here it is 0\.9; "
    with executing(two.option) as executor:
        assert isinstance(executor, Cluster)
        executor.wanted = there | {"numpy": "0.9"}
        with pytest.raises(InputError, match=other):
            executor.refuse_others()
        with pytest.raises(InputError, match=other):
            executor.submit(processes_to_begin).result(30)  # as of a worker that came later


def test_who_is_interrupted_leaves_nothing_at_the_scheduler(two) -> None:
    from distributed import Client

    with pytest.raises(KeyboardInterrupt), executing(two.option) as executor:
        for _ in range(20):
            executor.submit(time.sleep, 0.5)
        raise KeyboardInterrupt
    with Client(f"tcp://{two.address}", set_as_default=False) as client:
        assert client.run_on_scheduler(TASKS) == 0


def test_workers_that_do_not_come_back_are_reported(two, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "PATIENCE_S", 1.0)
    with executing(two.option) as executor:
        waiting = [executor.submit(time.sleep, 5.0) for _ in range(4)]
        two.kill_workers()
        for one in waiting:
            with pytest.raises(InputError, match=r"all workers of dask://.* are lost"):
                one.result(30)


def test_a_scheduler_that_is_lost_is_one_line_on_the_screen(two, tmp_path) -> None:
    """Last in this module: the cluster is gone then."""
    from distributed import Client

    begin = [sys.executable, "-c", "from tank2sim.cli import main; main()"]
    command = [*begin, "stability", "mariner", "--members", "5000", "--executor", two.option]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        with Client(f"tcp://{two.address}", set_as_default=False) as client:
            until = time.monotonic() + 60
            while not client.run_on_scheduler(TASKS):
                assert process.poll() is None and time.monotonic() < until, "it has begun"
                time.sleep(0.1)
        two.scheduler.kill()
        _, reported = process.communicate(timeout=60)
    assert process.returncode == 2
    assert (
        reported.count("\n") == 1 and "the scheduler at dask://" in reported and "was lost during the work" in reported
    )
