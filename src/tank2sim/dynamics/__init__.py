"""The equations, each once, in CasADi; :func:`build` makes the model of a card."""
