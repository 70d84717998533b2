"""From measured records to the coefficients of a model, with their uncertainty."""
