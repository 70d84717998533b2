"""An effect, a trial reader and a structure that tank2sim finds once this package is installed."""
