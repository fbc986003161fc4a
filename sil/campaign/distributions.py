"""The distributions that a campaign draws from, each as its quantile function.

A quantile function maps one uniform random number to one draw. Every parameter uses exactly one number of its
flight's stream, so changing the distribution of one parameter does not change the draws of the others.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Final, Literal

Kind = Literal["constant", "uniform", "log_uniform", "normal", "choice"]

_SHAPES: Final = (
    "a number, { uniform = [low, high] }, { log_uniform = [low, high] }, { normal = [mean, deviation] } "
    "or { choice = [value, ...] }"
)
_MOST_CHOICES: Final = 1000


@dataclass(frozen=True)
class Domain:
    """Admissible values of a parameter: `low` to `high`, whole numbers only if `whole`."""

    low: float
    high: float
    whole: bool = False


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
                return numbers[0] * math.exp(share * math.log(numbers[1] / numbers[0]))
            case "normal":
                return self._normal_quantile(share)
            case "choice":
                return numbers[int(share * len(numbers))]

    def _normal_quantile(self, share: float) -> float:
        mean, deviation = self.numbers
        if deviation == 0.0:
            return mean
        normal, domain = NormalDist(mean, deviation), self.domain
        below, above = normal.cdf(domain.low), normal.cdf(domain.high)
        inner = min(max(below + share * (above - below), 1e-16), 1.0 - 1e-16)
        return min(max(normal.inv_cdf(inner), domain.low), domain.high)

    def document(self) -> float | dict[str, list[float]]:
        """Return the distribution as written in campaign.toml."""
        return self.numbers[0] if self.kind == "constant" else {self.kind: list(self.numbers)}


def parse(value: Any, domain: Domain) -> Distribution:
    """Return the distribution written as `value` in campaign.toml; raises ValueError, "must ..."."""
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
