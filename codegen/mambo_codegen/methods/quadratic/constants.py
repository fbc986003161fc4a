"""The constants of a controller with a quadratic cost."""

from functools import cached_property

from mambo_codegen.methods.quadratic.attitude_constants import AttitudeConstants, attitude_constants
from mambo_codegen.methods.quadratic.formats import QuadraticFormats, formats
from mambo_codegen.methods.quadratic.guard_constants import GuardConstants, guard_constants
from mambo_codegen.methods.quadratic.height_constants import HeightConstants, height_constants
from mambo_codegen.methods.quadratic.law import LawConstants, law_constants, limits
from mambo_codegen.methods.quadratic.observer_constants import ObserverConstants, observer_constants
from mambo_codegen.methods.quadratic.target_observer_constants import (
    TargetObserverConstants,
    target_observer_constants,
)
from mambo_codegen.methods.quadratic.thrust_vector_constants import (
    ThrustVectorConstants,
    thrust_vector_constants,
)
from mambo_codegen.methods.quadratic.tilt_gain_constants import TiltGainConstants, tilt_gain_constants
from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.limits_constants import LimitsConstants
from mambo_codegen.port.row import NUMBER


class QuadraticConstants(Constants):
    """What follows from settings with `controller.method = "quadratic"`."""

    @property
    def step_s(self) -> float:
        """The step of the prediction, tau: the update period."""
        return self.settings.horizon.update_period_s

    @cached_property
    def attitude(self) -> AttitudeConstants:
        """The constants of the attitude model, in float64."""
        return attitude_constants(self.settings)

    @cached_property
    def thrust_vector(self) -> ThrustVectorConstants | None:
        """The constants of the thrust vector, in float64; None with small angles."""
        return thrust_vector_constants(self.settings, self.attitude.gain_m_step2_rad)

    @cached_property
    def tilt_gain(self) -> TiltGainConstants | None:
        """The constants of the tilt gain, in float64; None if none is learnt."""
        return tilt_gain_constants(self.settings)

    @cached_property
    def observer(self) -> ObserverConstants:
        """The constants of the observer, in float64."""
        return observer_constants(self.settings)

    @cached_property
    def law(self) -> LawConstants:
        """The constants of the cost's minimum, in float64."""
        return law_constants(self.settings)

    @cached_property
    def height(self) -> HeightConstants | None:
        """The constants of the height, in float64; None without it."""
        return height_constants(self.settings)

    @cached_property
    def guard(self) -> GuardConstants | None:
        """The constants of the guard, in float64; None without it."""
        return guard_constants(self.settings)

    @cached_property
    def target_observer(self) -> TargetObserverConstants:
        """The constants of the target's observer, in float64."""
        return target_observer_constants(self.settings)

    @cached_property
    def limiting(self) -> LimitsConstants:
        """The constants of the limits of speed, braking and place, in float64."""
        return limits(self.settings)

    def choose_formats(self) -> QuadraticFormats:
        """Choose the formats of fixed point."""
        return formats(self.settings)

    @property
    def presence(self) -> dict[str, bool]:
        """Whether each part is there."""
        model, feedback = self.settings.model, self.feedback_steps or (0.0, 0.0)
        return super().presence | {
            "age": bool(self.observer.age_steps),
            "confine": self.has_height or self.tilt_gain is not None,
            "drag": bool(self.observer.drag_1_step),
            "lift": self.height is not None and self.height.learns_acceleration,
            "pitch_feedback": feedback[1] != 0,
            "pitch_trim": model.pitch_trim_rad != 0,
            "predicted": model.start_attitude == "predicted",
            "quadratic": True,
            "roll_feedback": feedback[0] != 0,
            "roll_trim": model.roll_trim_rad != 0,
            "shift": True,
            "thrust_gain": self.height is not None and self.height.learns_gain,
            "target_observer": True,
            "tilt_gain": self.tilt_gain is not None,
            "two_moves": self.law.moves == 2,
        }

    @property
    def names(self) -> dict[str, str]:
        """What depends on the settings in the words of the port's rows."""
        gain = self.height.thrust_gain if self.height else 1.0
        return {
            "over_gain": "" if gain == 1 else f" / {gain}",
            "expected": "commanded" if gain == 1 else "expected",
        }

    @property
    def stored(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_t, in their order."""
        return tuple(row.quantity for row in self.port.kept("controller", NUMBER))
