"""The fixed point formats of a controller with a quadratic cost.

As for the 1-norm each quantity has as many fractional bits as its bound allows, and
no bound is sampled: each is the sum of the absolute values of all terms, with sine and cosine at most 1 each,
so that a proof by intervals finds the same bound in the C.

A sum of products is a 64-bit integer, and each gain of a row has the format that gives all products of the
row the same one; one shift makes the sum a 32-bit number again.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final

import numpy as np

from mambo_codegen.methods.quadratic.attitude_constants import MOST_WEIGHT, attitude_constants
from mambo_codegen.methods.quadratic.guard_constants import guard_constants
from mambo_codegen.methods.quadratic.height_constants import INTEGRAL, height_constants
from mambo_codegen.methods.quadratic.height_formats import (
    learnt_m_s2,
    spare_bound,
    vector_shifts,
    vertical_bits,
    vertical_bounds,
    vertical_shifts,
)
from mambo_codegen.methods.quadratic.law import STATES, law_constants, limits
from mambo_codegen.methods.quadratic.observer_constants import observer_constants
from mambo_codegen.methods.quadratic.target_observer_constants import (
    TargetObserverConstants,
    largest_velocities,
    target_observer_constants,
)
from mambo_codegen.methods.quadratic.thrust_vector_constants import (
    MOST_SLOPE,
    has_thrust_vector,
    thrust_vector_constants,
)
from mambo_codegen.methods.quadratic.tilt_gain_constants import tilt_gain_constants
from mambo_codegen.methods.shared.limits_constants import limits_bits
from mambo_codegen.methods.shared.rate_feedback import feedback_bits, feedback_steps
from mambo_codegen.numbers.fixed_point import FACTOR_BITS, SINE_BITS, fractional_bits
from mambo_codegen.numbers.representation import ATTITUDE_LIMIT_RAD, YAW_LIMIT_RAD
from mambo_codegen.settings.key import Refusal
from mambo_codegen.settings.sections import Sections

_TURN: Final = 2.01
"""A component of a vector that turns is at most this times the larger one: |sine|, |cosine| <= 1."""

LAGGED: Final = 1.01
"""|c| is at most this times the larger |u|: their weighted mean, apart from rounding."""

_ATTITUDE_STATES: Final = ("a", "i", "c", "u")
"""The states of the attitude model, in the order of its rows."""

_INPUTS: Final = {"e": "position", "v": "speed"}
"""The quantities of the law's states that are no accelerations in m/step^2."""

_SUM_BITS: Final = 62
"""Most bits of a sum of products without its sign: one less than the type has, as rounding adds to it."""

_COARSEST_POSITION_BITS: Final = 10
"""Fewest fractional bits of a position: its resolution is 1 mm or better."""

_COARSEST_COMMAND_RAD: Final = 1e-4
"""The resolution of a command is this or better."""


@dataclass(frozen=True)
class QuadraticFormats:
    """Fractional bits by quantity, and the right shifts of products and sums by the names of the templates.

    position:     input and estimated positions, m.       velocity: input velocities, m/s.
    angle:        tilt and commands, rad.                  yaw: rad.          thrust: m/s^2.
    speed:        velocities, m/step.                      acceleration: m/step^2.
    move:         the optimizer's moves, m/step^2.         disturbance: of an estimate, m/s^2.
    """

    bits: Mapping[str, int]
    shifts: Mapping[str, int]


@dataclass(frozen=True)
class _Bounds:
    """Bounds of absolute values: what the rows multiply, by the states' names, and of every quantity."""

    states: Mapping[str, float]
    position: float
    speed: float
    acceleration: float
    move: float
    angle: float
    thrust_m_s2: float
    learnt_m_s2: float


