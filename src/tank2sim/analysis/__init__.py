"""Analysis of ship models: stability, turning, steering, influence, validation."""
