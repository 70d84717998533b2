"""An effect, readers, a structure, a command and a kind of card that tank2sim finds once this package is installed."""