@lru_cache(maxsize=64)
def formats(settings: Sections) -> QuadraticFormats:
    """Choose the formats of `settings`; `refusals` says whether they are fine enough."""
    attitude, observer = attitude_constants(settings), observer_constants(settings)
    law, height = law_constants(settings), height_constants(settings)
    vector = thrust_vector_constants(settings, attitude.gain_m_step2_rad)
    target = target_observer_constants(settings)
    learnt = tilt_gain_constants(settings)
    bounds, period_s = _bounds(settings), settings.horizon.update_period_s
    ranges = settings.ranges
    loops = np.concatenate([attitude.tilt_row, attitude.integral_row])
    laws, gain, ratios = law.rows, observer.gain[np.newaxis], np.abs(law.ratios)
    if observer.coarse_gain is not None:
        gain = np.concatenate([gain, observer.coarse_gain[np.newaxis]])
    if learnt is not None:
        means = [[*row.tolist(), 0.0, 0.0] for row in (learnt.quick_row, learnt.slow_row)]
        loops = np.concatenate([loops, means])
    if height is not None:
        laws = np.concatenate([laws, np.insert(height.rows, INTEGRAL, 0.0, axis=1)[np.newaxis]])
        loops = np.concatenate([loops, np.insert(height.thrust_row, 1, 0.0)[np.newaxis]])
        gain, ratios = (
            np.concatenate([gain, height.gain[np.newaxis]]),
            np.append(ratios, abs(height.ratio)),
        )

    position = fractional_bits(bounds.position)
    speed = fractional_bits(bounds.speed)
    acceleration = fractional_bits(bounds.acceleration)
    speed, position = min(speed, acceleration - 1), min(position, speed - 1)
    bits = {
        "position": position,
        "velocity": fractional_bits(2 * ranges.velocity_m_s, *largest_velocities(target)),
        "angle": fractional_bits(bounds.angle * (learnt.inverse.most if learnt else 1.0)),
        "yaw": fractional_bits(YAW_LIMIT_RAD),
        "thrust": fractional_bits(bounds.thrust_m_s2),
        "speed": speed,
        "acceleration": acceleration,
        "move": min(fractional_bits(4 * bounds.move), acceleration),
        "disturbance": fractional_bits(bounds.learnt_m_s2),
        "step": fractional_bits(period_s),
        "tracker": _tracker_bits(settings, target),
        "gain": fractional_bits(attitude.gain_m_step2_rad, *attitude.command_gain_m_step2_rad),
        "command": fractional_bits(*attitude.command_rad_step2_m, vector.slope_step2_m if vector else 0.0),
        "feedback": feedback_bits(feedback_steps(settings)),
        "drag": fractional_bits(observer.drag_1_step) if observer.drag_1_step else 0,
        "age": fractional_bits(observer.age_steps) if observer.age_steps else 0,
        "ratio": fractional_bits(*ratios) if law.moves == 2 else 0,
        "per_step": fractional_bits(observer.steps_per_s),
        "per_step2": fractional_bits(observer.steps2_per_s2),
        "per_noise": fractional_bits(target.fade),
        "per_count": fractional_bits(target.known_slope, *target.memory_slopes),
        "learning": fractional_bits(learnt.rate_step2_m) if learnt else 0,
        "factor": FACTOR_BITS,
    }
    bits |= limits_bits(limits(settings), bits["velocity"], position)
    inputs = [bits[_INPUTS.get(name, "acceleration")] for name in STATES]
    shifts = {
        "attitude": _attitude_shift(loops, bounds.states, bits),
        "row": _shift(np.abs(laws), [bounds.states[name] for name in STATES], inputs, bits["move"]),
    }
    bits["attitude"] = shifts["attitude"]
    if height is not None:
        bits |= vertical_bits(height)
    learns_gain = height is not None and height.learns_gain
    rows = {name: gain[:, row] for row, name in enumerate(("position", "velocity", "disturbance"))}
    if learns_gain:
        rows |= {"disturbance": gain[:-1, 2], "gain": gain[-1:, 2]}
    kinds = {"position": "position", "velocity": "speed", "disturbance": "acceleration", "gain": "factor"}
    for name, row in rows.items():
        innovations = [bounds.states["innovation"], bounds.states["innovation_step"]]
        sources, kind = [position, speed], kinds[name]
        shift = _shift(np.abs(row), innovations, sources, bits[kind])
        shifts[f"{name}_correction"] = shift
        for by, source in zip(("position", "velocity"), sources, strict=True):
            bits[f"{name}_by_{by}"] = shift + bits[kind] - source
    for name, source in zip(STATES, inputs, strict=True):
        bits[f"row_{name}"] = shifts["row"] + bits["move"] - source
    shifts |= _product_shifts(bits, "velocity" if target else "acceleration")
    shifts |= vertical_shifts(bits) if height else {}
    return QuadraticFormats(bits, shifts | (vector_shifts(bits) if vector else {}))


