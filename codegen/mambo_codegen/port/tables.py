"""All records of a controller by name; each row stands here once, and a new one needs no other list."""

from typing import Final

from mambo_codegen.port import kept, taken
from mambo_codegen.port.row import PortRow

Table = dict[str, tuple[PortRow, ...]]
"""The rows of each record, nmpc_NAME_t in C; `controller` is nmpc_t."""

TAKEN: Final[Table] = {
    "state": taken.STATE,
    "target": taken.TARGET,
    "command": taken.COMMAND,
    "estimate": taken.ESTIMATE,
    "limits": taken.LIMITS,
    "weights": taken.WEIGHTS,
}
"""What it takes and gives, whatever its method."""

KEPT: Final[dict[str, Table]] = {
    "quadratic": {
        "observer": kept.OBSERVER,
        "attitude": kept.ATTITUDE,
        "tilt_gain": kept.TILT_GAIN,
        "noise": kept.NOISE,
        "tracker": kept.TRACKER,
        "height": kept.HEIGHT,
        "bounds": kept.BOUNDS,
        "controller": kept.QUADRATIC,
    },
    "1-norm": {
        "rollout": kept.ROLLOUT,
        "tracker": kept.STEP_TRACKER,
        "prediction": kept.PREDICTION,
        "bounds": kept.BOUNDS,
        "controller": kept.ONE_NORM,
    },
}
"""What it keeps, by `cost.norm`."""
