"""The generated C as a linear system: copies of its memory with one number changed, stepped once."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np

from mambo_codegen.methods import method_of
from mambo_codegen.numbers.gravity import GRAVITY_M_S2, hover_thrust
from mambo_codegen.settings.controller_toml import with_option
from mambo_codegen.settings.model import Settings
from mambo_codegen.settings.optional_sections import Height
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.errors import FlightError
from mambo_sil.flight.columns import LEVEL, SPACE, TARGET
from mambo_sil.flight.controllers.compiled import CompiledController
from mambo_sil.flight.controllers.thrust_controller import adapted, numbers_of

_SETTLING_STEPS: Final = 100
_LEARNING_S: Final = 30.0
"""Time in which a controller of the height must have learnt the thrust of hover of a drone."""
_RAMP_S: Final = 5.0
"""Time in which a drone gets as heavy as it is: at once it could swing with thrust at its limit for ever."""
_STILL: Final = 1e-6
"""A controller in whose memory no number changes by more in a second is at rest."""
_ON_TARGET_M: Final = 1e-3
"""A controller that has learnt the thrust holds the height this closely."""
_CHANGE: Final = 1e-6
"""Change of one number of memory or input; the law is linear there, so only rounding depends on it."""


@dataclass(frozen=True, eq=False)
class LinearController:
    """A controller at hover, at its target: memory' = a memory + b state, command = c memory + d state.

    a (k, k), b (k, 7), c (2, k), d (2, 7); the state is [x, y, vx, vy, roll, pitch, yaw], as it is seen, and
    the command roll and pitch. With a height b (k, 9), c (3, k), d (3, 9): the state ends with height and
    climb, the command with the thrust over mass.
    """

    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray


def has_linear_law(settings: Settings) -> bool:
    """Return whether the command is a smooth function of the state."""
    return method_of(settings).linear_law is not None


@lru_cache(maxsize=16)
def linear_controller(settings: Settings, load: float = 1.0) -> LinearController:
    """Return the C of `settings`, whose law must be linear, with scalar type float64 as a linear system.

    `load` is the thrust over mass that a drone needs to hover, over g; only controllers of the height see it.
    Raises BuildError, CacheError; FlightError if they cannot hover with it.
    """
    settings = with_option(settings, "code.scalar", "float64")
    settled = CompiledController(settings)
    state, target = _hover(settings)
    if settings.height is None:
        for _ in range(_SETTLING_STEPS):
            outcome = _step(settled, state, target)
        stored = outcome.stored.shape[1]
    else:
        state, stored = _learn(settled, state, target, load)
    seen = state.shape[1] - (settings.height is not None)  # contact with the floor is yes or no
    changed = stored + seen
    many = CompiledController(settings, 2 * changed)
    many.instances[:] = settled.instances
    changes = np.repeat(np.eye(changed), 2, axis=0) * np.tile([[_CHANGE], [-_CHANGE]], (changed, 1))
    _numbers(many, stored)[:] += changes[:, :stored]
    states = np.repeat(state, len(changes), axis=0)
    states[:, :seen] += changes[:, stored:]
    outcome = _step(many, states, target)
    memory, command = (
        ((after[0::2] - after[1::2]) / (2.0 * _CHANGE)).T
        for after in (_numbers(many, stored), numbers_of(outcome))
    )
    return LinearController(memory[:, :stored], memory[:, stored:], command[:, :stored], command[:, stored:])


def _hover(settings: Settings) -> tuple[FloatArray, FloatArray]:
    """Return state and target at rest at the origin; with a height the target lies midway.

    That is between floor and ceiling; `_learn` moves the state there.
    """
    if settings.height is None:
        return np.zeros((1, LEVEL.state)), np.zeros((1, LEVEL.target))
    state, target, fence = np.zeros((1, SPACE.state)), np.zeros((1, SPACE.target)), settings.limits.fence
    target[:, TARGET["height_m"]] = (fence.floor_m + fence.ceiling_m) / 2.0
    return state, target


def _learn(
    controller: CompiledController, state: FloatArray, target: FloatArray, load: float
) -> tuple[FloatArray, int]:
    """Let a controller hold the height of a point mass that needs a load; return its state and all it stores.

    Its thrust lags and its state is as old as the controller models it, so that the loop comes to rest
    whatever they are. It is at its target then, but for a controller that learns nothing.
    Raises FlightError if it does not come to rest there.
    """
    settings, height = controller.settings, controller.settings.height
    assert height is not None
    period_s, age_s = settings.horizon.update_period_s, settings.observer.measurement_age_s
    delayed_share = 1.0 - math.exp(-period_s / height.delay_s) if height.delay_s else 1.0
    lagged_share = 1.0 - math.exp(-period_s / height.lag_s)
    delayed_m_s2 = thrust_m_s2 = hover_thrust(settings)
    expected, seen = 1.0 / height.thrust_gain, state.copy()
    goal_m = float(target[0, TARGET["height_m"].start])
    height_m, climb_m_s, lift_m_s2 = goal_m, 0.0, 0.0
    updates_per_s, before = round(1.0 / period_s), np.zeros(0)
    for second in range(round(_LEARNING_S)):
        for update in range(updates_per_s):
            seen[0, 7:9] = height_m - age_s * climb_m_s, climb_m_s - age_s * lift_m_s2
            outcome = _step(controller, seen, target)
            delayed_m_s2 += delayed_share * (float(outcome.thrust_m_s2[0]) - delayed_m_s2)
            thrust_m_s2 += lagged_share * (delayed_m_s2 - thrust_m_s2)
            grown = min((second + update * period_s) / _RAMP_S, 1.0)
            lift_m_s2 = thrust_m_s2 / (expected + grown * (load - expected)) - GRAVITY_M_S2
            height_m += period_s * (climb_m_s + 0.5 * period_s * lift_m_s2)
            climb_m_s += period_s * lift_m_s2
        stored = outcome.stored.shape[1]
        now = _numbers(controller, stored).copy()
        if second > _RAMP_S and np.abs(now - before).max() < _STILL:
            break
        before = now
    off_m = abs(height_m - goal_m)
    if abs(lift_m_s2) > _STILL or (height.learnt != "none" and off_m > _ON_TARGET_M):
        raise FlightError(
            f"height: a drone that hovers with {load * height.thrust_gain:.3g} times the expected thrust "
            f"does not hold its height with {_learnt(height)} "
            f"and height.thrust_max_m_s2 = {height.thrust_max_m_s2:g}; derive settings from its vehicle.toml"
        )
    return seen, stored


def _learnt(height: Height) -> str:
    """Return what a controller learns of the height, as keys and values."""
    match height.learnt:
        case "gain":
            return f"height.learnt_gain_limit = {height.learnt_gain_limit:g}"
        case "acceleration":
            return f"height.learnt_acceleration_limit_m_s2 = {height.learnt_acceleration_limit_m_s2:g}"
        case _:
            return 'height.learnt = "none"'


def _step(controller: CompiledController, state: FloatArray, target: FloatArray) -> Any:
    """Step controllers with one target, at hover thrust; with a height at the thrust that they commanded."""
    n = controller.n
    thrust_m_s2 = np.full(n, GRAVITY_M_S2 if controller.settings.height is None else np.nan)
    return adapted(controller).step(state, np.repeat(target, n, axis=0), thrust_m_s2)


def _numbers(controller: CompiledController, stored: int) -> FloatArray:
    """Return the numbers (n, stored) in the memory of controllers in float64, themselves and no copy."""
    beginning = controller.instances[:, : stored * np.dtype(np.float64).itemsize]
    numbers: FloatArray = beginning.view(np.float64)
    return numbers
