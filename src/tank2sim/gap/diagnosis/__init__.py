"""Location and time of the differences of simulation and measurement."""
