"""The sections of the settings: every key of controller.toml, its default, bounds, unit and source.

The attribute path is the TOML path (`settings.horizon.prediction` is `prediction` under `[horizon]`).
The defaults are preset `table1`: Table I of the paper, and where the paper says nothing, a documented choice.
The descriptions are the comments of controller.toml and part of the JSON schema.
"""

import math
from typing import Annotated, Any, Final, Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from mambo_codegen.settings import reserved
from mambo_codegen.settings.fields import (
    ONE_NORM,
    QUADRATIC,
    WITH_GUARD,
    WITH_HEIGHT,
    Lag,
    Number,
    OnlyFor,
    OnlyWith,
    Ramp,
    SettingsSection,
    type_of,
)
from mambo_codegen.settings.limits_section import Limits
from mambo_codegen.settings.optimizer_section import Optimizer
from mambo_codegen.settings.optional_sections import Guard, Height


class ControllerSection(SettingsSection):
    """Which of the two controllers it is."""

    method: Literal["1-norm", "quadratic"] = Field(
        "1-norm",
        description='"1-norm" sums absolute values, as the paper does (eq 12), and RPROP searches for a '
        'small cost; "quadratic" sums squares, and its exact minimum is a matter of a few products.',
    )


class Horizon(SettingsSection):
    """How far the controller predicts, and how often it runs."""

    prediction: Annotated[int, ONE_NORM] = Field(
        10,
        ge=1,
        le=50,
        description="N_p, the prediction horizon: number of predicted states in the cost (eq 12, Table I).",
    )
    control: Annotated[int, ONE_NORM] = Field(
        2,
        ge=1,
        le=50,
        description="N_c, the control horizon, in prediction steps: the optimizer chooses a move of roll and "
        "pitch for each (eq 12, Table I). At most N_p; the last move is held to the end of the prediction "
        "horizon.",
    )
    prediction_step_s: Annotated[Number, ONE_NORM] = Field(
        0.07,
        ge=0.001,
        le=1,
        description="tau, the prediction step, in seconds: time between two predicted states (eqs 9-11). "
        "The paper prints 0.01 s; the horizon is then shorter than the lag of the Mambo's attitude loop, and "
        "the drone is lost.",
    )
    update_period_s: Number = Field(
        0.01,
        ge=0.001,
        le=1,
        description="Update period, in seconds: time between two calls of the step function (100 Hz in "
        "the paper).",
    )
    ramp_s: Annotated[Ramp, QUADRATIC] = Field(
        0.0,
        description="Duration of the ramp that leads from the first free move, the command, to the second, "
        "in seconds; 0 for one free move. With a ramp of 0.3 to 0.6 s the controller sees its tilt limit "
        "coming.",
    )

    @field_validator("control")
    @classmethod
    def _within_prediction(cls, control: int, info: ValidationInfo) -> int:
        longest = info.data.get("prediction", control)
        if control > longest:
            raise PydanticCustomError("horizon", f"must lie in 1..{longest} (horizon.prediction)")
        return control


