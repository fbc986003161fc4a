"""What a pilot meets: walls, far set-points, a lost camera, hand-overs. One function flies one event."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from benchmarks.firmware.laboratory import ControllerNumber
from benchmarks.firmware.stream import Job, Stream, ready
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M, Swing
from mambo_sil.flight.trajectories import Circle, Hover, InSpace, Trajectory, Waypoints

WALL_M: Final = 3.0
SET_POINT_MS: Final = 20
"""Between two set-points of an event."""
CIRCLE: Final = Circle(1.0, 1.5)
SWING: Final = InSpace(Hover(), Swing(0.3, 1.0))


class Happened(NamedTuple):
    """Measures by name, and the path: time, x, y and z, (n, 4)."""

    figures: dict[str, float]
    path: FloatArray


Event = Callable[[Job], Happened]


class Watch:
    """A laboratory that keeps the state of every 10 ms. Its drone hovers, or is on the floor."""

    def __init__(self, job: Job, trajectory: Trajectory, *, take_off: bool = True) -> None:
        stream = Stream(trajectory)
        self.laboratory = ready(replace(job, stream=stream), take_off=take_off)
        self.motion = stream.motion
        self.states: list[FloatArray] = []

    @property
    def time_s(self) -> float:
        """Since the watch began."""
        return 0.01 * len(self.states)

    @property
    def path(self) -> FloatArray:
        """Time, x, y and z of every state, (n, 4)."""
        return np.column_stack([0.01 * np.arange(1, len(self.states) + 1), np.array(self.states)[:, :3]])

    def run(self, milliseconds: int) -> None:
        """Let time pass."""
        for _ in range(milliseconds // 10):
            self.laboratory.run(10)
            self.states.append(self.laboratory.state)

    def target(self, begun_s: float = 0.0) -> FloatArray:
        """Return position, velocity and acceleration of the target, (3, 3)."""
        motion: FloatArray = self.motion(np.array([self.time_s - begun_s]))[0]
        return motion

    def follow(self, duration_s: float, heading_rad: float = 0.0, begun_s: float = 0.0) -> FloatArray:
        """Fly the trajectory by full-state set-points; return what the drone is off, (n, 3)."""
        off = []
        for _ in range(round(1000 * duration_s) // SET_POINT_MS):
            position_m, velocity_m_s, acceleration_m_s2 = self.target(begun_s)
            self.laboratory.full_state(position_m, velocity_m_s, acceleration_m_s2, heading_rad)
            self.run(SET_POINT_MS)
            off.append(self.states[-1][:3] - self.target(begun_s)[0])
        return np.array(off)

    def hold(self, x_m: float, duration_s: float, z_m: float = HOVER_HEIGHT_M) -> None:
        """Fly to a place on the x axis by position set-points."""
        for _ in range(round(1000 * duration_s) // SET_POINT_MS):
            self.laboratory.position(x_m, 0.0, z_m)
            self.run(SET_POINT_MS)

    def happened(self, **figures: float) -> Happened:
        """Return the figures with the path."""
        return Happened({name: float(value) for name, value in figures.items()}, self.path)


def _towards_wall(speed_m_s: float) -> Trajectory:
    """Return a target that crosses the wall at a speed and flies on for 6 s."""
    end_s = WALL_M / speed_m_s + 6.0
    return Waypoints(((0.0, 0.0, 0.0), (end_s, speed_m_s * end_s, 0.0)))


def through_wall(speed_m_s: float) -> Event:
    """Return the event of a target that crosses a fence at 3 m at a speed; only the app has a fence."""

    def fly(job: Job) -> Happened:
        watch = Watch(job, _towards_wall(speed_m_s))
        if job.controller is ControllerNumber.APP:
            watch.laboratory.set("nmpc.xMax", WALL_M)
        watch.follow(WALL_M / speed_m_s + 6.0)
        return watch.happened(largest_x_m=watch.path[:, 1].max())

    return fly


def fence_switched_on(speed_m_s: float) -> Event:
    """Return the event of a fence that is switched on while the drone passes its wall at a speed."""

    def fly(job: Job) -> Happened:
        watch = Watch(job, _towards_wall(speed_m_s))
        while watch.laboratory.state[0] < WALL_M:
            watch.follow(0.02)
        if job.controller is ControllerNumber.APP:
            watch.laboratory.set("nmpc.xMax", WALL_M)
        watch.follow(6.0)
        return watch.happened(largest_x_m=watch.path[:, 1].max(), end_x_m=watch.path[-1, 1])

    return fly


def far_set_point(job: Job) -> Happened:
    """Fly to a position 10 m away that is sent at once."""
    watch = Watch(job, Hover())
    watch.hold(10.0, 16.0)
    states = np.array(watch.states)
    return watch.happened(
        speed_m_s=np.hypot(*states[:, 3:5].T).max(),
        past_m=states[:, 0].max() - 10.0,
        lowest_m=states[:, 2].min(),
    )


def lost_camera(job: Job) -> Happened:
    """Switch the camera off for good on a circle, while set-points still come."""
    watch = Watch(job, CIRCLE)
    watch.follow(6.0)
    watch.laboratory.switch_camera(on=False)
    begin, lost_s, told_s = watch.states[-1], watch.time_s, math.inf
    while watch.time_s < lost_s + 12.0:
        watch.follow(0.02)
        if job.controller is ControllerNumber.APP and watch.laboratory.log("nmpc.lost") > 0:
            told_s = min(told_s, watch.time_s - lost_s)
    return _ended(watch, begin, told_s=told_s)


def lost_radio(job: Job) -> Happened:
    """Send nothing more from a place on the circle on."""
    watch = Watch(job, CIRCLE)
    watch.follow(6.0)
    begin = watch.states[-1]
    watch.run(5000)
    return _ended(watch, begin)


def _ended(watch: Watch, begin: FloatArray, **figures: float) -> Happened:
    """Return how far from a state the flight ended, how high, and with which thrust."""
    end = watch.states[-1]
    moved_m = math.hypot(*(end[:2] - begin[:2]))
    return watch.happened(moved_m=moved_m, height_m=end[2], thrust=end[9:].mean(), **figures)


def set_point_aside(job: Job) -> Happened:
    """Take off from the floor by a position set-point 2 m to the side."""
    watch = Watch(job, Hover(), take_off=False)
    angle_deg = 0.0
    for _ in range(250):
        watch.hold(2.0, 0.001 * SET_POINT_MS)
        if watch.states[-1][2] <= 0.0:
            angle_deg = max(angle_deg, abs(watch.laboratory.log("controller.pitch")))
    return watch.happened(floor_deg=angle_deg, past_m=watch.path[:, 1].max() - 2.0, end_x_m=watch.path[-1, 1])


def not_a_number(job: Job) -> Happened:
    """Send set-points whose height is not a number for 0.3 s, in hover."""
    watch = Watch(job, Hover())
    watch.hold(0.0, 3.0)
    watch.hold(0.0, 0.3, z_m=math.nan)
    watch.hold(0.0, 5.0)
    return watch.happened(lowest_m=watch.path[:, 3].min(), end_m=watch.path[-1, 3])


def go_to(job: Job) -> Happened:
    """Fly 2 m ahead and 1 m to the left in 3 s by the high-level commander."""
    watch = Watch(job, Hover())
    watch.laboratory.go_to((2.0, 1.0, HOVER_HEIGHT_M), 3.0)
    off_m = []
    for _ in range(450):
        watch.run(10)
        wanted = [watch.laboratory.log(f"ctrltarget.{axis}") for axis in "xy"]
        off_m.append(math.hypot(*(watch.states[-1][:2] - wanted)))
    return watch.happened(largest_m=max(off_m))


def turns(job: Job) -> Happened:
    """Turn by 90 degrees at once, three times, on the circle."""
    watch = Watch(job, CIRCLE)
    watch.follow(5.0)
    off = np.concatenate([watch.follow(5.0, 0.5 * math.pi * k) for k in (1, 2, 3)])
    return watch.happened(largest_m=np.hypot(*off[:, :2].T).max())


def heights(job: Job) -> Happened:
    """Take off in 2 s, hand over to full-state set-points and back, and follow a height that swings."""
    watch = Watch(job, SWING, take_off=False)
    laboratory = watch.laboratory
    laboratory.take_off()
    late_m = []
    for _ in range(250):
        watch.run(10)
        late_m.append(laboratory.log("ctrltarget.z") - watch.states[-1][2])
    watch.run(6000)
    sag_m = []
    for _ in range(2):
        begun, rested_m = len(watch.states), watch.states[-1][2]
        for _ in range(100):
            laboratory.full_state(np.array([0.0, 0.0, HOVER_HEIGHT_M]), np.zeros(3), np.zeros(3))
            watch.run(SET_POINT_MS)
        laboratory.stop_set_points()
        laboratory.go_to((0.0, 0.0, HOVER_HEIGHT_M), 1.0)
        watch.run(3000)
        sag_m.append(rested_m - np.array(watch.states)[begun:, 2].min())
    off = watch.follow(15.0, begun_s=watch.time_s)
    swing_rms_m = np.sqrt(np.mean(np.square(off[150:, 2])))
    return watch.happened(late_m=max(late_m), sag_m=max(sag_m), swing_rms_m=swing_rms_m)
