"""Tapes of targets that move: what a tracker or an observer of the target makes of changes and jumps."""

from collections.abc import Iterator

import numpy as np

from mambo_codegen.methods.shared.tracker_constants import TrackerConstants
from mambo_codegen.settings.model import Settings
from mambo_sil.verify.calls import ApiFunction, Tape, calls
from mambo_sil.verify.step_inputs import VELOCITY, Array, StepRows, around, method_of


def target_motion(settings: Settings, tracker: TrackerConstants) -> Iterator[Tape]:
    """Change the target's velocity by the tracker's limit and the numbers next to it, either way.

    Then accelerate the target to and fro along both axes, so that acceleration and jerk reach their limits,
    with a reset on the way, and with turns of the frame.
    """
    limit = tracker.change_limit_m_s
    for value in around(settings, "velocity", -limit, limit):
        if np.isfinite(value):
            for columns in ([1, 0], [0, 1]):
                yield _moving_steps(settings, np.outer([0.0, value, value, 0.0], columns))
    motion = np.cumsum(limit * np.repeat([0.5, 0.9, -0.9, 0.99, -0.99, 0.2], 8))
    yield from _jumps_at_the_ends(settings, 0.25 * limit)
    both = motion[:, None] * [1.0, -0.7]
    again = calls(settings, ApiFunction.RESET, np.zeros((1, 2)))
    yield np.concatenate([_moving_steps(settings, both), again, _moving_steps(settings, both[::-1])])
    before, after = _moving_steps(settings, both[:32]), _moving_steps(settings, both[32:])
    turned = np.zeros((1, len(method_of(settings).shift)))
    for turn_rad in around(settings, "yaw", 0.0, 0.3):
        turned[:, -1] = turn_rad
        yield np.concatenate([before, calls(settings, ApiFunction.SHIFT, turned), after])


def observed_motion(settings: Settings) -> Iterator[Tape]:
    """Change velocities by what is a jump, and known accelerations too, either way, once and twice in a row.

    Then a target accelerates to and fro, knowing more and less, with a reset on the way, and with turns and
    jumps of the frame.
    """
    period_s, limits = settings.horizon.update_period_s, method_of(settings).target_observer.level
    for known, jump, quantity in ((0, limits.jump, "velocity"), (1, limits.known_jump / period_s, "thrust")):
        for value in around(settings, quantity, -jump, jump):
            if np.isfinite(value):
                for columns in ([1, 0], [0, 1]):
                    for change in ([0.0, value, 0.0, 0.0], [0.0, value, value, 0.0]):
                        yield _moving_steps(settings, np.outer(change, columns), known)
    motion = limits.acceleration * np.repeat([0.5, 0.9, -0.9, 0.99, -0.99, 0.2, 0.0], 12)
    velocity = np.cumsum(motion)[:, None] * [1.0, -0.7]
    kinds = np.resize(np.repeat([0, 1, 0, 2, 1], 7), len(motion))
    told = np.where(kinds[:, None] > 0, motion[:, None] * [1.0, -0.7] / period_s, velocity)
    both = np.concatenate([_moving_steps(settings, told[[k]], int(kinds[k])) for k in range(len(motion))])
    again = calls(settings, ApiFunction.RESET, np.zeros((1, 2)))
    yield np.concatenate([_moving_steps(settings, velocity), again, both])
    turned = np.zeros((1, len(method_of(settings).shift)))
    for turn_rad in around(settings, "yaw", 0.0, 0.3):
        turned[:, -1] = turn_rad
        shift = calls(settings, ApiFunction.SHIFT, turned)
        yield np.concatenate([both[:30], shift, both[30:50], shift, _moving_steps(settings, velocity[50:])])
    yield from _jumps_at_the_ends(settings, 0.25 * limits.jump)


def _moving_steps(settings: Settings, motion: Array, known: int = 0) -> Tape:
    """Return steps of targets with velocities (n, 2), or accelerations where `known` is more than 0."""
    method = method_of(settings)
    rows, most_m_s = StepRows(method), settings.ranges.velocity_m_s
    made, first = rows.hovering(len(motion)), rows.target.start
    if known:
        made[:, rows.acceleration] = motion
    else:
        made[:, VELOCITY] = made[:, first + 2 : first + 4] = np.clip(motion, -most_m_s, most_m_s)
    made[:, [one.column for one in method.port.step_row() if one.member == "known"]] = known
    made[:, 0] = 1e-3
    return calls(settings, ApiFunction.STEP, made)


def _jumps_at_the_ends(settings: Settings, change_m_s: float) -> Iterator[Tape]:
    """Let the frame jump by twice a change of velocity, beyond the end of the range, where the target is."""
    jump, axes = np.zeros((1, len(method_of(settings).shift))), len(method_of(settings).shift) // 2
    speed_m_s = settings.ranges.velocity_m_s - change_m_s * np.array([3.0, 2.0, 1.0, 0.0, 0.0])
    for way in (-1.0, 1.0):
        steps = _moving_steps(settings, np.outer(speed_m_s, [way, way]))
        jump[:, axes : axes + 2] = 2.0 * way * change_m_s
        yield np.concatenate([steps[:3], calls(settings, ApiFunction.SHIFT, jump), steps[3:]])
