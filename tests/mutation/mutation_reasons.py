"""Faults that change no bit, and why: a row for every mutant that survives."""

from collections.abc import Callable
from typing import Any, Final

from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings.model import Settings
from tests.mutation.reasons import Reason, reasons


def _steps_stay_short(settings: Settings) -> bool:
    """Whether no number of iterations makes a step reach the largest."""
    optimizer = settings.optimizer
    longest = optimizer.initial_step_rad * optimizer.increase ** (optimizer.iterations - 1)
    return longest < 0.99 * optimizer.step_max_rad


def _steps_stay_long(settings: Settings) -> bool:
    """Whether no number of iterations makes a step reach the smallest."""
    optimizer = settings.optimizer
    shortest = optimizer.initial_step_rad * optimizer.decrease ** (optimizer.iterations - 1)
    return shortest > 1.01 * optimizer.step_min_rad


def _is_fixed(settings: Settings) -> bool:
    return settings.code.scalar == "fixed"


def _axes_alike(settings: Settings) -> bool:
    return settings.model.roll_lag_s == settings.model.pitch_lag_s


def _tolerates_one(settings: Settings) -> bool:
    """Whether the tolerance of fixed point is more than one number of the cost."""
    numbers = OneNorm(settings).numbers
    return numbers.bits is not None and bool(numbers.constant(settings.optimizer.tolerance, "cost") > 1)


def _does_not_show(of: str, change: int) -> Callable[[Settings], bool]:
    """Tell whether a factor of fixed point, a number more or less, rounds to the same steps on all paths."""

    def holds(settings: Settings) -> bool:
        optimizer, products = settings.optimizer, OneNormArithmetic(OneNorm(settings))
        if settings.code.scalar != "fixed" or optimizer.iterations > _MOST_WALKED:
            return False
        constant = products.numbers.constant
        initial, largest, smallest = (
            constant(step, "angle")
            for step in (optimizer.initial_step_rad, optimizer.step_max_rad, optimizer.step_min_rad)
        )
        factors = {name: constant(getattr(optimizer, name), "factor") for name in ("increase", "decrease")}

        def walked(increase: Any, decrease: Any) -> list[Any]:
            steps = [initial]
            for _ in range(optimizer.iterations - 1):
                longer = [min(products.step_product(step, increase), largest) for step in steps]
                shorter = [max(products.step_product(step, decrease), smallest) for step in steps]
                steps = [*steps, *longer, *shorter]
            return steps

        return walked(**factors) == walked(**factors | {of: factors[of] + change})

    return holds


_CONFIG: Final = "nmpc.h"
_MOST_WALKED: Final = 8
"""Iterations up to which every path of step sizes is walked: three ways on from each."""

_STEPS: Final = "with these settings no step grows or shrinks that far in the iterations there are"
_EQUAL: Final = "of two equal numbers either may be taken; a limit is never zero, of which there are two"
_REFUSED: Final = "saturation value: no range contains it, its neighbours or -2^31"
_PROVEN: Final = "not read before it is written again; it is written so that the proof need not know why"
_TERMS: Final = "the table grows by a zero, and a polynomial by a term of zero, which changes no bit"
_PARTS: Final = "the counter bounds the loop for static analysis; the sign changes run out first"
_FAINT: Final = (
    "not the same, but without effect: a gradient is a single number, 4e-9 or less, only if products of "
    "weights and slopes a million times as large cancel to that"
)
_FINER: Final = (
    "not the same, but without effect: it changes the product by at most a thousandth of a number of the "
    "acceleration, 3e-11 m, of which 64 are one of an error"
)
_ROUNDED: Final = "rounds to the same steps on every path that the iterations there are can take"

_ABSOLUTE: Final = "return (value < (nmpc_sum_t)0) ? -value : value;"
_SIGN: Final = "return (value > (nmpc_sum_t)0) ? 1 : ((value < (nmpc_sum_t)0) ? -1 : 0);"
_MAGNITUDE: Final = "#define NMPC_MAGNITUDE_BITS(value) ((bits_of(value) & 0x7FFFFFFFUL) << 1)"
_CHANGES: Final = "for (count = 1; (changes != 0U) && (count < NMPC_HORIZON_PREDICTION); count++) {"
_STEP_MAX: Final = "#define NMPC_STEP_MAX_RAD <{}> /* Delta_max, Table I */"
_STEP_MIN: Final = "#define NMPC_STEP_MIN_RAD <{}> /* Delta_min, Table I */"
_CLAMP: Final = "return (value > limit) ? limit : ((value < -limit) ? -limit : value);"
_NEAREST: Final = ("one more", "one less")

_TURN: Final = "nmpc_slew_heading: "
_SLEWS: Final = (
    (
        "if ((within(wanted_rad, NMPC_YAW_RANGE_RAD) == 0) || !(most_change_rad > (nmpc_real_t)0)) {",
        "a most change of 0 changes nothing",
        ("> -> >=",),
    ),
    ("if (change_rad > most_change_rad) {", "equal numbers are alike", ("> -> >=",)),
    ("} else if (change_rad < -most_change_rad) {", "equal numbers are alike", ("< -> <=",)),
    (
        "return (nmpc_real_t)((next_rad > NMPC_YAW_RANGE_RAD) ? NMPC_YAW_RANGE_RAD",
        "the clamp is for the proof",
        ("> -> >=",),
    ),
    (
        ": ((next_rad < -NMPC_YAW_RANGE_RAD) ? -NMPC_YAW_RANGE_RAD : next_rad));",
        "the clamp is for the proof",
        ("< -> <=", "- -> #1"),
    ),
)

