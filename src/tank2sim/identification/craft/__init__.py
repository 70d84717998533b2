"""The card of a craft with thrusters from trials in which its revolutions were recorded."""
