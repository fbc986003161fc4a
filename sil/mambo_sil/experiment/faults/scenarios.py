"""The list of faults: name, duration, effect, and the statuses that the controller must return."""

import math
from dataclasses import dataclass, field
from typing import Final

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.inputs import Status
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.link import NOT_CALLED
from mambo_sil.drone.plant.vehicle import LEVER_ERRORS_M
from mambo_sil.experiment.faults.fault import (
    Alteration,
    FreezeState,
    KeepInputs,
    ScaleState,
    SetState,
    SetThrust,
    WrapYaw,
    move_target,
    shift_yaw,
)
from mambo_sil.flight.fences import square_fence, with_limits

TO_THE_END: Final = math.inf
FAR_M: Final = 30.0
FENCE_M: Final = 1.0
"""Half the width of a fence round the origin, which the figure of eight leaves."""


@dataclass(frozen=True, eq=False)
class FaultScenario:
    """A named fault without its onset.

    answers: exactly the statuses that the controller must return during the fault; None: any.
    weights: tracking and effort weight set at the onset; the settings' weights return at the end.
    limits:  the numbers of nmpc_limits_t set at the onset; the settings' limits return at the end.
    moved_m: displacement of the true target along x from the onset on.
    turning: whether the heading turns throughout the flight.
    below_m: how far below where the controller takes it to be the drone is seen, throughout the flight.
    levelled: whether the caller commands zero tilt after `flights.PATIENCE` rejected steps.
    may_crash: whether no controller that flies the height by the state can be asked to stay in the air.
    """

    name: str
    duration_s: float
    alter: Alteration = field(default_factory=KeepInputs)
    drop_every: int = 0
    late_updates: int = 0
    weights: tuple[float, float] | None = None
    limits: tuple[float, ...] | None = None
    answers: frozenset[int] | None = None
    moved_m: float = 0.0
    turning: bool = False
    below_m: float = 0.0
    levelled: bool = False
    may_crash: bool = False


_NAN: Final = math.nan
_FEET_PER_M: Final = 1.0 / 0.3048
_DEGREES_PER_RAD: Final = 180.0 / math.pi


def scenarios(settings: Settings) -> tuple[FaultScenario, ...]:
    """Return the faults; their magnitudes depend on the input ranges of `settings`.

    Faults of the weights are there with a 1-norm only, faults of the limits with limits only. With a height
    a state that is missing to the end, or wrong for 5 s, is so for the thrust too, which a stock loop takes
    from the truth.
    """
    commands_thrust = settings.height is not None
    jump_m = min(100.0, settings.ranges.position_m / 2.0)
    beyond_m = 3.0 * settings.ranges.position_m
    outage = SetState(range(7), _NAN)
    bursts = SetState(range(7), _NAN, on=3, of=10)
    jump = move_target(jump_m)
    bad_state, bad_target = _only(Status.BAD_STATE), _only(Status.BAD_TARGET)
    levels_out = "caller levels out"
    return (
        FaultScenario(
            "state NaN in 3 of 10 steps, 5 s", 5.0, bursts, answers=_only(Status.OK, Status.BAD_STATE)
        ),
        FaultScenario("state NaN, 0.2 s", 0.2, outage, answers=bad_state),
        FaultScenario("state NaN, 1 s", 1.0, outage, answers=bad_state),
        FaultScenario(f"state NaN, 1 s, {levels_out}", 1.0, outage, answers=bad_state, levelled=True),
        FaultScenario("state NaN, 5 s", 5.0, outage, answers=bad_state),
        FaultScenario(f"state NaN, 5 s, {levels_out}", 5.0, outage, answers=bad_state, levelled=True),
        FaultScenario(
            "state NaN to the end", TO_THE_END, outage, answers=bad_state, may_crash=commands_thrust
        ),
        FaultScenario(
            f"state NaN to the end, {levels_out}",
            TO_THE_END,
            outage,
            answers=bad_state,
            levelled=True,
            may_crash=commands_thrust,
        ),
        FaultScenario("x infinite, 1 s", 1.0, SetState(range(1), math.inf), answers=bad_state),
        FaultScenario("vy minus infinite, 1 s", 1.0, SetState(range(3, 4), -math.inf), answers=bad_state),
        *(FaultScenario(f"state frozen, {span_s:g} s", span_s, FreezeState()) for span_s in (0.2, 1.0)),
        FaultScenario("state frozen, 5 s", 5.0, FreezeState(), may_crash=commands_thrust),
        FaultScenario("every 2nd tick dropped, 5 s", 5.0, drop_every=2, answers=_only(Status.OK, NOT_CALLED)),
        FaultScenario("all ticks dropped, 0.2 s", 0.2, drop_every=1, answers=_only(NOT_CALLED)),
        FaultScenario("all ticks dropped, 1 s", 1.0, drop_every=1, answers=_only(NOT_CALLED)),
        *(FaultScenario(f"commands {late} ticks late, 5 s", 5.0, late_updates=late) for late in (2, 5, 20)),
        *(
            FaultScenario(f"target {jump_m:g} m off, {span_s:g} s", span_s, jump)
            for span_s in (0.2, 1.0, 5.0)
        ),
        FaultScenario(f"target jumps {jump_m:g} m and stays", TO_THE_END, jump, moved_m=jump_m),
        FaultScenario("target beyond the range, 1 s", 1.0, move_target(beyond_m), answers=bad_target),
        *(_of_the_height() if commands_thrust else _of_the_thrust()),
        FaultScenario("yaw a turn off, to the end", TO_THE_END, shift_yaw(2.0 * math.pi)),
        FaultScenario("yaw wrapped at pi, turning, to the end", TO_THE_END, WrapYaw(), turning=True),
        FaultScenario("yaw half a turn off, 1 s", 1.0, shift_yaw(math.pi)),
        FaultScenario(
            "attitude in degrees, 5 s", 5.0, _scaled(1.0, _DEGREES_PER_RAD), may_crash=commands_thrust
        ),
        FaultScenario("position and velocity in feet, 5 s", 5.0, _scaled(_FEET_PER_M, 1.0)),
        FaultScenario("position and velocity in mm, 5 s", 5.0, _scaled(1000.0, 1.0)),
        *(
            FaultScenario(
                f"seen {100.0 * abs(below_m):g} cm {'below' if below_m > 0.0 else 'above'} the place told",
                TO_THE_END,
                below_m=below_m,
                answers=_only(Status.OK),
            )
            for below_m in LEVER_ERRORS_M
        ),
        *(_wrong_weights(settings) if method_of(settings).weight_limits else ()),
        *(_limited(settings) if method_of(settings).limiting else ()),
    )


