"""From CasADi functions to machine code: the C compiler of this machine, generated C, a cache of libraries."""
