"""A ship from dimensions and the figures of a wheelhouse poster."""
