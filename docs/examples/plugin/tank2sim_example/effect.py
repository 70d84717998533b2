"""A bow thruster."""

from tank2sim.dynamics.effects import Effect, EffectParameter
from tank2sim.dynamics.effects.forces import scales, with_forces


def push(model, given, card):
    """Y = F, N = a L F, F = 1/2 rho L^2 u0^2 F' / (1 + (u/w)^2); F and F' positive to starboard."""
    full = scales(model, model.symbol("ship.speed")).force * given["force"]
    force = full / (1 + (model.symbol("motion.u") / given["half_speed"]) ** 2)
    return with_forces(model, Y=force, N=given["lever"] * model.symbol("ship.length") * force)


# Bounds, typical value and defaults are choices of this example.
FORCE = EffectParameter("force_prime", "force at rest, prime, positive to starboard", -0.01, 0.01,
                        input_name="bow_thruster.force", absent=0.0, typical=(5e-4,))  # fmt: skip
LEVER = EffectParameter("lever", "place forward of midships, in ship lengths", 0.0, 0.5, default=0.4)
HALF_SPEED = EffectParameter("half_speed_mps", "speed at which half of the force is left", 0.1, 20.0, default=4.0)

BOW_THRUSTER = Effect(
    name="bow_thruster",
    acts_on="force",
    description="A thruster pushes the bow aside, less and less as the ship gains speed.",
    source="after Brix (ed.) (1993), Manoeuvring Technical Manual: lateral thrusters",
    parameters=(FORCE, LEVER, HALF_SPEED),
    equations=push,
    terminal="Bow thruster",
)
