"""The estimation problem: card, trials, free parameters and their prior."""
