"""``tank2sim pilotcard``: the pilot card of a ship."""

from tank2sim.api.ship import Ship
from tank2sim.cli.bridge import sheet_command

command = sheet_command(
    "pilotcard",
    Ship.pilot_card,
    "Draw the pilot card (IMO A.601(15), A4) of CARD; what the card does not state stays blank.",
)
