"""What an estimate is worth: identifiability, prediction intervals, held-out trials."""
