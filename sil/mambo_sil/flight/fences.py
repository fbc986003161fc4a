"""Fences that are set in flight, and how flights keep within the limits of their controllers."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from mambo_codegen.methods import method_of
from mambo_codegen.methods.shared.limits_constants import in_order
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.elementary import hypotenuse
from mambo_sil.errors import FlightError
from mambo_sil.flight.engine.adjusted import AdjustedController, Adjustment
from mambo_sil.flight.loop import Flight, PositionController
from mambo_sil.flight.metrics import TRANSIENT_S, horizontal_error_m, horizontal_speed_m_s
from mambo_sil.flight.scenario import Scenario
from mambo_sil.flight.traces import Trace

Walls = tuple[float, float, float, float, float, float]
"""x_min, y_min, floor, x_max, y_max, ceiling of a fence, m, heights up; infinity for no wall."""

FAST: Final = 0.5
"""Share of the speed limit beyond which a flight shows its speed."""


@dataclass(frozen=True, eq=False)
class LimitMetrics:
    """How n flights keep within limits, each field (n,); NaN for a flight that was lost."""

    speed_excess: FloatArray
    """Largest horizontal speed over the speed limit, less 1; 0 if it never exceeds the limit."""
    overshoot_m: FloatArray
    """Largest distance beyond the last target, along the line from the first; 0 if the last one moves."""
    past_wall_m: FloatArray
    """Largest distance outside the fence after the first time inside; 0 without a fence."""
    late_error_m: FloatArray
    """Largest horizontal error after the first TRANSIENT_S."""


LIMIT_METRICS: Final = tuple(field.name for field in fields(LimitMetrics))


def with_limits(settings: Settings, **changed: ArrayLike) -> tuple[float, ...]:
    """Return the numbers of nmpc_limits_t for settings that have limits, with some of its members changed."""
    limiting = method_of(settings).limiting
    if limiting is None:
        raise FlightError(
            "the settings have no limits: give limits.speed_m_s, limits.braking_m_s2 or a fence"
        )
    return tuple(in_order(limiting.named | changed).tolist())


def square_fence(half_width_m: float) -> dict[str, tuple[float, float]]:
    """Return the walls of a square round the origin, by their members of nmpc_limits_t."""
    return {"fence_min_m": (-half_width_m, -half_width_m), "fence_max_m": (half_width_m, half_width_m)}


def fenced(
    controller: PositionController, settings: Settings, scenarios: Sequence[Scenario], flight: Flight
) -> PositionController:
    """Return the controller of n flights with the fences of their scenarios, itself if none has one.

    Raises FlightError for a fence with settings that have no limits.
    """
    adjustments = [
        Adjustment(
            row, _update(flight, one), "set_limits", with_limits(settings, **square_fence(one.fence_m))
        )
        for row, one in enumerate(scenarios)
        if one.fence_m
    ]
    return AdjustedController(controller, len(scenarios), adjustments) if adjustments else controller


def measure_limits(trace: Trace, settings: Settings, scenarios: Sequence[Scenario]) -> LimitMetrics:
    """Return how flights keep within the limits of `settings` and the fences of their scenarios."""
    excess = (horizontal_speed_m_s(trace).max(axis=0) / with_limits(settings)[0]) - 1.0
    return LimitMetrics(
        speed_excess=np.maximum(excess, 0.0),
        overshoot_m=_overshoot_m(trace),
        past_wall_m=np.array([_past_wall_m(trace, row, settings, one) for row, one in enumerate(scenarios)]),
        late_error_m=horizontal_error_m(trace)[trace.time_s >= TRANSIENT_S].max(axis=0, initial=0.0),
    )


def walls_m(settings: Settings, fence_m: float = 0.0) -> Walls | None:
    """Return the fence of a flight, with `fence_m` +/- that along x and y; None without any wall."""
    fence, square = settings.limits.fence, (-fence_m, fence_m)
    ends = [
        square if fence_m else (fence.x_min_m, fence.x_max_m),
        square if fence_m else (fence.y_min_m, fence.y_max_m),
        (fence.floor_m, fence.ceiling_m) if settings.height else (0.0, 0.0),
    ]
    x, y, height = ((low, high) if low < high else (-np.inf, np.inf) for low, high in ends)
    walls: Walls = x[0], y[0], height[0], x[1], y[1], height[1]
    return walls if np.isfinite(walls).any() else None


def nears_limit(trace: Trace, speed_limit_m_s: float) -> bool:
    """Return whether the first flight shows its speed: it came near the limit (0: none)."""
    return bool(0.0 < FAST * speed_limit_m_s < horizontal_speed_m_s(trace)[:, 0].max())


def _update(flight: Flight, scenario: Scenario) -> int:
    """Return the update of a flight that is nearest to the time of its fence."""
    return int(np.searchsorted(flight.times_s(), scenario.fence_time_s - flight.update_period_s / 2.0))


def _overshoot_m(trace: Trace) -> FloatArray:
    first, last = trace.target[0, :, :2], trace.target[-1, :, :2]
    way_m = last - first
    length_m = hypotenuse(way_m[:, 0], way_m[:, 1])
    rests = (length_m > 0.0) & (trace.target[-1, :, 2:4] == 0.0).all(axis=1)
    along = (way_m / np.where(rests, length_m, 1.0)[:, np.newaxis]).T
    beyond = trace.position_m[..., :2] - last
    past_m = (beyond[..., 0] * along[0] + beyond[..., 1] * along[1]).max(axis=0)
    return np.asarray(np.where(rests, np.maximum(past_m, 0.0), 0.0 * past_m))


def _past_wall_m(trace: Trace, row: int, settings: Settings, scenario: Scenario) -> float:
    walls = walls_m(settings, scenario.fence_m)
    if walls is None:
        return 0.0 * float(trace.position_m[-1, row, 0])
    low, high = np.array(walls[:3]), np.array(walls[3:])
    since = trace.time_s >= (scenario.fence_time_s if scenario.fence_m else -np.inf)
    place_m = trace.position_m[since, row] * [1.0, 1.0, -1.0]  # the height is up
    outside_m = np.maximum(np.maximum(low - place_m, place_m - high).max(axis=1), 0.0)
    inside = np.flatnonzero(outside_m == 0.0)
    return float(outside_m[inside[0] if len(inside) else 0 :].max())
