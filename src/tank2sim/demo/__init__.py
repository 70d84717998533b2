"""The whole way on bundled data: five measured tows and the Mariner, from numbers on paper to verified FMUs."""
