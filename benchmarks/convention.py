"""Published derivatives with scrambled conventions: how often is the true reading the first of ``tank2sim convention``?

Each table of ``published_coefficients/*.csv`` states its conventions. It is rewritten in every combination of rudder
sign, scaling, yaw-rate terms and origin (where its centre of gravity is known and not midships), rounded to four digits
as in print, and read without a word on the conventions. The rewriting shares no code with what reads. What was tuned,
was tuned on the five tables of :data:`TUNED`; the others are apart.
"""

from __future__ import annotations

import csv
import itertools
import math
import re
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

import tank2sim as t2s
from tank2sim.apps.programs.convention_result import same_in_practice

HERE = Path(__file__).resolve().parent / "published_coefficients"

TUNED = ("mariner", "s175_container", "kvlcc2_mmg", "kvlcc2_identified", "esso_osaka_model")

SIZES = (
    *("length_m", "beam_m", "draught_m", "displacement_kg", "block_coefficient", "speed_mps", "centre_of_gravity_m"),
    "water_density_kgpm3",
)
CONVENTIONS = ("rudder_sign", "scaling", "yaw_rate_terms", "origin")
CHOICES = {
    "rudder_sign": ("starboard", "port"),
    "scaling": ("prime", "prime_ii", "bis", "dimensional"),
    "yaw_rate_terms": ("hydrodynamic", "total"),
    "origin": ("midships", "centre_of_gravity"),
}

Powers = tuple[int, int, int, int]  # of v, r, d, u


