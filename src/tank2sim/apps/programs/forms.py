"""Forms that a card can be converted to: cards of other kinds and conventions, and files of other programs."""

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
    """Something a card can be converted to."""

    words: str
    ending: str = ""  # Of the file that it is; empty for a form of several files, which are a folder
    writer: str = ""  # ``module:function`` that makes the files of a card; empty for a form of one file
    use: str = ""  # How the one file is used, for the README next to it

    def files(self, card: SteeredCard) -> ProgramFiles:
        """The files of a form that is a folder.

        Raises InputError: The card cannot be had in that form.
        """
        module, _, function = self.writer.partition(":")
        made: ProgramFiles = getattr(import_module(f"tank2sim.apps.programs.{module}"), function)(card)
        return made


_CARD_USE = "A card: wherever tank2sim takes a ship, give this file."

_ROBOT_LINK = """Make a link `base_link` with its origin midships, or write the name of yours into the plugin. The
comment at the top of `NAME.sdf` has mass, centre of gravity and yaw inertia (`izz`) for the link's `<inertial>`. Roll,
pitch, buoyancy, `ixx` and `iyy` are not on the card. `<fluid_added_mass>`, where it is written, belongs into that
`<inertial>` and needs SDF 1.10 and the engine DART.
"""

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
        use=f"""{_ROBOT_LINK}
Copy the plugins into the `<model>`. Each thruster plugin moves a revolute joint, `<name>_joint`, at the place in the
comment above it, x forward and y to port of midships, with its axis: make these joints, or write the names of yours.
Commands are newtons. gz-sim 7 (Garden) or later.""",
    ),
    "vrx": Form(
        "SDF of VRX's SimpleHydrodynamics for a small craft",
        MODEL[0],
        use=f"""{_ROBOT_LINK}
Copy the plugin into the `<model>`. Thrusters are not in the file: take the thrusters of VRX, with the thrusts that
`convert --to gazebo` writes.""",
    ),
    "mss": Form(
        "a function for MATLAB or Octave, as the ships of MSS are",
        MATLAB[0],
        use="Put the file into a folder on the path of MATLAB or Octave, and call `[xdot, U] = NAME(x, ui, p)`. "
        "Its comments list states, inputs and parameters, with units and signs; `ui` and `p` may be left out.",
    ),
    "pvs": Form(
        "a Python file with a vehicle for the Python Vehicle Simulator",
        PYTHON[0],
        use="""Copy the file into the folder `vehicles` of the simulator. In its main program import the class of this
name from it, and make the vehicle: `NAME("stepInput", 20)` steps the rudder to 20 deg (positive to starboard). It
needs NumPy alone. The comments of the file list states, inputs and parameters.""",
    ),
    "c99": Form("a folder with the ship in plain C99, for firmware and test benches", writer="c99:c99_files"),
    "xdyn": Form("a folder with a body of xdyn and LOTUSim and tables of commands", writer="xdyn:xdyn_files"),
    "bridge_command": Form(
        "a folder with an own ship of Bridge Command, with fitted numbers",
        writer="bridge_command:bridge_command_files",
    ),
    "osp": Form("a folder with the hull and the system of OSP's case dp-ship", writer="osp_case:osp_files"),
    "osp_gunnerus": Form("a folder with the hull of OSP's case gunnerus-dp", writer="osp_case:gunnerus_files"),
}
"""Name on the command line to the form."""
