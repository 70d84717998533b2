"""Names of :mod:`tank2sim.arguments`, for modules that are not yet moved."""

from tank2sim.arguments import *  # noqa: F403
