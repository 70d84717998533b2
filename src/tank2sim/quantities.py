"""Physical quantities that a user gives, each with unit and bounds: one type for arguments, cards and other files.

The bounds are far outside anything that was ever built, towed or steered: a number beyond them is a slip of the pen or
of the unit, and the powers of it in the prime system (up to L^5) leave the range of a float. They are project choices,
well beyond the largest known, which is named.
"""

from __future__ import annotations

from typing import Annotated

from tank2sim.arguments import ArgumentBounds

Length = Annotated[float, ArgumentBounds(0.01, 1000.0)]
"""m, of a ship, a body or a model. The longest ship had 458 m."""
BodyPlace = Annotated[float, ArgumentBounds(-1000.0, 1000.0)]
"""m, from midships or from the centre plane: within the longest body."""
Breadth = Annotated[float, ArgumentBounds(0.001, 200.0)]
"""m: beam, and height of a rudder or diameter of a propeller. The broadest ship has 124 m."""
Draught = Annotated[float, ArgumentBounds(0.001, 50.0)]
"""m. The deepest ships have 29 m."""
BlockCoefficient = Annotated[float, ArgumentBounds(0, 1.0, above=True)]
"""Displaced volume over L B T."""
WaterDepth = Annotated[float, ArgumentBounds(0.001, 11_000.0)]
"""m. The sea is 10 935 m deep at most (Challenger Deep)."""
TankSize = Annotated[float, ArgumentBounds(0, 5000.0, above=True)]
"""m, of a tank or of the way of its carriage. The longest tank has 1.3 km."""
TankModelLength = Annotated[float, ArgumentBounds(0.1, 100.0)]
"""m, of a model in a tank. Models of ships have 1 to 10 m, bodies that were towed up to 13 m."""
Area = Annotated[float, ArgumentBounds(1e-6, 1e6)]
"""m2: of a rudder, a profile, a hull. That of the longest body, squared."""
Volume = Annotated[float, ArgumentBounds(1e-9, 1e9)]
"""m3. The largest ship displaces 0.9e6 m3."""
Mass = Annotated[float, ArgumentBounds(1e-6, 1e12)]
"""kg. The largest ship displaces 0.9e9 kg."""
YawInertia = Annotated[float, ArgumentBounds(1e-9, 1e15)]
"""kg m2. The longest ship has 1e13."""
YawInertiaError = Annotated[float, ArgumentBounds(0, 1e15)]
"""kg m2, one standard deviation."""
TowingForce = Annotated[float, ArgumentBounds(0, 1e9, above=True)]
"""N. The strongest tugs pull with 5e6 N."""
TorqueConstant = Annotated[float, ArgumentBounds(1e-6, 1e6)]
"""N m/A, of a motor."""
MotorCurrent = Annotated[float, ArgumentBounds(1e-3, 1e6)]
"""A."""
CurrentNoise = Annotated[float, ArgumentBounds(0, 1e6)]
"""A, one standard deviation."""
Speed = Annotated[float, ArgumentBounds(0.001, 100.0)]
"""m/s, of a ship or a model."""
SpeedKnots = Annotated[float, ArgumentBounds(0.002, 200.0)]
"""kn: the same."""
WindSpeed = Annotated[float, ArgumentBounds(0, 60.0)]
"""m/s, a mean. A hurricane of the highest category begins at 70 m/s over one minute, and no ship manoeuvres in it."""
StreamSpeed = Annotated[float, ArgumentBounds(0, 10.0)]
"""m/s, of the water over the ground: the fastest tidal stream (Saltstraumen)."""
WaveFrequency = Annotated[float, ArgumentBounds(0, 100.0, above=True)]
"""rad/s, of encounter. Waves of 6 mm length have 100."""
Revolutions = Annotated[float, ArgumentBounds(-1e6, 1e6)]
"""rpm, of a propeller. The fastest turbines have 1e6."""
WaterDensity = Annotated[float, ArgumentBounds(900.0, 1300.0)]
"""kg/m3. Fresh water has 958 (boiling) to 1000, sea water up to 1030, the Dead Sea 1240: g/cm3 and t/m3 are refused."""
Viscosity = Annotated[float, ArgumentBounds(1e-7, 1e-5)]
"""m2/s. Water has 0.3e-6 (boiling) to 1.8e-6 (freezing): refuses centistokes."""
TimeConstant = Annotated[float, ArgumentBounds(1e-3, 1000.0)]
"""s."""
LONGEST_RUN_S = 2e5
"""Longest run, s, that is simulated: beyond two days a manoeuvre or a tow is a mistake in units, and its motion (two
million steps of 40 numbers) would fill gigabytes."""
Duration = Annotated[float, ArgumentBounds(0, LONGEST_RUN_S, above=True)]
"""s, of a run or a part of it."""
GapLength = Annotated[float, ArgumentBounds(0, 1e7, above=True)]
"""s, without readings: a third of a year."""
SlantAngle = Annotated[float, ArgumentBounds(-90.0, 90.0)]
"""deg, of a rudder, a drift, a path or a roll: beyond it the other side is meant."""
YawingAngle = Annotated[float, ArgumentBounds(0, 90.0)]
"""deg, by waves, one standard deviation."""
WeightAngle = Annotated[float, ArgumentBounds(0, 360.0, above=True)]
"""deg, that counts as much as another angle."""
SeaState = Annotated[int, ArgumentBounds(0, 9, whole=True)]
"""Code of the WMO."""
