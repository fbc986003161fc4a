"""Fly an events file: set-points, what happens, and the measures of the flight."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from mambo_extensions.crazyflie.desk.desk_flight import Desk
from mambo_extensions.crazyflie.desk.events_file import SENSORS, EventSection, EventsFile, MeasureName
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.own_curve import load_curve
from mambo_sil.flight.passing import PassedSummary
from mambo_sil.flight.polynomials import Pieces
from mambo_sil.flight.trajectories import CURVES, Trajectory, vertical_of

SAMPLE_MS: Final = 10
SWITCHED_ON_MS: Final = 1500
SETTLING_MS: Final = 4000
"""After the take-off, before the course begins."""
CLIMB_M_S: Final = 1.0
LEAST_CLIMB_S: Final = 2.0

Motion = FloatArray
"""Position, velocity and acceleration, (3, 3)."""


@dataclass(frozen=True)
class DeskTrace:
    """A flight on the desk, sampled every 10 ms; the course begins at time 0, before it the drone takes off.

    time_s:      (n,)
    position_m:  true, (n, 3)
    target_m:    that of the course, or of the plan where the high-level commander flies, (n, 3)
    command_rad: roll and pitch of the app's last step, (n, 2)
    lost:        the app's log variable, (n,)
    touch_m_s:   the fastest descent at which the drone met the floor
    """

    time_s: FloatArray
    position_m: FloatArray
    target_m: FloatArray
    command_rad: FloatArray
    lost: FloatArray
    touch_m_s: float
    console: str


def _curve(file: EventsFile) -> tuple[Trajectory, float, float]:
    """Return the curve, the sign of its second axis to the left, and the height that stands for `height_m`.

    A curve by name is mirrored; a file's course goes where it says, and begins at `height_m`.
    Raises TrajectoryError.
    """
    for name, curve in CURVES.items():
        if name == file.trajectory:
            return curve(file.size_m, file.rate_rad_s), 1.0, HOVER_HEIGHT_M
    course, _ = load_curve(file.trajectory)
    return course, -1.0, float(vertical_of(course, np.zeros(1))[0, 0])


class _Course:
    """The target every 10 ms, in the firmware's frame, and the set-points of it that a radio sends."""

    def __init__(self, file: EventsFile, seed: int) -> None:
        curve, left, begins_m = _curve(file)
        chases = (one.duration_s for one in file.event if one.do == "chase")
        lasts_s = file.duration_s + max(chases, default=0.0)
        times_s = 0.001 * SAMPLE_MS * np.arange(round(1000.0 * lasts_s) // SAMPLE_MS + 2)
        level = curve.target(times_s).reshape(-1, 2, 2)
        level = np.concatenate([level, curve.acceleration(times_s)[:, np.newaxis]], axis=1) * (1.0, left)
        self._motions = np.concatenate([level, vertical_of(curve, times_s)[:, :, np.newaxis]], axis=2)
        self._motions[:, 0] += (*-self._motions[0, 0, :2], file.height_m - begins_m)
        self._how, self._height_m = file.set_points, file.height_m
        self._random = np.random.default_rng(seed)
        self._sent: list[Motion] = []

    def motion(self, time_s: float) -> Motion:
        """Return the target's motion at a time, (3, 3)."""
        motion: Motion = self._motions[round(1000.0 * max(time_s, 0.0)) // SAMPLE_MS]
        return motion

    def packet(self, time_s: float) -> Motion:
        """Return the set-point that comes at a time."""
        how, motion = self._how, self.motion(time_s).copy()
        if how.noise_m > 0.0:
            motion[0] += self._random.normal(0.0, how.noise_m, 3)
            before = self._sent[-1][0] if self._sent else motion[0]
            motion[1] = (motion[0] - before) / (0.001 * how.period_ms)
        if not how.acceleration:
            motion[2] = 0.0
        if len(self._sent) < how.random:
            motion = self._random.uniform(-1.0, 1.0, (3, 3)) * ((1.0, 1.0, 0.5), (1.0,) * 3, (3.0,) * 3)
            motion[0, 2] += self._height_m
        self._sent.append(motion)
        behind = int(self._random.integers(0, how.most_behind + 1))
        return self._sent[max(len(self._sent) - 1 - behind, 0)]


class _Flight:
    """A flight that is under way, and what it has recorded."""

    def __init__(self, library: Path, file: EventsFile, seed: int, offset_ms: int) -> None:
        self.desk = Desk(library, file.conditions(seed, offset_ms))
        self._course, self._period_ms = _Course(file, seed), file.set_points.period_ms
        self._sends, self._due_ms = self._period_ms > 0, 0
        self._group = self.desk.group
        self._time_s = 0.0
        self.rows: list[tuple[float, ...]] = []

    def run(self, time_s: float) -> None:
        """Let time pass until `time_s`, and record."""
        desk = self.desk
        self._time_s = time_s
        desk.run(SAMPLE_MS)
        planned = tuple(desk.log(f"ctrltarget.{axis}") for axis in "xyz")
        target = self._course.motion(time_s)[0] if self._period_ms > 0 else planned
        logged = (desk.log(f"{self._group}.{name}") for name in ("outRoll", "outPitch", "lost"))
        self.rows.append((time_s, *desk.state.position_m, *target, *logged))

    def send(self, now_ms: int) -> None:
        """Send a set-point if one is due."""
        if self._sends and now_ms >= self._due_ms:
            self.desk.full_state(self._course.packet(0.001 * now_ms))
            self._due_ms = now_ms - now_ms % self._period_ms + self._period_ms

    def happen(self, event: EventSection) -> None:
        """Let an event happen."""
        desk, vector, lasts_s = self.desk, event.vector, event.duration_s
        direct: dict[str, Callable[[], None]] = {
            "sensors-on": lambda: desk.measure(on=True),
            "sensors-off": lambda: desk.measure(on=False),
            "switch": lambda: desk.switch(SENSORS[event.sensors]),
            "jump": lambda: desk.jump(vector, event.frames),
            "nan": lambda: desk.jump((math.nan, math.nan, math.nan), event.frames),
            "kick": lambda: desk.kick(vector),
            "hit": lambda: desk.hit(vector),
            "push": lambda: desk.push(vector, lasts_s),
            "controller": lambda: desk.set("stabilizer.controller", float(event.value)),
            "set": lambda: desk.set(f"{self._group}.{event.name}", float(event.value)),
        }
        if event.do in direct:
            direct[event.do]()
        elif event.do in ("radio-on", "radio-off"):
            self._sends = event.do == "radio-on" and self._period_ms > 0
        else:
            self._plan(event)

    def _plan(self, event: EventSection) -> None:
        """Let the high-level commander fly: to a place, to where the course will be, or down."""
        self._sends = False
        self.desk.yield_()
        if event.do == "land":
            self.desk.land(event.duration_s)
        elif event.do == "chase":
            x, y, z = (float(value) for value in self._course.motion(self._time_s + event.duration_s)[0])
            self.desk.go_to((x, y, z), event.duration_s)
        else:
            self.desk.go_to(event.vector, event.duration_s)


def fly_events(library: Path, file: EventsFile, seed: int = 0, offset_ms: int = 3) -> DeskTrace:
    """Fly an events file with the app of `library`; raises FlightError for a parameter that it has not.

    seed:      of all noise.
    offset_ms: of the clock of camera or flow deck against the estimator's.
    """
    flight = _Flight(library, file, seed, offset_ms)
    climb_s = max(LEAST_CLIMB_S, file.height_m / CLIMB_M_S)
    flight.desk.run(SWITCHED_ON_MS)
    yaw_rad = math.radians(file.sensors.initial_yaw_deg)
    flight.desk.take_off(file.drone.table_m + file.height_m, climb_s, yaw_rad)
    for left_ms in range(round(1000.0 * climb_s) + SETTLING_MS, 0, -SAMPLE_MS):
        flight.run(0.001 * (SAMPLE_MS - left_ms))
    coming = sorted(_repeated(file), key=lambda one: one.at_s)
    for now_ms in range(0, round(1000.0 * file.duration_s), SAMPLE_MS):
        while coming and 1000.0 * coming[0].at_s <= now_ms:
            flight.happen(coming.pop(0))
        flight.send(now_ms)
        flight.run(0.001 * (now_ms + SAMPLE_MS))
    table = np.array(flight.rows)
    parts = (table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7:9], table[:, 9])
    return DeskTrace(*parts, flight.desk.state.touch_m_s, flight.desk.console)


def _repeated(file: EventsFile) -> Iterator[EventSection]:
    """Yield the events of a file, each as often as it happens."""
    for event in file.event:
        count = 1 + int((file.duration_s - event.at_s) / event.every_s) if event.every_s else 1
        for again in range(count):
            yield event.model_copy(update={"at_s": event.at_s + again * event.every_s})


def measure(trace: DeskTrace, file: EventsFile) -> dict[MeasureName, float]:
    """Return the measures of a flight by name, from `measured_from_s` of the course on.

    lowest_m, highest_m: of the height
    off_m:               largest horizontal distance to the target
    mean_m:              mean horizontal distance to the target
    drift_m:             length of the mean of the distances as vectors: what stays to one side
    height_off_m:        largest difference to the target's height
    iae_60_s_m_s:        integral of the horizontal distance, scaled to 60 s
    command_rms_rad:     of roll and pitch
    touch_m_s:           fastest descent at which the floor was met
    told_s:              from the end of the measurements until the app says "lost"; infinite if it never does
    lost_s:              how long it said so before
    largest_x_m:         of the place
    """
    late = trace.time_s > file.measured_from_s
    position, off = trace.position_m[late], trace.position_m[late] - trace.target_m[late]
    distance = np.hypot(off[:, 0], off[:, 1])
    ends = [event.at_s for event in file.event if event.do in ("sensors-off", "nan")]
    blind = trace.time_s > min(ends, default=math.inf)
    said = trace.time_s[blind & (trace.lost > 0)]
    return {
        "lowest_m": float(position[:, 2].min()),
        "highest_m": float(position[:, 2].max()),
        "off_m": float(distance.max()),
        "mean_m": float(distance.mean()),
        "drift_m": float(np.hypot(*off[:, :2].mean(axis=0))),
        "height_off_m": float(np.abs(off[:, 2]).max()),
        "iae_60_s_m_s": float(60.0 * distance.mean()),
        "command_rms_rad": float(np.sqrt(np.mean(np.square(trace.command_rad[late])))),
        "touch_m_s": trace.touch_m_s,
        "told_s": float(said[0] - min(ends)) if len(said) else math.inf,
        "lost_s": 0.001 * SAMPLE_MS * int(np.count_nonzero(trace.lost[~blind] > 0)),
        "largest_x_m": float(position[:, 0].max()),
    }


def passed(trace: DeskTrace, file: EventsFile) -> list[PassedSummary] | None:
    """Return how the drone passed the points of a plan; None of a course without points."""
    curve, *_ = _curve(file)
    if not isinstance(curve, Pieces) or not curve.points:
        return None
    flown = trace.time_s >= 0.0
    return curve.passes(trace.time_s[flown], (trace.position_m - trace.target_m)[flown])


def broken(measures: dict[MeasureName, float], file: EventsFile) -> list[MeasureName]:
    """Return the measures that are out of the bounds of an events file."""
    return [
        name
        for name, bound in file.bounds.items()
        if not (
            (bound.least is None or measures[name] >= bound.least)
            and (bound.most is None or measures[name] <= bound.most)
        )
    ]
