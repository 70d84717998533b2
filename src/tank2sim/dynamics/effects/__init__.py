"""Physical effects on top of the polynomial: each a function from model to model."""

from tank2sim.dynamics.effects import (
    azimuths,
    banks,
    controllable_pitch,
    depth,
    derivatives,
    dynamic_effects,
    fields,
    gear,
    harbour,
    hull,
    loaded_rudder,
    loading,
    propeller,
    rudder,
    sensors,
    ships_near,
    surroundings,
    twin_screws,
    waves,
)
from tank2sim.dynamics.effects.effect import Effect, EffectParameter, sensor_fault_of
from tank2sim.dynamics.model import Model
from tank2sim.plugins import Registry

EFFECTS: Registry[Effect] = Registry(
    "tank2sim.effects",
    (
        surroundings.CURRENT,
        surroundings.WIND,
        fields.CURRENT_FIELD,
        fields.WIND_FIELD,
        surroundings.WAVE_DRIFT,
        waves.WAVES,
        surroundings.BANK_SUCTION,
        banks.BANK,
        ships_near.OTHER_SHIP,
        propeller.PROPELLER_SIDE_FORCE,
        propeller.PROPELLER_WALK,
        propeller.LOADING_SIDE_FORCE,
        propeller.ENGINE_DROOP,
        propeller.ENGINE_LAG,
        propeller.ENGINE_TELEGRAPH,
        propeller.REVERSED_THRUST,
        propeller.PROPELLER_ASTERN,
        controllable_pitch.CONTROLLABLE_PITCH,
        twin_screws.TWIN_ORDERS,
        harbour.BOW_THRUSTER,
        harbour.STERN_THRUSTER,
        harbour.TUG_FORCES,
        azimuths.AZIMUTHS,
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
        depth.FINITE_DEPTH,
        derivatives.TRIM,
        loading.LOADING,
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
    ),
    Effect,
    fault=sensor_fault_of,
)
"""All effects by the name that cards use, installed packages included."""


def acting_variable(model: Model, name: str) -> str:
    """The variable that acts for one of the steering gear: a variable of an effect in its place, or itself.

    Parameters
    ----------
    model : Model
    name : str
        ``steering.max_rate`` or ``steering.time_constant``.
    """
    for effect in EFFECTS.values():
        names = effect.model_names()
        for parameter, replaced in effect.in_place_of.items():
            if replaced == name and names[parameter] in model:
                return names[parameter]
    return name


def nearly_like(name: str) -> str:
    """The effect that shows in nearly the same way as this one; empty without one.

    Parameters
    ----------
    name : str
        Name of an effect.
    """
    return EFFECTS[name].nearly_like or next(
        (other.name for other in EFFECTS.values() if other.nearly_like == name), ""
    )


def undisturbed_inputs(model: Model) -> dict[str, float]:
    """Inputs that effects add to a model, at the values (SI) at which the effects vanish: no current, no wind."""
    parameters = [parameter for effect in EFFECTS.values() for parameter in effect.parameters]
    absent = {parameter.input_name: parameter.absent for parameter in parameters if parameter.input_name}
    return {name: value for name, value in absent.items() if value is not None and name in model.input_names}


__all__ = ["EFFECTS", "Effect", "EffectParameter", "acting_variable", "nearly_like", "undisturbed_inputs"]
