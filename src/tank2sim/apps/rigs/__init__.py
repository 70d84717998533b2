"""Rigs and bodies other than ships: accelerating tows, the yaw rig, underwater gliders."""
