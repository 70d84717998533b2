"""The page of a simulated manoeuvre."""
