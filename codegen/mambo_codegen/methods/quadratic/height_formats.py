"""The fixed point formats that a height asks for: bounds of its numbers, formats and shifts of its own."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mambo_codegen.methods.quadratic.attitude_constants import AttitudeConstants
from mambo_codegen.methods.quadratic.height_constants import LEAST_WEIGHT, HeightConstants
from mambo_codegen.methods.quadratic.observer_constants import ObserverConstants
from mambo_codegen.methods.quadratic.target_observer_constants import TargetObserverConstants
from mambo_codegen.methods.quadratic.thrust_vector_constants import ThrustVectorConstants
from mambo_codegen.numbers.fixed_point import FACTOR_BITS, SINE_BITS, fractional_bits
from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.settings.sections import Ranges

GAIN_CHANGE = 2.0
"""Beyond any change of the learnt gain; a correction is limited to it."""


@dataclass(frozen=True)
class VerticalBounds:
    """Bounds of absolute values of the height, in m and m/step^k; `thrust_m_s2` in SI units.

    states: of those of the law, and of the innovations.
    angle:  command, in rad, of the largest acceleration of a tilt over the least weight.
    """

    states: Mapping[str, float]
    position: float
    speed: float
    acceleration: float
    move: float
    thrust_m_s2: float
    angle: float


def vertical_bounds(
    height: HeightConstants,
    observer: ObserverConstants,
    attitude: AttitudeConstants,
    ranges: Ranges,
    observed: TargetObserverConstants,
) -> VerticalBounds:
    """Return the bounds of the height for inputs within `ranges`."""
    reach_m = ranges.position_m
    limit, speed, gravity = height.limit_m_step2, observer.velocity_limit_m_step, height.gravity_m_step2
    learnt = height.learnt_limit if height.learns_acceleration else 0.0
    deviation = height.learnt_limit if height.learns_gain else 0.0
    assert observed.climb is not None, "with a height"
    target, jerk = (observed.update_s * one for one in (observed.climb.acceleration, observed.climb.jerk))
    innovation = (2 * reach_m) + (observer.age_steps * speed)
    innovation_step = (2 * speed) + (observer.age_steps * (limit + learnt))
    corrections = np.abs(height.gain) @ [innovation, innovation_step]
    corrected_m, corrected = reach_m + corrections[0], speed + corrections[1]
    near_m = (height.reach_steps * speed) + corrected_m + reach_m + height.up_m + height.down_m
    states = {
        "e": near_m,
        "v": corrected + speed,
        "w": learnt + target,
        "j": jerk,
        "a": limit,
        "c": limit,
        "u": limit,
        "innovation": innovation,
        "innovation_step": innovation_step,
    }
    move = float(np.max(np.abs(height.rows) @ [states[name] for name in height.states]))
    move += height.ratio * (move + limit)
    most = (1.01 / (1 - deviation)) / height.least_share
    tilted = attitude.limit_m_step2 * 1.01 / LEAST_WEIGHT
    return VerticalBounds(
        states=states,
        position=max(near_m, corrected_m + corrected + limit),
        speed=max(states["v"], corrected + limit + learnt),
        acceleration=max(
            (gravity + limit) * most,
            limit + ((gravity + limit) * GAIN_CHANGE),
            learnt + corrections[2] if height.learns_acceleration else 0.0,
            (3 * target) + (2 * jerk) + learnt,
            float(np.sum(np.abs(height.thrust_row))) * limit,
            tilted,
        ),
        move=move,
        thrust_m_s2=(gravity + limit) * most * height.steps2_per_s2,
        angle=tilted * float(np.max(attitude.command_rad_step2_m)),
    )


def vertical_bits(height: HeightConstants) -> dict[str, int]:
    """Return the fractional bits of the height's own quantities."""
    return {
        "per_gravity": fractional_bits(height.per_gravity),
        "reach": fractional_bits(height.reach_steps),
        "step2": fractional_bits(height.step2_s2),
        "thrust_per_step2": fractional_bits(height.steps2_per_s2),
    }


def vertical_shifts(bits: Mapping[str, int]) -> dict[str, int]:
    """Return the right shifts of the height's own products, by their names in the templates."""
    return {
        "reach_product": bits["reach"] + bits["speed"] - bits["position"],
        "gravity_product": bits["per_gravity"] + bits["acceleration"] - FACTOR_BITS,
        "angle_square": (2 * bits["angle"]) - SINE_BITS,
        "step2_product": bits["step2"] + bits["thrust"] - bits["acceleration"],
        "thrust_product": bits["thrust_per_step2"] + bits["acceleration"] - bits["thrust"],
        "to_factor": SINE_BITS - FACTOR_BITS,
    }


def spare_bound(vector: ThrustVectorConstants, height: HeightConstants) -> float:
    """Return a bound of what the thrust leaves to the tilt, chord by chord, m/step^2."""
    deviation = height.learnt_limit if height.learns_gain else 0.0
    vertical = height.gravity_m_step2 + height.limit_m_step2
    return float(np.max(vector.chords)) * ((1 + deviation) * vector.spare_m_step2 + vertical)


def vector_shifts(bits: Mapping[str, int]) -> dict[str, int]:
    """Return the right shifts of the products of the thrust vector, by their names in the templates."""
    return {
        "slope_product": bits["command"] + bits["acceleration"] - FACTOR_BITS,
        "slope_acceleration": bits["gain"] + FACTOR_BITS - bits["acceleration"],
        "angle_to_yaw": bits["angle"] - bits["yaw"],
        "sine_to_angle": SINE_BITS - bits["angle"],
    }


def learnt_m_s2(height: HeightConstants) -> float:
    """Return the largest learnt acceleration, m/s^2; 0 if none is learnt."""
    return height.learnt_limit / height.gravity_m_step2 * GRAVITY_M_S2 if height.learns_acceleration else 0.0
