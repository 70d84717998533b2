"""Heading and track controllers for a ship: design, assessment, trials on the nonlinear model."""
