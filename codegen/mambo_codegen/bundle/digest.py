"""The self-test digest: a checksum of many control steps; a build with other bits has another digest.

An episode is TICKS steps of one controller after nmpc_init. Its inputs come from an integer random number
generator, so that C and NumPy draw the same ones. The C (`nmpc_self_test.c.j2`) runs the
episodes one after the other; this module runs them in parallel arrays when the C is generated.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.kept import keep
from mambo_codegen.methods import Method, Step
from mambo_codegen.methods.shared.math import Real, rounded
from mambo_codegen.methods.shared.tracker_constants import given_limit_m_s2
from mambo_codegen.numbers.fixed_point import LARGEST
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.numbers.representation import PREVIEW_TIMES, InputLimits, Representation

TICKS: Final = 100
"""Steps of an episode."""
TICKS_PER_INPUT: Final = 4
"""Steps for which an input is held, long enough for plans to reach their limits and for costs to converge."""

_MOST_EPISODES: Final = 1000
_USUAL_WORK: Final = 100
"""Largest Np x Nc x iterations for which the digest covers _MOST_EPISODES."""
_LEAST_WORK: Final = 20
"""Np x Nc below which the reference is not faster, because NumPy's overhead per operation dominates."""
_UNIT_BITS: Final = 23
_UNIT: Final = 1 << _UNIT_BITS
"""Random numbers are integers in -_UNIT.._UNIT - 1, which every scalar type represents exactly."""
_MULTIPLIER: Final = 2654435761
"""The prime nearest to 2**32 / golden ratio (Knuth, The Art of Computer Programming 3, section 6.4)."""

Words = NDArray[np.uint32]
StepInputs = tuple[Real, Real, Real | None]
"""States, targets and thrusts of one step of n controllers, as in `ReferenceController.step`."""


@dataclass(frozen=True)
class InputScales:
    """Factors from random integers to inputs; errors between drone and target have four sizes.

    In floating point an input is integer x factor. In fixed point, whose formats cannot represent factors
    that small, it is integer x factor / _UNIT.
    """

    target_position_m: float
    target_velocity_m_s: float
    error_position_m: tuple[float, ...]
    error_velocity_m_s: tuple[float, ...]
    attitude_rad: float
    yaw_rad: float
    thrust_acceleration_m_s2: float
    hover_m_s2: float
    target_motion: float
    """Of what the tracker reads: the change of the target's velocity from step to step, in m/s, or a given
    acceleration, in m/s^2; 0 without a tracker."""
    climb_motion: float
    """The same of the target's climb; 0 without a height."""


def input_scales(method: Method) -> InputScales:
    """Return the factors that give inputs as in a flight, within the ranges of the settings."""
    settings = method.settings
    half_m, half_m_s = settings.ranges.position_m / 2, settings.ranges.velocity_m_s / 2
    position_m, velocity_m_s = min(2.0, half_m), min(1.0, half_m_s)
    near = 0.25, 0.025, 0.0025
    fixed, most_m_s2 = settings.code.scalar == "fixed", settings.ranges.thrust_acceleration_max_m_s2
    hover_m_s2 = min(GRAVITY_M_S2, most_m_s2) if fixed else GRAVITY_M_S2
    thrust_m_s2 = min(3.0, most_m_s2 - hover_m_s2) if fixed else 3.0
    unit = 1 if fixed else _UNIT
    motions = []
    for tracker in (method.tracker, method.climb_tracker):
        if tracker:
            most = settings.ranges.thrust_acceleration_max_m_s2 if tracker.is_given else half_m_s / 4
        motions.append(min(tracker.tested_input, most) if tracker else 0.0)
    if method.has_preview:
        motions = [given_limit_m_s2(settings)] * 2
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
        target_motion=motions[0] / unit,
        climb_motion=motions[1] / unit,
    )


def scale_constants(method: Method, scales: InputScales) -> list[tuple[str, float, str]]:
    """Return the scales that have a constant in the C: its name, the scale and its quantity."""
    tracker, has_height = method.tracker, method.has_height
    is_given = method.settings.target.gives_acceleration
    found = [
        ("TARGET_M", scales.target_position_m, "position"),
        ("TARGET_M_S", scales.target_velocity_m_s, "velocity"),
        ("ATTITUDE_RAD", scales.attitude_rad, "angle"),
        ("YAW_RAD", scales.yaw_rad, "yaw"),
    ]
    if not has_height:
        found.append(("THRUST_M_S2", scales.thrust_acceleration_m_s2, "thrust"))
        found.append(("HOVER_M_S2", scales.hover_m_s2, "thrust"))
    if tracker or is_given:
        quantity = "thrust" if is_given else "velocity"
        ending = "M_S2" if is_given else "CHANGE_M_S"
        found.append(("TARGET_M_S2" if is_given else ending, scales.target_motion, quantity))
        if has_height:
            found.append((f"CLIMB_{ending}", scales.climb_motion, quantity))
    return found


