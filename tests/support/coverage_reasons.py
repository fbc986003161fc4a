"""Lines and branches of the generated C that no input reaches, and why."""

from typing import Final

from mambo_nmpc.codegen.settings.model import Settings
from tests.support.reasons import Reason

_SELF_TEST: Final = (
    "a build that computes the bits of the reference passes its self-test: it never finds a difference"
)


def _has_one_move(settings: Settings) -> bool:
    return settings.horizon.control == 1


REASONS: Final[tuple[Reason, ...]] = (
    *(
        Reason("src/nmpc_self_test.c", line, what, _SELF_TEST)
        for line, what in (
            ("if ((first_difference == 0)", "branch 1 never taken"),
            (
                "&& !((status == expected->status) && (command.roll_rad == expected->command.roll_rad)",
                "branch 1 never taken",
            ),
            (
                "&& !((status == expected->status) && (command.roll_rad == expected->command.roll_rad)",
                "branch 3 never taken",
            ),
            ("&& (command.pitch_rad == expected->command.pitch_rad)", "branch 1 never taken"),
            ("&& (nmpc_last_cost(scratch) == expected->cost)", "branch 1 never taken"),
            ("&& (scratch->gradient[0] == expected->gradient[0])", "branch 1 never taken"),
            ("&& (scratch->gradient[1] == expected->gradient[1]))) {", "branch 0 never taken"),
            ("first_difference = i + 1;", "never run"),
        )
    ),
    Reason(
        "src/nmpc_cost.c",
        "for (count = 1; (changes != 0U) && (count < NMPC_PREDICTION_HORIZON); count++) {",
        "branch 3 never taken",
        "the count bounds the loop for all to see; changes of sign run out before",
    ),
    Reason(
        "src/nmpc_predictor.h",
        "const nmpc_real_t *previous_rad = (i > 0) ? &moves_rad[NMPC_AXES * (i - 1)] : prediction->tilt_rad;",
        "branch 0 never taken",
        "with one move in the control horizon none follows another",
        _has_one_move,
    ),
)
