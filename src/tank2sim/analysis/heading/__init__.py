"""Heading and track controllers for a ship: design, judgement, trials on the nonlinear model."""
