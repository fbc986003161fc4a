"""The rows of what a controller keeps, in the order of the members of nmpc_t, whose numbers come first."""

from typing import Final

from mambo_codegen.port.row import BYTE, SUM, Row

BOUNDS: Final = (
    Row("centre_m", "position", "of the fence, x and y", 2),
    Row("clear_m", "position", "half the width of the fence less the margin; may be less than 0", 2),
    Row("margin_m", "position", "a wall that is farther limits nothing"),
    Row("knee_m", "position", "the distance up to which f is linear"),
    Row("near_m", "position", "the distance from a slow target at which braking ends"),
    Row("speed_m_s", "velocity", "V"),
    Row("braking_m_s2", "braking", "2 A"),
    Row("tilt_rad", "angle", "the tilt limit"),
    Row("command_m_step2", "move", "the largest |u| at that limit, right and forward", 2, ("quadratic",)),
    Row(
        "velocity_m_s",
        "velocity",
        "what stood for the target's velocity in the last step",
        2,
        ("given",),
    ),
    Row("target_m_s", "velocity", "the target's velocity in the last step", 2, ("turning",)),
    Row("turn_m2_s2", "velocity", "mean vector product of successive ones", when=("turning",)),
    Row("floor_m", "position", when=("height",)),
    Row("ceiling_m", "position", when=("height",)),
    Row("up_m", "position", "the distances at which the largest climb", when=("height",)),
    Row("down_m", "position", "and descent are", when=("height",)),
)

OBSERVER: Final = (
    Row("position_m", "position", "p", 2),
    Row("velocity_m_step", "speed", "v", 2),
    Row("disturbance_m_step2", "acceleration", "d", 2),
)

ATTITUDE: Final = (
    Row("tilt_m_step2", "acceleration", "a: acceleration of the tilt", 2),
    Row("integral_m_step2", "acceleration", "i: integral part of the attitude loop", 2),
    Row("lagged_m_step2", "acceleration", "c: command behind dead time and quick lags", 2),
    Row("command_m_step2", "acceleration", "u: the last command", 2),
    Row("sine", "sine", "of the heading that these axes belong to"),
    Row("cosine", "sine"),
)

TILT_GAIN: Final = (
    Row("quick_m_step2", "acceleration", "Q a", 2),
    Row("slow_m_step2", "acceleration", "S a", 2),
    Row("seen_quick_m_step2", "acceleration", "Q s", 2),
    Row("seen_slow_m_step2", "acceleration", "S s", 2),
    Row("gain", "factor", "k", 2),
)

NOISE: Final = (
    Row("deviation", "factor", "d"),
    Row("reversal", "factor", "r"),
    Row("doubt", "factor", "1 - s"),
)

TRACKER: Final = (
    Row("velocity_m_s", "velocity", "Tv_k: of the last step", 2, ("measured",)),
    Row("acceleration_m_step2", "acceleration", "A_T: the target's acceleration", 2),
    Row(
        "jerk_m_step2_update",
        "acceleration",
        "J_T: change of A_T from one control step to the next",
        2,
    ),
    Row("noise", count=2, when=("doubts",), kind="noise"),
)

HEIGHT: Final = (
    Row("height_m", "position", "p"),
    Row("velocity_m_step", "speed", "v"),
    Row("gain", "factor", "kg: delivered over {expected} thrust", when=("learns_gain",)),
    Row("disturbance_m_step2", "acceleration", "d", when=("learns_acceleration",)),
    Row("thrust_m_step2", "acceleration", "sa: vertical share of the thrust"),
    Row("lagged_m_step2", "acceleration", "sc: that of the command behind dead time and quick lags"),
    Row("command_m_step2", "acceleration", "su: that of the last command"),
    Row("share", "factor", "c"),
    Row("thrust_m_s2", "thrust", "the last command, thrust over mass"),
    Row("commanded_m_s2", "thrust", "the same, whatever the motors were given", when=("guard",)),
    Row("budget_m_s2", "thrust", "b", when=("guard",)),
    Row("target_velocity_m_s", "velocity", "of the last step", when=("measured",)),
    Row("target_acceleration_m_step2", "acceleration", when=("tracker",)),
    Row("target_jerk_m_step2_update", "acceleration", when=("tracker",)),
    Row("target_noise", when=("doubts",), kind="noise"),
)

