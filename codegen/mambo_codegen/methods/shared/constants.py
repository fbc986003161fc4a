"""The constants of one controller: what is derived from its settings, whatever its method, derived once."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mambo_codegen.methods.shared.limits_constants import LimitsConstants
from mambo_codegen.methods.shared.rate_feedback import feedback_steps
from mambo_codegen.methods.shared.tracker_constants import TrackerConstants, tracker_constants
from mambo_codegen.numbers.fixed_point import Formats
from mambo_codegen.numbers.representation import (
    ACCELERATION,
    ATTITUDE_LIMIT_RAD,
    COMMAND,
    CONTACT,
    HEIGHT,
    STATE,
    TARGET,
    THRUST,
    WEIGHTS,
    YAW_LIMIT_RAD,
    InputLimits,
    Representation,
)
from mambo_codegen.numbers.trigonometry import fixed_trigonometry, trigonometry
from mambo_codegen.settings.sections import Sections


@dataclass(frozen=True)
class Constants(ABC):
    """What follows from `settings`; each property is derived at its first use and cached."""

    settings: Sections

    @property
    @abstractmethod
    def step_s(self) -> float:
        """The step of the prediction, tau."""

    @abstractmethod
    def choose_formats(self) -> Formats:
        """Choose the formats of fixed point."""

    @property
    def weight_limits(self) -> tuple[float, ...]:
        """The largest tracking and effort weight, in SI units; none if the C takes no weights."""
        return ()

    @property
    @abstractmethod
    def limiting(self) -> LimitsConstants | None:
        """The constants of the limits of speed, braking and place, in float64; None without any."""

    @cached_property
    def tracker(self) -> TrackerConstants | None:
        """The constants of the target tracker, in float64; None if there is nothing to track."""
        return tracker_constants(self.settings, self.step_s)

    @property
    def guard(self) -> object | None:
        """The constants of the guard; None without one."""
        return None

    @property
    def climb_tracker(self) -> TrackerConstants | None:
        """The constants of the tracker of the target's height; None without one."""
        return None

    @cached_property
    def feedback_steps(self) -> tuple[float, float] | None:
        """Commands of roll and pitch per change of the angle in an update period; None without feedback."""
        return feedback_steps(self.settings)

    @property
    def has_limits(self) -> bool:
        """Whether speed, braking or place are limited."""
        return self.limiting is not None

    @property
    def has_height(self) -> bool:
        """Whether the controller has the height for a third axis, and commands the thrust."""
        return self.settings.height is not None

    @property
    def has_thrust_vector(self) -> bool:
        """Whether the controller computes with the direction of the thrust."""
        return self.has_height and self.settings.model.tilt == "exact"

    @property
    def learns_tilt_gain(self) -> bool:
        """Whether the controller learns how much the drone tilts."""
        return self.settings.observer is not None and self.settings.observer.tilt_gain == "learnt"

    @property
    def state(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_state_t, in their order."""
        return (*STATE, *HEIGHT, *CONTACT) if self.has_height else STATE

    @property
    def level_target(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_target_t but the height's, in their order."""
        return (*TARGET, *ACCELERATION) if self.settings.target.gives_acceleration else TARGET

    @property
    def target(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_target_t, in their order."""
        level = self.level_target
        if not self.has_height:
            return level
        upward = THRUST if len(level) > len(TARGET) else ()
        return (*level, *HEIGHT, *upward)

    @property
    def command(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_command_t, in their order."""
        return (*COMMAND, *THRUST) if self.has_height else COMMAND

    @property
    def shift(self) -> tuple[str, ...]:
        """The quantity of each number that nmpc_shift reads, in their order."""
        axes = 3 if self.has_height else 2
        return (*["position"] * axes, *["velocity"] * axes, "yaw")

    @property
    def state_members(self) -> tuple[str, ...]:
        """The members of nmpc_state_t, arrays by element, in the order of their numbers; likewise below."""
        level = (*_pairs("position_m", "velocity_m_s"), "roll_rad", "pitch_rad", "yaw_rad")
        return (*level, "height_m", "climb_m_s", "grounded") if self.has_height else level

    @property
    def target_members(self) -> tuple[str, ...]:
        """The members of nmpc_target_t."""
        is_given = self.settings.target.gives_acceleration
        level = _pairs("position_m", "velocity_m_s", *(("acceleration_m_s2",) if is_given else ()))
        upward = ("height_m", "climb_m_s", *(("climb_acceleration_m_s2",) if is_given else ()))
        return (*level, *upward) if self.has_height else level

    @property
    def limits_members(self) -> tuple[str, ...]:
        """The members of nmpc_limits_t."""
        level = ("speed_m_s", "braking_m_s2", *_pairs("fence_min_m", "fence_max_m"), "tilt_rad")
        return (*level, "floor_m", "ceiling_m", "climb_m_s", "descent_m_s") if self.has_height else level

    @property
    def bounds_members(self) -> dict[str, int]:
        """The members of nmpc_bounds_t, and how many numbers each holds."""
        is_given = self.settings.target.gives_acceleration
        is_turning = self.limiting is not None and self.limiting.turn_m_s_rad is not None
        return {
            "centre_m": 2,
            "clear_m": 2,
            **dict.fromkeys(("margin_m", "knee_m", "near_m", "speed_m_s", "braking_m_s2", "tilt_rad"), 1),
            **({"command_m_step2": 2} if self.settings.cost.norm == "quadratic" else {}),
            **({"velocity_m_s": 2} if is_given else {}),
            **({"target_m_s": 2, "turn_m2_s2": 1} if is_turning else {}),
            **(dict.fromkeys(("floor_m", "ceiling_m", "up_m", "down_m"), 1) if self.has_height else {}),
        }

    @cached_property
    def numbers(self) -> Representation:
        """The scalar type of the C, and in fixed point the format of each quantity."""
        scalar = self.settings.code.scalar
        return Representation(scalar, self.choose_formats() if scalar == "fixed" else None)

    @cached_property
    def limits(self) -> InputLimits:
        """The limits of inputs and commands, rounded to the numbers of the C."""
        constant, ranges = self.numbers.constant, self.settings.ranges
        return InputLimits(
            position=constant(ranges.position_m, "position"),
            velocity=constant(ranges.velocity_m_s, "velocity"),
            attitude=constant(ATTITUDE_LIMIT_RAD, "angle"),
            yaw=constant(YAW_LIMIT_RAD, "yaw"),
            thrust_least=constant(ranges.thrust_acceleration_min_m_s2, "thrust"),
            thrust_most=constant(ranges.thrust_acceleration_max_m_s2, "thrust"),
            tilt=constant(self.settings.limits.tilt_rad, "angle"),
            weights=np.array([constant(*pair) for pair in zip(self.weight_limits, WEIGHTS, strict=False)]),
        )

    @property
    def tilt_limit_rad(self) -> float:
        """The tilt limit in rad, as the C has it."""
        return float(self.numbers.to_si(np.array([self.limits.tilt]), "angle")[0])

    @cached_property
    def trigonometry(self) -> Any:
        """The constants of sine and cosine: `Trigonometry`, or `FixedTrigonometry` in fixed point."""
        bits = self.numbers.bits
        return trigonometry(self.settings.code.scalar) if bits is None else fixed_trigonometry(bits["yaw"])


def _pairs(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}[{axis}]" for name in names for axis in range(2))
