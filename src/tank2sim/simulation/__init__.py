"""Integration of a model, manoeuvres, and the figures read off them."""
