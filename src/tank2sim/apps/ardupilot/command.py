"""A ship as the physics of ArduPilot's simulator."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tank2sim.api.verbs import Progress, Written, verb
from tank2sim.arguments import ArgumentBounds
from tank2sim.errors import ArgumentError
from tank2sim.quantities import Duration

if TYPE_CHECKING:
    from tank2sim.apps.ardupilot.result import ServeResult
    from tank2sim.dynamics.vessel import Vessel

FIRST_PORT, PORTS_APART = 9002, 10
"""Port to which the first instance of SITL sends, and the distance to the next instance's."""

_PARAMETERS = Written((".parm",), "BOAT.parm", by_function=True)
Instance = Annotated[int, ArgumentBounds(0, 100, whole=True)]


@verb(
    "the physics of ArduPilot's SITL (--model JSON), in lock-step",
    default_ship="otter",
    name="serve",
    results=("tank2sim.apps.ardupilot.result:ServeResult",),
    charts=False,
)
def serve(
    ship: Vessel,
    output: str | Annotated[Path, _PARAMETERS] | None = None,
    *,
    instance: Instance = 0,
    silence_s: Duration | None = None,
    report: Progress = lambda _: None,
) -> ServeResult:
    """Answer ArduPilot's SITL as the physics of its ``--model JSON``, in lock-step, until it is interrupted.

    Start ``sim_vehicle.py -v Rover --model JSON:127.0.0.1 --add-param-file=boat.parm`` in another window. A craft with
    thrusters at both sides is steered by channels 1 and 3 (skid steering), a ship by rudder (1) and throttle (3).

    Parameters
    ----------
    ship : Vessel
        A craft with thrusters at both sides, or a ship with a rudder and propulsion.
    output : path, optional
        Parameter file of the boat: servos, cruise throttle and speed, feed-forward of the steering, largest turn.
    instance : int
        Instance of SITL; its port is 9002 + 10 times this.
    silence_s : float, optional
        End after so long without a packet, s; by default never.
    report : callable
        Called when the port is open.

    Raises
    ------
    InputError
        The ship has neither thrusters at both sides nor a rudder with an engine, or the port is taken.
    """
    from tank2sim.apps.ardupilot.parameters import boat_parameters
    from tank2sim.apps.ardupilot.physics import SitlShip
    from tank2sim.apps.ardupilot.result import Served, ServeResult
    from tank2sim.files import write_together

    model, port = ship.model, FIRST_PORT + PORTS_APART * instance
    parameters, physics = boat_parameters(model), SitlShip(model)
    files = {} if output is None else {Path(output): parameters.text}
    answered = refused = 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        try:
            sock.bind(("127.0.0.1", port))
        except OSError as error:
            problem = f"port {port} cannot be opened ({error.strerror})"
            raise ArgumentError(
                "instance", f"{instance}", problem, "end the program that has it, or give another"
            ) from None
        write_together(files)
        sock.settimeout(silence_s)
        report(f"SITL on UDP port {port}: waiting")
        try:
            while True:
                data, sender = sock.recvfrom(2048)
                reply = physics.answer(data)
                if reply is None:
                    refused += 1
                    continue
                sock.sendto(reply, sender)
                answered += 1
        except (TimeoutError, KeyboardInterrupt):
            pass
    study = Served(
        ship=ship.model.name,
        port=port,
        parameters=parameters,
        answered=answered,
        refused=refused,
        repeated=physics.repeated,
        restarts=physics.restarts,
        simulated_s=physics.time,
    )
    return ServeResult(study, tuple(files))