class Model(SettingsSection):
    """The prediction model of the drone."""

    position_update: Annotated[Literal["exact", "printed"], ONE_NORM] = Field(
        "exact",
        description='Factor of the acceleration in the position update (eq 9): tau^2/2 for "exact"; tau/2, '
        'as the paper prints it, for "printed", whose units do not match.',
    )
    yaw_convention: Annotated[Literal["rotation", "printed"], ONE_NORM] = Field(
        "rotation",
        description='Signs of the terms with yaw psi in eq 8: "rotation" takes those of the rotation matrix '
        '(eq 3, NED); "printed" takes those that eq 8 prints, with which the drone is lost at 45 degrees of '
        "yaw.",
    )
    thrust: Annotated[Literal["measured", "hover"], ONE_NORM] = Field(
        "measured",
        description='Thrust over mass u_1/m in eq 8: "measured" takes that of the control step, as the paper '
        'does; "hover" takes 9.81 m/s^2 in every step, for a drone whose thrust is not known or is noisy.',
    )
    roll_lag_s: Lag = Field(
        0.0,
        description="Time constant of the first-order lag from commanded to predicted roll phi, in seconds; "
        "0 for no lag, as in the paper. Preset mambo has the lag identified on the Mambo's roll loop.",
    )
    pitch_lag_s: Lag = Field(
        0.0,
        description="Time constant of the first-order lag from commanded to predicted pitch theta, in "
        "seconds; 0 for no lag, as in the paper. Preset mambo has the lag identified on the Mambo's "
        "pitch loop.",
    )

    roll_gain: Annotated[Number, QUADRATIC] = Field(
        1.0, ge=0.2, le=2, description="Measured roll per commanded roll when the attitude loop has settled."
    )
    pitch_gain: Annotated[Number, QUADRATIC] = Field(
        1.0,
        ge=0.2,
        le=2,
        description="Measured pitch per commanded pitch when the attitude loop has settled.",
    )
    roll_delay_s: Annotated[Lag, QUADRATIC] = Field(
        0.0,
        description="Dead time of the roll loop and its lags other than roll_lag_s, in seconds, together: "
        "they count as one first-order lag.",
    )
    pitch_delay_s: Annotated[Lag, QUADRATIC] = Field(
        0.0, description="The same for the pitch loop: dead time and the lags other than pitch_lag_s."
    )
    roll_integral_1_s: Annotated[Number, QUADRATIC] = Field(
        0.0,
        ge=0,
        le=20,
        description="Integral gain of the roll loop over its angle gain, in 1/s; 0 for a loop without an "
        "integrator.",
    )
    pitch_integral_1_s: Annotated[Number, QUADRATIC] = Field(
        0.0, ge=0, le=20, description="Integral gain of the pitch loop over its angle gain, in 1/s."
    )
    roll_trim_rad: Annotated[Number, QUADRATIC] = Field(
        0.0,
        ge=-0.2,
        le=0.2,
        description="Measured roll at which the drone does not accelerate, in radians.",
    )
    pitch_trim_rad: Annotated[Number, QUADRATIC] = Field(
        0.0,
        ge=-0.2,
        le=0.2,
        description="Measured pitch at which the drone does not accelerate, in radians.",
    )
    acceleration_per_tilt: Annotated[Number, QUADRATIC] = Field(
        1.0,
        ge=0.2,
        le=2,
        description="Horizontal acceleration per radian of measured tilt, in units of 9.81 m/s^2.",
    )
    drag_1_s: Annotated[Number, QUADRATIC] = Field(
        0.0, ge=0, le=5, description="Linear drag: deceleration over velocity, in 1/s."
    )
    tilt: Annotated[Literal["small-angle", "exact"], QUADRATIC, WITH_HEIGHT] = Field(
        "small-angle",
        description='How a tilt accelerates the drone: "small-angle", in proportion to the angle, which is '
        'good to about 0.4 rad; "exact", as the direction of the thrust says, and no more is asked of the '
        "tilt than the largest thrust leaves beside the height. For tilt limits of more than 0.5 rad.",
    )
    start_attitude: Annotated[Literal["measured", "predicted"], QUADRATIC] = Field(
        "measured",
        description='Attitude at the start of the prediction: "measured", or "predicted" from the past '
        "commands, which closes no quick loop through the attitude and so tolerates slow motors.",
    )

    @field_validator("roll_lag_s", "pitch_lag_s")
    @classmethod
    def _no_lag_in_print(cls, lag: float, info: ValidationInfo) -> float:
        if lag > 0 and info.data.get("position_update") == "printed":
            raise PydanticCustomError(
                "lag",
                'must be 0 with model.position_update = "printed", which has no lag; '
                'write 0 here or position_update = "exact"',
            )
        return lag


class Target(SettingsSection):
    """What the 1-norm knows of the target's motion beyond its position and velocity."""

    acceleration: Annotated[Literal["none", "tracked"], ONE_NORM] = Field(
        "none",
        description='Acceleration of the target in the prediction: "none" predicts a target of constant '
        'velocity, as the paper does (eq 11); "tracked" estimates it from the velocities of successive '
        "steps, which must then be those of the target's motion, without noise. Held over the horizon, it "
        "removes most of the tracking error on curved paths.",
    )

    @field_validator("acceleration", mode="before")
    @classmethod
    def _is_known(cls, acceleration: Any) -> Any:
        if acceleration in ("given", "preview"):
            raise PydanticCustomError(
                "removed",
                'must be "none" or "tracked"; with a quadratic cost leave it out: since version 0.4 each '
                "target says what it knows of its acceleration, in its member `known`",
            )
        return acceleration

    tracker_gain: Annotated[Number, ONE_NORM] = Field(
        0.3,
        ge=0.01,
        le=1,
        description='With "tracked" alone: share of a new acceleration that the estimate of the acceleration '
        "and its rate takes; a larger gain follows faster and is noisier.",
    )


