"""Many ships at once: their folders, the search over them, and the record by which it goes on where it stopped."""
