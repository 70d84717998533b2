"""Charts and sections of an ensemble."""
