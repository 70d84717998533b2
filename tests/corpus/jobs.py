"""The jobs: which command is given which inputs, how often, and with what mutations; the same always."""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable

from tests.corpus.inputs import RESULTS, plain
from tests.corpus.mutations import EDGES, Files, mutate
from tests.corpus.worker import Job

Recipe = tuple[list[str], list[str]]
"""Arguments, and the files among them that are mutated."""

QUICK = ["--figures", "steady_radius_m@20", "--hours", "3", "--members", "0"]
FAST = ["--structure", "linear", "--members", "0", "--method"]

RECIPES: dict[str, list[Recipe]] = {
    "simulate": [
        (["card.toml", "--manoeuvre", "turn:35", "--duration", "40", "-o", "run.csv"], ["card.toml"]),
        (["card.toml", "--manoeuvre", "zigzag:10/10", "--duration", "40", "--json", "out.json"], ["card.toml"]),
        (["card.toml", "--manoeuvre", "file:orders.csv", "--duration", "40"], ["orders.csv"]),
        (["tanker.toml", "--manoeuvre", "pullout:20", "--duration", "40"], ["tanker.toml"]),
        (["craft.toml", "--manoeuvre", "difference:190", "--duration", "10", "--json", "out.json"], ["craft.toml"]),
    ],
    "reduce": [
        (["captive.toml", "-o", "out.toml"], ["captive.toml", "averages.csv"]),
        (["tank/campaign.toml", "-o", "out.toml"], ["tank/campaign.toml", "tank/*.csv"]),
        (["tank/campaign.toml", "--keep-going", "--json", "out.json"], ["tank/*.csv"]),
        (["arm/campaign.toml", "-o", "out.toml"], ["arm/campaign.toml", "arm/runs.csv"]),
        (["mmg/campaign.toml", "--mmg", "-o", "out.toml"],
         ["mmg/campaign.toml", "mmg/runs.csv", "mmg/water.csv"]),
    ],
    "tow": [
        (["tows.csv", "-o", "out.toml"], ["tows.csv"]),
        (["tows.csv", "--method", "qr", "--terms", "B3", "--json", "out.json"], ["tows.csv"]),
        (["tows.csv", "--force-N", "11.6", "--mass-kg", "2243"], ["tows.csv"]),
    ],
    "yaw": [
        (["water.csv", "-o", "out.toml"], ["water.csv"]),
        (["water.csv", "--inertia-kgm2", "0.018", "--json", "out.json"], ["water.csv"]),
        (["water.csv", "--card", "card.toml", "-o", "out.toml"], ["water.csv", "card.toml"]),
        (["made.csv", "--simulate", "rig.toml"], ["rig.toml"]),
    ],
    "audit": [
        (["zigzag.csv", "--json", "out.json"], ["zigzag.csv"]),
        (["turn.csv", "zigzag.csv"], ["turn.csv"]),
        (["hsva.dat"], ["hsva.dat"]),
    ],
    "identify": [
        (["card.toml", "zigzag.csv", *FAST, "equation_error", "-o", "out.toml"], ["card.toml", "zigzag.csv"]),
        (["card.toml", "zigzag.csv", "turn.csv", *FAST, "output_error", "-o", "out.toml"], ["turn.csv"]),
        (["card.toml", "zigzag.csv", *FAST, "equation_error", "--holdout", "turn.csv"], ["turn.csv"]),
        (["craft.toml", "craft.csv", "-o", "out.toml", "--json", "out.json"], ["craft.csv", "craft.toml"]),
    ],
    "gap": [(["card.toml", "zigzag.csv", "-o", "gap", "--workers", "1", "--effects", "current", "--max-effects", "1"],
             ["card.toml", "zigzag.csv", "zigzag.csv"])],
    "signals": [
        (["zigzag.csv", "--json", "out.json"], ["zigzag.csv"]),
        (["noise.csv", "--columns", "r_degps"], ["noise.csv"]),
        (["zigzag.csv", "--columns", "r_degps", "--filter", "lowpass:0.2", "-o", "out.csv"], ["zigzag.csv"]),
    ],
    "log": [
        (["voyage.csv", "-o", "voyage", "--json", "out.json"], ["voyage.csv"]),
        (["voyage.nmea", "-o", "voyage"], ["voyage.nmea"]),
        (["voyage.log", "-o", "voyage"], ["voyage.log"]),
        (["digits.csv", "-o", "voyage"], ["digits.csv"]),
        (["brackets.log", "-o", "voyage"], ["brackets.log"]),
        (["mixed.nmea", "-o", "voyage"], ["mixed.nmea"]),
    ],
    "validate": [(["card.toml", "zigzag.csv", "--members", "0"], ["card.toml", "zigzag.csv"]),
                 (["card.toml", "turn.csv", "--members", "0", "--json", "out.json"], ["turn.csv"])],
    "compare": [(["card.toml", "tanker.toml", "--members", "0", "--json", "out.json"], ["card.toml", "tanker.toml"])],
    "influence": [
        (["card.toml", "--figures", "K_per_s", "criterion_C", "--json", "out.json"], ["card.toml"]),
        (["card.toml", "--figures", "steady_radius_m@20"], ["card.toml"]),
        (["steering.toml", "--json", "out.json"], ["steering.toml"]),
    ],
    "design": [
        (["card.toml", *QUICK, "--json", "out.json", "-o", "out.csv"], ["card.toml"]),
        (["card.toml", *QUICK, "--tank", "tank.toml", "--campaign", "out.toml"], ["tank.toml"]),
        (["card.toml", *QUICK, "--usual", "captive_runs.toml"], ["captive_runs.toml"]),
    ],
    "autopilot": [
        (["card.toml", "--design", "pd", "--json", "out.json"], ["card.toml"]),
        (["card.toml", "--design", "pd", "--track", "track.csv"], ["track.csv"]),
    ],
    "glide": [
        (["glider.toml", "--angles", "-30", "--json", "out.json"], ["glider.toml"]),
        (["glider.toml", "--programme", "programme.csv"], ["programme.csv"]),
        (["glider.toml", "--angles", "25", "--budget-kg", "5", "--depth-m", "100"], ["glider.toml"]),
    ],
    "export": [(["card.toml", "-o", "out.fmu"], ["card.toml"]),
               (["surge.toml", "-o", "out.fmu"], ["surge.toml"])],
    "check": [(["ship.fmu"], ["ship.fmu"]), (["ship.fmu", "--card", "card.toml"], ["card.toml"])],
    "stability": [(["card.toml", "--no-spirals", "--json", "out.json"], ["card.toml"])],
    "report": [([name, "-o", "out.html"], [name]) for name in RESULTS],
}  # fmt: skip

