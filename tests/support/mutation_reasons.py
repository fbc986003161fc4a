"""Faults that change no bit, and why: a row for every mutant that survives."""

from collections.abc import Callable
from typing import Any, Final

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.reference.arithmetic import arithmetic
from mambo_nmpc.codegen.settings.model import Settings
from tests.support.reasons import Reason


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


def _is_float32(settings: Settings) -> bool:
    return settings.code.scalar == "float32"


def _is_float64(settings: Settings) -> bool:
    return settings.code.scalar == "float64"


def _is_fixed(settings: Settings) -> bool:
    return settings.code.scalar == "fixed"


def _axes_alike(settings: Settings) -> bool:
    return settings.model.roll_lag_s == settings.model.pitch_lag_s


def _tolerates_one(settings: Settings) -> bool:
    """Whether the tolerance of fixed point is more than one number of the cost."""
    numbers = Design(settings).numbers
    return numbers.bits is not None and bool(numbers.constant(settings.optimizer.tolerance, "cost") > 1)


def _does_not_show(of: str, change: int) -> Callable[[Settings], bool]:
    """Tell whether a factor of fixed point, a number more or less, rounds to the same steps on all paths."""

    def holds(settings: Settings) -> bool:
        optimizer, products = settings.optimizer, arithmetic(Design(settings))
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


_MOST_WALKED: Final = 8
"""Iterations up to which every path of step sizes is walked: three ways on from each."""

_STEPS: Final = "with these settings no step grows or shrinks that far in the iterations there are"
_EQUAL: Final = "of two equal numbers either may be taken; a limit is never zero, of which there are two"
_REFUSED: Final = "stands for what no format holds; no range contains it, nor its neighbour, nor -2^31"
_SIGN: Final = "of a slope and of a direction only the sign is read"
_THIRD: Final = (
    "not the same, and out of sight: the third part, 3.5e-27, changes a sine that is nearly zero, and every "
    "outcome adds a multiple of the cosine to that"
)
_PROVEN: Final = (
    "never read before it is written again; written all the same, so that a proof need not know why"
)
_TERMS: Final = "the table grows by a zero, and a polynomial by a term of zero, which changes no bit"

_PARTS: Final = (
    "the count bounds the loop for all to see; errors change their sign less often, and so end it first"
)
_FAINT: Final = (
    "not the same, and out of sight: no gradient is a single number, 4e-9 or less, unless products of "
    "weights and slopes a million times as large cancel to that"
)

