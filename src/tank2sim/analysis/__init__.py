"""What a model says about the ship: stability, steering."""
