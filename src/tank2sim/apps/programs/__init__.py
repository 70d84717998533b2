"""Cards in other conventions and languages: origin, scaling, rudder sign; MMG to a polynomial; other programs."""
