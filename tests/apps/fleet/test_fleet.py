"""A folder of ships: what is a ship and what is not, what need not be computed again, and one bad ship among others."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from tank2sim.apps.fleet.run import (
    NEW,
    RUN,
    Fault,
    ShipTask,
    find_at_once,
    find_in_turn,
    fleet_run_record,
    stale,
    with_results,
)
from tank2sim.apps.fleet.ships import ShipFolder, fleet_in, ship_alone, ship_in
from tank2sim.cards import ManoeuvringCard
from tank2sim.errors import InputError
from tank2sim.gap.workflow import GapOptions
from tank2sim.identification.trials.problem.prepare_trials import Measured

CARD, TRIAL = 'format = "tank2sim-ship/1"\n', "# a trial\nt_s,delta_deg,u_mps\n0,0,7\n"


def laid(folder: Path, *names: str) -> Path:
    """A folder with files of these names: cards, trials, or what is neither."""
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text({".toml": CARD, ".csv": TRIAL}.get(path.suffix, "mine"))
    return folder


# -- what is a ship ------------------------------------------------------------------------------------------------


def test_each_sub_folder_with_a_card_and_trials_is_a_ship(tmp_path: Path) -> None:
    laid(tmp_path, "b b/any.toml", "b b/z.csv", "b b/a.csv", "a/c.toml", "a/t.csv", "a/holdout/h.csv", "a/notes.txt")
    laid(tmp_path, ".hidden/c.toml", ".hidden/t.csv", "papers/read.me", "ship.txt", "a/.old.toml", "a/._t.csv")
    (tmp_path / "a/folder.csv").mkdir()
    found = fleet_in(tmp_path, tmp_path / "out")
    assert found.faults == {} and [ship.name for ship in found.ships] == ["a", "b b"]
    a, b = found.ships
    assert [path.name for path in a.inputs] == ["c.toml", "t.csv", "h.csv"]
    assert found.passed_over == (tmp_path / "papers",)
    assert [path.name for path in b.trials] == ["a.csv", "z.csv"] and b.holdout == ()


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("s/a.toml", "s/b.toml", "s/t.csv"), "holds 2 cards (a.toml, b.toml)"),
        (("s/a.toml",), "holds a card and no trial"),
        (("s/t.csv",), "holds trials and no ship card"),
        (("s/a.toml", "s/t.csv", "s/holdout/read.me"), "holds no trial"),
    ],
)
def test_a_folder_at_fault_is_told_and_does_not_hide_the_others(
    tmp_path: Path, names: tuple[str, ...], words: str
) -> None:
    found = fleet_in(laid(tmp_path, *names, "good/a.toml", "good/t.csv"), tmp_path / "out")
    assert [ship.name for ship in found.ships] == ["good"]
    assert list(found.faults) == ["s"] and words in found.faults["s"] and str(tmp_path / "s") in found.faults["s"]


@pytest.mark.parametrize(
    ("good", "bad", "why"),
    [
        ((), "s/t.csv", "no column t_s"),
        (("s/u.csv",), "s/t.csv", "no column t_s"),
        (("s/u.csv",), "s/holdout/t.csv", "no column t_s"),
        (("s/u.csv",), "s/t.dat", "it does not begin like free-running records of MARIN and HSVA (SIMMAN 2008)"),
    ],
)
def test_a_file_that_is_called_like_a_trial_and_is_none_is_a_fault(
    tmp_path: Path, good: tuple[str, ...], bad: str, why: str
) -> None:
    """Judged without it, she would be judged by less than what was measured."""
    laid(tmp_path, "s/a.toml", *good, bad)
    (tmp_path / bad).write_text("ts,delta_deg,u_mps\n0,0,7\n")
    found = fleet_in(tmp_path, tmp_path / "out")
    assert found.ships == () and found.faults["s"].startswith(f"{tmp_path / bad}: is not a trial: {why};")


def test_results_are_no_ships(tmp_path: Path) -> None:
    """Those of this run, of a fleet before it, and of one ship alone, which hold an improved card and trials."""
    laid(tmp_path, "a/c.toml", "a/t.csv", "out/a/improved.toml", "out/a/t.csv", "old/a/improved.toml")
    laid(tmp_path, "one/gap.json", "one/improved.toml", "one/next_test.csv")
    for output in ("out", "new"):
        found = fleet_in(tmp_path, tmp_path / output)
        assert [ship.name for ship in found.ships] == ["a"] and found.faults == {}
    laid(tmp_path, "out/mine.csv")
    assert fleet_in(tmp_path, tmp_path / "out").faults == {}


def test_results_do_not_go_where_ships_lie(tmp_path: Path) -> None:
    laid(tmp_path, "a/c.toml", "a/t.csv")
    for output in (tmp_path, tmp_path / "a"):
        with pytest.raises(InputError, match="folder of a ship's card and trials"):
            fleet_in(tmp_path, output)


def test_a_folder_without_ships_is_refused(tmp_path: Path) -> None:
    campaign = laid(tmp_path, "captive/campaign.toml", "captive/run.csv", "papers/read.me")
    (tmp_path / "captive/campaign.toml").write_text('format = "tank2sim-campaign/1"\n')
    (tmp_path / "captive/run.csv").write_text("time,force\n")
    with pytest.raises(InputError, match="holds no ship; a folder with a sub-folder for each ship"):
        fleet_in(campaign, tmp_path / "out")


def test_a_folder_with_a_card_is_one_ship_but_not_with_others_in_it(tmp_path: Path) -> None:
    laid(
        tmp_path, "a/c.toml", "a/t.csv", "a/holdout/c.toml", "a/holdout/h.csv", "a/out/gap.json", "a/out/improved.toml"
    )
    assert ship_alone(tmp_path) is None
    assert ship_alone(tmp_path / "a") == ship_in(tmp_path / "a")
    laid(tmp_path, "a/sister/c.toml")
    with pytest.raises(InputError, match="so does its sub-folder sister"):
        ship_alone(tmp_path / "a")


# -- what need not be computed again -------------------------------------------------------------------------------


def wrote(folder: Path, ship: ShipFolder, options: GapOptions) -> Path:
    """A folder as a run leaves it."""
    files = {folder / "gap.json": "{}", folder / "corrected/t.csv": b"t_s\r\n"}
    record = with_results(fleet_run_record(ship, options), files, folder)
    laid(folder, "gap.json", "corrected/t.csv")
    (folder / "gap.json").write_text("{}")
    (folder / "corrected/t.csv").write_bytes(b"t_s\r\n")
    (folder / RUN).write_text(json.dumps(record))
    return folder


CHANGES: dict[str, tuple[Callable[[Path], object], str]] = {
    "nothing": (lambda folder: None, ""),
    "only the time of a file": (lambda folder: (folder / "ship/t.csv").touch(), ""),
    "card": (lambda folder: (folder / "ship/c.toml").write_text(CARD + "#"), "the card was changed"),
    "trial": (lambda folder: (folder / "ship/t.csv").write_text(TRIAL + "1,0,7\n"), "the trials were changed"),
    "more trials": (lambda folder: laid(folder, "ship/u.csv"), "the trials were changed"),
    "held out": (lambda folder: (folder / "ship/holdout/h.csv").write_text(TRIAL * 2), "held out were changed"),
    "result": (lambda folder: (folder / "out/gap.json").write_text("{ }"), "its results were changed"),
    "no result": (lambda folder: (folder / "out/corrected/t.csv").unlink(), "its results were changed"),
    "no record": (lambda folder: (folder / "out" / RUN).unlink(), NEW),
    "torn record": (lambda folder: (folder / "out" / RUN).write_text('{"format'), NEW),
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_result_stands_until_what_it_was_computed_from_changes(tmp_path: Path, what: str) -> None:
    ship = ship_in(laid(tmp_path / "ship", "c.toml", "t.csv", "holdout/h.csv"))
    assert ship is not None
    out = wrote(tmp_path / "out", ship, GapOptions())
    change, words = CHANGES[what]
    change(tmp_path)
    changed = ship_in(tmp_path / "ship")
    assert changed is not None
    reason = stale(fleet_run_record(changed, GapOptions()), out)
    assert (words in reason) if words else reason == ""


def test_options_that_change_the_result_make_it_stale_and_others_do_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ship = ship_in(laid(tmp_path / "ship", "c.toml", "t.csv"))
    assert ship is not None
    out = wrote(tmp_path / "out", ship, GapOptions(effects=("current",)))
    assert stale(fleet_run_record(ship, GapOptions(effects=("current",), workers=7)), out) == ""
    for options in (GapOptions(), GapOptions(("current",), ("wind",)), GapOptions(("current",), max_effects=1)):
        assert stale(fleet_run_record(ship, options), out) == "the options were changed"
    monkeypatch.setattr("tank2sim.apps.fleet.run.__version__", "99")
    assert stale(fleet_run_record(ship, GapOptions(effects=("current",))), out) == "computed by another version"


# -- the work ------------------------------------------------------------------------------------------------------


def sought(card: ManoeuvringCard, *names: str) -> list[ShipTask]:
    none = Measured((), "angle", ())
    return [
        ShipTask(ShipFolder(name, Path(card.source), (), ()), replace(card, source=name), none, none) for name in names
    ]


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that fails at two ships, one by her data and one by a fault of the program."""

    def find_gap(card, fitted, held, options, progress, executor=None):
        progress("looking")
        if card.source == "bad":
            raise InputError("bad.csv", "row 3", "is torn", "correct it")
        if card.source == "odd":
            raise ZeroDivisionError("by zero")
        return f"gap of {card.source}"

    monkeypatch.setattr("tank2sim.apps.fleet.run.run_gap_workflow", find_gap)


