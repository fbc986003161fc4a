"""What the hop of fly.py compares: whether a drone moves where its tilt and believed heading push it.

With one camera marker the filter cannot measure the heading: it begins with kalman.initialYaw, and learns the
rest in flight. The position that it reports is measured. So over a hop the position is
a + b t + c t^2 + turn s(t), where s is the second integral of the acceleration that tilt and believed
heading give, and c stands for wind and a tilt that is off. The angle of the complex `turn` is what the
heading is off. Least squares find it.
"""

import math
from collections.abc import Mapping

from .calls import Rows
from .values import VALUES

POSE = tuple(f"{VALUES.group}.{name}" for name in ("x", "y", "inRoll", "inPitch", "inYaw"))
GRAVITY_M_S2, LEAST_ROWS = 9.81, 30


def push(row: Mapping[str, float]) -> complex:
    """Return the acceleration, x + i y, that tilt and believed heading give."""
    roll, pitch, yaw = (row[name] for name in POSE[2:])
    return -GRAVITY_M_S2 * complex(math.tan(pitch), math.tan(roll)) * complex(math.cos(yaw), math.sin(yaw))


def heading_error(rows: Rows, duration_s: float) -> float:
    """Return by how much, in rad to the left, the heading is off, by the rows of the last `duration_s`.

    NaN if they are too few.
    """
    import numpy as np  # comes with cflib

    begin = max(rows, default=0) - 1000.0 * duration_s
    stamps = [stamp for stamp in sorted(rows) if stamp >= begin and {*POSE} <= {*rows[stamp]}]
    if len(stamps) < LEAST_ROWS:
        return math.nan
    time_s = 0.001 * (np.array(stamps) - stamps[0])
    position = np.array([complex(rows[stamp][POSE[0]], rows[stamp][POSE[1]]) for stamp in stamps])
    pushed = np.array([push(rows[stamp]) for stamp in stamps])
    for _ in range(2):
        steps = 0.5 * (pushed[1:] + pushed[:-1]) * np.diff(time_s)
        pushed = np.concatenate([[0.0], np.cumsum(steps)])
    terms = np.column_stack([np.ones_like(time_s), time_s, time_s**2, pushed])
    turn = np.linalg.lstsq(terms, position, rcond=None)[0][3]
    return float(np.angle(turn))
