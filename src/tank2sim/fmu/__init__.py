"""A model as a Functional Mock-up Unit: interface, C generation, packaging, verification."""