def refusals(settings: Sections) -> list[Refusal]:
    """Return which values of `settings` fixed point cannot represent."""
    found = formats(settings)
    command_rad = math.ldexp(np.max(attitude_constants(settings).command_rad_step2_m), -found.bits["move"])
    unused = {name for name in ("feedback", "ratio") if not found.bits[name]}
    least = min(
        shift
        for name, shift in found.shifts.items()
        if name != "move" and name.removesuffix("_product") not in unused
    )
    if (
        found.bits["position"] >= _COARSEST_POSITION_BITS
        and command_rad <= _COARSEST_COMMAND_RAD
        and least >= 1
    ):
        return []
    rule = (
        f'is too wide for code.scalar = "fixed", which would resolve commands to {command_rad:.2g} rad; '
        "write less"
    )
    return [Refusal("ranges", "position_m", rule)]


def _bounds(settings: Sections) -> _Bounds:
    """Return the bounds along all axes."""
    height, level = height_constants(settings), _level_bounds(settings)
    if height is None:
        return level
    found = vertical_bounds(
        height,
        observer_constants(settings),
        attitude_constants(settings),
        settings.ranges,
        target_observer_constants(settings),
    )
    names = ("position", "speed", "acceleration", "move", "thrust_m_s2", "angle")
    gain = attitude_constants(settings).gain_m_step2_rad
    if (vector := thrust_vector_constants(settings, gain)) is not None:
        level = replace(level, acceleration=max(level.acceleration, spare_bound(vector, height)))
    return replace(
        level,
        states={name: max(bound, found.states.get(name, 0.0)) for name, bound in level.states.items()},
        learnt_m_s2=max(level.learnt_m_s2, learnt_m_s2(height)),
        **{name: max(getattr(level, name), getattr(found, name)) for name in names},
    )


def _level_bounds(settings: Sections) -> _Bounds:
    """Return the bounds along right and forward, and of what the axes share."""
    attitude, observer = attitude_constants(settings), observer_constants(settings)
    law, guard = law_constants(settings), guard_constants(settings)
    reach_m, speed, limit = settings.ranges.position_m, observer.velocity_limit_m_step, attitude.limit_m_step2
    tilted = attitude.gain_m_step2_rad * (ATTITUDE_LIMIT_RAD + float(np.max(np.abs(attitude.trim_rad))))
    if has_thrust_vector(settings):
        tilted = attitude.gain_m_step2_rad * MOST_SLOPE
    tilted *= MOST_WEIGHT if settings.height else 1.0
    tilted, turned = max(tilted, limit), _TURN * limit
    observed = target_observer_constants(settings)
    target, jerk = (observed.update_s * one for one in (observed.level.acceleration, observed.level.jerk))
    innovation = (2 * reach_m) + (observer.age_steps * speed)
    explained = (_TURN * tilted) + observer.disturbance_limit_m_step2 + (observer.drag_1_step * speed)
    innovation_step = (2 * speed) + (observer.age_steps * explained)
    corrections = np.abs(observer.gain) @ [innovation, innovation_step]
    if observer.coarse_gain is not None:
        corrections = np.maximum(corrections, np.abs(observer.coarse_gain) @ [innovation, innovation_step])
    corrected_m, corrected = reach_m + corrections[0], speed + corrections[1]
    unexplained = observer.disturbance_limit_m_step2 + (observer.drag_1_step * corrected)
    acceleration = (_TURN * tilted) + unexplained
    states = {
        "e": _TURN * (corrected_m + reach_m),
        "v": _TURN * (corrected + speed),
        "w": _TURN * (unexplained + target),
        "j": _TURN * jerk,
        "a": max(tilted, turned),
        "i": limit,
        "c": LAGGED * limit,
        "u": limit,
        "innovation": innovation,
        "innovation_step": innovation_step,
    }
    rows = np.abs(np.concatenate([attitude.tilt_row, attitude.integral_row]))
    move = float(np.max(np.abs(law.rows) @ [states[name] for name in STATES]))
    if law.moves == 2:
        most = float(np.max(attitude.command_limit_m_step2))
        move += float(np.max(np.abs(law.ratios))) * (move + most)
    return _Bounds(
        states=states,
        position=max(states["e"], corrected_m + corrected + acceleration),
        speed=max(states["v"], corrected + acceleration),
        acceleration=max(
            acceleration,
            states["w"],
            observer.disturbance_limit_m_step2 + corrections[2],
            float(np.max(rows @ [states[name] for name in _ATTITUDE_STATES])),
            turned,
            (3 * target) + (2 * jerk),
            (4 * LAGGED * states["a"]) if settings.observer.tilt_gain == "learnt" else 0.0,
        ),
        move=move,
        angle=max(
            (2 * (ATTITUDE_LIMIT_RAD + float(np.max(np.abs(attitude.trim_command_rad)))))
            * max([1.0, *(feedback_steps(settings) or ())])
            + (2 * settings.limits.tilt_rad),
            guard.tilt_budget_rad + guard.tilt_growth_rad if guard else 0.0,
        ),
        thrust_m_s2=max(
            settings.ranges.thrust_acceleration_max_m_s2,
            guard.thrust_budget_m_s2 + guard.thrust_growth_m_s2 if guard and settings.height else 0.0,
        ),
        learnt_m_s2=max(settings.observer.disturbance_limit_m_s2, 0.001),
    )


