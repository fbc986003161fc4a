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
    ATTITUDE_LIMIT_RAD,
    COMMAND,
    WEIGHTS,
    YAW_LIMIT_RAD,
    InputLimits,
    Representation,
)
from mambo_codegen.numbers.trigonometry import fixed_trigonometry, trigonometry
from mambo_codegen.port.port import ControllerPort
from mambo_codegen.port.taken import PARTS
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
    def target_observer(self) -> Any:
        """The constants of the target's observer; None with the 1-norm."""
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
    def presence(self) -> dict[str, bool]:
        """Whether each part of a controller is there, by its name.

        Rows of the port, chapters of nmpc.c, and their lines `#if WITH_NAME` ask for parts by these names.
        """
        limiting, tracker, settings = self.limiting, self.tracker, self.settings
        is_fixed = settings.code.scalar == "fixed"
        return dict.fromkeys(PARTS, False) | {
            "braking_trim": limiting is not None and limiting.tilted.trim_m_s2 != 0,
            "confine": False,
            "double": settings.code.scalar == "float64",
            "feedback": self.feedback_steps is not None,
            "fixed": is_fixed,
            "float": is_fixed,
            "guard": self.guard is not None,
            "height": self.has_height,
            "height_command": self.has_height,
            "limits": limiting is not None,
            "limits_arithmetic": limiting is not None,
            "set_limits": limiting is not None,
            "thrust_vector": self.has_thrust_vector,
            "target_observer": False,
            "tracker": tracker is not None,
            "turning": limiting is not None and limiting.turn_m_s_rad is not None,
        }

    @property
    def parts(self) -> frozenset[str]:
        """The parts that are there."""
        return frozenset(name for name, is_there in self.presence.items() if is_there)

    @property
    def sizes(self) -> dict[str, int]:
        """The constants of nmpc.h that are sizes of arrays."""
        return {"NMPC_ANGLES": len(COMMAND)}

    @property
    @abstractmethod
    def names(self) -> dict[str, str]:
        """What depends on the settings in the words of the port's rows."""

    @cached_property
    def port(self) -> ControllerPort:
        """What the controller takes, gives and keeps."""
        return ControllerPort(self.settings.controller.method, self.parts, self.sizes, self.names)

    @property
    def state(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_state_t, in their order."""
        return self.port.quantities("state")

    @property
    def target(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_target_t, in their order."""
        return self.port.quantities("target")

    @property
    def command(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_command_t, in their order."""
        return self.port.quantities("command")

    @property
    def shift(self) -> tuple[str, ...]:
        """The quantity of each number that nmpc_frame_jumped reads, in their order."""
        return self.port.shift

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
