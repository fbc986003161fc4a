"""Why some faults of the linear system of a controller change nothing that a test can see."""

from collections.abc import Mapping
from typing import Final

from tests.mutation.reasons import Key

_EQUAL: Final = "two numbers that are equal"
_CHOICE: Final = "a choice, which has no definition"
_SIZE: Final = "only its absolute value counts"
_DELAYED: Final = "delayed_share = 1.0 - math.exp(-period_s / height.delay_s) if height.delay_s else 1.0"
_EXPECTED: Final = "expected, seen = 1.0 / height.thrust_gain, state.copy()"
_BEGINNING: Final = "height_m, climb_m_s, lift_m_s2 = float(target[0, 6]), 0.0, 0.0"
_BEFORE: Final = "updates_per_s, before = round(1.0 / period_s), np.zeros(0)"
_OLD: Final = "seen[0, 7:9] = height_m - age_s * climb_m_s, climb_m_s - age_s * lift_m_s2"
_GROWN: Final = "grown = min((second + update * period_s) / _RAMP_S, 1.0)"
_CLIMBED: Final = "height_m += period_s * (climb_m_s + 0.5 * period_s * lift_m_s2)"
_RESTS: Final = "if second > _RAMP_S and np.abs(now - before).max() < _STILL:"
_HOVERS: Final = 'if abs(lift_m_s2) > _STILL or (height.learn != "none" and off_m > _ON_TARGET_M):'
_WAY: Final = "the state at rest does not depend on the way there"
_UNREAD: Final = "a column of zeros that is not read"

CONTROLLER_REASONS: Final[Mapping[Key, str]] = {
    ("controller_jacobian.py", line, change): reason
    for line, change, reason in (
        ("_SETTLING_STEPS: Final = 100", "100 -> 101", "a step more at rest"),
        ("_LEARNING_S: Final = 30.0", "30.0 -> 33.0", _CHOICE),
        ("_RAMP_S: Final = 5.0", "5.0 -> 5.5", _WAY),
        ("_STILL: Final = 1e-6", "1e-6 -> 1.1e-06", _CHOICE),
        ("_ON_TARGET_M: Final = 1e-3", "1e-3 -> 0.0011", _CHOICE),
        ("_CHANGE: Final = 1e-6", "1e-6 -> 1.1e-06", _CHOICE),
        ("return np.zeros((1, 7)), np.zeros((1, 6))", "6 -> 7", _UNREAD),
        (
            "state, target, fence = np.zeros((1, 10)), np.zeros((1, 9)), settings.limits.fence",
            "9 -> 10",
            _UNREAD,
        ),
        (_DELAYED, "1.0 -> 1.1", _WAY),
        (_DELAYED, "1.0 -> 1.1 #1", _WAY),
        (_EXPECTED, "1.0 -> 1.1", _WAY),
        (_BEGINNING, "6 -> 7", _WAY),
        (_BEGINNING, "0.0 -> 1.0", _WAY),
        (_BEGINNING, "0.0 -> 1.0 #1", _WAY),
        (_BEFORE, "1.0 -> 1.1", _WAY),
        (_BEFORE, "zeros -> ones", "replaced before it is compared"),
        (_BEFORE, "0 -> 1", "replaced before it is compared"),
        (_OLD, "climb_m_s - age_s * lift_m_s2 -> (age_s * lift_m_s2) - (climb_m_s)", _WAY),
        (_OLD, "- -> + #1", _WAY),
        (_GROWN, "+ -> -", _WAY),
        (_GROWN, "* -> /", _WAY),
        (_GROWN, "/ -> *", _WAY),
        (_CLIMBED, "+ -> -", _WAY),
        (_CLIMBED, "0.5 -> 0.55", _WAY),
        (_RESTS, "> -> >=", "a second less at rest"),
        (
            _RESTS,
            "np.abs(now - before) -> (now - before)",
            "ends sooner if all numbers fall, which changes the matrices by less than 1e-6",
        ),
        (_RESTS, "now - before -> (before) - (now)", _SIZE),
        (_RESTS, "- -> +", "never ends sooner, and a drone that rests goes on resting"),
        (_RESTS, "< -> <=", _EQUAL),
        (
            "off_m = abs(height_m - float(target[0, 6]))",
            "height_m - float(target[0, 6]) -> (float(target[0, 6])) - (height_m)",
            _SIZE,
        ),
        (_HOVERS, "> -> >=", _EQUAL),
        (_HOVERS, "> -> >= #1", _EQUAL),
    )
}
