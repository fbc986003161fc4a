"""The pilot of programs: connects to an autopilot, takes off, follows targets, lands."""

import contextlib
import math
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType, TracebackType
from typing import Final, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike

from mambo_extensions.mavlink.links import SimulatedLink, UdpLink
from mambo_extensions.mavlink.messages import send_order
from mambo_extensions.mavlink.signing import read_key
from mambo_extensions.mavlink.sockets import parse_link
from mambo_sil.api.api_controller import Controller
from mambo_sil.api.options import ControllerOptions
from mambo_sil.arguments import of_shape, require_choice, require_number, require_path
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.vehicles import vehicle_toml
from mambo_sil.errors import ArgumentError, PilotError
from mambo_sil.flight.states import DroneState, TargetState
from mambo_sil.flight.trajectories import Trajectory
from mambo_sil.life.courses import Along, Place, TargetCourse, TargetProgram
from mambo_sil.life.life_cycle import FARTHEST_M, LifeCycle
from mambo_sil.life.phases import Phase
from mambo_sil.life.records import PX4, STACKS, EstimatedState
from mambo_sil.life.steering import Steering, Update

NEAR_M, STAYS_S = 0.15, 1.0
"""How near the drone is when it has arrived, and how long it has been."""
LOWEST_M, HIGHEST_M = 0.3, 100.0
NEAREST_BOUND_M, FARTHEST_BOUND_M = 1.0, 10_000.0
"""Bounds on the bound `farthest_m`."""
LONGEST_S: Final = 36_000.0