class Cost(SettingsSection):
    """The cost: distance from the target, and changes of the attitude command."""

    tracking_weight: Annotated[Number, ONE_NORM] = Field(
        2250.0,
        ge=0.001,
        le=1e6,
        description="lambda_1, in 1/m: weight of the 1-norm of the distance between predicted and target "
        "position (eq 12, Table I).",
    )
    effort_weight: Annotated[Number, ONE_NORM] = Field(
        1.0,
        ge=0,
        le=1e6,
        description="lambda_2, in 1/rad: weight of the 1-norm of the change from one move to the next "
        "(eq 12, Table I). A larger weight gives calmer commands and larger tracking errors.",
    )

    response_time_s: Annotated[Number, QUADRATIC] = Field(
        0.215,
        ge=0.02,
        le=2,
        description="Time in which the drone answers an error, in seconds: its cube is the weight of the "
        "command's rate, in s^3. Shorter is closer to the target and less robust.",
    )
    velocity_weight_s: Annotated[Number, QUADRATIC] = Field(
        0.0,
        ge=0,
        le=2,
        description="Weight of the velocity's error beside the position's, in seconds: more damping after "
        "large steps.",
    )


class Observer(SettingsSection):
    """The estimate of position, velocity and disturbance: a Kalman filter with fixed gains."""

    acceleration_noise: Number = Field(
        0.3, ge=1e-4, le=100, description="Noise density of the acceleration, in m/s^2 per root Hz."
    )
    disturbance_noise: Number = Field(
        0.3,
        ge=1e-4,
        le=100,
        description="Noise density of the disturbance's rate, in m/s^3 per root Hz: a larger one learns wind "
        "and model errors faster.",
    )
    position_noise: Number = Field(
        0.01, ge=1e-5, le=10, description="Noise density of the measured position, in m per root Hz."
    )
    velocity_noise: Number = Field(
        0.05, ge=1e-5, le=100, description="Noise density of the measured velocity, in m/s per root Hz."
    )
    disturbance_limit_m_s2: Number = Field(
        3.0, ge=0, le=20, description="Largest disturbance, in m/s^2; 0 for none."
    )
    measurement_age_s: Number = Field(
        0.0,
        ge=0,
        le=0.2,
        description="Age of the measured position and velocity, in seconds. Never more than measured: a "
        "wrong age of 0.04 s crashes.",
    )
    outage_s: Number = Field(
        0.5,
        ge=0,
        le=2,
        description="Time without a good state, in seconds, over which the controller flies on by its "
        "prediction; after it the controller brakes by its model, then levels. At most 250 update periods.",
    )
    tilt_gain: Literal["given", "learnt"] = Field(
        "given",
        description='Whether model.roll_gain and model.pitch_gain are right, "given", or "learnt" in flight, '
        "within 0.5 to 1.6 of them: for a drone whose gains are known to 10 % or worse.",
    )


class Damping(SettingsSection):
    """Feedback of the attitude's rates to the commands."""

    roll_rate_feedback_s: Number = Field(
        0.0,
        ge=0,
        le=0.2,
        description="Command of roll per rate of roll, in seconds; positive feedback, which takes excess "
        "damping off a slow roll loop. 0 for none.",
    )
    pitch_rate_feedback_s: Number = Field(
        0.0, ge=0, le=0.2, description="Command of pitch per rate of pitch, in seconds. 0 for none."
    )


class Ranges(SettingsSection):
    """The ranges of the inputs; a step refuses an input out of range with a status."""

    position_m: Number = Field(
        1000.0,
        ge=1,
        le=10000,
        description="Largest absolute position of drone and target along each axis, in metres.",
    )
    velocity_m_s: Number = Field(
        100.0,
        ge=0.1,
        le=1000,
        description="Largest absolute velocity of drone and target along each axis, in metres per second.",
    )
    thrust_acceleration_min_m_s2: Number = Field(
        1.0,
        ge=0.1,
        le=100,
        description="Smallest thrust over mass, u_1/m in eq 8, in metres per second squared; hover is 9.81.",
    )
    thrust_acceleration_max_m_s2: Number = Field(
        50.0,
        ge=0.1,
        le=1000,
        description="Largest thrust over mass, u_1/m in eq 8, in metres per second squared; more than the "
        "smallest.",
    )

    @field_validator("thrust_acceleration_max_m_s2")
    @classmethod
    def _max_above_min(cls, largest: float, info: ValidationInfo) -> float:
        smallest = info.data.get("thrust_acceleration_min_m_s2", -math.inf)
        if largest <= smallest:
            raise PydanticCustomError(
                "range", f"must be more than {smallest!r} (ranges.thrust_acceleration_min_m_s2)"
            )
        return largest


