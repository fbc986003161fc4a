"""Frozen steps: inputs that C and NumPy make alike from whole numbers, and the digest of their outcomes.

An episode is one controller, stepped TICKS times from nmpc_init. `templates/src/nmpc_self_test.c.j2` runs the
same episodes one after the other; here they run side by side, so that the digest is known when the C is
generated.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.fixed_point import LARGEST
from mambo_nmpc.codegen.reference import ReferenceController, Step
from mambo_nmpc.codegen.reference.math import Real, rounded
from mambo_nmpc.codegen.representation import STATE, TARGET, InputLimits, Representation
from mambo_nmpc.codegen.settings.model import Settings

TICKS: Final = 100
"""Steps of an episode."""
TICKS_PER_INPUT: Final = 4
"""Ticks that see the same input: plans reach their limits, and costs come to rest."""
HOVER_M_S2: Final = 9.81

_MOST_EPISODES: Final = 1000
_USUAL_WORK: Final = 100
"""Predicted steps times moves times iterations up to which a digest is of _MOST_EPISODES."""
_LEAST_WORK: Final = 20
"""What an iteration of few predicted steps and moves takes the reference all the same."""
_TOGETHER: Final = 250
"""Episodes side by side: few enough for the caches, many enough for NumPy."""
_UNIT_BITS: Final = 23
_UNIT: Final = 1 << _UNIT_BITS
"""A draw is a whole number in -_UNIT.._UNIT - 1, which every scalar type holds exactly."""
_MULTIPLIER: Final = 2654435761
"""The prime next to 2**32 over the golden ratio (Knuth, The Art of Computer Programming 3, section 6.4)."""

Words = NDArray[np.uint32]
Inputs = tuple[Real, Real, Real]


@dataclass(frozen=True)
class InputScales:
    """How far the frozen inputs lie apart, for each unit of a draw; errors come in four sizes.

    In fixed point, which has no format for that, for each _UNIT of a draw.
    """

    target_position_m: float
    target_velocity_m_s: float
    error_position_m: tuple[float, ...]
    error_velocity_m_s: tuple[float, ...]
    attitude_rad: float
    yaw_rad: float
    thrust_acceleration_m_s2: float
    hover_m_s2: float


def input_scales(settings: Settings) -> InputScales:
    """Spread the inputs over what a flight meets, all within the ranges of `settings`."""
    half_m, half_m_s = settings.ranges.position_m / 2, settings.ranges.velocity_m_s / 2
    position_m, velocity_m_s = min(2.0, half_m), min(1.0, half_m_s)
    near = 0.25, 0.025, 0.0025
    fixed, most_m_s2 = settings.code.scalar == "fixed", settings.ranges.thrust_acceleration_max_m_s2
    hover_m_s2 = min(HOVER_M_S2, most_m_s2) if fixed else HOVER_M_S2
    thrust_m_s2 = min(3.0, most_m_s2 - hover_m_s2) if fixed else 3.0
    unit = 1 if fixed else _UNIT
    return InputScales(
        target_position_m=position_m / unit,
        target_velocity_m_s=velocity_m_s / unit,
        error_position_m=tuple(
            error / unit for error in (min(20.0, half_m), *(size * position_m for size in near))
        ),
        error_velocity_m_s=tuple(
            error / unit for error in (min(10.0, half_m_s), *(size * velocity_m_s for size in near))
        ),
        attitude_rad=0.5 / unit,
        yaw_rad=100.0 / unit,
        thrust_acceleration_m_s2=thrust_m_s2 / unit,
        hover_m_s2=hover_m_s2,
    )


def episode_count(settings: Settings) -> int:
    """Return how many episodes the digest in a bundle covers: fewer where a step is much work."""
    horizon = settings.horizon
    work = max(horizon.prediction * horizon.control, _LEAST_WORK) * settings.optimizer.iterations
    return max(1, min(_MOST_EPISODES, _MOST_EPISODES * _USUAL_WORK // work))


def self_test_digest(design: Design, count: int) -> int:
    """Return the digest of the first `count` episodes, 32 bits, as the reference computes it."""
    digest = 0
    for first in range(0, count, _TOGETHER):
        for seen in _episodes(design, np.arange(first, min(first + _TOGETHER, count), dtype=np.uint32)):
            digest = int(_fold(np.array([digest], np.uint32), np.array([seen], np.uint32))[0])
    return digest


def episode_inputs(design: Design, episode: Words) -> Iterator[Inputs]:
    """Yield the inputs of each tick of n episodes: states (n, 7), targets (n, 4), thrusts (n,)."""
    source, scales = _Source(episode), input_scales(design.settings)
    for _ in range(TICKS // TICKS_PER_INPUT):
        inputs = _next_inputs(design, scales, source)
        for _ in range(TICKS_PER_INPUT):
            yield inputs


class _Source:
    """n streams of 32-bit numbers: Marsaglia's xorshift (Journal of Statistical Software 8(14), 2003)."""

    def __init__(self, episode: Words) -> None:
        self._state = _fold(np.zeros_like(episode), episode + np.uint32(1))

    def next(self) -> Words:
        """Return the next number of every stream."""
        number = self._state
        number = number ^ (number << np.uint32(13))
        number = number ^ (number >> np.uint32(17))
        number = number ^ (number << np.uint32(5))
        self._state = number
        return number

    def draw(self, numbers: Representation, scale: Real) -> Real:
        """Return the upper 24 bits of the next number, signed, times `scale`: the one rounding of a draw."""
        whole = ((self.next() >> 8).astype(np.int32) - _UNIT).astype(numbers.computed)
        drawn: Real = whole * scale if numbers.formats is None else rounded(whole * scale, _UNIT_BITS)
        return drawn


