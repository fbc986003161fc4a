"""What must be so before the motors start: each a sentence if it is not."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from mambo_sil.link.records import MULTICOPTERS, STACKS, Estimate, Heartbeat, Stack

LEAST_BATTERY: Final = 0.2
LARGEST_TILT_RAD: Final = 0.25
LONGEST_PERIODS: Final = 2.5
"""Update periods of the controller from one estimate to the next, at the median."""
LEAST_ESTIMATES: Final = 50


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


def parameter_fault(stack: Stack, values: Mapping[str, float]) -> str | None:
    """Return why the parameters of an autopilot do not do; None if they do."""
    for name, bits in stack.needs.items():
        if int(values[name]) & bits != bits:
            wanted = int(values[name]) | bits
            return (
                f"{stack.name} has {name} = {int(values[name])}, so that it takes the thrust for a climb rate; "
                f"set it to {wanted}"
            )
    hover = values[stack.hover_parameter]
    if not 0.05 <= hover <= 0.9:
        return f"{stack.name} has {stack.hover_parameter} = {hover:g}; it must lie in 0.05..0.9"
    return None


def estimate_fault(estimates: list[Estimate], period_s: float) -> str | None:
    """Return why estimates do not do for a controller of this update period; None if they do."""
    median_s = float(np.median(np.diff([one.time_s for one in estimates])))
    if median_s > LONGEST_PERIODS * period_s:
        return (
            f"an estimate comes every {1e3 * median_s:.0f} ms; the controller wants one every "
            f"{1e3 * period_s:.0f} ms: raise the rate of the link, or use another"
        )
    roll_rad, pitch_rad, _ = estimates[-1].attitude_rad.tolist()
    if (tilt_rad := math.hypot(roll_rad, pitch_rad)) > LARGEST_TILT_RAD:
        return f"the drone is tilted by {math.degrees(tilt_rad):.0f} degrees: set it down level"
    return None


def battery_fault(share: float | None) -> str | None:
    """Return that the battery is low; None if it is not, or is not known."""
    if share is not None and share < LEAST_BATTERY:
        return f"the battery is at {share:.0%}; {LEAST_BATTERY:.0%} are needed"
    return None