class Table:
    """A published table, as numbers about midships, in the prime system, without inertia, rudder to starboard."""

    def __init__(self, path: Path) -> None:
        lines = [line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
        rows = list(csv.reader(lines))[1:]
        self.sizes = {key: float(value) for key, value in rows if key in SIZES}
        self.stated = {key: value for key, value in rows if key in CONVENTIONS}
        numbers = {key: float(value) for key, value in rows if key not in SIZES and key not in CONVENTIONS}
        size = self.sizes
        self.L, self.U = size["length_m"], size["speed_mps"]
        self.rho = size.get("water_density_kgpm3", 1025.0)
        volume = size.get("block_coefficient", 0.0) * self.L * size["beam_m"] * size["draught_m"]
        self.displacement = size.get("displacement_kg", volume * self.rho)
        self.printed_body = {key: numbers.pop(key) for key in ("mass", "yaw_inertia", "x_G") if key in numbers}
        unit = self.unit(self.stated["scaling"])
        self.mass = self.printed_body.get("mass", self.displacement / unit["mass"]) * unit["mass"]
        length = self.L if self.stated["scaling"] != "dimensional" else 1.0
        self.x_G = size.get("centre_of_gravity_m", self.printed_body.get("x_G", 0.0) * length)
        self.inertia = self.printed_body.get("yaw_inertia", 0.0) * unit["inertia"]
        # All in SI.
        self.acceleration: dict[str, float] = {}
        self.forces: dict[str, dict[Powers, float]] = {"X": {}, "Y": {}, "N": {}}
        for name, value in numbers.items():
            self._add(name, value)
        if self.stated["yaw_rate_terms"] == "total":
            self._inertia(1.0, self.x_G)
        assert self.stated["origin"] == "midships", path

    def unit(self, scaling: str) -> dict[str, float]:
        """SI value of a mass, inertia, force of 1."""
        rho, L, U, d = self.rho, self.L, self.U, self.sizes["draught_m"]
        g = 9.80665
        match scaling:
            case "prime":
                return {"mass": rho / 2 * L**3, "inertia": rho / 2 * L**5, "force": rho / 2 * L**2 * U**2, "speed": U}
            case "prime_ii":
                ratio = d / L
                found = self.unit("prime")
                return {key: value * (ratio if key != "speed" else 1) for key, value in found.items()}
            case "bis":
                m, speed = self.displacement, math.sqrt(g * L)
                return {"mass": m, "inertia": m * L**2, "force": m * g, "speed": speed}
        return {"mass": 1.0, "inertia": 1.0, "force": 1.0, "speed": 1.0}

    def size_of(self, scaling: str, force: str, powers: Powers) -> float:
        """SI value of a coefficient of 1 of these powers."""
        unit, length = self.unit(scaling), 1.0 if scaling == "dimensional" else self.L
        v, r, _, u = powers
        arm = length if force == "N" else 1.0
        return unit["force"] * arm / unit["speed"] ** (v + u) / (unit["speed"] / length) ** r

    def _add(self, name: str, value: float) -> None:
        scaling = self.stated["scaling"]
        unit, length = self.unit(scaling), 1.0 if scaling == "dimensional" else self.L
        alias = {"mx": ("Xudot", -1), "my": ("Yvdot", -1), "Jz": ("Nrdot", -1), "R0": ("X0", -1)}
        name, sign = alias.get(name, (name, 1))
        if name.endswith("dot"):
            arms = (name[0] == "N") + (name[1] == "r")
            self.acceleration[name] = sign * value * unit["mass"] * length**arms
            return
        letters = re.findall(r"beta|[vrdu]", name[1:])
        powers: Powers = (
            letters.count("v") + letters.count("beta"),
            letters.count("r"),
            letters.count("d"),
            letters.count("u"),
        )
        sign *= (-1) ** letters.count("beta")
        if self.stated["rudder_sign"] == "port":
            sign *= (-1) ** powers[2]
        self.forces[name[0]][powers] = sign * value * self.size_of(scaling, name[0], powers)

    def _inertia(self, sign: float, x_G: float) -> None:
        """Take the ship's own inertia out of what is printed in total (+1), or put it in (-1)."""
        m, U = self.mass, self.U
        terms = [("Y", (0, 1, 0, 0), m * U), ("N", (0, 1, 0, 0), m * x_G * U)]
        if any(powers[0] + powers[1] for powers in self.forces["X"]):
            terms += [("X", (1, 1, 0, 0), -m), ("X", (0, 2, 0, 0), -m * x_G)]
        for force, powers, value in terms:
            self.forces[force][powers] = self.forces[force].get(powers, 0.0) + sign * value

    def about(self, ahead: float) -> None:
        """Move the origin `ahead` m: v = v_P - a r and N_P = N - a Y, by multiplying polynomials out."""
        for force, terms in self.forces.items():
            moved: dict[Powers, float] = defaultdict(float)
            for (v, r, d, u), value in terms.items():
                factors: dict[tuple[int, int], float] = {(0, 0): value}
                for _ in range(v):
                    product: dict[tuple[int, int], float] = defaultdict(float)
                    for (i, j), number in factors.items():
                        product[i + 1, j] += number
                        product[i, j + 1] -= ahead * number
                    factors = product
                for (i, j), number in factors.items():
                    moved[i, r + j, d, u] += number
            self.forces[force] = dict(moved)
        for powers, value in self.forces["Y"].items():
            self.forces["N"][powers] = self.forces["N"].get(powers, 0.0) - ahead * value
        old = {key: self.acceleration.get(key, 0.0) for key in ("Yvdot", "Yrdot", "Nvdot", "Nrdot")}
        if any(old.values()):
            self.acceleration["Yrdot"] = old["Yrdot"] - ahead * old["Yvdot"]
            self.acceleration["Nvdot"] = old["Nvdot"] - ahead * old["Yvdot"]
            self.acceleration["Nrdot"] = old["Nrdot"] - ahead * (old["Nvdot"] + old["Yrdot"]) + ahead**2 * old["Yvdot"]
        if self.inertia:
            self.inertia += self.mass * ((self.x_G - ahead) ** 2 - self.x_G**2)

    def rows(self, reading: dict[str, str]) -> list[str]:
        """The rows of the table in other conventions, without a word on them."""
        about_centre = reading["origin"] == "centre_of_gravity"
        if about_centre:
            self.about(self.x_G)
        if reading["yaw_rate_terms"] == "total":
            self._inertia(-1.0, 0.0 if about_centre else self.x_G)
        scaling = reading["scaling"]
        unit, length = self.unit(scaling), 1.0 if scaling == "dimensional" else self.L
        rows = [f"{key},{value:.8g}" for key, value in self.sizes.items() if key != "centre_of_gravity_m"]
        if self.x_G:
            rows.append(f"centre_of_gravity_m,{self.x_G:.6g}")
        if "mass" in self.printed_body:
            rows.append(f"mass,{self.mass / unit['mass']:.4g}")
        if self.inertia:
            rows.append(f"yaw_inertia,{self.inertia / unit['inertia']:.4g}")
        for name, value in self.acceleration.items():
            arms = (name[0] == "N") + (name[1] == "r")
            rows.append(f"{name},{value / unit['mass'] / length**arms:.4g}")
        for force, terms in self.forces.items():
            for powers, value in terms.items():
                sign = (-1) ** powers[2] if reading["rudder_sign"] == "port" else 1
                number = sign * value / self.size_of(scaling, force, powers)
                odd = "".join(letter * power for letter, power in zip("vrd", powers, strict=False))
                zero = "0" if not odd and (force != "X" or not powers[3]) else ""
                if number:
                    rows.append(f"{force}{zero}{odd}{'u' * powers[3]},{number:.4g}")
        return rows


def combinations(table: Table) -> list[dict[str, str]]:
    """Every convention in which a table differs."""
    choices = dict(CHOICES)
    if not table.x_G:
        choices["origin"] = ("midships",)
    if not any(powers[2] % 2 for terms in table.forces.values() for powers in terms):
        choices["rudder_sign"] = ("starboard",)
    return [dict(zip(choices, values, strict=True)) for values in itertools.product(*choices.values())]


def main() -> None:
    """Print the shares, by table and by convention."""
    totals: dict[str, Counter[str]] = {"tuned": Counter(), "apart": Counter()}
    claimed: list[tuple[float, bool]] = []
    print(f"{'table':20s} {'combinations':>12s} {'first':>6s} {'but for the origin':>18s} {'figures alike':>13s}")
    for path in sorted(HERE.glob("*.csv")):
        fold = "tuned" if path.stem in TUNED else "apart"
        counts: Counter[str] = Counter()
        for wanted in combinations(Table(path)):
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "table.csv"
                file.write_text("\n".join(Table(path).rows(wanted)) + "\n", encoding="utf-8")
                found = t2s.convention(file)
            first = found.readings[0]
            right = {key: getattr(first, key) == value for key, value in wanted.items()}
            counts["all"] += 1
            counts["first"] += all(right.values())
            counts["ship"] += all(value for key, value in right.items() if key != "origin")
            truth = next(entry for entry in found.readings if wanted.items() <= vars(entry).items())
            counts["alike"] += all(right.values()) or same_in_practice(first, truth)
            claimed.append((first.probability, all(right.values())))
        totals[fold] += counts
        n = counts["all"]
        shares = [100 * counts[key] / n for key in ("first", "ship", "alike")]
        print(f"{path.stem:20s} {n:12d} {shares[0]:5.0f}% {shares[1]:17.0f}% {shares[2]:12.0f}%  {fold}")
    for fold, counts in [*totals.items(), ("all", totals["tuned"] + totals["apart"])]:
        n = counts["all"]
        shares = [100 * counts[key] / n for key in ("first", "ship", "alike")]
        print(f"{fold:20s} {n:12d} {shares[0]:5.1f}% {shares[1]:17.1f}% {shares[2]:12.1f}%")
    for low, high in ((0.0, 0.7), (0.7, 0.9), (0.9, 0.99), (0.99, 1.01)):
        chosen = [right for probability, right in claimed if low <= probability < high]
        if chosen:
            share = 100 * sum(chosen) / len(chosen)
            print(f"claimed {low:.2f} to {min(high, 1):.2f}: {len(chosen)} tables, the first is true in {share:.0f} %")


if __name__ == "__main__":
    main()
