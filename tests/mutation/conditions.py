"""Settings for which a reason holds: tables of reasons name these conditions."""

from collections.abc import Callable
from typing import Any, Final

from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings.model import Settings

MOST_WALKED: Final = 8
"""Iterations up to which every path of step sizes is walked: three ways on from each."""


def steps_stay_short(settings: Settings) -> bool:
    """Whether no number of iterations makes a step reach the largest."""
    optimizer = settings.optimizer
    longest = optimizer.initial_step_rad * optimizer.increase ** (optimizer.iterations - 1)
    return longest < 0.99 * optimizer.step_max_rad


def steps_stay_long(settings: Settings) -> bool:
    """Whether no number of iterations makes a step reach the smallest."""
    optimizer = settings.optimizer
    shortest = optimizer.initial_step_rad * optimizer.decrease ** (optimizer.iterations - 1)
    return shortest > 1.01 * optimizer.step_min_rad


def is_fixed(settings: Settings) -> bool:
    """Whether the numbers are whole."""
    return settings.code.scalar == "fixed"


def axes_alike(settings: Settings) -> bool:
    """Whether roll and pitch have the same lag."""
    return settings.model.roll_lag_s == settings.model.pitch_lag_s


def tolerates_one(settings: Settings) -> bool:
    """Whether the tolerance of fixed point is more than one number of the cost."""
    numbers = OneNorm(settings).numbers
    return numbers.bits is not None and bool(numbers.constant(settings.optimizer.tolerance, "cost") > 1)


def rounds(of: str, change: int) -> Callable[[Settings], bool]:
    """Tell whether a factor of fixed point, a number more or less, rounds to the same steps on all paths."""

    def holds(settings: Settings) -> bool:
        optimizer, products = settings.optimizer, OneNormArithmetic(OneNorm(settings))
        if settings.code.scalar != "fixed" or optimizer.iterations > MOST_WALKED:
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


def has_room_for_thrust(settings: Settings) -> bool:
    """Whether the thrusts of the self-test are in range."""
    ranges = settings.ranges
    return ranges.thrust_acceleration_min_m_s2 < 6.8 and ranges.thrust_acceleration_max_m_s2 > 12.9


CONDITIONS: Final[dict[str, Callable[[Settings], bool]]] = {
    "steps_stay_short": steps_stay_short,
    "steps_stay_long": steps_stay_long,
    "is_fixed": is_fixed,
    "is_float": lambda settings: not is_fixed(settings),
    "axes_alike": axes_alike,
    "tolerates_one": tolerates_one,
    **{
        f"{factor}_{way}_rounds": rounds(factor, change)
        for factor in ("increase", "decrease")
        for way, change in (("up", 1), ("down", -1))
    },
    "has_room_for_thrust": has_room_for_thrust,
    "is_single_move": lambda settings: settings.horizon.control == 1,
    "is_slow": lambda settings: settings.horizon.update_period_s > 0.33,
}
