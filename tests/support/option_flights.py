"""One short flight of each option by the reference controller, and the same flight by other routes.

The flight shows what a route leaves out: a circle whose height swings, so that no acceleration is 0,
a turning heading, gusts and motion capture. Whoever compares returns "=", and fails if a bit differs.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from mambo_codegen.methods import method_of
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.sensors.mocap import MotionCapture
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.drone.vehicles.vehicle_sections import MocapSensors
from mambo_sil.experiment.faults.fault import Fault, KeepInputs, SetState, move_target
from mambo_sil.experiment.faults.injection import FaultyController, LevellingCaller
from mambo_sil.flight import loop
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import adapted, numbers_of
from mambo_sil.flight.engine.adjusted import AdjustedController, Adjustment
from mambo_sil.flight.engine.simulate import fly
from mambo_sil.flight.fences import square_fence, with_limits
from mambo_sil.flight.height_profiles import Swing
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.scenario import Scenario
from mambo_sil.flight.traces import Trace
from mambo_sil.flight.trajectories import Circle, InSpace, Trajectory

DURATION_S: Final = 0.5
COURSE: Final = InSpace(Circle(1.0, 2.0), Swing(0.3, 4.0))
CALM: Final = InSpace(Circle(0.4, 0.8), Swing(0.05, 1.5))
"""A course on which no mixer caps a thrust, which no log shows."""
FAULTS: Final = (
    None,
    Fault(10, 45, SetState(range(7), np.nan, on=3, of=10)),
    Fault(10, 45, KeepInputs(), drop_every=3),
    Fault(10, 45, move_target(0.5), late_updates=4),
    Fault(5, 45, SetState(range(7), np.nan)),
)
"""Faults of the wrapped flights; the caller of the last one levels out, and the first one has none."""
PATIENCE: Final = np.array([2**31, 2**31, 2**31, 2**31, 9])
SET_AT: Final = 20
"""Update at which all but the first get other limits or weights."""


@dataclass(frozen=True, eq=False)
class Update:
    """The inputs of one update of a controller of one drone, and its command (1, 2 or 3).

    With a height `thrust_m_s2` is what the drone got in place of the last command, NaN if it got that.
    """

    state: FloatArray
    target: FloatArray
    thrust_m_s2: FloatArray
    command: FloatArray


class Observed:
    """A controller of one drone that keeps its inputs and commands."""

    def __init__(self, controller: Any) -> None:
        self.controller, self.updates = adapted(controller), list[Update]()

    def step(self, state: FloatArray, target: FloatArray, thrust_acceleration_m_s2: FloatArray) -> Any:
        """Step, and keep what it was about."""
        done = self.controller.step(state, target, thrust_acceleration_m_s2)
        self.updates.append(Update(state, target, thrust_acceleration_m_s2, numbers_of(done)))
        return done


class OptionFlights:
    """The flights with some settings."""

    def __init__(self, settings: Settings) -> None:
        self.settings, self.method = settings, method_of(settings)
        self.name = "crazyflie" if settings.height else "mambo"
        self.drone = vehicle_toml.load(self.name)
        self._observed = Observed(self.method.reference_controller(1))

    @property
    def scenario(self) -> Scenario:
        """A flight that commands and campaigns can be given: in space for a controller of the height."""
        return Scenario(
            vehicle=self.drone,
            trajectory="swinging-eight" if self.settings.height else "circle",
            size_m=1.0,
            rate_rad_s=2.0,
            duration_s=DURATION_S,
            yaw_rad=0.7,
        )

    def flight(self, flights: int = 1, course: Trajectory = COURSE) -> Flight:
        """Return the flight, n times."""
        return Flight(
            course,
            duration_s=DURATION_S,
            flights=flights,
            yaw_rad=0.7,
            yaw_rate_rad_s=0.5,
            vehicle=Vehicle.of(self.drone),
            update_period_s=self.settings.horizon.update_period_s,
            seeds=(3,) * flights,
            disturbances=Disturbances(wind_speed_m_s=3.0, push_m_s2=(0.4, -0.6)),
            sensors=MotionCapture(_cameras()),
        )

    def compiled(self, n: int = 1) -> CompiledController:
        """Return n controllers in C; each set of settings is compiled once."""
        return CompiledController(self.settings, n)

    @cached_property
    def trace(self) -> Trace:
        """The trace of the reference controller."""
        return fly(self.flight(), self._observed)

    @property
    def updates(self) -> list[Update]:
        """The updates of that flight."""
        assert len(self.trace.time_s) == len(self._observed.updates)
        return self._observed.updates

    @property
    def calm_updates(self) -> list[Update]:
        """The updates of the C on a calm course."""
        observed = Observed(self.compiled())
        fly(replace(self.flight(course=CALM), disturbances=Disturbances()), observed)
        return observed.updates

    def wrapped(self) -> PositionController:
        """Return controllers in all wrappers: faults, a caller that levels out, limits or weights set."""
        compiled, n = self.compiled(len(FAULTS)), len(FAULTS)
        changes = [Adjustment(row, SET_AT, *self._other()) for row in range(1, n)] if self._other() else []
        adjusted = AdjustedController(compiled, n, changes)
        return FaultyController(LevellingCaller(adjusted, compiled, PATIENCE), FAULTS, compiled.instances)

    def _other(self) -> Any:
        """Return a setter with its values; nothing for settings that have none."""
        if self.method.limiting:
            return "set_limits", with_limits(self.settings, **square_fence(0.4), speed_m_s=0.8)
        return ("set_weights", (800.0, 3.0)) if self.method.weight_limits else ()

    @cached_property
    def wrapped_trace(self) -> Trace:
        """The trace of the wrapped controllers in the engine."""
        return fly(self.flight(len(FAULTS)), self.wrapped())

    def in_engine(self) -> str:
        """Compare the C in the engine with the reference."""
        assert fly(self.flight(), self.compiled()).same_bits(self.trace)
        return "="

    def in_wrappers(self) -> str:
        """Compare the wrapped controllers in NumPy with those in the engine, and the first with none."""
        in_numpy = loop.fly(self.flight(len(FAULTS)), self.wrapped())
        assert in_numpy.same_bits(self.wrapped_trace)
        assert in_numpy.digest(0) == self.trace.digest()
        return "="

    def told(self) -> str:
        """Compare C and reference that are told of jumps, sent commands, and what else they can be told."""
        compiled, reference = self.compiled(), self.method.reference_controller(1)
        assert self._open_loop(compiled).tobytes() == self._open_loop(reference).tobytes()
        return "="

    def _open_loop(self, controller: Any) -> FloatArray:
        """Return the commands (k, 2 or 3) on the inputs of the flight, with calls between the updates."""
        calls, commands, caller = self._calls(), list[FloatArray](), adapted(controller)
        for number, update in enumerate(self.updates):
            for name, values in calls.get(number, ()):
                assert getattr(controller, name)(np.array([values])).tolist() == [0], name
            done = caller.step(update.state, update.target, update.thrust_m_s2)
            commands.append(numbers_of(done))
        return np.concatenate(commands)

    def _calls(self) -> dict[int, list[tuple[str, Any]]]:
        """Return the calls before some updates: function and values."""
        has_height = self.method.has_height
        shift = (0.2, -0.1, 0.3, 0.1, 0.2, -0.1, 0.4) if has_height else (0.2, -0.1, 0.1, 0.2, 0.4)
        command = (0.1, -0.05, 9.0) if has_height else (0.1, -0.05)
        found: dict[int, list[tuple[str, Any]]] = {5: [("frame_jumped", shift)], 40: [("reset", command)]}
        if self.method.setter == "report_command":
            found[10] = [("report_command", command)]
        if has_height:
            found[15] = [("report_thrust", 8.0)]
        if self._other():
            found[SET_AT] = [self._other()]
        if self.settings.guard:
            found[30] = [("set_position_measured", False)]
        return found


def _cameras() -> MocapSensors:
    """Return motion capture that any drone may have."""
    sensors = vehicle_toml.preset("crazyflie").sensors
    assert isinstance(sensors, MocapSensors)
    return sensors
