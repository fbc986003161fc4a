"""What must be so before the motors start: each a sentence if it is not."""

import math
from typing import Final

import numpy as np

from mambo_sil.life.records import (
    MULTICOPTERS,
    STACKS,
    AskParameter,
    Battery,
    Echo,
    EstimatedState,
    Heartbeat,
    Order,
    Parameter,
    Ping,
    Record,
    SetRate,
    Stack,
    Stream,
)

LEAST_BATTERY: Final = 0.2
LARGEST_TILT_RAD: Final = 0.25
HOVER: Final = (0.05, 0.9)
"""Bounds on the share of the largest thrust that carries a drone."""
LANDED_HZ: Final = 5.0
LONGEST_PERIODS: Final = 2.5
"""Update periods of the controller from one estimate to the next, at the median."""
LEAST_ESTIMATES: Final = 50
LEAST_ECHOES: Final = 20
LONGEST_DELAY_S: Final = 0.12
"""Delay of the link in each direction, at the median: beyond it the loop may oscillate."""


def stack_of(heartbeat: Heartbeat) -> Stack | str:
    """Return the autopilot of a heartbeat, or why it is not flown."""
    stack = next((one for one in STACKS.values() if one.ident == heartbeat.autopilot), None)
    if stack is None:
        return (
            f"the autopilot is neither PX4 nor ArduCopter (MAV_AUTOPILOT {heartbeat.autopilot}); "
            "only these are flown"
        )
    if heartbeat.vehicle not in MULTICOPTERS:
        return (
            f"{stack.name} flies no multicopter (MAV_TYPE {heartbeat.vehicle}); the controller flies no other"
        )
    if heartbeat.armed:
        return f"{stack.name} is armed already: land and disarm it, then start the pilot"
    return stack


class Preflight:
    """Collects what the checks read, for a controller with an update period."""

    def __init__(self, stack: Stack, period_s: float) -> None:
        self._stack, self._period_s = stack, period_s
        self._parameters: dict[str, float] = {}
        self._battery: float | None = None
        self._estimates: list[EstimatedState] = []
        self._pings_s: list[float] = []
        self._trips_s: list[float] = []

    def receive(self, record: Record, now_s: float) -> None:
        """Take a record that has come."""
        match record:
            case Parameter():
                self._parameters[record.name] = record.value
            case Battery():
                self._battery = record.share
            case EstimatedState():
                self._estimates.append(record)
            case Echo() if 0 < record.number <= len(self._pings_s):  # others ask too
                self._trips_s.append(now_s - self._pings_s[record.number - 1])

    def requests(self) -> list[Order]:
        """Return what to ask the autopilot for."""
        rates = [SetRate(stream, 1.0 / self._period_s) for stream in self._stack.streams]
        asked = map(AskParameter, self._missing_parameters())
        return [*rates, SetRate(Stream.EXTENDED_SYS_STATE, LANDED_HZ), *asked]

    def ping(self, now_s: float) -> Order:
        """Return what measures the delay of the link."""
        self._pings_s.append(now_s)
        return Ping(len(self._pings_s))

    @property
    def delay_s(self) -> float:
        """The delay of the link each way, by which states are carried ahead: rather too short than too long.

        It is half of what a question and its answer take, at the lower quartile. Carried 15 ms too far, a
        quick controller swings between its limits of tilt; 10 ms too short cost it nothing.
        """
        return 0.5 * float(np.quantile(self._trips_s, 0.25))

    @property
    def hover_thrust(self) -> float:
        """The share of the largest thrust that carries the drone, by the autopilot's parameter."""
        return self._parameters[self._stack.hover_parameter]

    def missing(self) -> str | None:
        """Return what has not come yet; None if all has."""
        if parameters := self._missing_parameters():
            return f"{self._stack.name} sends no {parameters[0]}"
        if len(self._estimates) < LEAST_ESTIMATES:
            return (
                f"{self._stack.name} sends no position and attitude, or rarely: its estimator has none "
                "yet, or the link is too slow"
            )
        if len(self._trips_s) < LEAST_ECHOES:
            return f"{self._stack.name} answers no TIMESYNC, which measures the delay of the link, or rarely"
        return None

    def fault(self) -> str | None:
        """Return the first fault of what has come; None if there is none."""
        return (
            self._parameter_fault() or self._estimate_fault() or self._delay_fault() or self._battery_fault()
        )

    def _missing_parameters(self) -> list[str]:
        wanted = (self._stack.hover_parameter, *self._stack.needs)
        return [name for name in wanted if name not in self._parameters]

    def _parameter_fault(self) -> str | None:
        for name, bits in self._stack.needs.items():
            value = int(self._parameters[name])
            if value & bits != bits:
                return (
                    f"{self._stack.name} has {name} = {value}, with which it takes the thrust for a climb "
                    f"rate; set it to {value | bits}"
                )
        if not HOVER[0] <= self.hover_thrust <= HOVER[1]:
            return (
                f"{self._stack.name} has {self._stack.hover_parameter} = {self.hover_thrust:g}; it must "
                f"lie in {HOVER[0]:g}..{HOVER[1]:g}"
            )
        return None

    def _estimate_fault(self) -> str | None:
        median_s = float(np.median(np.diff(sorted({one.time_s for one in self._estimates}))))
        if median_s > LONGEST_PERIODS * self._period_s:
            return (
                f"an estimate comes every {1e3 * median_s:.0f} ms; the controller wants one every "
                f"{1e3 * self._period_s:.0f} ms: raise the rate of the link, or use another"
            )
        roll_rad, pitch_rad, _ = self._estimates[-1].attitude_rad.tolist()
        if (tilt_rad := math.hypot(roll_rad, pitch_rad)) > LARGEST_TILT_RAD:
            return f"the drone is tilted by {math.degrees(tilt_rad):.0f} degrees: set it down level"
        return None

    def _delay_fault(self) -> str | None:
        median_s = 0.5 * float(np.median(self._trips_s))
        if median_s <= LONGEST_DELAY_S:
            return None
        return (
            f"a message takes {1e3 * median_s:.0f} ms each way; with more than "
            f"{1e3 * LONGEST_DELAY_S:.0f} ms the drone may swing: use a quicker link"
        )

    def _battery_fault(self) -> str | None:
        if self._battery is None or self._battery >= LEAST_BATTERY:
            return None
        return f"the battery is at {self._battery:.0%}; {LEAST_BATTERY:.0%} are needed"
