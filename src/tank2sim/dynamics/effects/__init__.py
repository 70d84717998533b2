"""Physical effects on top of the polynomial: each a function from model to model."""
