"""The page on which a ship is steered."""
