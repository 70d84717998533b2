"""The public API behind ``import tank2sim``: ships, results, and what the commands do, in degrees and data frames."""
