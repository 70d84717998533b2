"""What follows from a gap: the improved card, corrected sensors, the next test."""
