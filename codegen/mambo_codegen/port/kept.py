"""The rows of what a controller keeps, in the order of the members of nmpc_t, whose numbers come first."""

from typing import Final

from mambo_codegen.port.row import BYTE, SUM, PortRow, Table

BOUNDS: Final = (
    PortRow("centre_m", "position", "of the fence, x and y", 2),
    PortRow("clear_m", "position", "half the width of the fence less the margin; may be less than 0", 2),
    PortRow("margin_m", "position", "a wall that is farther limits nothing"),
    PortRow("knee_m", "position", "the distance up to which f is linear"),
    PortRow("near_m", "position", "the distance from a slow target at which braking ends"),
    PortRow("speed_m_s", "velocity", "V"),
    PortRow("braking_m_s2", "braking", "2 A"),
    PortRow("tilt_rad", "angle", "the tilt limit"),
    PortRow("command_m_step2", "move", "the largest |u| at that limit, right and forward", 2, ("quadratic",)),
    PortRow("target_m_s", "velocity", "the target's velocity in the last step", 2, ("turning",)),
    PortRow("turn_m2_s2", "velocity", "mean vector product of successive ones", when=("turning",)),
    PortRow("floor_m", "position", when=("height",)),
    PortRow("ceiling_m", "position", when=("height",)),
    PortRow("up_m", "position", "the distances at which the largest climb", when=("height",)),
    PortRow("down_m", "position", "and descent are", when=("height",)),
)

OBSERVER: Final = (
    PortRow("position_m", "position", "p", 2),
    PortRow("velocity_m_step", "speed", "v", 2),
    PortRow("disturbance_m_step2", "acceleration", "d", 2),
)

ATTITUDE: Final = (
    PortRow("tilt_m_step2", "acceleration", "a: acceleration of the tilt", 2),
    PortRow("integral_m_step2", "acceleration", "i: integral part of the attitude loop", 2),
    PortRow("lagged_m_step2", "acceleration", "c: command behind dead time and quick lags", 2),
    PortRow("command_m_step2", "acceleration", "u: the last command", 2),
    PortRow("sine", "sine", "of the heading that these axes belong to"),
    PortRow("cosine", "sine"),
)

TILT_GAIN: Final = (
    PortRow("quick_m_step2", "acceleration", "Q a", 2),
    PortRow("slow_m_step2", "acceleration", "S a", 2),
    PortRow("seen_quick_m_step2", "acceleration", "Q s", 2),
    PortRow("seen_slow_m_step2", "acceleration", "S s", 2),
    PortRow("gain", "factor", "k", 2),
)

TRACKER: Final = (
    PortRow("acceleration_m_step2", "acceleration", "A_T: the target's acceleration", 2),
    PortRow(
        "jerk_m_step2_update",
        "acceleration",
        "J_T: change of A_T from one control step to the next",
        2,
    ),
    PortRow("axis", count=2, kind="motion"),
    PortRow("desired_m_s", "velocity", "v_d: while limits act, that of the last step", 2),
    PortRow("desired_acceleration", "velocity", "d, in m/s per step", 2),
    PortRow("desired_jerk", "velocity", "e, in m/s per step^2", 2),
)

MOTION: Final = (
    PortRow("velocity_m_s", "velocity", "v"),
    PortRow("acceleration", "velocity", "a, in m/s per step"),
    PortRow("jerk", "velocity", "j, in m/s per step^2"),
    PortRow("snap", "velocity", "s, in m/s per step^3"),
    PortRow("innovation", "velocity", "nu of the last set-point; 0 if it was rejected"),
    PortRow("noise", "velocity", "h"),
    PortRow("memory", "whole", "n; 0 with known accelerations"),
    PortRow("missed", "whole", "1 if the last set-point was rejected, 2 after a turn, else 0"),
)

HEIGHT: Final = (
    PortRow("height_m", "position", "p"),
    PortRow("velocity_m_step", "speed", "v"),
    PortRow("gain", "factor", "kg: delivered over {expected} thrust", when=("thrust_gain",)),
    PortRow("disturbance_m_step2", "acceleration", "d", when=("lift",)),
    PortRow("thrust_m_step2", "acceleration", "sa: vertical share of the thrust"),
    PortRow("lagged_m_step2", "acceleration", "sc: that of the command behind dead time and quick lags"),
    PortRow("command_m_step2", "acceleration", "su: that of the last command"),
    PortRow("share", "factor", "c"),
    PortRow("thrust_m_s2", "thrust", "the last command, thrust over mass"),
    PortRow("commanded_m_s2", "thrust", "the same, whatever the motors were given", when=("guard",)),
    PortRow("budget_m_s2", "thrust", "b", when=("guard",)),
    PortRow("target_acceleration_m_step2", "acceleration"),
    PortRow("target_jerk_m_step2_update", "acceleration"),
    PortRow("target", kind="motion"),
)

