"""Members of the structures of nmpc.h, arrays by element, in the order of their numbers."""

from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.numbers.representation import PREVIEW_TIMES


def state_members(constants: Constants) -> tuple[str, ...]:
    """Return the members of nmpc_state_t."""
    level = (*_pairs("position_m", "velocity_m_s"), "roll_rad", "pitch_rad", "yaw_rad")
    return (*level, "height_m", "climb_m_s", "grounded") if constants.has_height else level


def target_members(constants: Constants) -> tuple[str, ...]:
    """Return the members of nmpc_target_t."""
    is_given = constants.settings.target.gives_acceleration
    level = _pairs("position_m", "velocity_m_s", *(("acceleration_m_s2",) if is_given else ()))
    upward = ("height_m", "climb_m_s", *(("climb_acceleration_m_s2",) if is_given else ()))
    times = range(PREVIEW_TIMES * constants.has_preview)
    ahead = (f"preview_m_s2[{time}][{axis}]" for time in times for axis in range(3))
    return (*level, *upward, *ahead) if constants.has_height else level


def limits_members(constants: Constants) -> tuple[str, ...]:
    """Return the members of nmpc_limits_t."""
    level = ("speed_m_s", "braking_m_s2", *_pairs("fence_min_m", "fence_max_m"), "tilt_rad")
    return (*level, "floor_m", "ceiling_m", "climb_m_s", "descent_m_s") if constants.has_height else level


def bounds_members(constants: Constants) -> dict[str, int]:
    """Return the members of nmpc_bounds_t, and how many numbers each holds."""
    is_given = constants.settings.target.gives_acceleration
    is_turning = constants.limiting is not None and constants.limiting.turn_m_s_rad is not None
    return {
        "centre_m": 2,
        "clear_m": 2,
        **dict.fromkeys(("margin_m", "knee_m", "near_m", "speed_m_s", "braking_m_s2", "tilt_rad"), 1),
        **({"command_m_step2": 2} if constants.settings.cost.norm == "quadratic" else {}),
        **({"velocity_m_s": 2} if is_given else {}),
        **({"target_m_s": 2, "turn_m2_s2": 1} if is_turning else {}),
        **(dict.fromkeys(("floor_m", "ceiling_m", "up_m", "down_m"), 1) if constants.has_height else {}),
    }


def _pairs(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}[{axis}]" for name in names for axis in range(2))
