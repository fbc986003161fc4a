"""The rows of what a controller takes and gives: state, target, command, estimate, limits and weights."""

from dataclasses import replace
from typing import Final

from mambo_codegen.port.row import AIM, BESIDE, CHANCE, COUNT, SHARE, WHOLE, Draw, PortRow, Table

_HEIGHT: Final = ("height",)
_OBSERVED: Final = ("target_observer",)
AHEAD_S: Final = 0.05
"""How far ahead of a set-point the acceleration ahead is."""
MOST_KNOWN: Final = 2
"""What a target that knows most says of it."""
_TILT: Final = Draw("ATTITUDE_RAD", 0.8)
"""Beyond what any small angle stands for, and the steepest that counts for a thrust."""
_STATE_TILT: Final = replace(_TILT, rests=True)

STATE: Final = (
    PortRow(
        "position_m",
        "position",
        "x north, y east",
        2,
        draw=BESIDE,
        told=(("x", "measured position north"), ("y", "measured position east")),
    ),
    PortRow(
        "velocity_m_s",
        "velocity",
        "v_x, v_y",
        2,
        draw=BESIDE,
        told=(("vx", "measured velocity north"), ("vy", "measured velocity east")),
    ),
    PortRow("roll_rad", "angle", "phi", draw=_STATE_TILT, told=(("roll", "measured roll, right side down"),)),
    PortRow("pitch_rad", "angle", "theta", draw=_STATE_TILT, told=(("pitch", "measured pitch, nose up"),)),
    PortRow(
        "yaw_rad",
        "yaw",
        "psi",
        note=", wrapped or not",
        draw=Draw("YAW_RAD", 100.0),
        told=(("yaw", "measured yaw, clockwise from above"),),
    ),
    PortRow(
        "height_m",
        "position",
        "up",
        when=_HEIGHT,
        draw=BESIDE,
        told=(("height", "measured height, upwards"),),
    ),
    PortRow(
        "climb_m_s",
        "velocity",
        "up",
        when=_HEIGHT,
        draw=BESIDE,
        told=(("climb", "measured velocity upwards"),),
    ),
    PortRow(
        "on_ground",
        "whole",
        "1 while the drone touches the floor, else 0",
        when=_HEIGHT,
        kind=WHOLE,
        draw=CHANCE,
        told=(("on_ground", "1 while the drone touches the floor, else 0"),),
    ),
)

TARGET: Final = (
    PortRow(
        "position_m",
        "position",
        "Tp_k = x_ref, y_ref",
        2,
        draw=AIM,
        told=(("target_x", "position of the target north"), ("target_y", "position of the target east")),
    ),
    PortRow(
        "velocity_m_s",
        "velocity",
        "Tv_k = vx_ref, vy_ref",
        2,
        draw=AIM,
        told=(("target_vx", "velocity of the target north"), ("target_vy", "velocity of the target east")),
    ),
    PortRow(
        "acceleration_m_s2",
        "thrust",
        "",
        2,
        _OBSERVED,
        draw=Draw("TARGET_M_S2"),
        told=(
            ("target_ax", "acceleration of the target north"),
            ("target_ay", "acceleration of the target east"),
        ),
    ),
    PortRow(
        "height_m",
        "position",
        "up",
        when=_HEIGHT,
        draw=AIM,
        told=(("target_height", "height of the target"),),
    ),
    PortRow(
        "climb_m_s",
        "velocity",
        "up",
        when=_HEIGHT,
        draw=AIM,
        told=(("target_climb", "velocity of the target upwards"),),
    ),
    PortRow(
        "climb_acceleration_m_s2",
        "thrust",
        "up",
        when=(*_HEIGHT, *_OBSERVED),
        draw=Draw("CLIMB_M_S2"),
        told=(("target_az", "acceleration of the target upwards"),),
    ),
    PortRow(
        "ahead_m_s2",
        "thrust",
        "acceleration 0.05 s later",
        2,
        _OBSERVED,
        draw=Draw("TARGET_M_S2"),
        told=(
            ("target_ahead_x", "acceleration of the target north, 0.05 s later"),
            ("target_ahead_y", "acceleration of the target east, 0.05 s later"),
        ),
    ),
    PortRow(
        "climb_ahead_m_s2",
        "thrust",
        "up, 0.05 s later",
        when=(*_HEIGHT, *_OBSERVED),
        draw=Draw("CLIMB_M_S2"),
        told=(("target_ahead_z", "acceleration of the target upwards, 0.05 s later"),),
    ),
    PortRow(
        "known",
        "whole",
        "0: position and velocity; 1: acceleration too; 2: and the one ahead; what is not known is 0",
        when=_OBSERVED,
        kind=WHOLE,
        draw=COUNT,
        told=(
            ("target_known", "1 if the target's acceleration is known, 2 if that 0.05 s later too, else 0"),
        ),
    ),
)