QUADRATIC: Final = (
    Row("observer", kind="observer"),
    Row("attitude", kind="attitude"),
    Row("tilt_gain", when=("tilt_gain",), kind="tilt_gain"),
    Row("tracker", when=("tracker",), kind="tracker"),
    Row("height", when=("height",), kind="height"),
    Row("bounds", when=("limits",), kind="bounds"),
    Row("tilt_rad", "angle", "roll and pitch of the last good state", "NMPC_ANGLES", ("feedback",)),
    Row("budget_rad", "angle", "b of roll and pitch", "NMPC_ANGLES", ("guard",)),
    Row("command_rad", "angle", "the last command", "NMPC_ANGLES"),
    Row("missed", words="control steps since the last good state", kind=BYTE),
    Row("has_target", words="1 once the tracker has seen a target", when=("tracker",), kind=BYTE),
    Row("limited", words="the limits that act, but NMPC_LIMIT_TILT", when=("limits",), kind=BYTE),
    Row("is_coarse", words="1 while no position is measured", when=("guard",), kind=BYTE),
)

ROLLOUT: Final = (
    Row("error_m", "error", "e = r - Tp, of eqs 9 and 11"),
    Row("displacement_m_step", "acceleration", "d: change of the error over the next prediction step"),
    Row("acceleration_m_step2", "acceleration", "A: tau^2 times eq 8{at_moves}{less_target}"),
    Row(
        "roll_deficit_m_step2",
        "acceleration",
        "D of roll: correction of A, because roll lags behind its move",
        when=("lag",),
    ),
    Row("pitch_deficit_m_step2", "acceleration", "D of pitch", when=("lag",)),
)

STEP_TRACKER: Final = (
    Row("velocity_m_s", "velocity", "Tv_k: of the last good step", 2, ("measured",)),
    Row("acceleration_m_step2", "acceleration", "A_T: tau^2 times the target's acceleration", 2),
    TRACKER[2],
)
"""The tracker in prediction steps."""

PREDICTION: Final = (
    Row(
        "gain_x_m_step2_rad",
        "gain",
        "tau^2 times the row of eq 8 for x: of roll, of pitch",
        "NMPC_ANGLES",
    ),
    Row("gain_y_m_step2_rad", "gain", "tau^2 times the row of eq 8 for y", "NMPC_ANGLES"),
    Row("tilt_rad", "angle", "before the first moves: {tilt}", "NMPC_ANGLES"),
    Row("x", words="the start of the roll-out along x", kind="rollout"),
    Row("y", words="the start of the roll-out along y", kind="rollout"),
)

ONE_NORM: Final = (
    Row("weights", words="lambda_1, lambda_2", kind="weights"),
    Row("prediction", kind="prediction"),
    Row("tracker", when=("tracker",), kind="tracker"),
    Row(
        "command_rad",
        "angle",
        "u*_k-1: the last {first_moves}, NMPC_UPDATE_PERIOD_S ago",
        "NMPC_ANGLES",
    ),
    Row(
        "sent_rad",
        "angle",
        "the last command: u*_k-1 and the rate feedback, limited",
        "NMPC_ANGLES",
        ("feedback",),
    ),
    Row("tilt_rad", "angle", "phi, theta of the last good step", "NMPC_ANGLES", ("feedback",)),
    Row("plan_rad", "angle", "u_k+i, i = 0 .. N_c - 1: the moves, tau apart", "NMPC_MOVES"),
    Row(
        "gradient",
        "gradient",
        "dJ/du, 1/rad, of the plan that the last iteration evaluated",
        "NMPC_MOVES",
        kind=SUM,
    ),
    Row("cost", "cost", "J, eq 12, of that plan", kind=SUM),
    Row("bounds", when=("limits",), kind="bounds"),
    Row("iterations", words="how many iterations updated the plan, at most I_max", kind=BYTE),
    Row("converged", words="1 once J changed by less than epsilon", kind=BYTE),
    Row("has_tilt", words="1 once tilt_rad is measured", when=("feedback",), kind=BYTE),
    Row("has_target", words="1 once the tracker has seen a target", when=("tracker",), kind=BYTE),
    Row(
        "missed",
        words="control steps since the last good state, at most NMPC_OUTAGE_STEPS",
        when=("limits",),
        kind=BYTE,
    ),
    Row("limited", words="the limits that act, but NMPC_LIMIT_TILT", when=("limits",), kind=BYTE),
)
