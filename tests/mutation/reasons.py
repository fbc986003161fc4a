"""Exceptions of the coverage and mutation tests: why a line cannot run, or why a fault changes no bit.

A table has, below the name of each source file, a row for a line of it: the line, the reason, and the faults
or branches, with ` @@ ` between. A reason that begins with `if NAME: ` holds under that condition only.
"""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from mambo_codegen.methods.one_norm.arithmetic import OneNormArithmetic
from mambo_codegen.methods.one_norm.method import OneNorm
from mambo_codegen.settings.model import Settings

Key = tuple[str, str, str]
"""File, line, and what happens there, spelled by `plain`, so that the key stays valid when the line moves."""


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
    "is_searched": lambda settings: settings.controller.method == "1-norm",
    "is_solved": lambda settings: settings.controller.method == "quadratic",
    "is_single_move": lambda settings: settings.horizon.control == 1,
    "is_slow": lambda settings: settings.horizon.update_period_s > 0.33,
}
"""Settings for which a reason holds, by the names that tables have."""


def is_explained(key: Key, reasons: Mapping[Key, str], settings: Settings) -> bool:
    """Whether a reason for `key` holds for these settings."""
    condition = re.match(r"if (\w+): ", reasons.get(key, ""))
    return key in reasons and (condition is None or CONDITIONS[condition[1]](settings))


def plain(text: str) -> str:
    """Return `text` on one line, without reals and integers from 100 on: those may come from the settings."""
    without_reals = re.sub(r"-?\b\d+\.\d*(e[-+]?\d+)?f?|-?\b\d+e-?\d+f?", "<real>", text)
    return " ".join(re.sub(r"\b\d{3,}\b", "<number>", without_reals).split())


def survivors(name: str) -> dict[Key, str]:
    """Return the reasons of a table in this folder."""
    found, source = dict[Key, str](), ""
    for row in Path(__file__).with_name(name).read_text("utf-8").splitlines():
        line, *reason_and_faults = row.split(" @@ ")
        if reason_and_faults:
            reason, *faults = reason_and_faults
            found |= {(source, line, fault): reason for fault in faults}
        else:
            source = row
    return found