class Pilot:
    """Flies one drone; positions are NED in the frame of the autopilot's estimator, z down.

    It is a context manager: it opens its link, lands if the drone still flies, and closes the link.
    The calls must follow each other without a pause: while none runs, nothing is sent, which the autopilot
    takes for a lost link after a second. Ctrl-C lands, a second one stops the motors; either raises
    KeyboardInterrupt after that; so does SIGTERM. It lands too if the target is farther than `farthest_m`
    from the drone. Every call raises PilotError, with a sentence, if the flight has ended.
    """

    def __init__(
        self,
        controller: Controller,
        open_link: Callable[[], UdpLink],
        record: Callable[[Update], None] = lambda update: None,  # noqa: ARG005 - records nothing
        watch: Callable[["Pilot"], None] | None = None,
        *,
        farthest_m: float = FARTHEST_M,
    ) -> None:
        require_number("farthest_m", farthest_m, NEAREST_BOUND_M, FARTHEST_BOUND_M)
        self._open_link, self.steering = open_link, Steering(controller, record)
        self.life = LifeCycle(self.steering, 1.0, farthest_m)
        self._watch, self._interrupts, self._interrupted = watch or _watch_nothing, 0, ""

    @classmethod
    def connect(
        cls,
        path: str | Path,
        link: str,
        *,
        key: str | Path | None = None,
        farthest_m: float = FARTHEST_M,
        **options: Unpack[ControllerOptions],
    ) -> Self:
        """Return a pilot with the settings of a controller.toml at a link such as udp:127.0.0.1:14540.

        `key` is a file of 64 hexadecimal digits, the key with which both sides sign. Raises LinkError, and
        what `Controller.from_file` raises.
        """
        address, secret = parse_link(link), None if key is None else read_key(key)
        controller = Controller.from_file(path, **options)
        return cls(controller, lambda: UdpLink(address, secret), farthest_m=farthest_m)

    @classmethod
    def simulate(
        cls,
        path: str | Path,
        vehicle: str | Path,
        autopilot: str = "px4",
        *,
        farthest_m: float = FARTHEST_M,
        **options: Unpack[ControllerOptions],
    ) -> Self:
        """Return a pilot of a simulated drone behind the messages of an autopilot: "px4" or "ardupilot"."""
        require_choice("autopilot", autopilot, tuple(STACKS))
        require_path("vehicle", vehicle, f"a vehicle.toml, or one of {', '.join(vehicle_toml.names())}")
        drone = vehicle_toml.load(str(vehicle))
        controller = Controller.from_file(path, **options)
        return cls(controller, lambda: SimulatedLink(STACKS[autopilot], drone), farthest_m=farthest_m)

    def take_off(self, height_m: float) -> None:
        """Connect, check, arm, climb by the autopilot's own controller, and take over at a height."""
        require_number("height_m", height_m, LOWEST_M, HIGHEST_M)
        self.life.height_m = height_m
        self._run(lambda: self.life.phase is Phase.FLYING)

    def go_to(self, position_m: ArrayLike, yaw_rad: float | None = None, within_s: float = 30.0) -> bool:
        """Go to a position (3,) with a heading; return whether the drone has arrived in time.

        It stays there until the next call.
        """
        require_number("within_s", within_s, 0.1, LONGEST_S)
        arrival = _Arrival(of_shape("position_m", position_m, (3,)))
        self._fly(
            Place(arrival.position_m, yaw_rad, within_s),
            lambda: self.life.is_course_over or arrival.is_at(self.life.estimate),
        )
        return arrival.is_at(self.life.estimate)

    def fly(self, curve: Trajectory, duration_s: float) -> None:
        """Fly a curve of `mambo_nmpc.curves`, moved to begin where the drone is.

        It begins and ends softly; a plan from rest to rest is flown in its own time.
        """
        require_number("duration_s", duration_s, 0.1, LONGEST_S)
        self._fly(Along(curve, self._target_m, duration_s), lambda: self.life.is_course_over)

    def follow(self, targets: Callable[[float], TargetState], duration_s: float) -> None:
        """Follow the targets that a function returns for the time since the beginning, in s."""
        require_number("duration_s", duration_s, 0.1, LONGEST_S)
        if not callable(targets):
            raise ArgumentError(f"targets = {targets!r} must be a function of the time")
        self._fly(TargetProgram(targets, duration_s), lambda: self.life.is_course_over)

    def land(self, why: str = "as planned") -> str:
        """Land by the autopilot's own controller; return how the flight ended."""
        self.life.land(why, good=True)
        self._run(lambda: False)
        return "" if self.life.end is None else self.life.end.sentence

    @property
    def words(self) -> str:
        """The phase, and where the drone is, in a line."""
        life, estimate = self.life, self.life.estimate
        if estimate is None:
            return life.phase.value
        x, y, z = estimate.position_m.tolist()
        line = f"{life.phase.value}, {estimate.time_s:.0f} s, x {x:.2f} y {y:.2f} height {-z:.2f} m"
        if life.phase is not Phase.FLYING:
            return line
        away_m = float(np.linalg.norm(estimate.position_m - self._target_m))
        return f"{line}, {100.0 * away_m:.0f} cm off"

    @property
    def state(self) -> DroneState:
        """The last estimate of the autopilot."""
        estimate = self.life.estimate
        if estimate is None:
            raise PilotError("there is no state yet: take off first")
        return DroneState(estimate.position_m, estimate.velocity_m_s, estimate.attitude_rad)

    @property
    def _target_m(self) -> FloatArray:
        """Where the present target is (3,)."""
        return self.life.course.target(self.life.course_time_s).position_m

    def _fly(self, course: TargetCourse, until: Callable[[], bool]) -> None:
        if self.life.phase is not Phase.FLYING:
            raise PilotError(f"the drone does not fly (it is {self.life.phase.value}): take off first")
        self.life.fly(course)
        self._run(until)

    def _run(self, until: Callable[[], bool]) -> None:
        """Serve the link until `until` or the end of the flight; raises PilotError unless that is good."""
        try:
            with self._counted_interrupts():
                while not (self.life.is_over or (self.life.end is None and until())):
                    self._serve()
        except BaseException:
            self._abandon()
            raise
        if self._interrupts and self.life.end is not None:
            raise KeyboardInterrupt(self.life.end.sentence)
        if self.life.end is not None and not self.life.end.good:
            raise PilotError(self.life.end.sentence)

    def _serve(self) -> None:
        """Take what has come, and send what is to be sent."""
        records = self.link.receive()
        now_s = self.link.now_s()
        self.life.hint = self.link.hint
        for record in records:
            self.life.receive(record, now_s)
        if self._interrupts > 1:
            self.life.stop(f"{self._interrupted} twice")
        elif self._interrupts == 1:
            self.life.land(self._interrupted, good=False)
        for order in self.life.orders(now_s):
            send_order(self.link.mav, order, self.life.system, self.life.stack or PX4)
        self._watch(self)

    def _abandon(self) -> None:
        """Leave the course, whose targets may have failed, and land: `__exit__` waits for that."""
        self._watch = _watch_nothing
        self.life.hold()
        self.life.land("the program has failed", good=False)

    @contextlib.contextmanager
    def _counted_interrupts(self) -> Iterator[None]:
        """Count SIGINT and SIGTERM in place of what else they do; only the main thread gets signals."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return

        def count(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - what a handler gets
            self._interrupts += 1
            self._interrupted = "Ctrl-C" if number == signal.SIGINT else "SIGTERM"

        before = {number: signal.signal(number, count) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def __enter__(self) -> Self:
        """Open the link; raises LinkError."""
        self.link = self._open_link()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Land if the drone still flies, and close the link."""
        try:
            if self.life.is_flying:
                self.life.land("the program has ended", good=error is None)
                with contextlib.suppress(PilotError):
                    self._run(lambda: False)
        finally:
            self.link.close()


def _watch_nothing(_: Pilot) -> None:
    """Show nothing of a flight."""


class _Arrival:
    """Watches whether a drone has been near a position (3,) for long enough."""

    def __init__(self, position_m: FloatArray) -> None:
        self.position_m, self._since_s = position_m, math.inf

    def is_at(self, estimate: EstimatedState | None) -> bool:
        """Return whether it has, at an estimate."""
        if estimate is None or float(np.linalg.norm(estimate.position_m - self.position_m)) > NEAR_M:
            self._since_s = math.inf
            return False
        self._since_s = min(self._since_s, estimate.time_s)
        return estimate.time_s - self._since_s >= STAYS_S