COMMAND: Final = (
    PortRow("roll_rad", "angle", "phi*", draw=_TILT, told=(("roll_command", "roll command"),)),
    PortRow("pitch_rad", "angle", "theta*", draw=_TILT, told=(("pitch_command", "pitch command"),)),
    PortRow(
        "thrust_m_s2",
        "thrust",
        "thrust over mass{over_gain}, from NMPC_THRUST_MIN_M_S2 to NMPC_THRUST_MAX_M_S2",
        when=_HEIGHT,
        draw=Draw("THRUST_M_S2", way=SHARE),
        reset="NMPC_HOVER_M_S2",
        told=(("thrust_command", "thrust over mass"),),
    ),
)

ESTIMATE: Final = (
    PortRow("position_m", "position", "x, y", 2),
    PortRow("velocity_m_s", "velocity", "v_x, v_y", 2),
    PortRow("disturbance_m_s2", "disturbance", "acceleration that tilt and drag do not explain", 2),
    PortRow("height_m", "position", when=_HEIGHT),
    PortRow("climb_m_s", "velocity", when=_HEIGHT),
    PortRow("thrust_gain", "factor", "delivered over {expected} thrust, as learnt", when=("thrust_gain",)),
    PortRow(
        "lift_m_s2",
        "disturbance",
        "vertical acceleration that the thrust does not explain, up",
        when=("lift",),
    ),
    PortRow(
        "roll_gain",
        "factor",
        "measured over modelled tilt, as learnt; 1 by the settings",
        when=("tilt_gain",),
    ),
    PortRow("pitch_gain", "factor", "the same", when=("tilt_gain",)),
    PortRow("is_valid", "whole", "1, or 0 before the first good state and after an outage", kind=WHOLE),
)

LIMITS: Final = (
    PortRow(
        "speed_m_s",
        "velocity",
        "NMPC_SMALLEST_SPEED_LIMIT_M_S to NMPC_VELOCITY_RANGE_M_S",
        told=(("speed_limit", "speed limit"),),
    ),
    PortRow(
        "braking_m_s2",
        "braking",
        "NMPC_SMALLEST_BRAKING_LIMIT_M_S2 to what the tilt limit gives",
        told=(("braking_limit", "braking limit"),),
    ),
    PortRow(
        "fence_min_m",
        "position",
        "the walls at the least x and y,",
        2,
        told=(("fence_x_min", "least x in the fence"), ("fence_y_min", "least y in the fence")),
    ),
    PortRow(
        "fence_max_m",
        "position",
        "and at the largest; all within +/- NMPC_POSITION_RANGE_M",
        2,
        told=(("fence_x_max", "largest x in the fence"), ("fence_y_max", "largest y in the fence")),
    ),
    PortRow("tilt_rad", "angle", "at most NMPC_TILT_LIMIT_RAD"),
    PortRow(
        "floor_m", "position", "walls below and", when=_HEIGHT, told=(("floor", "least height in the fence"),)
    ),
    PortRow(
        "ceiling_m",
        "position",
        "above, within +/- NMPC_POSITION_RANGE_M",
        when=_HEIGHT,
        told=(("ceiling", "largest height in the fence"),),
    ),
    PortRow(
        "climb_m_s",
        "velocity",
        "NMPC_SMALLEST_SPEED_LIMIT_M_S to NMPC_LARGEST_CLIMB_LIMIT_M_S",
        when=_HEIGHT,
        told=(("climb_limit", "speed limit upwards, refused where the thrust cannot brake it in time"),),
    ),
    PortRow(
        "descent_m_s",
        "velocity",
        "NMPC_SMALLEST_SPEED_LIMIT_M_S to NMPC_LARGEST_DESCENT_LIMIT_M_S",
        when=_HEIGHT,
        told=(("descent_limit", "speed limit downwards, refused where the thrust cannot brake it in time"),),
    ),
)

WEIGHTS: Final = (
    PortRow(
        "tracking",
        "tracking",
        "lambda_1",
        unit="1/m",
        draw=Draw("TRACKING"),
        told=(("tracking_weight", "lambda1, eq 12"),),
    ),
    PortRow(
        "effort",
        "effort",
        "lambda_2",
        unit="1/rad",
        draw=Draw("EFFORT"),
        told=(("effort_weight", "lambda2, eq 12"),),
    ),
)

TAKEN: Final[Table] = {
    "state": STATE,
    "target": TARGET,
    "command": COMMAND,
    "estimate": ESTIMATE,
    "limits": LIMITS,
    "weights": WEIGHTS,
}
"""The records that a controller takes and gives, whatever its method, by name."""

PARTS: Final = sorted({part for rows in TAKEN.values() for row in rows for part in row.when})
"""The parts that their rows ask for."""

MACROS: Final = {
    "target_observer": (
        "NMPC_HAS_TARGET_KNOWN",
        "nmpc_target_t has the members known, acceleration_m_s2 and ahead_m_s2",
    ),
    "guard": ("NMPC_HAS_GUARD", "there is nmpc_set_position_measured()"),
    "tilt_gain": ("NMPC_HAS_TILT_GAIN", "nmpc_estimate_t has the members roll_gain and pitch_gain"),
    "height": (
        "NMPC_HAS_HEIGHT",
        "states and targets have a height, commands a thrust, which nmpc_step() does not take",
    ),
}
"""How nmpc.h says that a part is there on which its functions and structs depend, and what that means."""
