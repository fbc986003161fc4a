"""The parts of a controller that chapters common to all methods ask for, by the names of their conditions."""

from mambo_codegen.methods.shared.constants import Constants


def common_parts(constants: Constants) -> dict[str, bool]:
    """Return which parts there are."""
    limiting, tracker, settings = constants.limiting, constants.tracker, constants.settings
    return {
        "WITH_BRAKING_TRIM": limiting is not None and limiting.tilted.trim_m_s2 != 0,
        "WITH_DOUBTS": tracker is not None and tracker.noise is not None,
        "WITH_DOUBLE": settings.code.scalar == "float64",
        "WITH_FEEDBACK": constants.feedback_steps is not None,
        "WITH_FIXED": constants.numbers.formats is not None,
        "WITH_GIVEN": settings.target.gives_acceleration,
        "WITH_HEIGHT": constants.has_height,
        "WITH_LIMITS": limiting is not None,
        "WITH_TRACKER": tracker is not None,
        "WITH_TURNING": limiting is not None and limiting.turn_m_s_rad is not None,
    }