REASONS: Final[tuple[Reason, ...]] = (
    *(
        Reason(
            "src/nmpc_cost.c",
            "for (count = 1; (changes != 0U) && (count < NMPC_PREDICTION_HORIZON); count++) {",
            what,
            _PARTS,
        )
        for what in ("1 -> 0", "1 -> 2", "< -> <=", "++ -> --")
    ),
    *(
        Reason(
            "src/nmpc_math.h",
            "return (value > (nmpc_sum_t)0) ? 1 : ((value < (nmpc_sum_t)0) ? -1 : 0);",
            what,
            _FAINT,
            _is_fixed,
        )
        for what in ("0 -> 1", "0 -> (-1) #1")
    ),
    *(
        Reason(
            "src/nmpc_predictor.c",
            f"rollout->{axis}_deficit_m_step2 = (nmpc_real_t)0;",
            "left out",
            "nmpc_init() has written the same, and nothing else is ever written there",
        )
        for axis in ("roll", "pitch")
    ),
    Reason("src/nmpc_optimizer.c", "rprop[k].previous_rad = self->plan_rad[k];", "left out", _PROVEN),
    Reason(
        "include/nmpc_config.h",
        "#define NMPC_STEP_MAX_RAD <real> /* Delta_max, Table I */",
        "next number",
        _STEPS,
        _steps_stay_short,
    ),
    *(
        Reason(
            "include/nmpc_config.h",
            "#define NMPC_STEP_MIN_RAD <real> /* Delta_min, Table I */",
            what,
            _STEPS,
            _steps_stay_long,
        )
        for what in ("next number", "negative")
    ),
    *(
        Reason(
            "include/nmpc_config.h",
            f"#define NMPC_STEP_{end}_RAD <number> /* Delta_{end.lower()}, Table I */",
            what,
            _STEPS,
            holds,
        )
        for end, holds in (("MAX", _steps_stay_short), ("MIN", _steps_stay_long))
        for what in ("one more", "one less")
    ),
    *(
        Reason(
            "include/nmpc_config.h",
            f"#define NMPC_{factor.upper()} <number> /* {symbol}, Table I */",
            what,
            "rounds to the same steps, on every path that the iterations there are can take",
            _does_not_show(factor, change),
        )
        for factor, symbol in (("increase", "eta+"), ("decrease", "eta-"))
        for what, change in (("one more", 1), ("one less", -1))
    ),
    Reason(
        "src/nmpc_math.h",
        "return (value < (nmpc_sum_t)0) ? -value : value;",
        "0 -> (-1)",
        "a cost that falls by one number is at rest either way",
        _tolerates_one,
    ),
    *(
        Reason("src/nmpc_float.c", "nmpc_real_t number = <number>;", what, _REFUSED)
        for what in ("one more", "one less")
    ),
    Reason(
        "src/nmpc_float.c",
        "if ((scaled > -NMPC_NUMBERS_END) && (scaled < NMPC_NUMBERS_END)) {",
        "> -> >=",
        _REFUSED,
    ),
    *(
        Reason(
            "src/nmpc_float.c",
            "status = nmpc_step(self, NULL, NULL, 0, &fixed_command);",
            what,
            "null pointers are refused before the thrust is looked at",
        )
        for what in ("0 -> 1", "0 -> (-1)")
    ),
    Reason(
        "src/nmpc_math.h",
        "return (value < (nmpc_sum_t)0) ? -value : value;",
        "< -> <=",
        "zero negated is zero",
        _is_fixed,
    ),
    *(
        Reason(
            "src/nmpc_math.h",
            "return (value > (nmpc_sum_t)0) ? 1 : ((value < (nmpc_sum_t)0) ? -1 : 0);",
            what,
            _SIGN,
        )
        for what in ("1 -> 2", "1 -> 2 #1")
    ),
    Reason("src/nmpc_math.h", "return (a < b) ? a : b;", "< -> <=", _EQUAL),
    Reason("src/nmpc_math.h", "return (a > b) ? a : b;", "> -> >=", _EQUAL),
    *(
        Reason("src/nmpc_math.c", f"#define NMPC_{series}_TERMS {terms}", f"{terms} -> {terms + 1}", _TERMS)
        for series, terms in (("SINE", 4), ("COSINE", 5), ("SINE", 8), ("COSINE", 8))
    ),
    Reason(
        "src/nmpc_math.c",
        "const int quadrant = (int)(turns + ((turns < (nmpc_real_t)0) ? -half : half));",
        "< -> <=",
        "no turn at all, less or more a half, is quadrant 0 either way",
    ),
    *(
        Reason("src/nmpc_math.c", line, what, _THIRD, _is_float64)
        for line, what in (
            ("<real>, <real>, <real>", "negative #2"),
            ("<real>, <real>, <real>", "a thousandth more #2"),
            ("- (count * quarter_turn_rad[2]);", "- -> +"),
        )
    ),
    Reason(
        "src/nmpc_predictor.h",
        "#define NMPC_RESPONSES (NMPC_MOVES / NMPC_AXES_PER_RESPONSE)",
        "/ -> *",
        "a wider table, whose further columns nobody reads",
        _axes_alike,
    ),
    Reason(
        "src/nmpc_math.c",
        "const nmpc_real_t half = <real>;",
        "next number",
        "of all float32 numbers in range, tried one by one, only +-0.78539807 falls into another quadrant; "
        "its sine and cosine have the same bits in both",
        _is_float32,
    ),
)
