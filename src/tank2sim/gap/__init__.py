"""Where simulation and measurement differ: the missing physical effect named, added, and proved."""
