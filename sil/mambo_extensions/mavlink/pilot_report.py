"""The record of a flight over a link, how it ended, how near it stayed, what it learnt, and its log."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Self

import numpy as np

from mambo_sil.flight.flight_report import flight_pictures
from mambo_sil.flight.traces import Trace
from mambo_sil.life.life_cycle import LifeCycle
from mambo_sil.life.steady_frame import FrameJump
from mambo_sil.life.steering import Update
from mambo_sil.model.identify.signals import (
    JUMP,
    JUMPS,
    START_THRUST,
    TAKE_OVERS,
    TARGET_KNOWN,
    THRUST,
    THRUST_COMMAND,
    UPDATE,
)
from mambo_sil.results.blocks import Block, CommandResult, ResultTable
from mambo_sil.results.number_format import distance
from mambo_sil.results.summary import Number, ReportedSummary

LOG: Final = "flight.csv"
TRACE: Final = "trace.npz"
PICTURES: Final = ("flight.png", "flight.svg")
COLUMNS: Final = (
    *("time_s", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "roll_rad", "pitch_rad", "yaw_rad"),
    *("target_x_m", "target_y_m", "target_height_m", "target_vx_m_s", "target_vy_m_s", "target_climb_m_s"),
    *("target_ax_m_s2", "target_ay_m_s2", "target_climb_acceleration_m_s2"),
    *(
        "target_ahead_x_m_s2",
        "target_ahead_y_m_s2",
        "target_climb_ahead_m_s2",
        TARGET_KNOWN,
        "target_yaw_rad",
    ),
    *("roll_command_rad", "pitch_command_rad", THRUST, THRUST_COMMAND, "status"),
    *(TAKE_OVERS, UPDATE, START_THRUST, JUMPS, *JUMP),
)
"""What the controller got: the state ahead of the estimate by the delay of the link, from 10 ms each way on,
and the target off by what remains of the jumps of the estimator.

Roll and pitch, measured and commanded, are less the lean against the wind at a take-over.
"""
SETTLES_S: Final = 5.0
"""Time after the take-over from which on errors count."""


class PilotSummary(ReportedSummary):
    """A flight over a link; errors are of the estimate, in m."""

    command = "pilot"

    source: str
    settings: str
    link: str
    autopilot: str | None
    simulated: bool
    end: str
    good: bool
    trajectory: str
    set_points: int
    flown_s: Number
    interval_s: tuple[Number, Number]
    """From one set-point to the next: median, and what 95 % do not exceed."""
    horizontal_rms_m: Number
    vertical_rms_m: Number
    command_rms_rad_s: Number
    """Rate of change of the commanded roll and pitch, together."""
    hover_parameter: str | None
    hover_thrust: Number
    """The share of the largest thrust that the autopilot's parameter gives for hover."""
    mean_thrust: Number
    """The one that the flight needed, in the mean of its last seconds."""
    link_delay_s: Number
    """Delay of the link in each direction, as measured before the flight."""
    jumps: int
    pauses: int
    refused: int

    @property
    def about(self) -> str:
        """Say what flew over which link."""
        drone = "a simulated" if self.simulated else "an"
        heard = self.autopilot or "that was never heard"
        return f"{self.source} over {self.link}, {drone} autopilot {heard}"

    def result(self, folder: Path, /) -> CommandResult:
        """Return the result of this flight; drawing raises TraceError."""
        caption = (
            "Path, horizontal error as estimated, height, commanded and actual angles, "
            "both less the lean against the wind at the take-over."
        )
        blocks: list[Block] = [
            *flight_pictures(folder, {self.source: TRACE}, caption),
            ResultTable((), _rows(self) if self.set_points else []),
        ]
        return CommandResult(self.about, self.good, [self.end], blocks)

    @property
    def is_judged(self) -> bool:
        """Whether it flew for longer than `SETTLES_S`."""
        return self.horizontal_rms_m == self.horizontal_rms_m

    def draw(self, trace: Trace, folder: Path) -> None:
        """Write `PICTURES`."""
        from mambo_sil.flight.flight_plots import draw_flight  # noqa: PLC0415 - loaded when drawing

        message = self.end
        if self.is_judged:
            rms = " and ".join(f"{distance(one)}" for one in (self.horizontal_rms_m, self.vertical_rms_m))
            message += f"; {rms} (rms, in the plane and in height, as estimated) off the target"
        about = f"{self.about}; one flight: {self.trajectory}, {self.flown_s:.0f} s"
        draw_flight(trace, message, about, folder / "flight")

    @classmethod
    def of(cls, life: LifeCycle, updates: Sequence[Update], **named: object) -> Self:
        """Return the record of a flight that has ended; `named` has what the options say."""
        end, stack, steering = life.end, life.stack, life.steering
        measured = _measures(updates)
        return cls.model_validate(
            named
            | measured
            | {
                "settings": steering.controller.settings.digest,
                "autopilot": None if stack is None else stack.name,
                "end": "" if end is None else end.sentence,
                "good": end is not None and end.good,
                "hover_parameter": None if stack is None else stack.hover_parameter,
                "hover_thrust": steering.hover_thrust,
                "mean_thrust": steering.mean_thrust,
                "link_delay_s": life.delay_s,
                "jumps": steering.frame.jumps,
                "pauses": max(steering.take_overs - 1, 0),
            }
        )


