"""A ship from her dimensions and the figures of her wheelhouse poster."""
