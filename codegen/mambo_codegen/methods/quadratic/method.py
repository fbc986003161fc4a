"""The quadratic cost, minimised in closed form, behind the interface of all methods."""

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.methods.interface import LinearLaw, Method, StepResult
from mambo_codegen.methods.quadratic import formats, law
from mambo_codegen.methods.quadratic.arithmetic import QuadraticArithmetic
from mambo_codegen.methods.quadratic.attitude import AttitudeModel
from mambo_codegen.methods.quadratic.constants import QuadraticConstants
from mambo_codegen.methods.quadratic.controller import QuadraticController, QuadraticStep
from mambo_codegen.methods.quadratic.height_constants import height_context
from mambo_codegen.methods.quadratic.height_constants import refusals as height_refusals
from mambo_codegen.methods.quadratic.height_formats import GAIN_CHANGE
from mambo_codegen.methods.quadratic.law import STATES
from mambo_codegen.methods.quadratic.optimizer import ROW_QUANTITIES
from mambo_codegen.methods.quadratic.step import REST_M_S
from mambo_codegen.methods.quadratic.target_observer_constants import FALL
from mambo_codegen.methods.quadratic.thrust_vector_constants import thrust_vector_context
from mambo_codegen.methods.quadratic.tilt_gain_constants import tilt_gain_context
from mambo_codegen.methods.shared.limits_constants import LATER_LIMITS
from mambo_codegen.methods.shared.proofs import FLOAT_PROOFS, TURN_EVERYWHERE
from mambo_codegen.numbers.representation import THRUST
from mambo_codegen.settings.key import Refusal

_WORK: tuple[int, int] = (50, 1)
"""What a step counts as, in predicted states of the 1-norm."""


class Quadratic(QuadraticConstants, Method):
    """A controller with a quadratic cost."""

    folder: ClassVar[str] = "quadratic"
    step_type: ClassVar[type] = QuadraticStep
    sub_blocks: ClassVar[Mapping[str, str]] = {
        "numbers": "comparisons, limits and products",
        "inputs": "the checks of inputs",
        "trigonometry": "sine and cosine of the heading",
        "thrust_vector": "the direction of the thrust",
        "attitude": "how the drone answers the commands",
        "tilt_gain": "how much it tilts, over what the model says",
        "axis": "what x, y and the height have in common",
        "observer": "position, velocity and disturbance",
        "target_observer": "motion of the target, by set-points that say what they know",
        "optimizer": "the minimum of the cost",
        "guard": "how much the commands may vary",
        "height": "the third axis, whose command is the thrust",
        "height_command": "that thrust",
        "limits_arithmetic": "roots and products of the limits",
        "limits": "speed, braking and place",
        "set_limits": "what the limits need, and their functions of nmpc.h",
        "step": "what the functions of a control step hand on",
        "observe": "where the drone is",
        "aim": "what the next command flies to",
        "command": "the command of the least cost",
        "advance": "a control step",
        "interface": "the functions of nmpc.h",
        "heading": "set-points of a yaw loop",
        "float": "the same functions with floats",
    }
    setter: ClassVar[str] = "report_command"
    digested: ClassVar[tuple[str, ...]] = ("steps_blind", "stored")
    iterates: ClassVar[bool] = False
    unnamed: ClassVar[tuple[str, ...]] = (
        "target",
        *LATER_LIMITS,
        "height.thrust_gain",
        "model.tilt",
        "observer.tilt_gain",
    )
    float_proofs: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "take_numbers": (*FLOAT_PROOFS["take_numbers"], "-eva-use-spec sine_cosine"),
        "refuse_nan": (
            *FLOAT_PROOFS["refuse_nan"],
            # What they require is that they are called without NaN.
            "-eva-use-spec sine_cosine,attitude_measure,optimizer_minimize",
        ),
        "turn_everywhere": ("-warn-special-float nan", *TURN_EVERYWHERE),
    }

    def refusals(self) -> list[Refusal]:
        """Return why a controller with a quadratic cost cannot have the settings."""
        settings = self.settings
        refused = law.refusals(settings) or height_refusals(settings)
        return refused or (formats.refusals(settings) if settings.code.scalar == "fixed" else [])

    def reference_controller(self, n: int = 1) -> QuadraticController:
        """Return n controllers in NumPy that compute the bits of the C."""
        return QuadraticController(self, n)

    @property
    def proofs(self) -> Mapping[str, tuple[str, ...]]:
        """The options of the proofs; the rows of the target's observer have a contract."""
        found = super().proofs
        if "refuse_nan" not in found:
            return found
        *others, specs = found["refuse_nan"]
        return {**found, "refuse_nan": (*others, f"{specs},motion_row")}

    @property
    def results(self) -> tuple[StepResult, ...]:
        """The results of a step."""
        return (
            StepResult("status"),
            StepResult("command_rad", ("angle",), (2,)),
            StepResult("steps_blind"),
            StepResult("saturated", count_type=np.bool_),
            StepResult("stored", self.stored, (len(self.stored),)),
            StepResult("active_limits"),
            *((StepResult("thrust_m_s2", THRUST),) if self.has_height else ()),
        )

    @property
    def setter_quantities(self) -> tuple[str, ...]:
        """The quantities of a command."""
        return self.command

    @property
    def work(self) -> tuple[int, int]:
        """What the products of a step count as, and one iteration."""
        return _WORK

    @property
    def outage_steps(self) -> int:
        """Control steps without a good state over which the observer predicts."""
        return self.observer.outage_steps

    @property
    def least_square(self) -> float:
        """That of the limits or, with the direction of the thrust, of the shortest move that it leaves."""
        vector = self.thrust_vector
        left = vector.least_spare_m_step2 if vector else math.inf
        return min(super().least_square, 0.99 * left**2)

    @property
    def linear_law(self) -> LinearLaw:
        """The law in control terms."""
        period_s, model = self.settings.horizon.update_period_s, self.settings.model
        scale = np.array([1.0, period_s, period_s**2])
        loops = law.closed_loops(self.settings)
        return LinearLaw(
            gain=-self.law.rows[:, 0, :3] * self.attitude.command_rad_step2_m[:, None] * scale,
            loops=(
                _without_unread(loops[0], model.roll_integral_1_s, model.roll_delay_s),
                _without_unread(loops[1], model.pitch_integral_1_s, model.pitch_delay_s),
            ),
            observer_gain=self.observer.gain / period_s ** np.subtract.outer(np.arange(3), np.arange(2)),
        )

    @property
    def context(self) -> dict[str, object]:
        """What only the templates of a quadratic cost insert."""
        period_s, model = self.settings.horizon.update_period_s, self.settings.model
        found = self.numbers.formats
        return {
            "quadratic": True,
            "attitude": self.attitude,
            "move_limits": AttitudeModel(self, QuadraticArithmetic(self)).command_limit.tolist(),
            "observer": self.observer,
            "law": self.law,
            **height_context(self.height),
            **thrust_vector_context(self.thrust_vector),
            **tilt_gain_context(self.tilt_gain),
            **_target_context(self),
            "gain_change": GAIN_CHANGE,
            "guard": self.guard,
            "stored_numbers": len(self.stored),
            "row_quantities": ROW_QUANTITIES,
            "height_quantities": [name for name in ROW_QUANTITIES if name != "row_i"],
            "row_names": STATES,
            "height_names": [name for name in STATES if name != "i"],
            "stored_limits": _stored_limits(self),
            "attitude_shares": [
                period_s / (period_s + lag_s) for lag_s in (model.roll_lag_s, model.pitch_lag_s)
            ],
            "thrust_share": period_s / (period_s + self.settings.height.lag_s)
            if self.settings.height
            else None,
            "shifts": (shifts := found.shifts if isinstance(found, formats.QuadraticFormats) else {}),
            "number_of": {name: _number_macro(bits) for name, bits in shifts.items()},
            "plain_products": _plain_products(self),
            "rest_m_step": REST_M_S * period_s,
        }


