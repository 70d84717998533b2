"""Event indicators in Model Exchange: a solver that steps up to the kinks of the rudder comes nearer to the truth."""

from __future__ import annotations

import contextlib
import io
from ctypes import c_double, c_size_t, c_void_p
from typing import TYPE_CHECKING, Any

import fmpy
import numpy as np
import pytest

from tank2sim.arrays import Array
from tank2sim.fmu.running import RunningFmu
from tests.fmu.driving import ERROR, STATES, FmuFile, Instantiate, Status, begun, steps, untyped

if TYPE_CHECKING:
    from tank2sim.arrays import Array

RATE_LIMIT = 0.08726646259971647  # 5 deg/s


class FixedSteps:
    """A simulator of Model Exchange with classical Runge-Kutta steps, which may step up to the events it meets."""

    def __init__(self, fmu: RunningFmu) -> None:
        self.fmu, self.count, self.events = fmu, fmu.unpacked.description.numberOfContinuousStates, 0
        begun(fmu).update()

    def _read(self, function: Any, count: int) -> Array:
        values = (c_double * count)()
        function(values, count)
        return np.array(values)

    def _rates(self, x: Array) -> Array:
        self.fmu.instance.setContinuousStates((c_double * self.count)(*x), self.count)
        instance = self.fmu.instance
        return self._read(
            getattr(instance, "getContinuousStateDerivatives", None) or instance.getDerivatives, self.count
        )

    def _moved(self, x: Array, h: float) -> Array:
        k1 = self._rates(x)
        k2 = self._rates(x + h / 2 * k1)
        k3 = self._rates(x + h / 2 * k2)
        return np.array(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + self._rates(x + h * k3)))

    def _signs(self, x: Array) -> list[bool]:
        self._rates(x)
        return [bool(value > 0) for value in self._read(self.fmu.instance.getEventIndicators, 2)]

    def step(self, h: float, stop_at_events: bool) -> None:
        """One step of `h`, or to the first event in it and from there on."""
        x = self._read(self.fmu.instance.getContinuousStates, self.count)
        before, end = self._signs(x), self._moved(x, h)
        if not stop_at_events or self._signs(end) == before:
            self._rates(end)
            return
        short, far = 0.0, h
        while far - short > 1e-12:
            middle = (short + far) / 2
            short, far = (middle, far) if self._signs(self._moved(x, middle)) == before else (short, middle)
        self._rates(self._moved(x, far))
        self.events += 1
        self.step(h - far, stop_at_events)

    def zigzag(self, h: float, stop_at_events: bool) -> list[float]:
        """States at the end of 60 s in which the rudder goes from side to side every 20 s."""
        for order in (0.35, -0.35, 0.35):
            self.fmu.write({"rudder.command": order})
            for _ in range(round(20.0 / h)):
                self.step(h, stop_at_events)
        return self.fmu.read(STATES)


def co_simulated(fmu: RunningFmu, largest_step: float) -> list[float]:
    """The same zigzag by Co-Simulation."""
    fmu.write({"solver.max_step": largest_step})
    begun(fmu)
    for leg, order in enumerate((0.35, -0.35, 0.35)):
        fmu.write({"rudder.command": order})
        steps(fmu, 20, 1.0, begin=20.0 * leg)
    return fmu.read(STATES)


def test_a_zigzag_with_events_agrees_better_with_co_simulation(fmi: int, instantiate: Instantiate) -> None:
    """An integration of fourth order across a kink is of second order; up to it and on from it, of fourth again."""
    truth = co_simulated(instantiate("hull", fmi, "CoSimulation"), 1e-3)
    aware, blind = (FixedSteps(instantiate("hull", fmi, "ModelExchange")) for _ in range(2))
    rudder = STATES.index("rudder.angle")
    errors = [np.abs(np.array(one.zigzag(0.2, one is aware)) - truth) for one in (aware, blind)]
    assert (aware.events, blind.events) == (3, 0)
    assert (errors[0] < 0.1 * errors[1])[:rudder].all()  # the rudder itself is at rest at the end


def test_a_solver_with_root_finding_stops_at_every_event(fmi: int, fmu_file: FmuFile, instantiate: Instantiate) -> None:
    """FMPy's CVode: with its error control it needs the events less, but must not be led astray or chatter."""
    truth = co_simulated(instantiate("hull", fmi, "CoSimulation"), 1e-3)
    times = np.repeat(np.arange(0.0, 61.0, 20.0), 2)[1:-1]
    table = zip(times, np.repeat([0.35, -0.35, 0.35], 2), strict=True)
    with contextlib.redirect_stdout(io.StringIO()):
        found = fmpy.simulate_fmu(
            str(fmu_file("hull", fmi)),
            fmi_type="ModelExchange",
            stop_time=60.0,
            input=np.array(list(table), dtype=[("time", float), ("rudder.command", float)]),
            output=STATES,
            output_interval=1.0,
            relative_tolerance=1e-9,
        )
    assert [found[name][-1] for name in STATES] == pytest.approx(truth, abs=1e-5)
    between = [time for time in found["time"] if abs(time - round(time)) > 1e-6]
    # At its largest rate until the rest of the way is what the lag of 1 s makes of that rate.
    left = [(way - RATE_LIMIT) / RATE_LIMIT for way in (0.35, 0.7, 0.7)]
    assert sorted(set(np.round(between, 6))) == pytest.approx([left[0], 20 + left[1], 40 + left[2]], abs=1e-5)


def test_indicators_change_sign_where_the_rudder_reaches_its_rate_limit(fmi: int, instantiate: Instantiate) -> None:
    fmu = begun(instantiate("hull", fmi, "ModelExchange"))
    fmu.update()
    assert fmu.unpacked.description.numberOfEventIndicators == 2

    def signs(order: float) -> list[bool]:
        values = (c_double * 2)()
        fmu.write({"rudder.command": order})
        fmu.instance.getEventIndicators(values, 2)
        assert list(values) == fmu.read(["kinks.rudder.rate[1]", "kinks.rudder.rate[2]"])
        return [value > 0 for value in values]

    assert signs(0.999 * RATE_LIMIT) == signs(-0.999 * RATE_LIMIT)
    assert sum(a != b for a, b in zip(signs(0.999 * RATE_LIMIT), signs(1.001 * RATE_LIMIT), strict=True)) == 1
    assert signs(1.001 * RATE_LIMIT) != signs(-1.001 * RATE_LIMIT)


def test_event_indicators_are_refused_where_they_are_not(fmi: int, instantiate: Instantiate, status: Status) -> None:
    model, slave = (begun(instantiate("hull", fmi, kind)) for kind in ("ModelExchange", "CoSimulation"))
    assert status(model.instance.getEventIndicators, (c_double * 3)(), 3) == ERROR
    assert len(model.log) == 1
    if fmi == 3:
        assert model.instance.getNumberOfEventIndicators() == 2
    function = getattr(untyped(slave), f"fmi{fmi}GetEventIndicators")
    assert function(c_void_p(slave.instance.component), (c_double * 2)(), c_size_t(2)) == ERROR


def test_a_model_without_kinks_has_no_indicators(fmi: int, instantiate: Instantiate) -> None:
    fmu = begun(instantiate("body", fmi, "ModelExchange"))
    assert fmu.unpacked.description.numberOfEventIndicators == 0
    fmu.instance.getEventIndicators((c_double * 0)(), 0)