def _measures(updates: Sequence[Update]) -> dict[str, object]:
    """Return what the steps of a flight show; NaN where there are too few."""
    none = float("nan")
    time_s = np.array([one.estimate.time_s for one in updates])
    found: dict[str, object] = {
        "set_points": len(updates),
        "refused": sum(one.status != 0 for one in updates),
        "flown_s": float(np.ptp(time_s)) if len(updates) else 0.0,
        **dict.fromkeys(("horizontal_rms_m", "vertical_rms_m", "command_rms_rad_s"), none),
        "interval_s": (none, none),
    }
    if len(updates) < 3:
        return found
    intervals_s = np.diff(time_s)
    found["interval_s"] = (float(np.median(intervals_s)), float(np.quantile(intervals_s, 0.95)))
    judged = time_s >= time_s[0] + SETTLES_S
    if judged.sum() < 3:
        return found
    errors = np.array([one.estimate.position_m - one.target.position_m for one in updates])[judged]
    tilt = np.array([one.command_rad for one in updates])[judged]
    rates = np.diff(tilt, axis=0) / np.diff(time_s[judged])[:, np.newaxis]
    return found | {
        "horizontal_rms_m": float(np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1)))),
        "vertical_rms_m": float(np.sqrt(np.mean(errors[:, 2] ** 2))),
        "command_rms_rad_s": float(np.sqrt(np.mean(np.sum(rates**2, axis=1)))),
    }


def _rows(summary: PilotSummary) -> list[tuple[str, str]]:
    """Return what is told of a flight, name and value."""
    median_s, most_s = summary.interval_s
    rms_cm = 100.0 * summary.horizontal_rms_m, 100.0 * summary.vertical_rms_m
    judged = [
        ("error, rms", f"{rms_cm[0]:.1f} cm in the plane, {rms_cm[1]:.1f} cm in height, as estimated"),
        ("command", f"moves at {np.degrees(summary.command_rms_rad_s):.0f} degrees/s rms"),
    ]
    return [
        ("set-points", f"{summary.set_points} in {summary.flown_s:.1f} s"),
        ("interval", f"{1e3 * median_s:.0f} ms, 95 % within {1e3 * most_s:.0f} ms"),
        *(judged if summary.is_judged else [("error", f"not judged: flown for less than {SETTLES_S:.0f} s")]),
        (
            "thrust of hover",
            f"{summary.mean_thrust:.3f}; {summary.hover_parameter} says {summary.hover_thrust:.3f}",
        ),
        ("link", f"{1e3 * summary.link_delay_s:.0f} ms each way, before the flight"),
        ("jumps, pauses", f"{summary.jumps} of the estimator, {summary.pauses} of the link"),
    ]


def trace_of(updates: Sequence[Update]) -> Trace:
    """Return the steps of a flight as the trace of one flight: of the estimate, on the course's clock."""
    rows = np.array([_logged(update)[: COLUMNS.index("target_ax_m_s2")] for update in updates])[:, np.newaxis]
    time_s, position_m, velocity_m_s, euler_rad, x_y_m, height_m, v_m_s, climb_m_s = np.split(
        rows, np.cumsum((1, 3, 3, 3, 2, 1, 2)), axis=-1
    )
    return Trace(
        time_s=time_s[:, 0, 0] - time_s[0, 0, 0],
        position_m=position_m,
        velocity_m_s=velocity_m_s,
        euler_rad=euler_rad,
        target=np.concatenate([x_y_m, v_m_s, height_m, climb_m_s], axis=-1),
        command_rad=np.array([one.command_rad for one in updates])[:, np.newaxis],
        thrust_acceleration_m_s2=np.array([[one.thrust_m_s2] for one in updates]),
        status=np.array([[one.status] for one in updates]),
    )


def write_log(updates: Sequence[Update], path: Path) -> None:
    """Write the steps of a flight as CSV."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(map(_logged, updates))


def _logged(update: Update) -> list[float]:
    estimate, target = update.estimate, update.target
    x, y, z = target.position_m.tolist()
    vx, vy, vz = target.velocity_m_s.tolist()
    (ax, ay, az), (later_x, later_y, later_z) = (
        (0.0, 0.0, 0.0) if one is None else one.tolist()
        for one in (target.acceleration_m_s2, target.ahead_m_s2)
    )
    return [
        estimate.time_s,
        *(*estimate.position_m.tolist(), *estimate.velocity_m_s.tolist(), *estimate.attitude_rad.tolist()),
        *(x, y, -z, vx, vy, -vz, ax, ay, -az),
        *(later_x, later_y, -later_z, float(target.known)),
        0.0 if target.yaw_rad is None else float(target.yaw_rad),
        *(*update.command_rad, update.thrust_m_s2, update.thrust, update.status),
        *(update.take_overs, update.number, update.start_thrust_m_s2, update.jumps),
        *_jump(update.jump),
    ]


def _jump(jump: FrameJump | None) -> list[float]:
    """Return the columns of a jump, zeros of none."""
    if jump is None:
        return [0.0] * len(JUMP)
    return [*jump.position_m.tolist(), *jump.velocity_m_s.tolist(), jump.heading_rad]