def episode_count(method: Method) -> int:
    """Return how many episodes the digest covers: fewer for long horizons, which keeps the run time equal."""
    states, iterations = method.work
    work = max(states, _LEAST_WORK) * iterations
    return max(1, min(_MOST_EPISODES, _MOST_EPISODES * _USUAL_WORK // work))


def kept_digest(method: Method) -> int:
    """Return the self-test digest over the episodes of a bundle's self-test; it is kept."""
    count = episode_count(method)
    inputs = method.settings.model_dump(mode="json"), count
    return int(keep("self-test digest", inputs, lambda: self_test_digest(method, count)))


def self_test_digest(method: Method, count: int) -> int:
    """Run the first `count` episodes on the reference controller, and return their digest of 32 bits.

    They run side by side, which outweighs NumPy's overhead for each operation.
    """
    digest = np.zeros(1, np.uint32)
    for word in _episode_digests(method, np.arange(count, dtype=np.uint32)):
        digest = _fold(digest, word)
    return int(digest[0])


def episode_inputs(method: Method, episodes: Words) -> Iterator[StepInputs]:
    """Yield the inputs of each of TICKS steps; `episodes` (n,) are the indices of the episodes."""
    numbers, generator, scales = method.numbers, _Generator(episodes), input_scales(method)
    for _ in range(TICKS // TICKS_PER_INPUT):
        state, target, thrust, change = _next_inputs(method, scales, generator)
        for _ in range(TICKS_PER_INPUT):
            yield (
                numbers.to_si(state, *method.state),
                numbers.to_si(target, *method.target),
                None if method.has_height else numbers.to_si(thrust, "thrust"),
            )
            target = target + change


class _Generator:
    """n random number generators: Marsaglia's xorshift (Journal of Statistical Software 8(14), 2003)."""

    def __init__(self, episodes: Words) -> None:
        self._state = _fold(np.zeros_like(episodes), episodes + np.uint32(1))

    def next(self) -> Words:
        """Return the next 32 bits of every generator."""
        number = self._state
        number = number ^ (number << np.uint32(13))
        number = number ^ (number >> np.uint32(17))
        number = number ^ (number << np.uint32(5))
        self._state = number
        return number

    def draw(self, numbers: Representation, scale: Real) -> Real:
        """Return the upper 24 of the next 32 bits as a signed integer times `scale`, rounded once."""
        whole = ((self.next() >> 8).astype(np.int32) - _UNIT).astype(numbers.computed)
        drawn: Real = whole * scale if numbers.formats is None else rounded(whole * scale, _UNIT_BITS)
        return drawn


def _next_inputs(method: Method, scales: InputScales, generator: _Generator) -> tuple[Real, Real, Real, Real]:
    """Draw states, targets, thrusts and changes of the targets from step to step, in numbers of the C.

    Five in 64 have an input out of range, six if an acceleration is given. Velocities change for a tracker
    that measures the acceleration by them. With a height one drone in eight touches the floor.
    """
    numbers, limits = method.numbers, method.limits
    choice = generator.next()
    size = choice & 3

    def draw(scale: float, quantity: str) -> Real:
        return generator.draw(numbers, numbers.constant(scale, quantity))

    def error(sizes: tuple[float, ...], quantity: str) -> Real:
        return generator.draw(numbers, np.array([numbers.constant(one, quantity) for one in sizes])[size])

    target = [draw(scales.target_position_m, "position") for _ in range(2)]
    target += [draw(scales.target_velocity_m_s, "velocity") for _ in range(2)]
    state: list[Real] = [target[axis] + error(scales.error_position_m, "position") for axis in (0, 1)]
    state += [target[axis] + error(scales.error_velocity_m_s, "velocity") for axis in (2, 3)]
    state += [draw(scales.attitude_rad, "angle") for _ in range(2)]
    state += [draw(scales.yaw_rad, "yaw")]
    thrust = np.full_like(state[0], limits.thrust_least)
    if not method.has_height:
        offset = draw(scales.thrust_acceleration_m_s2, "thrust")
        thrust = numbers.constant(scales.hover_m_s2, "thrust") + offset
        thrust = np.minimum(np.maximum(thrust, limits.thrust_least), limits.thrust_most)
    change = [np.zeros_like(thrust)] * len(method.target)
    is_given = method.settings.target.gives_acceleration
    has_motion, quantity = method.tracker is not None or is_given, "thrust" if is_given else "velocity"
    if has_motion:
        motion = [draw(scales.target_motion, quantity) for _ in range(2)]
        if is_given:
            target += motion
        else:
            change[2:4] = motion
    if method.has_height:
        target += [draw(scales.target_position_m, "position"), draw(scales.target_velocity_m_s, "velocity")]
        state += [target[-2] + error(scales.error_position_m, "position")]
        state += [target[-1] + error(scales.error_velocity_m_s, "velocity")]
        state += [((choice >> 14) & 7 == 0).astype(numbers.computed)]
        vertical = [draw(scales.climb_motion, quantity)] if has_motion else []
        if len(method.target) > len(target):
            target += vertical
        else:
            change[-1:] = vertical or change[-1:]
    axes = scales.target_motion, scales.target_motion, scales.climb_motion
    target += [draw(scale, quantity) for scale in axes * PREVIEW_TIMES * method.has_preview]
    fault = (choice >> 8) & 63
    _put_out_of_range(method, fault, state, target, change)
    thrust = np.where(fault == 4, numbers.computed(0), thrust)
    return np.stack(state, axis=1), np.stack(target, axis=1), thrust, np.stack(change, axis=1)


def _put_out_of_range(
    method: Method, fault: NDArray[Any], state: list[Real], target: list[Real], change: list[Real]
) -> None:
    """Put one input out of range where `fault` (n,) is small, in place, but for a thrust."""
    numbers, limits = method.numbers, method.limits
    position, pitch, yaw, velocity = _out_of_range(numbers, limits)
    state[0] = np.where(fault == 0, position, state[0])
    state[5] = np.where(fault == 1, pitch, state[5])
    state[6] = np.where(fault == 2, yaw, state[6])
    target[3], change[3] = np.where(fault == 3, velocity, target[3]), np.where(fault == 3, 0, change[3])
    if method.has_height:
        state[8] = np.where(fault == 4, velocity, state[8])
    if method.settings.target.gives_acceleration:
        last = -2 if method.has_preview else 4
        target[last] = np.where(fault == 5, position, target[last])


def _out_of_range(numbers: Representation, limits: InputLimits) -> tuple[Any, Any, Any, Any]:
    """Return a position, an attitude, a yaw and a velocity out of range; the position is NaN in float."""
    if numbers.formats is not None:
        return LARGEST, LARGEST, LARGEST, -LARGEST
    two = numbers.scalar(2)
    return numbers.scalar(np.nan), two * limits.attitude, two * limits.yaw, -two * limits.velocity


def _episode_digests(method: Method, episodes: Words) -> Words:
    """Run n episodes, and return the digest of each (n,)."""
    controller = method.reference_controller(len(episodes))
    digests = np.zeros_like(episodes)
    for inputs in episode_inputs(method, episodes):
        digests = step_digest(method, controller.step(*inputs), digests)
    return digests


def step_digest(method: Method, step: Step, digests: Words) -> Words:
    """Fold every bit of the results of a step of n controllers into `digests` (n,)."""
    for word in _words(method, step):
        digests = _fold(digests, word)
    return digests


def _words(method: Method, step: Step) -> Iterator[Words]:
    """Yield the outcome of a step as 32-bit words (n,); a 64-bit number gives its upper word first."""
    results = {one.name: one for one in method.results}
    for name in filter(results.__contains__, method.digested):
        values, quantities = getattr(step, name), results[name].quantities
        if not quantities:
            yield values.astype(np.uint32)
            continue
        numbers = method.numbers.from_si(values, *quantities)
        rows = np.ascontiguousarray(numbers.reshape(len(numbers), -1))
        yield from rows.astype(rows.dtype.newbyteorder(">")).view(">u4").astype(np.uint32).T


def _fold(digest: NDArray[Any], word: NDArray[Any]) -> Words:
    """Mix a word into a digest; for a given digest, different words give different results."""
    mixed = (digest ^ word) * np.uint32(_MULTIPLIER)
    folded: Words = mixed ^ (mixed >> np.uint32(15))
    return folded
