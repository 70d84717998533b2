"""One page of any result that a command wrote as JSON."""
