"""Mutated inputs to every command: bad input ends in one line that names the file, never in a fault of the program."""
