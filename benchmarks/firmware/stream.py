"""Fly a trajectory by full-state set-points, as a script sends them by radio, and measure the flight."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.firmware.laboratory import ControllerNumber, Laboratory, LaboratoryConditions, Place
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.flight.trajectories import Trajectory, vertical_of

SAMPLE_MS: Final = 10
SETTLED_M: Final = 0.05
TAKE_OFF_MS: Final = 8000
"""Until a drone rests at the height of the flight."""


class ClockOffset(NamedTuple):
    """Of the clocks of camera, app and radio against the estimator's, in ms."""

    camera_ms: int
    app_ms: int
    radio_ms: int


OFFSETS: Final = tuple(
    ClockOffset(camera_ms, app_ms, number)
    for number, (camera_ms, app_ms) in enumerate((c, a) for a in (0, 3, 7) for c in (0, 3, 7))
)


@dataclass(frozen=True)
class Stream:
    """Full-state set-points of a trajectory, whose x and y are those of the firmware.

    period_ms:    between two of them.
    jitter_ms:    half-width of the uniform deviation of each period.
    lost_packets: share that never arrives.
    acceleration: whether they have one.
    """

    trajectory: Trajectory
    duration_s: float = 60.0
    period_ms: int = 10
    jitter_ms: int = 0
    lost_packets: float = 0.0
    acceleration: bool = True
    heading_rad: float = 0.0

    def motion(self, times_s: NDArray[np.floating[Any]]) -> FloatArray:
        """Return position, velocity and acceleration at times (n,) as (n, 3, 3)."""
        target = self.trajectory.target(times_s).reshape(-1, 2, 2)
        level = np.concatenate([target, self.trajectory.acceleration(times_s)[:, np.newaxis]], axis=1)
        return np.concatenate([level, vertical_of(self.trajectory, times_s)[:, :, np.newaxis]], axis=2)


@dataclass(frozen=True)
class Job:
    """A flight: who flies what, in which conditions, at which offset of the clocks."""

    image: Path
    controller: ControllerNumber
    stream: Stream
    conditions: LaboratoryConditions
    offset: ClockOffset


class StreamedFlight(NamedTuple):
    """What a flight was.

    crashed:     tumbled, or more than 50 m away.
    iae_m_s:     integral of the horizontal distance to the target.
    largest_m:   largest horizontal distance after 5 s.
    past_m:      how far the drone was ahead of the target along x at most.
    settled_s:   time from which on the distance is below 5 cm.
    busy:        sum of the changes of the four motors' shares in 10 ms, mean.
    speed_m_s:   largest.
    height_m:    largest deviation of the height.
    height_rms_m: its root mean square.
    path:        [time, x, y, z, target x, y, z] every 10 ms, (n, 7).
    """

    crashed: bool
    iae_m_s: float
    largest_m: float
    past_m: float
    settled_s: float
    busy: float
    speed_m_s: float
    height_m: float
    height_rms_m: float
    path: FloatArray


def ready(job: Job, *, take_off: bool = True) -> Laboratory:
    """Return a laboratory whose drone hovers where the stream begins, with the clocks at the job's offset.

    Without `take_off` the drone is on the floor, and the app's clock begins when it takes off.
    """
    conditions, offset, heading_rad = job.conditions, job.offset, job.stream.heading_rad
    x_m, y_m = job.stream.motion(np.zeros(1))[0, 0, :2]
    changed: dict[str, Any] = {
        "camera_offset_ms": offset.camera_ms,
        "seed": conditions.seed + offset.radio_ms,
    }
    laboratory = Laboratory(
        job.image, job.controller, replace(conditions, **changed), Place(x_m, y_m, heading_rad)
    )
    laboratory.run(1000)
    if not take_off:
        laboratory.run(offset.app_ms)
        return laboratory
    laboratory.take_off(yaw_rad=heading_rad)
    laboratory.run(TAKE_OFF_MS - 1000 - 20)
    if job.controller is ControllerNumber.APP:  # its clock begins when it takes over
        laboratory.set("nmpc.on", 0)
        laboratory.run(10 + offset.app_ms)
        laboratory.set("nmpc.on", 1)
        laboratory.run(10 - offset.app_ms)
    else:
        laboratory.run(20)
    laboratory.run(offset.radio_ms)
    return laboratory


def fly(job: Job) -> StreamedFlight:
    """Fly a stream of set-points. It can be called once in a process."""
    laboratory, stream = ready(job), job.stream
    random = np.random.default_rng(job.offset.radio_ms)
    times_s = 0.001 * np.arange(0, round(1000 * stream.duration_s) + 1, SAMPLE_MS)
    motion = stream.motion(times_s)
    states = np.zeros((len(times_s) - 1, 13))
    due_s = 0.0
    for k, time_s in enumerate(times_s[:-1]):
        if time_s >= due_s - 1e-9:
            if random.random() >= stream.lost_packets:
                position, velocity, acceleration = motion[k]
                laboratory.full_state(
                    position,
                    velocity,
                    acceleration if stream.acceleration else np.zeros(3),
                    stream.heading_rad,
                )
            due_s += 0.001 * (stream.period_ms + random.uniform(-stream.jitter_ms, stream.jitter_ms))
        laboratory.run(SAMPLE_MS)
        states[k] = laboratory.state
        if laboratory.log("sys.isTumbled") == 1 or not np.abs(states[k, :3]).max() < 50.0:
            return judge(times_s[1 : k + 2], states[: k + 1], motion[1 : k + 2, 0], crashed=True)
    return judge(times_s[1:], states, motion[1:, 0], crashed=False)


def judge(
    times_s: NDArray[np.floating[Any]], states: FloatArray, target_m: FloatArray, *, crashed: bool
) -> StreamedFlight:
    """Return the measures of times (n,), states (n, 13) and targets (n, 3)."""
    distance = np.hypot(*(states[:, :2] - target_m[:, :2]).T)
    height = states[:, 2] - target_m[:, 2]
    late = times_s > 5.0
    away = np.flatnonzero(distance > SETTLED_M)
    return StreamedFlight(
        crashed=crashed,
        iae_m_s=float(distance.sum() * 0.001 * SAMPLE_MS),
        largest_m=float(distance[late].max(initial=0.0)),
        past_m=float((states[:, 0] - target_m[:, 0]).max()),
        settled_s=float(times_s[away[-1]]) if len(away) else 0.0,
        busy=float(np.abs(np.diff(states[:, 9:], axis=0)).sum(axis=1).mean()),
        speed_m_s=float(np.hypot(*states[:, 3:5].T).max()),
        height_m=float(np.abs(height).max()),
        height_rms_m=float(np.sqrt((height[late] ** 2).mean())) if late.any() else 0.0,
        path=np.column_stack([times_s, states[:, :3], target_m]),
    )