def test_a_bad_ship_does_not_stop_the_others(mariner_card: ManoeuvringCard, failing) -> None:
    messages: list[str] = []
    ships = sought(mariner_card, "a", "bad", "odd", "z")
    with ThreadPoolExecutor(2) as pool:
        for found in (
            find_in_turn(ships, GapOptions(), messages.append),
            find_at_once(iter(ships), GapOptions(), messages.append, pool),
        ):
            results = {ship.folder.name: result for ship, result in found}
            assert results["a"] == "gap of a" and results["z"] == "gap of z"
            assert results["bad"] == Fault("bad.csv: row 3: is torn; correct it")
            assert (
                isinstance(results["odd"], Fault) and "not of yours: ZeroDivisionError: by zero" in results["odd"].line
            )
    assert "a: looking" in messages and any(" to go: " in message for message in messages)


def test_a_lost_executor_ends_the_run_in_one_line(mariner_card: ManoeuvringCard) -> None:
    class Lost(ThreadPoolExecutor):
        def submit(self, *work, **options):  # type: ignore[override]
            future: Future[object] = Future()
            future.set_exception(BrokenExecutor("killed"))
            return future

    with Lost(1) as pool, pytest.raises(InputError, match=r"a worker was lost while a was sought .*goes on where"):
        list(find_at_once(sought(mariner_card, "a"), GapOptions(), lambda stage: None, pool))


def test_what_is_sent_to_a_worker_needs_no_file_of_this_machine(mariner_card: ManoeuvringCard) -> None:
    (ship,) = sought(mariner_card, "a")
    received = pickle.loads(pickle.dumps(ship))
    assert received.card == ship.card and received.folder == ship.folder
