"""The log of a flight's steps, as the app gives it, and its replay through the same settings."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.firmware.stream import Job, Stream, ready
from mambo_sil.flight.trajectories import Bernoulli

VARIABLES: Final = (
    *("step", "takeOvers", "age", "status", "x", "y", "vx", "vy", "inRoll", "inPitch", "inYaw"),
    *("targetX", "targetY", "targetVx", "targetVy", "targetAx", "targetAy", "outRoll", "outPitch"),
)
OF_HEIGHTS: Final = (
    *("z", "vz", "grounded", "targetZ", "targetVz", "targetAz", "outThrust", "startThrust", "level"),
)
"""What an app that flies the height logs besides."""
DURATION_S: Final = 30.0


def write_log(job: Job, path: Path) -> None:
    """Fly the figure of eight, and write every step of the app from its take-over on."""
    stream = Stream(Bernoulli(2.0, 0.5))
    laboratory = ready(replace(job, stream=stream))
    laboratory.set("nmpc.on", 0)
    laboratory.run(10)
    laboratory.set("nmpc.on", 1)
    last = laboratory.log("nmpc.step")
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        known = [name for name in (*VARIABLES, *OF_HEIGHTS) if not np.isnan(laboratory.log(f"nmpc.{name}"))]
        writer.writerow(["Timestamp", *(f"nmpc.{name}" for name in known)])
        for time_ms in range(round(1000 * DURATION_S)):
            if time_ms % 10 == 0:
                laboratory.full_state(*stream.motion(np.array([0.001 * time_ms]))[0])
            laboratory.run(1)
            if laboratory.log("nmpc.step") != last:
                last = laboratory.log("nmpc.step")
                writer.writerow(
                    [laboratory.time_ms, *(repr(laboratory.log(f"nmpc.{name}")) for name in known)]
                )
