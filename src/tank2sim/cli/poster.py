"""``tank2sim poster``: the wheelhouse poster of a ship."""

from tank2sim.api.ship import Ship
from tank2sim.cli.bridge import sheet_command

command = sheet_command(
    "poster",
    Ship.poster,
    "Draw the wheelhouse poster (IMO A.601(15), A3) of CARD; what the card does not state stays blank.",
)