REASONS: Final[tuple[Reason, ...]] = (
    *(reason for line, why, changes in _SLEWS for reason in reasons("nmpc.c", line, _TURN + why, *changes)),
    *reasons(
        "nmpc.c",
        _SLEWS[0][0],
        "the least number more than -1 is 0, which changes nothing",
        "0 -> (-1) #1",
        holds=_is_fixed,
    ),
    *reasons(
        "nmpc.c",
        "change_rad = change_rad - ((((change_rad * <real>) + NMPC_ROUNDING) - NMPC_ROUNDING) * turn_rad);",
        "the nearest whole number of turns is the same",
        "next number",
        holds=lambda settings: not _is_fixed(settings),
    ),
    *reasons("nmpc.c", _CHANGES, _PARTS, "1 -> 0", "1 -> 2", "< -> <=", "++ -> --"),
    *reasons(
        "nmpc.c",
        "clamped = (value < (nmpc_real_t)0) ? -limit : limit;",
        "a value beyond a limit is not 0",
        "< -> <=",
        holds=lambda settings: not _is_fixed(settings),
    ),
    *reasons("nmpc.c", _SIGN, _FAINT, "0 -> 1", "0 -> (-1) #1", holds=_is_fixed),
    *reasons("nmpc.c", _SIGN, "only the sign of a slope or direction is read", "1 -> 2", "1 -> 2 #1"),
    *(
        Reason(
            "nmpc.c",
            f"rollout->{axis}_deficit_m_step2 = (nmpc_real_t)0;",
            "left out",
            "nmpc_init() has written the same, and nothing else is ever written there",
        )
        for axis in ("roll", "pitch")
    ),
    *reasons("nmpc.c", "rprop[k].previous_rad = self->plan_rad[k];", _PROVEN, "left out"),
    *reasons(_CONFIG, _STEP_MAX.format("real"), _STEPS, "next number", holds=_steps_stay_short),
    *reasons(_CONFIG, _STEP_MIN.format("real"), _STEPS, "next number", "negative", holds=_steps_stay_long),
    *reasons(_CONFIG, _STEP_MAX.format("number"), _STEPS, *_NEAREST, holds=_steps_stay_short),
    *reasons(_CONFIG, _STEP_MIN.format("number"), _STEPS, *_NEAREST, holds=_steps_stay_long),
    *(
        Reason(
            _CONFIG,
            f"#define NMPC_{factor.upper()} <number> /* {symbol}, Table I */",
            what,
            _ROUNDED,
            _does_not_show(factor, change),
        )
        for factor, symbol in (("increase", "eta+"), ("decrease", "eta-"))
        for what, change in (("one more", 1), ("one less", -1))
    ),
    *reasons(
        "nmpc.c",
        _ABSOLUTE,
        "a cost that falls by one number has converged either way",
        "0 -> (-1)",
        holds=_tolerates_one,
    ),
    *reasons("nmpc.c", _ABSOLUTE, "zero negated is zero", "< -> <=", holds=_is_fixed),
    *reasons("nmpc.c", "nmpc_real_t number = <number>;", _REFUSED, *_NEAREST),
    *reasons(
        "nmpc.c",
        "if ((scaled > -NMPC_NUMBERS_END) && (scaled < NMPC_NUMBERS_END)) {",
        _REFUSED,
        "> -> >=",
    ),
    *reasons(
        "nmpc.c",
        "status = nmpc_step(self, NULL, NULL, 0, &fixed_command);",
        "null pointers are refused before the thrust is read",
        "0 -> 1",
        "0 -> (-1)",
    ),
    *reasons("nmpc.c", _CLAMP, _EQUAL, "> -> >=", "< -> <="),
    *reasons("nmpc.c", "return (a < b) ? a : b;", _EQUAL, "< -> <="),
    *reasons("nmpc.c", "return (a > b) ? a : b;", _EQUAL, "> -> >="),
    *(
        Reason("nmpc.c", f"#define NMPC_{series}_TERMS {terms}", f"{terms} -> {terms + 1}", _TERMS)
        for series, terms in (("SINE", 3), ("COSINE", 3), ("COSINE", 4), ("SINE", 8), ("COSINE", 8))
    ),
    *reasons(
        "nmpc.c",
        "#define NMPC_RESPONSES (NMPC_MOVES / NMPC_ANGLES_PER_RESPONSE)",
        "a wider table, whose further columns nobody reads",
        "/ -> *",
        holds=_axes_alike,
    ),
    Reason("nmpc.c", _MAGNITUDE, "1 -> 0", "both sides of a comparison are shifted alike"),
    Reason(
        "nmpc.c",
        _MAGNITUDE,
        "1 -> 2",
        "no bit is lost, since an unsigned long of this computer has 64; of 32, the largest numbers would be",
    ),
    *reasons("nmpc.c", "self->has_target = 1U;", "only 0 means none", "1U -> 2U"),
    *(
        Reason("nmpc.c", f"#define NMPC_{line}", "one less", _FINER, _is_fixed)
        for line in (
            "STEP_SQUARED_PER_UPDATE_S <number> /* tau^2/T_s */",
            "TRACKER_GAIN <number> /* alpha */",
            "TRACKER_JERK_GAIN <number> /* beta */",
        )
    ),
)