QUADRATIC: Final = (
    PortRow("observer", kind="observer"),
    PortRow("attitude", kind="attitude"),
    PortRow("tilt_gain", when=("tilt_gain",), kind="tilt_gain"),
    PortRow("tracker", kind="tracker"),
    PortRow("height", when=("height",), kind="height"),
    PortRow("bounds", kind="bounds"),
    PortRow("tilt_rad", "angle", "roll and pitch of the last good state", "NMPC_ANGLES", ("feedback",)),
    PortRow("budget_rad", "angle", "b of roll and pitch", "NMPC_ANGLES", ("guard",)),
    PortRow("command_rad", "angle", "the last command", "NMPC_ANGLES"),
    PortRow("steps_blind", words="control steps since the last good state", kind=BYTE),
    PortRow("has_target", words="1 once there was a target", kind=BYTE),
    PortRow("active_limits", words="the limits that act, but NMPC_LIMIT_TILT", kind=BYTE),
    PortRow("is_coarse", words="1 while no position is measured", when=("guard",), kind=BYTE),
)

ROLLOUT: Final = (
    PortRow("error_m", "error", "e = r - Tp, of eqs 9 and 11"),
    PortRow("displacement_m_step", "acceleration", "d: change of the error over the next prediction step"),
    PortRow("acceleration_m_step2", "acceleration", "A: tau^2 times eq 8{at_moves}{less_target}"),
    PortRow(
        "roll_deficit_m_step2",
        "acceleration",
        "D of roll: correction of A, because roll lags behind its move",
        when=("lag",),
    ),
    PortRow("pitch_deficit_m_step2", "acceleration", "D of pitch", when=("lag",)),
)

STEP_TRACKER: Final = (
    PortRow("velocity_m_s", "velocity", "Tv_k: of the last good step", 2, ("tracker",)),
    PortRow("acceleration_m_step2", "acceleration", "A_T: tau^2 times the target's acceleration", 2),
    TRACKER[1],
)
"""The tracker in prediction steps."""

PREDICTION: Final = (
    PortRow(
        "gain_x_m_step2_rad",
        "gain",
        "tau^2 times the row of eq 8 for x: of roll, of pitch",
        "NMPC_ANGLES",
    ),
    PortRow("gain_y_m_step2_rad", "gain", "tau^2 times the row of eq 8 for y", "NMPC_ANGLES"),
    PortRow("tilt_rad", "angle", "before the first moves: {tilt}", "NMPC_ANGLES"),
    PortRow("x", words="the start of the roll-out along x", kind="rollout"),
    PortRow("y", words="the start of the roll-out along y", kind="rollout"),
)

ONE_NORM: Final = (
    PortRow("weights", words="lambda_1, lambda_2", kind="weights"),
    PortRow("prediction", kind="prediction"),
    PortRow("tracker", when=("tracker",), kind="tracker"),
    PortRow(
        "command_rad",
        "angle",
        "u*_k-1: the last {first_moves}, NMPC_UPDATE_PERIOD_S ago",
        "NMPC_ANGLES",
    ),
    PortRow(
        "sent_rad",
        "angle",
        "the last command: u*_k-1 and the rate feedback, limited",
        "NMPC_ANGLES",
        ("feedback",),
    ),
    PortRow("tilt_rad", "angle", "phi, theta of the last good step", "NMPC_ANGLES", ("feedback",)),
    PortRow("plan_rad", "angle", "u_k+i, i = 0 .. N_c - 1: the moves, tau apart", "NMPC_MOVES"),
    PortRow(
        "gradient",
        "gradient",
        "dJ/du, 1/rad, of the plan that the last iteration evaluated",
        "NMPC_MOVES",
        kind=SUM,
    ),
    PortRow("cost", "cost", "J, eq 12, of that plan", kind=SUM),
    PortRow("bounds", when=("limits",), kind="bounds"),
    PortRow("iterations", words="how many iterations updated the plan, at most I_max", kind=BYTE),
    PortRow("converged", words="1 once J changed by less than epsilon", kind=BYTE),
    PortRow("has_tilt", words="1 once tilt_rad is measured", when=("feedback",), kind=BYTE),
    PortRow("has_target", words="1 once there was a target", when=("tracker",), kind=BYTE),
    PortRow(
        "steps_blind",
        words="control steps since the last good state, at most NMPC_OUTAGE_STEPS",
        when=("limits",),
        kind=BYTE,
    ),
    PortRow("active_limits", words="the limits that act, but NMPC_LIMIT_TILT", when=("limits",), kind=BYTE),
)

KEPT: Final[dict[str, Table]] = {
    "quadratic": {
        "observer": OBSERVER,
        "attitude": ATTITUDE,
        "tilt_gain": TILT_GAIN,
        "motion": MOTION,
        "tracker": TRACKER,
        "height": HEIGHT,
        "bounds": BOUNDS,
        "controller": QUADRATIC,
    },
    "1-norm": {
        "rollout": ROLLOUT,
        "tracker": STEP_TRACKER,
        "prediction": PREDICTION,
        "bounds": BOUNDS,
        "controller": ONE_NORM,
    },
}
"""What it keeps, by `controller.method`."""

WORDS: Final = {
    "observer": "Estimates along x and y, by the observer of nmpc.c.",
    "attitude": "The attitude model of nmpc.c along right and forward, the axes of the heading.",
    "tilt_gain": "The gain of the tilt, of roll and pitch, by the chapter of nmpc.c.",
    "motion": "The target's motion along an axis, by its observer in nmpc.c.",
    "tracker": "The target's motion along x and y, by its chapter of nmpc.c.",
    "height": "The height, by the chapter of nmpc.c.",
    "bounds": "What follows from the limits, for the law in nmpc.c.",
}
"""What nmpc.h says of each record that a controller with a quadratic cost keeps."""