def _tracker_bits(settings: Sections, target: TargetObserverConstants) -> int:
    """Return the bits of what makes an acceleration in m/step^2 of what the target's observer reads."""
    height = height_constants(settings)
    snaps_s = [*law_constants(settings).snap_s, *([height.snap_s] if height else [])]
    return fractional_bits(target.update_s, target.half_ahead_s, *snaps_s)


def _attitude_shift(rows: Any, states: Mapping[str, float], bits: Mapping[str, int]) -> int:
    bounds = [states[name] for name in _ATTITUDE_STATES]
    return _shift(np.abs(rows), bounds, [bits["acceleration"]] * 4, bits["acceleration"])


def _shift(gains: Any, bounds: Sequence[float], inputs: Sequence[int], result: int) -> int:
    """Return by how many bits a row's sum of products is shifted to the format `result`.

    gains (..., k) multiply values within `bounds` in the formats `inputs`: as many bits as the gains' words
    and the sum's word hold.
    """
    largest = np.max(gains.reshape(-1, len(bounds)), axis=0)
    words = [
        fractional_bits(gain) + source - result
        for gain, source in zip(largest.tolist(), inputs, strict=True)
        if gain
    ]
    total = float(np.max(gains.reshape(-1, len(bounds)) @ np.array(bounds)))
    return min(*words, _SUM_BITS - 1 - math.frexp(1.01 * total)[1] - result)


def _product_shifts(bits: Mapping[str, int], noise_input: str) -> dict[str, int]:
    """Return the right shift of each product: the bits of both factors less those of the result.

    `noise_input` is the quantity of the noise of a tracker or observer of the target.
    """
    factors = {
        "speed_product": ("step", "velocity", "speed"),
        "drag_product": ("drag", "speed", "acceleration"),
        "tilt_product": ("gain", "angle", "acceleration"),
        "command_product": ("command", "acceleration", "angle"),
        "per_step_product": ("per_step", "speed", "velocity"),
        "per_step2_product": ("per_step2", "acceleration", "disturbance"),
        "aged_position": ("age", "speed", "position"),
        "aged_velocity": ("age", "acceleration", "speed"),
        "target_product": ("tracker", "velocity", "acceleration"),
        "noise_product": ("per_noise", noise_input, "factor"),
        "count_product": ("per_count", "velocity", "whole"),
        "change_product": ("step", "thrust", "velocity"),
        "factor_product": ("factor", "acceleration", "acceleration"),
        "learning_product": ("learning", "acceleration", "factor"),
    }
    bits = {**bits, "whole": 0}
    if not bits["per_count"]:
        factors.pop("change_product")
    unused = {
        name for name in ("drag", "age", "tracker", "per_noise", "per_count", "learning") if not bits[name]
    }
    shifts = {
        name: bits[one] + bits[other] - bits[result]
        for name, (one, other, result) in factors.items()
        if one not in unused
    }
    shifts["half_change"] = bits["acceleration"] - bits["speed"] + 1
    shifts["velocity_change"] = bits["acceleration"] - bits["speed"]
    shifts["position_change"] = bits["speed"] - bits["position"]
    shifts["feedback_product"] = bits["feedback"]
    shifts["ratio_product"] = bits["ratio"]
    shifts["tracker_product"] = SINE_BITS
    shifts["move"] = bits["acceleration"] - bits["move"]
    return shifts
