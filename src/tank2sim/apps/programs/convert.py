"""A ship's card in another language."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from tank2sim.api.verbs import Output, verb
from tank2sim.apps.programs.forms import FORMS
from tank2sim.arguments import Scatter
from tank2sim.quantities import BodyPlace

if TYPE_CHECKING:
    from tank2sim.apps.programs.convert_result import ConversionResult
    from tank2sim.dynamics.vessel import Vessel

Language = Literal[
    "abkowitz", "mmg", "small_craft", "shipmmg", "mmgdynamics", "gazebo", "vrx", "mss", "pvs", "c99", "xdyn",
    "bridge_command", "osp", "osp_gunnerus",
]  # fmt: skip
"""Names of :data:`.FORMS`."""


@verb(
    "a card in another language: MMG as a polynomial, other conventions, other programs",
    Output(
        "-o",
        None,
        "Write the new file, or a folder with a README.",
        lambda result, path: result.files(path),
        "FILE|DIR",
        required=True,
        folder_without_ending=True,
    ),
    choices={"to": {name: form.words for name, form in FORMS.items()}},
    results=("tank2sim.apps.programs.convert_result:ConversionResult",),
    charts=False,
)
def convert(
    ship: Vessel,
    to: Language = "abkowitz",
    *,
    scaling: Literal["prime", "prime_ii", "bis", "dimensional"] | None = None,
    rudder_sign: Literal["port", "starboard"] | None = None,
    origin_m: BodyPlace = 0.0,
    scatter: Scatter | None = None,
    added_mass: Literal["plugin", "inertial"] | None = None,
) -> ConversionResult:
    """Write a ship's card in another language.

    An MMG ship becomes a polynomial by least squares over the motions of standard manoeuvres; between polynomial cards
    the conversions of scaling, rudder sign and origin are exact. Files of other programs are written from the equations
    themselves. Programs that run FMUs (Unity, Unreal, Simulink) take the one of export.

    Parameters
    ----------
    ship : Vessel
    to : str
        Language of the new file.
    scaling : str, optional
        Scaling of the new card; by default as it is, ``prime`` for a fit.
    rudder_sign : str, optional
        Side to which a positive rudder of the new card turns the ship.
    origin_m : float
        New origin forward of the old one, m.
    scatter : float, optional
        Spread of the motions of a fit about standard manoeuvres, as a share of their usual spread; by default 0.3.
    added_mass : str, optional
        Where Gazebo and VRX have the added mass of a craft: in the ``plugin``, whose explicit step is stable only for
        light ones, or in the ``inertial`` of the link (engine DART); by default in the plugin where that is stable.

    Raises
    ------
    InputError
        The card is at fault or cannot be had in that language.

    Examples
    --------
    >>> import tank2sim as t2s
    >>> made = t2s.convert("mariner", scaling="dimensional")
    >>> round(made.ship.turn(35).figures["tactical_diameter_lengths"], 1)
    6.4
    """
    from tank2sim.apps.programs.conventions import Conventions
    from tank2sim.apps.programs.convert_result import (
        ConversionResult,
        ConversionStudy,
        ConvertedFigure,
        PolynomialRange,
    )
    from tank2sim.apps.programs.languages import converted
    from tank2sim.cards.examination import doubts
    from tank2sim.notices import Notice

    made = converted(ship.card, to, Conventions(scaling, rudder_sign, origin_m), scatter, added_mass)
    fit = None
    if made.fit is not None:
        residuals = {name: 100 * value for name, value in made.fit.residuals.items()}
        fit = PolynomialRange(residuals, dict(made.fit.ranges))
    study = ConversionStudy(
        ship=ship.name,
        from_kind=ship.card.model.kind,
        to=to,
        made=FORMS[to].words,
        fit=fit,
        figures=tuple(ConvertedFigure(**vars(one), error_percent=one.error_percent) for one in made.changes),
        notices=(*doubts(ship.card), *map(Notice, made.losses)),
    )
    return ConversionResult(study, made, made.card, str(ship.card.source))
