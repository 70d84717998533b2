"""Prior of third-order terms, from the ratios of known ships, for campaigns that hardly determine them.

Small angles do not show the third order. Dropping a term that does not differ from zero would state that it is zero,
and would make its linear term look more accurate than it is (post-selection inference; Leeb & Pötscher 2005,
Econometric Theory 21). A free term would extrapolate noise at 10 degrees of rudder to 35. Therefore every term that the
campaign can distinguish stays in the regression with a wide prior about zero: its ratio to the linear term of the same
force has the standard deviation of the ratios of known ships. The prior does not move terms that the tests determine;
the card has no others.
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
"""Powers of a term of Y or N to the linear term of the ratio, and the standard deviation of the ratio (prime).

Round figures, above the largest of the Mariner (Chislett & Strom-Tejsen 1965: Yvvv/Yv 7.0, Yvvr/Yv 13, Nvvr/Nv 21,
Nvvv/Nv 6.2, Nvvd/Nd 3.5, Yvvd/Yd 4.3, Yddd/Yd 0.32). Other terms are free."""


def with_prior(equations: CampaignEquations, spread: Spread) -> CampaignEquations:
    """The equations with the prior of third-order terms of Y and N, scaled by the estimated linear terms."""
    found = solve(equations, spread)
    held = {}
    for name in equations.names:
        reference, ratio = RATIOS.get(name[1:], ("", math.inf))
        linear = name[0] + reference
        if name[0] in "YN" and linear in equations.names:
            size = max(abs(found.value(linear)), found.error(linear))
            held[name] = ratio * size
    return equations.held(held)
