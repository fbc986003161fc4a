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

WORDS: Final = {
    "observer": "Estimates along x and y, by the observer of nmpc.c.",
    "attitude": "The attitude model of nmpc.c along right and forward, the axes of the heading.",
    "tilt_gain": "The gain of the tilt, of roll and pitch, by the chapter of nmpc.c.",
    "noise": "Noise of the target's motion along an axis, by the tracker of nmpc.c.",
    "tracker": "The target's motion along x and y, by the tracker of nmpc.c.",
    "height": "The height, by the chapter of nmpc.c.",
    "bounds": "What follows from the limits, for the law in nmpc.c.",
}
"""What nmpc.h says of each record that a controller with a quadratic cost keeps."""

MACROS: Final = {
    "given": ("NMPC_HAS_TARGET_ACCELERATION", "nmpc_target_t has the member acceleration_m_s2"),
    "guard": ("NMPC_HAS_GUARD", "there is nmpc_set_position_measured()"),
    "tilt_gain": ("NMPC_HAS_TILT_GAIN", "nmpc_estimate_t has the members roll_gain and pitch_gain"),
    "height": (
        "NMPC_HAS_HEIGHT",
        "states and targets have a height, commands a thrust, which nmpc_step() does not take",
    ),
}
"""How nmpc.h says that a part is there on which its functions and structs depend, and what that means."""
