"""What ships in general say of third-order terms that a campaign leaves open.

Small angles do not show the third order. To drop a term because it does not differ from zero would be to claim that it
is zero, and would make its linear term look better known than it is (post-selection inference; Leeb & Pötscher 2005,
Econometric Theory 21). To leave it free would let noise at 10 degrees of rudder speak of 35. So every term that the
campaign can distinguish stays in the regression, held loosely about zero: its ratio to the linear term of the same
force has a standard deviation as wide as the ratios of known ships. Where the tests show a term this moves it by
nothing; the values come from the tests alone, or are not in the card.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from tank2sim.identification.captive.equations import CampaignEquations
from tank2sim.identification.captive.regression import Spread, solve

RATIOS: Mapping[str, tuple[str, float]] = {
    "vvv": ("v", 10.0),
    "vvr": ("v", 25.0),
    "vrr": ("v", 10.0),
    "rrr": ("v", 1.0),
    "ddd": ("d", 1.0),
    "vvd": ("d", 6.0),
    "vdd": ("d", 2.0),
    "rdd": ("d", 2.0),
    "rrd": ("d", 2.0),
    "vrd": ("d", 6.0),
}
"""Powers of a term of Y or N to the linear term it is compared with and the standard deviation of the ratio (prime).

Round figures, above the largest of the Mariner (Chislett & Strom-Tejsen 1965: Yvvv/Yv 7.0, Yvvr/Yv 13, Nvvr/Nv 21,
Nvvv/Nv 6.2, Nvvd/Nd 3.5, Yvvd/Yd 4.3, Yddd/Yd 0.32). Terms that are not here are free."""


def with_prior(equations: CampaignEquations, spread: Spread) -> CampaignEquations:
    """The equations with third-order terms of Y and N held loosely about zero, by their linear terms as found."""
    found = solve(equations, spread)
    held = {}
    for name in equations.names:
        reference, ratio = RATIOS.get(name[1:], ("", math.inf))
        linear = name[0] + reference
        if name[0] in "YN" and linear in equations.names:
            size = max(abs(found.value(linear)), found.error(linear))
            held[name] = ratio * size
    return equations.held(held)
