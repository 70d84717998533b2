"""A ship's card in another language: a polynomial for an MMG ship, other conventions, other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from tank2sim.analysis.conversion.conventions import Conventions, in_conventions
from tank2sim.analysis.conversion.mmg_programs import mmgdynamics_text, shipmmg_text
from tank2sim.analysis.conversion.polynomial_fit import (
    SCATTER,
    FigureChange,
    PolynomialFit,
    figure_changes,
    fit_polynomial,
    manoeuvre_motions,
    polynomial_card,
    scattered_motions,
)
from tank2sim.analysis.conversion.program_code import mss_function, pvs_class
from tank2sim.analysis.conversion.robotics import (
    VRX_MASSES,
    VRX_TERMS,
    craft_changes,
    gazebo_model,
    gazebo_text,
    vrx_model,
    vrx_text,
)
from tank2sim.answer.parts import Table
from tank2sim.api.bounds import NumberArgument, Scatter, checked
from tank2sim.api.result import OldResult, screen_table
from tank2sim.api.ship import Ship, as_ship
from tank2sim.cards import CraftCard, ManoeuvringCard
from tank2sim.cards.card import MmgCard
from tank2sim.cards.examination import doubts
from tank2sim.cards.reading import changed_text, craft_in_scaling, parse_card
from tank2sim.dynamics import build
from tank2sim.errors import InputError, close_name
from tank2sim.files import write_together

LANGUAGES = {
    "abkowitz": "a card with a third-order polynomial",
    "mmg": "a card of the MMG method, in another scaling",
    "shipmmg": "a Python file with the parameters of shipmmg",
    "mmgdynamics": "a Python file with a vessel of mmgdynamics",
    "small_craft": "a card of a small craft, in another scaling",
    "gazebo": "SDF of Gazebo's hydrodynamics and thruster plugins for a small craft",
    "vrx": "SDF of VRX's SimpleHydrodynamics for a small craft",
    "mss": "a function for MATLAB or Octave, as the ships of MSS are",
    "pvs": "a Python file with a vehicle for the Python Vehicle Simulator",
}
"""What a card can be converted to."""

_OF_CRAFT = ("small_craft", "gazebo", "vrx")
_OF_MMG = {"shipmmg": shipmmg_text, "mmgdynamics": mmgdynamics_text}
_SCALINGS = ("prime", "prime_ii", "bis", "dimensional")


@dataclass(frozen=True)
class ConvertedText:
    """What was made: the text, and the card if it is one."""

    text: str
    card: ManoeuvringCard | CraftCard | None = None
    fit: PolynomialFit | None = None
    changes: tuple[FigureChange, ...] = ()


class ConversionResult(OldResult):
    """A ship in another language.

    Parameters
    ----------
    ship : Ship
        As it was given.
    language : str
        One of :data:`LANGUAGES`.
    made : ConvertedText
    notices : tuple of str
    """

    command = "convert"

    def __init__(self, ship: Ship, language: str, made: ConvertedText, notices: tuple[str, ...]) -> None:
        self.ship, self.language, self.made = ship, language, made
        self.notices = (*doubts(ship.card), *notices)

    @property
    def text(self) -> str:
        """The file."""
        return self.made.text

    @property
    def converted(self) -> Ship:
        """The ship of the card that was made.

        Raises
        ------
        LookupError
            No card was made, but a file of another program.
        """
        if self.made.card is None:
            raise LookupError(f"{self.language} is not a card")
        return Ship(self.made.card)

    def files(self, path: str | Path) -> dict[Path, str | bytes]:
        """The file at `path`, with the covariance of a card next to it."""
        return {Path(path): self.text} if self.made.card is None else self.made.card.files(Path(path))

    def save(self, path: str | Path) -> None:
        """Write :meth:`files`, all or none.

        Raises
        ------
        InputError
            A file cannot be written.
        """
        write_together(self.files(path), inputs=[Path(self.ship.card.source)])

    def content(self) -> Mapping[str, object]:
        """As :meth:`.OldResult.content`."""
        fit = self.made.fit
        return {
            "ship": self.ship.name,
            "from_kind": self.ship.card.model.kind,
            "to": self.language,
            "fit": fit
            and {
                "residuals_percent": {name: 100 * value for name, value in fit.residuals.items()},
                "ranges": {name: list(value) for name, value in fit.ranges.items()},
            },
            "figures": [asdict(change) | {"error_percent": _percent(change)} for change in self.made.changes],
            "notices": list(self.notices),
        }

    @property
    def headline(self) -> tuple[str, ...]:
        """What was made of what, and how well a fit follows."""
        line = f"{self.ship.name} ({self.ship.card.model.kind}): {LANGUAGES[self.language]}"
        fit = self.made.fit
        if fit is None:
            return (line,)
        residuals = ", ".join(f"{name} {100 * value:.1f} %" for name, value in fit.residuals.items())
        low, high = fit.ranges["u"]
        widest = {name: max(map(abs, fit.ranges[name])) for name in ("drift_deg", "yaw_rate_prime", "rudder_deg")}
        envelope = (
            f"u {low:.2g} to {high:.2g} u0, drift to {widest['drift_deg']:.3g} deg, r' to "
            f"{widest['yaw_rate_prime']:.2g}, rudder to {widest['rudder_deg']:.3g} deg"
        )
        return line, f"fitted over {envelope} at nominal revolutions; residuals of the forces: {residuals}"

    @property
    def tables(self) -> tuple[Table, ...]:
        """Figures of standard manoeuvres before and after."""
        if not self.made.changes:
            return ()
        rows = [
            [change.manoeuvre, change.figure, change.before, change.after, _percent(change)]
            for change in self.made.changes
        ]
        return (screen_table("Standard manoeuvres", ("manoeuvre", "figure", "card", self.language, "error (%)"), rows),)


def _percent(change: FigureChange) -> float | None:
    if change.before is None or change.after is None or not change.before:
        return None
    return 100 * (change.after / change.before - 1)


@checked
def convert(
    card: str | Path | Ship,
    to: str = "abkowitz",
    *,
    scaling: str | None = None,
    rudder_sign: str | None = None,
    origin_m: NumberArgument = 0.0,
    scatter: Scatter = SCATTER,
) -> ConversionResult:
    """Write a ship's card in another language.

    An MMG ship becomes a polynomial by least squares over the motions of standard manoeuvres; between polynomial cards
    the conversions of scaling, rudder sign and origin are exact. Files of other programs are written from the equations
    themselves.

    Parameters
    ----------
    card : str, path or Ship
    to : str
        One of :data:`LANGUAGES`.
    scaling : str, optional
        Of a card: ``prime``, ``prime_ii``, ``bis`` or ``dimensional``; by default as it is, ``prime`` for a fit.
    rudder_sign : str, optional
        Of a card: side to which a positive rudder turns the ship, ``port`` or ``starboard``.
    origin_m : float
        Of a card: the new origin forward of the old one, m.
    scatter : float
        Of a fit: how far motions are scattered about those of standard manoeuvres, over
        :data:`tank2sim.analysis.conversion.polynomial_fit.SPREADS`.

    Raises
    ------
    InputError
        The card is at fault or cannot be had in that language.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> made = t2s.convert("mariner", scaling="dimensional")
    >>> round(made.converted.turn(35).figures["tactical_diameter_lengths"], 1)
    6.4
    """
    if to not in LANGUAGES:
        raise InputError("--to", to, "is not a language of cards", close_name(to, LANGUAGES))
    for option, value, known in (
        ("--scaling", scaling, _SCALINGS),
        ("--rudder-sign", rudder_sign, ("port", "starboard")),
    ):
        if value is not None and value not in known:
            raise InputError(option, value, "is not known", close_name(value, known))
    ship = as_ship(card)
    if isinstance(ship.card, CraftCard):
        return _of_craft(ship, ship.card, to, Conventions(scaling, rudder_sign, origin_m))
    given = _of_ship(ship, to)
    if abs(origin_m) > given.ship.length_m:
        raise InputError("--origin", f"{origin_m:g}", "is more than a length from midships", "give it in m")
    wanted = Conventions(scaling, rudder_sign, origin_m)
    if to not in ("abkowitz", "mmg"):
        if not wanted.unchanged:
            raise InputError("--to", to, "has conventions of its own", "leave --scaling, --rudder-sign, --origin out")
        return _program(ship, given, to)
    if to == "mmg" and not isinstance(given, MmgCard):
        problem = f"is {given.model.kind}: without thrust and rudder force its terms cannot be split into MMG's"
        raise given.fault("model.kind", problem, "convert an MMG card to abkowitz, not the other way")
    notices: tuple[str, ...] = ()
    if origin_m:
        notices = (
            "U of the new origin scales the numbers now: a difference of second order in the distance and r'",
            "figures, positions and speeds of the new card are those of its own origin",
        )
    if to == "abkowitz" and isinstance(given, MmgCard):
        return _fitted(ship, given, wanted, scatter, notices)
    if to == "abkowitz" and given.model.kind == "linear":
        changed = parse_card(changed_text(given.text, given.source, {"model.kind": "abkowitz"}), given.source)
        assert isinstance(changed, ManoeuvringCard)
        given, notices = changed, (*notices, "third-order terms that the card does not have are zero")
    made = in_conventions(given, wanted)
    build(made)
    return ConversionResult(ship, to, ConvertedText(made.text, made), notices)


def _of_ship(ship: Ship, to: str) -> ManoeuvringCard:
    """The card of a ship; raises InputError if it is none, or the language is one of small craft."""
    if to in _OF_CRAFT:
        raise ship.card.fault("model.kind", f"is {ship.card.model.kind}, and {to} is for small_craft", "use mss or pvs")
    return ship.manoeuvring()


def _of_craft(ship: Ship, card: CraftCard, to: str, wanted: Conventions) -> ConversionResult:
    if to not in _OF_CRAFT:
        problem = "is small_craft, whose damping is not a polynomial about a speed"
        raise card.fault("model.kind", problem, f"convert it to {', '.join(_OF_CRAFT)}")
    if wanted.rudder_sign is not None or wanted.origin_m:
        raise InputError("--to", to, "has neither a rudder nor another origin", "leave --rudder-sign, --origin out")
    if to == "small_craft":
        if wanted.scaling not in (None, "dimensional", "prime"):
            raise InputError("--scaling", wanted.scaling or "", "is not of a small craft", "give dimensional or prime")
        made = craft_in_scaling(card, wanted.scaling or card.model.scaling)
        return ConversionResult(ship, to, ConvertedText(made.text, made), ())
    if wanted.scaling is not None:
        raise InputError("--to", to, "has conventions of its own", "leave --scaling out")
    text, model = (gazebo_text, gazebo_model) if to == "gazebo" else (vrx_text, vrx_model)
    notices = []
    if card.effects:
        notices.append(f"effects are left out: {', '.join(entry.name for entry in card.effects)}")
    if to == "gazebo":
        notices.append(
            "the hull is whole; the thruster plugin takes a thrust in N and has neither the loss by speed, nor the "
            "dead band, nor the lag of the card"
        )
    else:
        lost = [name for name, value in card.derivatives.items() if value and name not in (*VRX_TERMS, *VRX_MASSES)]
        also = f", and {', '.join(lost)}" if lost else ""
        notices.append(f"SimpleHydrodynamics has no Coriolis terms of the added mass (no moment of Munk){also}")
    changes = craft_changes(card, model(card))
    return ConversionResult(ship, to, ConvertedText(text(card), changes=changes), tuple(notices))


def _fitted(
    ship: Ship, card: MmgCard, wanted: Conventions, scatter: float, notices: tuple[str, ...]
) -> ConversionResult:
    bare = build(card)
    model = build(replace(card, effects=())) if card.effects else bare
    fit = fit_polynomial(card, model, scattered_motions(model, manoeuvre_motions(model), scatter))
    polynomial = polynomial_card(card, fit)
    changes = figure_changes(bare, build(polynomial))
    made = in_conventions(polynomial, wanted)
    if fit.covariance is not None:
        carried = "standard errors are those of the MMG card's numbers, carried through the fit with their covariance"
        notices = (*notices, f"{carried}; what the fit itself misses is in the table alone")
    return ConversionResult(ship, "abkowitz", ConvertedText(made.text, made, fit, changes), notices)


def _program(ship: Ship, card: ManoeuvringCard, to: str) -> ConversionResult:
    if to in _OF_MMG:
        if not isinstance(card, MmgCard):
            raise card.fault("model.kind", f"is {card.model.kind}, and {to} is a program of the MMG method", "use mss")
        notices = [
            f"{to} has the wake w_P0 exp(-4 beta_P^2) in place of C_1, C_2, and U and beta of v - x_G r: it turns "
            "more tightly than the card"
        ]
        if card.effects:
            notices.append(f"effects are left out: {', '.join(entry.name for entry in card.effects)}")
        if card.ship.beam_m is None:
            notices.append("the card states no beam_m: B is nan (shipmmg does not use it)")
        return ConversionResult(ship, to, ConvertedText(_OF_MMG[to](card)), tuple(notices))
    write = mss_function if to == "mss" else pvs_class
    return ConversionResult(ship, to, ConvertedText(write(card, build(card))), ())
