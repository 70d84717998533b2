"""Apps: programs that use the core and that no room of the core imports; one folder each (study, result, command)."""
