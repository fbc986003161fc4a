"""The rows of what a controller takes and gives: state, target, command, estimate, limits and weights."""

from dataclasses import replace
from typing import Final

from mambo_codegen.port.row import AIM, BESIDE, CHANCE, SHARE, WHOLE, Draw, Row

_HEIGHT: Final = ("height",)
_TILT: Final = Draw("ATTITUDE_RAD", 0.8)
"""Beyond what any small angle stands for, and the steepest that counts for a thrust."""
_STATE_TILT: Final = replace(_TILT, rests=True)

STATE: Final = (
    Row("position_m", "position", "x north, y east", 2, draw=BESIDE),
    Row("velocity_m_s", "velocity", "v_x, v_y", 2, draw=BESIDE),
    Row("roll_rad", "angle", "phi", draw=_STATE_TILT),
    Row("pitch_rad", "angle", "theta", draw=_STATE_TILT),
    Row("yaw_rad", "yaw", "psi", note=", wrapped or not", draw=Draw("YAW_RAD", 100.0)),
    Row("height_m", "position", "up", when=_HEIGHT, draw=BESIDE),
    Row("climb_m_s", "velocity", "up", when=_HEIGHT, draw=BESIDE),
    Row(
        "grounded",
        "whole",
        "1 while the drone touches the floor, else 0",
        when=_HEIGHT,
        kind=WHOLE,
        draw=CHANCE,
    ),
)

TARGET: Final = (
    Row("position_m", "position", "Tp_k = x_ref, y_ref", 2, draw=AIM),
    Row("velocity_m_s", "velocity", "Tv_k = vx_ref, vy_ref", 2, draw=AIM),
    Row("acceleration_m_s2", "thrust", "", 2, ("given",), draw=Draw("TARGET_M_S2")),
    Row("height_m", "position", "up", when=_HEIGHT, draw=AIM),
    Row("climb_m_s", "velocity", "up", when=_HEIGHT, draw=AIM),
    Row("climb_acceleration_m_s2", "thrust", "up", when=("height", "given"), draw=Draw("CLIMB_M_S2")),
)

COMMAND: Final = (
    Row("roll_rad", "angle", "phi*", draw=_TILT),
    Row("pitch_rad", "angle", "theta*", draw=_TILT),
    Row(
        "thrust_m_s2",
        "thrust",
        "thrust over mass{over_gain}, from NMPC_THRUST_MIN_M_S2 to NMPC_THRUST_MAX_M_S2",
        when=_HEIGHT,
        draw=Draw("THRUST_M_S2", way=SHARE),
        reset="NMPC_HOVER_M_S2",
    ),
)

ESTIMATE: Final = (
    Row("position_m", "position", "x, y", 2),
    Row("velocity_m_s", "velocity", "v_x, v_y", 2),
    Row("disturbance_m_s2", "disturbance", "acceleration that tilt and drag do not explain", 2),
    Row("height_m", "position", when=_HEIGHT),
    Row("climb_m_s", "velocity", when=_HEIGHT),
    Row("thrust_gain", "factor", "delivered over {expected} thrust, as learnt", when=("learns_gain",)),
    Row(
        "lift_m_s2",
        "disturbance",
        "vertical acceleration that the thrust does not explain, up",
        when=("learns_acceleration",),
    ),
    Row(
        "roll_gain",
        "factor",
        "measured over modelled tilt, as learnt; 1 by the settings",
        when=("tilt_gain",),
    ),
    Row("pitch_gain", "factor", "the same", when=("tilt_gain",)),
    Row("is_valid", "whole", "1, or 0 before the first good state and after an outage", kind=WHOLE),
)

LIMITS: Final = (
    Row("speed_m_s", "velocity", "NMPC_SMALLEST_SPEED_LIMIT_M_S to NMPC_VELOCITY_RANGE_M_S"),
    Row("braking_m_s2", "braking", "NMPC_SMALLEST_BRAKING_LIMIT_M_S2 to what the tilt limit gives"),
    Row("fence_min_m", "position", "the walls at the least x and y,", 2),
    Row("fence_max_m", "position", "and at the largest; all within +/- NMPC_POSITION_RANGE_M", 2),
    Row("tilt_rad", "angle", "at most NMPC_TILT_LIMIT_RAD"),
    Row("floor_m", "position", "walls below and", when=_HEIGHT),
    Row("ceiling_m", "position", "above, within +/- NMPC_POSITION_RANGE_M", when=_HEIGHT),
    Row(
        "climb_m_s",
        "velocity",
        "NMPC_SMALLEST_SPEED_LIMIT_M_S to NMPC_LARGEST_CLIMB_LIMIT_M_S",
        when=_HEIGHT,
    ),
    Row(
        "descent_m_s",
        "velocity",
        "NMPC_SMALLEST_SPEED_LIMIT_M_S to NMPC_LARGEST_DESCENT_LIMIT_M_S",
        when=_HEIGHT,
    ),
)

WEIGHTS: Final = (
    Row("tracking", "tracking", "lambda_1", unit="1/m", draw=Draw("TRACKING")),
    Row("effort", "effort", "lambda_2", unit="1/rad", draw=Draw("EFFORT")),
)
