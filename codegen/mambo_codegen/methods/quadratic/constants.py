"""The constants of a controller with a quadratic cost."""

from functools import cached_property

from mambo_codegen.methods.quadratic.attitude_constants import AttitudeConstants, attitude_constants
from mambo_codegen.methods.quadratic.formats import QuadraticFormats, formats
from mambo_codegen.methods.quadratic.guard_constants import GuardConstants, guard_constants
from mambo_codegen.methods.quadratic.height_constants import HeightConstants, height_constants
from mambo_codegen.methods.quadratic.law import LawConstants, law_constants, limits
from mambo_codegen.methods.quadratic.observer_constants import ObserverConstants, observer_constants
from mambo_codegen.methods.quadratic.thrust_vector_constants import (
    ThrustVectorConstants,
    thrust_vector_constants,
)
from mambo_codegen.methods.quadratic.tilt_gain_constants import TiltGainConstants, tilt_gain_constants
from mambo_codegen.methods.shared.constants import Constants
from mambo_codegen.methods.shared.limits_constants import LimitsConstants, stored_quantities
from mambo_codegen.methods.shared.tracker_constants import TrackerConstants


class QuadraticConstants(Constants):
    """What follows from settings with `cost.norm = "quadratic"`."""

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

    @property
    def climb_tracker(self) -> TrackerConstants | None:
        """The constants of the tracker of the target's height; None without one."""
        return self.height.tracker if self.height else None

    @cached_property
    def limiting(self) -> LimitsConstants:
        """The constants of the limits of speed, braking and place, in float64."""
        return limits(self.settings)

    def choose_formats(self) -> QuadraticFormats:
        """Choose the formats of fixed point."""
        return formats(self.settings)

    @property
    def stored(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_t, in their order."""
        observer = [*["position"] * 2, *["speed"] * 2, *["acceleration"] * 2]
        attitude = [*["acceleration"] * 8, *["sine"] * 2]
        attitude += [*["acceleration"] * 8, *["factor"] * 2] if self.tilt_gain else []
        tracker = [quantity for quantity in self._stored_tracker for _ in "xy"]
        limiting = stored_quantities("move", "move")
        if self.settings.target.gives_acceleration:
            limiting += ("velocity", "velocity")
        height = self._stored_height
        if self.height:
            limiting += ("position",) * 4
        tilt = ["angle"] * 2 if self.feedback_steps else []
        guard = ["angle"] * 2 if self.guard else []
        return (*observer, *attitude, *tracker, *height, *limiting, *tilt, *guard, "angle", "angle")

    @property
    def _stored_tracker(self) -> tuple[str, ...]:
        """The quantity of each number that a tracker stores along an axis, in their order."""
        if self.tracker is None:
            return ()
        velocity = () if self.tracker.is_given else ("velocity",)
        return (*velocity, "acceleration", "acceleration", *(("factor",) * 3 if self.tracker.noise else ()))

    @property
    def _stored_height(self) -> tuple[str, ...]:
        """The quantity of each number in nmpc_height_t, in their order."""
        if self.height is None:
            return ()
        learnt = {"gain": ["factor"], "acceleration": ["acceleration"], "none": []}[self.height.learn]
        commands = ["thrust"] * (3 if self.guard else 1)
        moved = [*["acceleration"] * 3, "factor", *commands]
        return ("position", "speed", *learnt, *moved, *self._stored_tracker)
