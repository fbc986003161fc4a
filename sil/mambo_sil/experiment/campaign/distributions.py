"""The distributions that a campaign draws from, each as its quantile function.

A quantile function maps one uniform random number to one draw. Every parameter uses exactly one number of its
flight's stream, so changing the distribution of one parameter does not change the draws of the others.

Exponential, logarithm and the normal distribution come from `decimal` and are rounded once: a C
library's differ between processors.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import Decimal, localcontext
from pathlib import Path
from statistics import NormalDist
from typing import Any, Final, Literal

Kind = Literal["constant", "uniform", "log_uniform", "normal", "choice"]

_SHAPES: Final = (
    "a number, { uniform = [low, high] }, { log_uniform = [low, high] }, { normal = [mean, deviation] } "
    "or { choice = [value, ...] }"
)
_MOST_CHOICES: Final = 1000
_DIGITS: Final = 40
_ROOT_TWO_PI: Final = Decimal("2.506628274631000502415765284811045253006986740609938")
_FARTHEST: Final = 9
"""Deviations from the mean beyond which less than `_LEAST_SHARE` of a normal distribution lies."""
_LEAST_SHARE: Final = Decimal("1e-16")


@dataclass(frozen=True)
class Domain:
    """Admissible values of a parameter: `low` to `high`, whole numbers only if `whole`.

    With `names` the values are these names, each represented by its index.
    """

    low: float
    high: float
    whole: bool = False
    names: tuple[str, ...] = ()
    is_file: Callable[[str], bool] | None = None
    """Whether a name that is not among these names a file, which is as good."""

    @classmethod
    def of_names(cls, names: tuple[str, ...], is_file: Callable[[str], bool] | None = None) -> "Domain":
        """Return the domain of names."""
        return cls(0, len(names) - 1, whole=True, names=names, is_file=is_file)

    def value(self, number: float) -> float | str:
        """Return the value that `number` represents: a name, a whole number, or itself."""
        if self.names:
            return self.names[int(number)]
        return int(number) if self.whole else number


@dataclass(frozen=True)
class Distribution:
    """One distribution within a domain.

    `numbers` holds the value of a constant, the limits of a uniform or log-uniform distribution, mean and
    standard deviation of a normal one, or the values of a choice. A normal distribution is truncated at the
    limits of the domain.
    """

    kind: Kind
    numbers: tuple[float, ...]
    domain: Domain

    def quantile(self, share: float) -> float:
        """Return the quantile of `share` in [0, 1): the value below which that share of all draws lies."""
        numbers = self.numbers
        match self.kind:
            case "constant":
                return numbers[0]
            case "uniform":
                return numbers[0] + share * (numbers[1] - numbers[0])
            case "log_uniform":
                with localcontext() as context:
                    context.prec = _DIGITS
                    low, high = (Decimal(number) for number in numbers)
                    return float(low * (Decimal(share) * (high / low).ln()).exp())
            case "normal":
                return self._normal_quantile(share)
            case "choice":
                return numbers[int(share * len(numbers))]

    def _normal_quantile(self, share: float) -> float:
        mean, deviation = self.numbers
        if deviation == 0.0:
            return mean
        domain = self.domain
        with localcontext() as context:
            context.prec = _DIGITS
            below, above = (
                _share_below((Decimal(limit) - Decimal(mean)) / Decimal(deviation))
                for limit in (domain.low, domain.high)
            )
            inner = below + Decimal(share) * (above - below)
            quantile = _standard_quantile(min(max(inner, _LEAST_SHARE), 1 - _LEAST_SHARE))
        return min(max(mean + deviation * quantile, domain.low), domain.high)

    def document(self) -> float | str | dict[str, list[Any]]:
        """Return the distribution as written in campaign.toml."""
        names = self.domain.names
        numbers: list[Any] = [names[int(one)] for one in self.numbers] if names else list(self.numbers)
        return numbers[0] if self.kind == "constant" else {self.kind: numbers}

    def text(self) -> str:
        """Return the distribution in words, as in "1", "1 .. 2" or "circle or step"."""
        names = [Path(name).name for name in self.domain.names]
        words = [names[int(one)] if names else f"{one:g}" for one in self.numbers]
        match self.kind:
            case "choice":
                return " or ".join(words)
            case "normal":
                return f"{words[0]} +- {words[1]}"
            case _:
                return " .. ".join(words)


def _density(z: Decimal) -> Decimal:
    """Return the density of the standard normal distribution, in the precision of the context."""
    return (-z * z / 2).exp() / _ROOT_TWO_PI


def _share_below(z: Decimal) -> Decimal:
    """Return the share of the standard normal distribution below z, in the precision of the context.

    It is 1/2 + density * (z + z^3/3 + z^5/(3 * 5) + ...).
    """
    if abs(z) > _FARTHEST:
        return Decimal(int(z > 0))
    total, term, odd = Decimal(0), z, 1
    while total + term != total:
        total, odd = total + term, odd + 2
        term = term * z * z / odd
    return Decimal("0.5") + _density(z) * total


def _standard_quantile(share: Decimal) -> float:
    """Return the quantile of the standard normal distribution, rounded once.

    Two steps of Newton's method improve a float64, whatever its last bits, beyond the digits of the result.
    The upper half mirrors the lower one: a float64 near 1 has too few digits of what it lacks to 1.
    """
    if share > Decimal("0.5"):
        return -_standard_quantile(1 - share)
    z = Decimal(NormalDist().inv_cdf(float(share)))
    for _ in range(2):
        z -= (_share_below(z) - share) / _density(z)
    return float(z)


def parse(value: Any, domain: Domain) -> Distribution:
    """Return the distribution written as `value` in campaign.toml; raises ValueError, "must ..."."""
    if domain.names:
        return _parse_names(value, domain)
    match value:
        case dict() if len(value) == 1:
            ((kind, numbers),) = value.items()
        case bool() | dict() | list() | str():
            raise ValueError(f"must be {_SHAPES}")
        case _:
            kind, numbers = "constant", [value]
    wrong = not isinstance(numbers, list) or not all(
        isinstance(number, int | float) and not isinstance(number, bool) for number in numbers
    )
    if wrong or kind not in ("constant", "uniform", "log_uniform", "normal", "choice"):
        raise ValueError(f"must be {_SHAPES}")
    for rule in _broken_rules(kind, numbers, domain):
        raise ValueError(rule)
    return Distribution(kind, tuple(float(number) for number in numbers), domain)


def _parse_names(value: Any, domain: Domain) -> Distribution:
    """Return the distribution over names written as `value`; raises ValueError, "must ..."."""
    match value:
        case {"choice": [*chosen]} if len(value) == 1 and 1 <= len(chosen) <= _MOST_CHOICES:
            kind: Kind = "choice"
        case _:
            kind, chosen = "constant", [value]
    is_file = domain.is_file or (lambda _: False)
    if not all(isinstance(one, str) and (one in domain.names or is_file(one)) for one in chosen):
        forms = ", ".join((*domain.names, *(("FILE.csv", "FILE.py:CLASS") if domain.is_file else ())))
        raise ValueError(f"must be one of {forms}, or {{ choice = [name, ...] }} of them")
    domain = Domain.of_names(tuple(dict.fromkeys((*domain.names, *chosen))), domain.is_file)
    return Distribution(kind, tuple(float(domain.names.index(one)) for one in chosen), domain)


def _broken_rules(kind: str, numbers: list[float], domain: Domain) -> Iterator[str]:
    """Yield the rules that the numbers of this kind of distribution break; a rule assumes those before it."""
    if kind == "choice" and not 1 <= len(numbers) <= _MOST_CHOICES:
        yield f"must have 1 to {_MOST_CHOICES} values to choose from"
    if kind in ("uniform", "log_uniform", "normal") and len(numbers) != 2:
        yield f"must have two numbers: {_SHAPES}"
    within = numbers[:1] if kind == "normal" else numbers
    if not all(domain.low <= number <= domain.high for number in within):
        yield f"must lie in {domain.low:g}..{domain.high:g}"
    if domain.whole and any(number != int(number) for number in within):
        yield "must be whole numbers"
    if domain.whole and kind not in ("constant", "choice"):
        yield "must be a whole number or { choice = [value, ...] } of them"
    if kind in ("uniform", "log_uniform") and numbers[0] > numbers[1]:
        yield "must have the lower limit first"
    if kind == "log_uniform" and numbers[0] <= 0.0:
        yield "must have limits above 0; a logarithm needs them"
    if kind == "normal" and not 0.0 <= numbers[1] < math.inf:
        yield "must have a standard deviation of 0 or more"
