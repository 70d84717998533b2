"""Design of the next captive campaign and of the next sea trial: the runs that make chosen figures most certain."""