def _next_inputs(design: Design, scales: InputScales, source: _Source) -> Inputs:
    """Draw states, targets and thrusts; five in 64 will be refused."""
    numbers, limits = design.numbers, design.limits
    choice = source.next()
    size = choice & 3

    def draw(scale: float, quantity: str) -> Real:
        return source.draw(numbers, numbers.constant(scale, quantity))

    def error(sizes: tuple[float, ...], quantity: str) -> Real:
        return source.draw(numbers, np.array([numbers.constant(one, quantity) for one in sizes])[size])

    target = [draw(scales.target_position_m, "position") for _ in range(2)]
    target += [draw(scales.target_velocity_m_s, "velocity") for _ in range(2)]
    state: list[Real] = [target[axis] + error(scales.error_position_m, "position") for axis in (0, 1)]
    state += [target[axis] + error(scales.error_velocity_m_s, "velocity") for axis in (2, 3)]
    state += [draw(scales.attitude_rad, "angle") for _ in range(2)]
    state += [draw(scales.yaw_rad, "yaw")]
    thrust = numbers.constant(scales.hover_m_s2, "thrust") + draw(scales.thrust_acceleration_m_s2, "thrust")
    thrust = np.minimum(np.maximum(thrust, limits.thrust_least), limits.thrust_most)

    refusal = (choice >> 8) & 63
    no_number, roll, yaw, velocity = _refused(numbers, limits)
    state[0] = np.where(refusal == 0, no_number, state[0])
    state[5] = np.where(refusal == 1, roll, state[5])
    state[6] = np.where(refusal == 2, yaw, state[6])
    target[3] = np.where(refusal == 3, velocity, target[3])
    thrust = np.where(refusal == 4, numbers.computed(0), thrust)
    return (
        np.stack(
            [numbers.to_si(value, quantity) for value, quantity in zip(state, STATE, strict=True)], axis=1
        ),
        np.stack(
            [numbers.to_si(value, quantity) for value, quantity in zip(target, TARGET, strict=True)], axis=1
        ),
        numbers.to_si(thrust, "thrust"),
    )


def _refused(numbers: Representation, limits: InputLimits) -> tuple[Any, Any, Any, Any]:
    """Return no number, an attitude, a yaw and a velocity out of range."""
    if numbers.formats is not None:
        return LARGEST, LARGEST, LARGEST, -LARGEST
    two = numbers.scalar(2)
    return numbers.scalar(np.nan), two * limits.attitude, two * limits.yaw, -two * limits.velocity


def _episodes(design: Design, episode: Words) -> Words:
    """Return the digests (n,) of n episodes, each by itself."""
    controller = ReferenceController(design, len(episode))
    seen = np.zeros_like(episode)
    for inputs in episode_inputs(design, episode):
        for word in _words(design.numbers, controller.step(*inputs)):
            seen = _fold(seen, word)
    return seen


def _words(numbers: Representation, step: Step) -> Iterator[Words]:
    """Yield the outcome of a step in words (n,), the upper one first where a number has two."""
    for whole in (step.status, step.iterations, step.converged):
        yield whole.astype(np.uint32)
    for name in ("command_rad", "cost", "gradient", "plan_rad"):
        real = numbers.from_si(getattr(step, name), name)
        rows = np.ascontiguousarray(real.reshape(len(real), -1))
        yield from rows.astype(rows.dtype.newbyteorder(">")).view(">u4").astype(np.uint32).T


def _fold(digest: NDArray[Any], word: NDArray[Any]) -> Words:
    """Fold a word into a digest: no two words give the same, and upper bits reach lower ones."""
    mixed = (digest ^ word) * np.uint32(_MULTIPLIER)
    folded: Words = mixed ^ (mixed >> np.uint32(15))
    return folded
