"""A ship or a craft as the physics of ArduPilot's simulator (SITL, ``--model JSON``)."""
