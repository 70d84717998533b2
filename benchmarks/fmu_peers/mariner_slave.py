"""The Mariner as a slave of PythonFMU: what a programmer would write for this one ship in Python with numpy."""

from pathlib import Path

import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

STATES = ("motion.x", "motion.y", "motion.psi", "motion.u", "motion.v", "motion.r", "rudder.angle")
FIXED, SURGE_TERMS, SIDE_TERMS = 9, 16, 22


class Mariner(Fmi2Slave):
    """Equation (3.8) in the prime system, a first-order steering gear, classical Runge-Kutta steps."""

    def __init__(self, **more):
        super().__init__(**more)
        numbers = np.loadtxt(Path(self.resources) / "ship.txt")
        (self.length, self.speed, _, mass, x_g, inertia, self.lag, self.rate, self.angle) = numbers[:FIXED]
        surge, side_1, side_2 = np.cumsum([FIXED + SURGE_TERMS, SIDE_TERMS, SIDE_TERMS])
        self.surge, self.sides = numbers[FIXED:surge], numbers[surge:side_2].reshape(2, side_1 - surge)
        x_udot, y_vdot, y_rdot, n_vdot, n_rdot = numbers[side_2:]
        self.surge_mass = mass - x_udot
        self.inverse = np.linalg.inv([[mass - y_vdot, mass * x_g - y_rdot], [mass * x_g - n_vdot, inertia - n_rdot]])
        self.state, self.order = np.array([0.0, 0.0, 0.0, self.speed, 0.0, 0.0, 0.0]), 0.0
        order = Real("rudder.command", causality=Fmi2Causality.input, start=0.0)
        order.getter, order.setter = (lambda: self.order), self.set_order
        self.register_variable(order, nested=False)
        for place, name in enumerate(STATES):
            output = Real(name, causality=Fmi2Causality.output)
            output.getter = lambda place=place: self.state[place]
            self.register_variable(output, nested=False)

    def set_order(self, order):
        self.order = order

    def rates(self, state):
        _, _, psi, u_mps, v_mps, r_radps, d = state.tolist()
        speed = np.hypot(u_mps, v_mps)
        v, r, u = v_mps / speed, r_radps * self.length / speed, (u_mps - self.speed) / speed
        vv, rr, dd, uu = v * v, r * r, d * d, u * u
        surge = self.surge @ np.array(
            [
                *(1.0, u, uu, uu * u, vv, rr, dd, vv * u, rr * u, dd * u),
                *(v * r, v * d, r * d, v * r * u, v * d * u, r * d * u),
            ]
        )
        sides = self.sides @ np.array(
            [
                *(1.0, u, uu, v, vv * v, v * rr, v * dd, v * u, v * uu, r, rr * r, vv * r, r * dd, r * u, r * uu),
                *(d, dd * d, vv * d, rr * d, d * u, d * uu, v * r * d),
            ]
        )
        v_dot, r_dot = self.inverse @ sides
        scale, sine, cosine = speed * speed / self.length, np.sin(psi), np.cos(psi)
        order = max(-self.angle, min(self.angle, self.order))
        return np.array(
            [
                u_mps * cosine - v_mps * sine,
                u_mps * sine + v_mps * cosine,
                r_radps,
                surge / self.surge_mass * scale,
                v_dot * scale,
                r_dot * scale / self.length,
                max(-self.rate, min(self.rate, (order - d) / self.lag)),
            ]
        )

    def do_step(self, current_time, step_size):
        x, h = self.state, step_size
        k1 = self.rates(x)
        k2 = self.rates(x + h / 2 * k1)
        k3 = self.rates(x + h / 2 * k2)
        k4 = self.rates(x + h * k3)
        self.state = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return True
