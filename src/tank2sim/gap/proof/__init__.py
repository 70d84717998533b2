"""Whether a named effect holds on trials that it was not fitted to."""
