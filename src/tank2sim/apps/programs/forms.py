"""What a card can be converted to: cards of other kinds and conventions, and files of other programs."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from tank2sim.files import CARD, MATLAB, MODEL, PYTHON

if TYPE_CHECKING:
    from tank2sim.apps.programs.program_files import ProgramFiles
    from tank2sim.cards import SteeredCard


@dataclass(frozen=True)
class Form:
    """Something a card can be converted to.

    Parameters
    ----------
    words : str
    ending : str
        Of the file that it is; empty for a form of several files, which are a folder.
    writer : str
        ``module:function`` that makes the files of a card; empty for a form of one file.
    use : str
        How the one file is used, for the README next to it.
    """

    words: str
    ending: str = ""
    writer: str = ""
    use: str = ""

    def files(self, card: SteeredCard) -> ProgramFiles:
        """The files of a form that is a folder.

        Raises
        ------
        InputError
            The card cannot be had in that form.
        """
        module, _, function = self.writer.partition(":")
        made: ProgramFiles = getattr(import_module(f"tank2sim.apps.programs.{module}"), function)(card)
        return made


_CARD_USE = "A card: wherever tank2sim takes a ship, give this file."

FORMS = {
    "abkowitz": Form("a card with a third-order polynomial", CARD[0], use=_CARD_USE),
    "mmg": Form("a card of the MMG method, in another scaling", CARD[0], use=_CARD_USE),
    "small_craft": Form("a card of a small craft, in another scaling", CARD[0], use=_CARD_USE),
    "shipmmg": Form(
        "a Python file with the parameters of shipmmg",
        PYTHON[0],
        use="Import the file, and give `basic_params` and `maneuvering_params` to `simulate_mmg_3dof`.",
    ),
    "mmgdynamics": Form(
        "a Python file with a vessel of mmgdynamics", PYTHON[0], use="Import the file, and give `vessel` to `step`."
    ),
    "gazebo": Form(
        "SDF of Gazebo's hydrodynamics and thruster plugins for a small craft",
        MODEL[0],
        use="Copy the elements into the `<model>` of the craft: the plugins as they are, `<inertial>` into its link.",
    ),
    "vrx": Form(
        "SDF of VRX's SimpleHydrodynamics for a small craft",
        MODEL[0],
        use="Copy the elements into the `<model>` of the craft: the plugin as it is, `<inertial>` into its link.",
    ),
    "mss": Form(
        "a function for MATLAB or Octave, as the ships of MSS are",
        MATLAB[0],
        use="Put the file into a folder on the path of MATLAB or Octave, and call `[xdot, U] = NAME(x, ui, p)`.",
    ),
    "pvs": Form(
        "a Python file with a vehicle for the Python Vehicle Simulator",
        PYTHON[0],
        use="Copy the file into the folder `vehicles` of the simulator, and make the vehicle in its main program.",
    ),
    "c99": Form("a folder with the ship in plain C99, for firmware and test benches", writer="c99:c99_files"),
    "xdyn": Form("a folder with a body of xdyn and LOTUSim and tables of commands", writer="xdyn:xdyn_files"),
    "bridge_command": Form(
        "a folder with an own ship of Bridge Command, with fitted numbers",
        writer="bridge_command:bridge_command_files",
    ),
    "osp": Form("a folder with the hull and the system of OSP's case dp-ship", writer="osp_case:osp_files"),
    "osp_gunnerus": Form("a folder with the hull of OSP's case gunnerus-dp", writer="osp_gunnerus:gunnerus_files"),
}
"""Name on the command line to the form."""