SHARES: dict[str, int] = {
    "simulate": 380, "reduce": 340, "tow": 270, "yaw": 150, "audit": 300, "log": 120, "identify": 180, "gap": 25,
    "signals": 250, "design": 60,
    "validate": 120, "compare": 60, "influence": 110, "autopilot": 75, "glide": 180, "export": 30, "check": 20,
    "stability": 60, "report": 270,
}  # fmt: skip
"""Jobs of each command: 3 000 in all, fewer of those that take long."""

_NUMBER_OPTIONS = (
    "--duration",
    "--force-N",
    "--mass-kg",
    "--inertia-kgm2",
    "--angles",
    "--budget-kg",
    "--depth-m",
    "--members",
)


A_THOUSAND = "1_000"
"""As a number of members it is good, and takes minutes; of all other options it is an edge."""


def job(command: str, number: int, made: Callable[[str], bytes]) -> Job:
    """The job of this number; `made` gives the content of an input that the program itself has to make."""
    draw = random.Random(zlib.crc32(f"{command} {number}".encode()))
    arguments, changeable = draw.choice(RECIPES[command])
    arguments = list(arguments)
    names = _inputs(arguments)
    files: Files = {name: plain()[name] if name in plain() else made(name) for name in names}
    wanted = [
        each
        for pattern in changeable
        for each in (
            [n for n in names if n.startswith("tank/") and n.endswith(".csv")] if "*" in pattern else [pattern]
        )
    ]
    numeric = [place + 1 for place, text in enumerate(arguments) if text in _NUMBER_OPTIONS]
    exits = (0, 1, 2) if command == "check" else (0, 2)
    if numeric and draw.random() < 0.06:
        place = draw.choice(numeric)
        option = arguments[place - 1]
        arguments[place] = draw.choice([each for each in EDGES if option != "--members" or each != A_THOUSAND])
        return Job(command, number, arguments, files, option, f"{option} {arguments[place][:20]}", exits)
    changed, name, words = mutate({each: files[each] for each in wanted}, plain(), draw)
    return Job(command, number, arguments, {**files, **changed}, name, words, exits)


def _inputs(arguments: list[str]) -> list[str]:
    every = [*plain(), "water.csv", "ship.fmu", *RESULTS]
    names = [name for text in arguments if (name := text.removeprefix("file:")) in every]
    if "captive.toml" in names:
        names.append("averages.csv")
    if "tank/campaign.toml" in names:
        names += [name for name in plain() if name.startswith("tank/") and name.endswith(".csv")]
    for folder in ("arm", "mmg"):
        if f"{folder}/campaign.toml" in names:
            names += [name for name in plain() if name.startswith(f"{folder}/") and name.endswith(".csv")]
    return names
