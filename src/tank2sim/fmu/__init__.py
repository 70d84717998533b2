"""The FMU of a model: described, generated, compiled, packed and verified."""
