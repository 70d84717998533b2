"""Physical effects on top of the polynomial: each a function from model to model."""

from tank2sim.dynamics.effects import (
    derivatives,
    dynamic_effects,
    gear,
    hull,
    loaded_rudder,
    propeller,
    rudder,
    sensors,
    surroundings,
)
from tank2sim.dynamics.effects.effect import Effect, EffectParameter

EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        surroundings.CURRENT,
        surroundings.WIND,
        surroundings.WAVE_DRIFT,
        surroundings.BANK_SUCTION,
        propeller.PROPELLER_SIDE_FORCE,
        propeller.PROPELLER_WALK,
        propeller.LOADING_SIDE_FORCE,
        propeller.ENGINE_DROOP,
        propeller.ENGINE_LAG,
        rudder.RUDDER_BIAS,
        rudder.RUDDER_EFFECTIVENESS,
        rudder.RUDDER_SLIPSTREAM,
        rudder.RUDDER_STALL,
        loaded_rudder.LOADED_RUDDER,
        gear.RUDDER_RATE_LIMIT,
        gear.RUDDER_LAG,
        gear.RUDDER_BACKLASH,
        gear.RUDDER_DEAD_BAND,
        gear.TELEMOTOR_LAG,
        hull.CROSS_FLOW_DRAG,
        hull.HULL_FOULING,
        hull.HUMP_RESISTANCE,
        hull.ASYMMETRIC_TURNING,
        derivatives.CUBIC_YAW_DAMPING,
        derivatives.SWAY_YAW_COUPLING,
        derivatives.TURNING_DRAG,
        derivatives.ADDED_YAW_INERTIA,
        derivatives.ADDED_SWAY_MASS,
        derivatives.LINEAR_YAW_DAMPING,
        derivatives.LINEAR_SWAY_DAMPING,
        derivatives.SHALLOW_WATER,
        derivatives.WATER_DEPTH,
        derivatives.TRIM,
        dynamic_effects.ROLL_COUPLING,
        dynamic_effects.FLOW_MEMORY,
        sensors.GYRO_BIAS,
        sensors.GYRO_SCALE,
        sensors.HEADING_OFFSET,
        sensors.ANTENNA_LEVER_ARM,
        sensors.LOG_SCALE,
        sensors.LOG_MISALIGNMENT,
        sensors.LOG_LEVER_ARM,
        sensors.RUDDER_TIME_OFFSET,
    )
}
"""All effects by the name that cards use."""

__all__ = ["EFFECTS", "Effect", "EffectParameter"]
