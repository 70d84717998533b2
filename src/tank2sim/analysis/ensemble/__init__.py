"""Ships as uncertain as their cards say: what their figures, tracks and verdicts are."""
