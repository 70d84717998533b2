"""Result of ``convert``: a ship's card in another language."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from tank2sim.answer.parts import Section, records_table
from tank2sim.answer.result import Result
from tank2sim.apps.programs.forms import FORMS
from tank2sim.apps.programs.program_code import program_name
from tank2sim.apps.programs.program_files import ProgramFiles
from tank2sim.cards import Card
from tank2sim.errors import InputError
from tank2sim.escaping import one_line
from tank2sim.files import folder_made, names_folder, write_together
from tank2sim.notices import Notice
from tank2sim.version import __version__


@dataclass(frozen=True)
class PolynomialRange:
    """A polynomial fitted to an MMG ship."""

    residuals_percent: dict[str, float]  # Force to the root mean square of its residual, % of its own
    # ``u`` (over u0), ``drift_deg``, ``yaw_rate_prime``, ``rudder_deg`` to lowest and highest value that was fitted
    ranges: dict[str, tuple[float, float]]


@dataclass(frozen=True)
class ConvertedFigure:
    """A figure of a standard manoeuvre before and after; None where the run was too short for it."""

    manoeuvre: str
    figure: str
    before: float | None
    after: float | None
    error_percent: float | None


@dataclass(frozen=True, kw_only=True)
class ConversionStudy:
    """A ship in another language."""

    ship: str
    from_kind: str
    to: str
    made: str  # The language in words
    fit: PolynomialRange | None
    figures: tuple[ConvertedFigure, ...]
    notices: tuple[Notice, ...]


@dataclass(frozen=True, eq=False, repr=False)
class ConversionResult(Result[ConversionStudy]):
    """A ship in another language.

    Parameters
    ----------
    study : ConversionStudy
    made : ProgramFiles, optional
        None if the result was read from its JSON.
    card : Card, optional
        The card that was made; None for a file of another program. ``ship`` is its ship.
    source : str
        Card that was converted.
    """

    study: ConversionStudy
    made: ProgramFiles | None = None
    card: Card | None = None
    source: str = ""
    command: ClassVar[str] = "convert"

    @property
    def text(self) -> str:
        """The file."""
        return self._made.text

    @property
    def _made(self) -> ProgramFiles:
        if self.made is None:
            raise LookupError("the JSON of a conversion does not hold its file")
        return self.made

    def files(self, path: str | Path) -> dict[Path, str | bytes]:
        """The file at `path`, with the covariance of a card next to it; or all files and a README in the folder.

        Parameters
        ----------
        path : path
            A name without an ending means a folder.

        Raises
        ------
        InputError
            The form has several files, and `path` names one.
        """
        path, made, form = Path(path), self._made, FORMS[self.study.to]
        if not names_folder(path):
            if made.files:
                raise InputError(path, "", f"is one file, and {self.study.to} has several", "give a folder")
            return {path: made.text} if made.card is None else made.card.files(path)
        if made.files:
            return {
                **{path / name: content for name, content in made.files.items()},
                path / "README.md": self._readme(made.use),
            }
        main = path / f"{program_name(self.study.ship)}{form.ending}"
        return {**self.files(main), path / "README.md": self._readme(form.use.replace("NAME", main.stem))}

    def save(self, path: str | Path) -> None:
        """Write :meth:`files`, all or none.

        Raises
        ------
        InputError
            A file cannot be written.
        """
        contents = self.files(path)
        with folder_made(Path(path)) if names_folder(Path(path)) else nullcontext():
            write_together(contents, inputs=[Path(self.source)])

    def _readme(self, use: str) -> str:
        """Description of the files, their use and what was lost, in Markdown."""
        study, source = self.study, one_line("/".join(Path(self.source).parts[-2:]))
        text = (
            f"# {one_line(study.ship)}: {study.to}\n\n{study.made[0].upper()}{study.made[1:]}, written by tank2sim "
            f"{__version__} from {source}.\n\n## Use\n\n{use.strip()}\n\n## What is lost\n\n"
        )
        said = [str(notice) for notice in study.notices]
        text += "".join(f"- {one_line(line)}.\n" for line in said) if said else "Nothing that tank2sim knows of.\n"
        if study.figures:
            text += f"\n| manoeuvre | figure | tank2sim | {study.to} | error (%) |\n|---|---|---|---|---|\n"
            for one in study.figures:
                cells = ("" if value is None else f"{value:.4g}" for value in (one.before, one.after))
                error = "" if one.error_percent is None else f"{one.error_percent:+.2f}"
                text += f"| {one.manoeuvre} | {one.figure} | {' | '.join(cells)} | {error} |\n"
        return text

    @property
    def title(self) -> str:
        """The ship and the language."""
        return f"{self.study.ship}: {self.study.to}"

    @property
    def headline(self) -> tuple[str, ...]:
        """Source and result of the conversion, and how well a fit follows."""
        line, fit = f"{self.study.ship} ({self.study.from_kind}): {self.study.made}", self.study.fit
        if fit is None:
            return (line,)
        residuals = ", ".join(f"{name} {value:.1f} %" for name, value in fit.residuals_percent.items())
        low, high = fit.ranges["u"]
        widest = {name: max(map(abs, fit.ranges[name])) for name in ("drift_deg", "yaw_rate_prime", "rudder_deg")}
        envelope = (
            f"u {low:.2g} to {high:.2g} u0, drift to {widest['drift_deg']:.3g} deg, r' to "
            f"{widest['yaw_rate_prime']:.2g}, rudder to {widest['rudder_deg']:.3g} deg"
        )
        return line, f"Fitted over {envelope} at nominal revolutions; residuals of the forces: {residuals}"

    @property
    def sections(self) -> Sequence[Section]:
        """Figures of standard manoeuvres before and after."""
        if not self.study.figures:
            return []
        fields = {"manoeuvre": "", "figure": "", "before": "card", "after": self.study.to, "error_percent": ""}
        name = "Standard manoeuvres"
        return [Section(name, tables=[records_table(name, self.study.figures, fields=fields)])]