def _target_context(constants: QuadraticConstants) -> dict[str, object]:
    """Return what the template of the target's observer inserts."""
    return {
        "observer_of_target": constants.target_observer,
        "memory_fall": FALL,
        "level_snap_s": float(np.mean(constants.law.snap_s)),
        "climb_snap_s": constants.height.snap_s if constants.height else None,
        "drag": bool(constants.observer.drag_1_step),
    }


def _without_unread(loop: NDArray[np.float64], integral_1_s: float, delay_s: float) -> NDArray[np.float64]:
    """Return the transition of `law.MOVED` less integral part and delay where the model has none."""
    unread = {name for name, value in (("i", integral_1_s), ("c", delay_s)) if value == 0}
    kept = [k for k, state in enumerate(law.MOVED) if state not in unread]
    return loop[np.ix_(kept, kept)]


def _number_macro(shift: int) -> str:
    """Return the macro of the C that shifts a sum by so many bits to a number."""
    names = ((32, "NMPC_NUMBER_ABOVE"), (17, "NMPC_NUMBER_BELOW"), (0, "(nmpc_real_t)NMPC_ROUNDED"))
    return next(name for least, name in names if shift >= least)


def _stored_limits(constants: QuadraticConstants) -> list[float]:
    """Return bounds of what a controller stores, as numbers of the C, in ascending order."""
    observed, limit = constants.target_observer, constants.attitude.limit_m_step2
    bounds = [
        (constants.settings.ranges.position_m, "position"),
        (constants.observer.velocity_limit_m_step, "speed"),
        (constants.observer.disturbance_limit_m_step2, "acceleration"),
        (limit, "acceleration"),
        (formats.LAGGED * limit, "acceleration"),
        (constants.settings.limits.tilt_rad, "angle"),
        (observed.update_s * observed.level.acceleration, "acceleration"),
        (observed.update_s * observed.level.jerk, "acceleration"),
        (observed.velocity_range, "velocity"),
        (observed.most_noise, "velocity"),
        (observed.longest, "whole"),
        *((one, "velocity") for limits in observed.limits for one in limits.row),
    ]
    return sorted(constants.numbers.constant(*bound) for bound in bounds)


def _plain_products(constants: QuadraticConstants) -> list[str]:
    """Return the products of two numbers that a controller with a quadratic cost has in fixed point."""
    learns = constants.tilt_gain is not None
    wanted = {
        "speed_product": True,
        **dict.fromkeys(("tilt_product", "command_product"), constants.thrust_vector is None),
        "slope_acceleration": constants.thrust_vector is not None,
        "per_step_product": True,
        "per_step2_product": True,
        "drag_product": bool(constants.observer.drag_1_step),
        "aged_position": bool(constants.observer.age_steps),
        "aged_velocity": bool(constants.observer.age_steps),
        "feedback_product": constants.feedback_steps is not None,
        "ratio_product": constants.law.moves > 1,
        **dict.fromkeys(
            ("reach_product", "gravity_product", "step2_product", "thrust_product"),
            constants.has_height,
        ),
        "factor_product": True,
        "learning_product": learns,
        **dict.fromkeys(
            ("noise_product", "target_product", "tracker_product", "change_product", "count_product"), True
        ),
    }
    return [name for name, is_wanted in wanted.items() if is_wanted]
