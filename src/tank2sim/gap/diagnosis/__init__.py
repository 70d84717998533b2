"""Where and when simulation and measurement differ."""