def _of_the_thrust() -> tuple[FaultScenario, ...]:
    bad_thrust = _only(Status.BAD_THRUST)
    return (
        FaultScenario("thrust reported as zero, 1 s", 1.0, SetThrust(0.0), answers=bad_thrust),
        FaultScenario("thrust NaN, 1 s", 1.0, SetThrust(_NAN), answers=bad_thrust),
    )


def _of_the_height() -> tuple[FaultScenario, ...]:
    return (
        FaultScenario("thrust told as least, 1 s", 1.0, SetThrust(1.0), answers=_only(Status.OK)),
        FaultScenario("floor reported in the air, 1 s", 1.0, SetState(range(9, 10), 1.0)),
        FaultScenario("height NaN, 1 s", 1.0, SetState(range(7, 8), _NAN), answers=_only(Status.BAD_STATE)),
    )


def _limited(settings: Settings) -> tuple[FaultScenario, ...]:
    ok, refused = _only(Status.OK), _only(Status.OK, Status.BAD_LIMITS)
    near = with_limits(settings, **square_fence(FENCE_M))
    far = move_target(FAR_M)
    return (
        FaultScenario(f"target {FAR_M:g} m away and stays", TO_THE_END, far, answers=ok, moved_m=FAR_M),
        FaultScenario(f"target {FAR_M:g} m through a wall, 5 s", 5.0, far, limits=near, answers=ok),
        FaultScenario(
            f"fence of {2 * FENCE_M:g} m, state NaN in 100 of 300 steps, 9 s",
            9.0,
            SetState(range(7), _NAN, on=100, of=300),
            limits=near,
            answers=_only(Status.OK, Status.BAD_STATE),
        ),
        FaultScenario(f"fence of {2 * FENCE_M:g} m, 5 s", 5.0, limits=near, answers=ok),
        FaultScenario(
            "speed limit 0.5 m/s, 5 s", 5.0, limits=with_limits(settings, speed_m_s=0.5), answers=ok
        ),
        FaultScenario("limits NaN, 5 s", 5.0, limits=(_NAN,) * len(near), answers=refused),
        FaultScenario(
            "fence inside out, 5 s", 5.0, limits=with_limits(settings, **square_fence(-1.0)), answers=refused
        ),
    )


def _wrong_weights(settings: Settings) -> tuple[FaultScenario, ...]:
    right, bad_weight = settings.cost, _only(Status.OK, Status.BAD_WEIGHT)
    return (
        FaultScenario("weights NaN, 5 s", 5.0, weights=(_NAN, _NAN), answers=bad_weight),
        FaultScenario(
            "tracking weight -1, 5 s", 5.0, weights=(-1.0, right.effort_weight), answers=bad_weight
        ),
        FaultScenario("both weights zero, 5 s", 5.0, weights=(0.0, 0.0)),
        FaultScenario("effort weight 1e6, 5 s", 5.0, weights=(right.tracking_weight, 1e6)),
    )


def _only(*statuses: int) -> frozenset[int]:
    return frozenset(int(status) for status in statuses)


def _scaled(position: float, attitude: float) -> ScaleState:
    """Scale position and velocity by one factor, roll, pitch and yaw by another."""
    return ScaleState((*[position] * 4, *[attitude] * 3))