class Code(SettingsSection):
    """Types and names of the C."""

    scalar: Literal["float32", "float64", "fixed"] = Field(
        "float32",
        description="Scalar type of the C: float32 is float, float64 is double, fixed is fixed point with "
        "32-bit integers, for 32-bit processors without an FPU.",
    )
    prefix: str = Field(
        "nmpc",
        max_length=24,
        pattern=r"^[a-z][a-z0-9]*(_[a-z0-9]+)*$",
        description="Prefix of all public names, as in nmpc_step and NMPC_OK; with different prefixes "
        "several controllers can be linked into one firmware.",
    )

    @field_validator("prefix")
    @classmethod
    def _no_keyword(cls, prefix: str) -> str:
        if prefix in reserved.KEYWORDS:
            raise PydanticCustomError(
                "keyword", f"must not be a keyword of C or C++; write for example {prefix}_nmpc"
            )
        if prefix in reserved.STANDARD_NAMES:
            raise PydanticCustomError(
                "keyword",
                f"must not be a header or a name of the C library or POSIX; write for example {prefix}_nmpc",
            )
        if prefix in reserved.OWN_NAMES:
            raise PydanticCustomError(
                "keyword", f"must not begin names of the controller's own C; write for example {prefix}_nmpc"
            )
        return prefix


class Sections(SettingsSection):
    """All sections; `Settings` adds the rule between them."""

    controller: ControllerSection = Field(
        ControllerSection(), description="Which of the two controllers it is."
    )
    horizon: Horizon = Field(Horizon(), description="How far the controller predicts, and how often it runs.")
    model: Model = Field(Model(), description="The prediction model of the drone.")
    target: Target = Field(
        Target(),
        description="What the controller knows of the target's motion beyond its position and velocity.",
    )
    cost: Cost = Field(
        Cost(), description="The cost: distance from the target, and changes of the attitude command."
    )
    observer: Annotated[Observer, QUADRATIC] = Field(
        Observer(),
        description="The estimate of position, velocity and disturbance: a Kalman filter with fixed gains.",
    )
    damping: Damping = Field(Damping(), description="Feedback of the attitude's rates to the commands.")
    optimizer: Annotated[Optimizer, ONE_NORM] = Field(
        Optimizer(), description="The RPROP search for the moves."
    )
    limits: Limits = Field(Limits(), description="The limits of commands, speed, braking and place.")
    height: Annotated[Height | None, QUADRATIC, WITH_HEIGHT] = Field(
        None,
        description="The height as a third axis of the controller, whose command is the thrust. Without this "
        "section it commands roll and pitch alone.",
    )
    guard: Annotated[Guard | None, QUADRATIC, WITH_GUARD] = Field(
        None,
        description="The guard against commands that rattle, by noise in set-points or estimates. Without "
        "this section commands vary as the cost asks.",
    )
    ranges: Ranges = Field(
        Ranges(), description="The ranges of the inputs; a step refuses an input out of range with a status."
    )
    code: Code = Field(Code(), description="Types and names of the C.")

    def uses(self, path: str) -> bool:
        """Return whether a controller with these settings uses the key or section at a dotted path."""
        return self.unmet(path) is None

    def unmet(self, path: str) -> str | None:
        """Return why a controller with these settings does not use a dotted path; None if it does."""
        model, metadata = type(self), []
        for name in path.split("."):
            field = model.model_fields[name]
            metadata += field.metadata
            model = type_of(field)
        for mark in metadata:
            if isinstance(mark, OnlyFor) and (value := self.value(mark.path)) != mark.value:
                return f'with {mark.path} = "{value}"'
            if isinstance(mark, OnlyWith) and getattr(self, mark.section) is None:
                return f"without [{mark.section}]"
        return None

    def value(self, path: str) -> Any:
        """Return the value at a dotted path: of a key, or a section; of an absent section the default."""
        found: Any = self
        for name in path.split("."):
            field = type(found).model_fields[name]
            found = getattr(found, name)
            if found is None and path != name:
                found = type_of(field)()
        return found

    @property
    def values(self) -> dict[str, dict[str, Any]]:
        """All values, by the dotted paths of their sections, in the order of the file; no absent section."""
        found: dict[str, dict[str, Any]] = {}
        for section, values in self.model_dump(exclude_none=True).items():
            found[section] = {name: value for name, value in values.items() if not isinstance(value, dict)}
            inner = {name: value for name, value in values.items() if isinstance(value, dict)}
            found |= {f"{section}.{name}": value for name, value in inner.items()}
        return found

    @property
    def used_values(self) -> dict[str, dict[str, Any]]:
        """The values of the keys that a controller uses, by section; a section without any is left out."""
        found = {
            section: {name: value for name, value in values.items() if self.uses(f"{section}.{name}")}
            for section, values in self.values.items()
        }
        return {section: values for section, values in found.items() if values}


DEFAULTS: Final = Sections()
"""The settings that a missing key has."""
