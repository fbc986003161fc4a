"""Lines and branches of the generated C that no input reaches, and why."""

from typing import Final

from mambo_codegen.settings.model import Settings
from tests.mutation.reasons import Reason, reasons

_SELF_TEST: Final = (
    "a build that computes the bits of the reference passes its self-test: it never finds a difference"
)
_STATUS_AND_ROLL: Final = (
    "&& !((status == expected->status) && (command.roll_rad == expected->command.roll_rad)"
)
_FILE: Final = "nmpc_self_test.c"
_THRUST: Final = (
    "the thrusts of the self-test, within 3 m/s^2 of hover, are in range; other settings limit them"
)


def _has_room_for_thrust(settings: Settings) -> bool:
    ranges = settings.ranges
    return ranges.thrust_acceleration_min_m_s2 < 6.8 and ranges.thrust_acceleration_max_m_s2 > 12.9


_ROUNDING: Final = "the clamp tells a proof by intervals what holds but for rounding, which no case meets"

REASONS: Final[tuple[Reason, ...]] = (
    *reasons(
        "nmpc.c",
        "return (nmpc_real_t)((next_rad > NMPC_YAW_RANGE_RAD) ? NMPC_YAW_RANGE_RAD",
        _ROUNDING,
        *(f"branch {branch} never taken" for branch in range(4)),
    ),
    *reasons(_FILE, _STATUS_AND_ROLL, _SELF_TEST, "branch 1 never taken", "branch 3 never taken"),
    *(
        Reason(_FILE, line, what, _SELF_TEST)
        for line, what in (
            ("if ((first_difference == 0)", "branch 1 never taken"),
            ("&& (command.pitch_rad == expected->command.pitch_rad)", "branch 1 never taken"),
            ("&& (nmpc_last_cost(scratch) == expected->cost)", "branch 1 never taken"),
            ("&& (scratch->gradient[0] == expected->gradient[0])", "branch 1 never taken"),
            ("&& (scratch->gradient[1] == expected->gradient[1]))) {", "branch 0 never taken"),
            ("first_difference = i + 1;", "never run"),
        )
    ),
    *(
        Reason(_FILE, line, what, _THRUST, _has_room_for_thrust)
        for line, what in (
            ("if (thrust_m_s2 < NMPC_THRUST_ACCELERATION_MIN_M_S2) {", "branch 0 never taken"),
            ("thrust_m_s2 = NMPC_THRUST_ACCELERATION_MIN_M_S2;", "never run"),
            ("} else if (thrust_m_s2 > NMPC_THRUST_ACCELERATION_MAX_M_S2) {", "branch 0 never taken"),
            ("thrust_m_s2 = NMPC_THRUST_ACCELERATION_MAX_M_S2;", "never run"),
        )
    ),
    *reasons(
        "nmpc.c",
        "for (count = 1; (changes != 0U) && (count < NMPC_HORIZON_PREDICTION); count++) {",
        "the counter bounds the loop for static analysis; the sign changes run out first",
        "branch 3 never taken",
    ),
    *reasons(
        "nmpc.c",
        "const nmpc_real_t *previous_rad = "
        "(i > 0) ? &moves_rad[NMPC_ANGLES * (i - 1)] : prediction->tilt_rad;",
        "with one move in the control horizon none follows another",
        "branch 0 never taken",
        holds=lambda settings: settings.horizon.control == 1,
    ),
    *reasons(
        "nmpc.c",
        "if ((size_m2_s2 > most_m2_s2) && (size_m2_s2 > NMPC_LEAST_TURN_M2_S2)) {",
        "a turn that is too hard for a drone is larger than the least one, whose square has a root",
        "branch 3 never taken",
    ),
    *reasons(
        "nmpc.c",
        "if (self->missed == NMPC_OUTAGE_STEPS) {",
        "an outage of one control step is over at once",
        "branch 1 never taken",
        holds=lambda settings: settings.horizon.update_period_s > 0.33,
    ),
)
