"""Statistics, spectra and filters of a record."""
