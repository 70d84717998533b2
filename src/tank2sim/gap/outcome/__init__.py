"""Results of a gap: the improved card, corrected sensors, the next test."""
