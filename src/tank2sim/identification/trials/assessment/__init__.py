"""Quality of an estimate: identifiability, prediction intervals, held-out trials."""
