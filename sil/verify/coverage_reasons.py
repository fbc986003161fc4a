"""Lines and branches of the generated C that no input reaches, and why."""

from typing import Final

from codegen.settings import Settings
from sil.verify.reasons import Reason

_SELF_TEST: Final = (
    "a build that computes the bits of the reference passes its self-test: it never finds a difference"
)

_ONE_MOVE: Final = "with one move in the control horizon none follows another"


def _has_one_move(settings: Settings) -> bool:
    return settings.horizon.control == 1


REASONS: Final[tuple[Reason, ...]] = tuple(
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
) + tuple(
    Reason(file, line, what, _ONE_MOVE, _has_one_move)
    for file, line, what in (
        (
            "src/nmpc_cost.c",
            "const nmpc_real_t before_rad = (k < NMPC_AXES) ? last_rad[k] : moves_rad[k - NMPC_AXES];",
            "branch 1 never taken",
        ),
        ("src/nmpc_cost.c", "if (k >= NMPC_AXES) {", "branch 0 never taken"),
        (
            "src/nmpc_cost.c",
            "gradient[k - NMPC_AXES] = gradient[k - NMPC_AXES] - effort;",
            "never run",
        ),
        (
            "src/nmpc_predictor.h",
            "const nmpc_real_t *before_rad = "
            "(i > 0) ? &moves_rad[NMPC_AXES * (i - 1)] : prediction->tilt_rad;",
            "branch 0 never taken",
        ),
    )
)
