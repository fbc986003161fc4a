"""Limits of a plan, from the drone, from others like it, and from the settings of its controller.

The attitude loop follows the horizontal acceleration a of a course with a lag and a dead time, and the motors
the vertical one: to fly a, the controller commands, to second order in these times,
a + (lag + dead time) a' + (lag dead time + dead time^2 / 2) a''. So jerk and snap take a share of tilt and
thrust.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_codegen.numbers.reach import PLANNED_SHARE, THRUST_LEFT, largest_acceleration_m_s2
from mambo_codegen.settings.model import Settings
from mambo_extensions.plan.hermite import ORDERS
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.vehicle import Vehicle
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile

LEAST_THRUST_M_S2: Final = 0.3 * GRAVITY_M_S2
"""Least vertical thrust over mass where the settings have no height: roll and pitch need some."""

Rule = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""What a quantity (..., 3) takes of its limit, less 1, and the gradient of that (..., 3).

The second argument is the share (...) of tilt and thrust that may be taken.
"""


@dataclass(frozen=True, eq=False)
class FlightLimit:
    """A limit on a sum of derivatives of the position; the drone flies what is not above 0.

    weights: (ORDERS, 3) of position to snap along each axis.
    offset:  (3,) that is added.
    scale:   what 1 is of the limit itself: of the thrust, the part beyond the weight.
    """

    name: str
    weights: FloatArray
    offset: FloatArray
    rule: Rule
    scale: float = 1.0

    def of(self, motion: FloatArray, allowed: ArrayLike = 1.0) -> tuple[FloatArray, FloatArray]:
        """Return share of the limit less 1, and its gradient, of motions (ORDERS, ..., 3).

        allowed: (...) share of what the weakest drone has beyond its weight, and of the tilt if less.
        """
        summed = np.einsum("kc,k...c->...c", self.weights, motion)
        return self.rule(summed + self.offset, np.asarray(allowed, np.float64))


@dataclass(frozen=True)
class Figures:
    """The numbers that limits are made of; infinity for what has none.

    thrust_m_s2:         largest thrust over mass of the weakest drone.
    least_thrust_m_s2:   least vertical one.
    slope:               tangent of the largest steady tilt.
    tilt_lag_s, tilt_dead_time_s, thrust_lag_s, thrust_dead_time_s: with the width of their intervals.
    """

    thrust_m_s2: float
    least_thrust_m_s2: float
    slope: float
    tilt_lag_s: float
    tilt_dead_time_s: float
    thrust_lag_s: float
    thrust_dead_time_s: float
    drag_1_s: float
    speed_m_s: float
    """Horizontal, as the controller limits it."""
    climb_m_s: float
    descent_m_s: float
    walls_m: tuple[tuple[int, float, float], ...]
    """Of each wall the axis (0 to 2), which side it limits (1 or -1), and where it stands."""


def figures_of(drone: VehicleFile, settings: Settings, drawn: Vehicle) -> Figures:
    """Return the limits' numbers of a drone with these settings; `drawn` are others like it."""
    model, height, limits = settings.model, settings.height, settings.limits
    known = drone.uncertainty
    width = {} if known is None else known.model_dump(exclude_none=True)
    thrust_m_s2 = drone.largest_thrust_n / drone.body.mass_kg
    if height is not None:
        thrust_m_s2 = min(thrust_m_s2, height.thrust_max_m_s2)
    thrust_lag_s, thrust_dead_time_s = drone.motor_lag_s, 0.0
    if drone.thrust is not None:
        thrust_lag_s, thrust_dead_time_s = drone.thrust.lag_s, drone.thrust.dead_time_s
    weakest = weakest_share(drone, drawn) * (1.0 - width.get("thrust_gain", 0.0) / drone.thrust_gain)
    tilted = min(1.0 - width.get(f"{axis}_gain", 0.0) / getattr(model, f"{axis}_gain") for axis in _AXES)

    def slowest(part: str) -> float:
        found = (getattr(model, f"{axis}_{part}") + width.get(_NAMES[part](axis), 0.0) for axis in _AXES)
        return float(max(found))

    return Figures(
        thrust_m_s2=weakest * thrust_m_s2,
        least_thrust_m_s2=LEAST_THRUST_M_S2 if height is None else height.thrust_min_m_s2,
        slope=tilted * largest_acceleration_m_s2(settings) / GRAVITY_M_S2,
        tilt_lag_s=slowest("lag_s"),
        tilt_dead_time_s=slowest("delay_s"),
        thrust_lag_s=thrust_lag_s + width.get("thrust_lag_s", 0.0),
        thrust_dead_time_s=thrust_dead_time_s,
        drag_1_s=drone.body.drag_1_s,
        speed_m_s=limits.speed_m_s or math.inf,
        climb_m_s=math.inf if height is None else height.climb_m_s,
        descent_m_s=math.inf if height is None else height.descent_m_s,
        walls_m=_walls(settings),
    )


_AXES: Final = ("roll", "pitch")
_NAMES: Final[dict[str, Callable[[str], str]]] = {
    "lag_s": lambda axis: f"{axis}_lag_s",
    "delay_s": lambda axis: f"{axis}_dead_time_s",
}
"""Keys of [uncertainty] by those of [model]."""


def weakest_share(drone: VehicleFile, drawn: Vehicle) -> float:
    """Return the least thrust over mass of the drawn drones over that of the file, at most 1."""
    nominal = Vehicle.of(drone).airframe
    share = drawn.airframe.thrust_factor_n_s2 / drawn.airframe.mass_kg
    return min(1.0, float(np.min(share)) * float(nominal.mass_kg) / float(nominal.thrust_factor_n_s2))


def _walls(settings: Settings) -> tuple[tuple[int, float, float], ...]:
    """Return the walls of a fence along x ahead, y to the left, z up; a pair of equal ones is none."""
    fence = settings.limits.fence
    pairs = (
        (0, fence.x_min_m, fence.x_max_m),
        (1, -fence.y_max_m, -fence.y_min_m),
        (2, fence.floor_m, fence.ceiling_m),
    )
    return tuple(
        wall
        for axis, least, most in pairs
        if least != most
        for wall in ((axis, -1.0, least), (axis, 1.0, most))
    )


def limits_of(figures: Figures) -> list[FlightLimit]:
    """Return the limits of a drone with these numbers."""
    spare_m_s2 = _spare_m_s2(figures)
    spare_share = spare_m_s2 / (GRAVITY_M_S2 + spare_m_s2)
    return [
        FlightLimit("tilt", *_commanded(figures), _cone(figures.slope)),
        FlightLimit("thrust", *_commanded(figures), _ellipsoid(spare_m_s2), spare_share),
        FlightLimit("least thrust", *_commanded(figures), _above(figures.least_thrust_m_s2)),
        *(
            FlightLimit(name, _of(1), np.zeros(3), _below(np.array([0.0, 0.0, sign]), most_m_s))
            for name, sign, most_m_s in (
                ("climb", 1.0, figures.climb_m_s),
                ("descent", -1.0, figures.descent_m_s),
            )
            if most_m_s < math.inf
        ),
        *(
            [FlightLimit("speed", _of(1), np.zeros(3), _ball(figures.speed_m_s, np.array([1.0, 1.0, 0.0])))]
            if figures.speed_m_s < math.inf
            else []
        ),
        *(
            FlightLimit("fence", _of(0), np.zeros(3), _wall(axis, side, wall_m))
            for axis, side, wall_m in figures.walls_m
        ),
    ]


def _spare_m_s2(figures: Figures) -> float:
    """Return what the thrust of the weakest drone leaves beyond its weight."""
    return max(THRUST_LEFT * figures.thrust_m_s2 - GRAVITY_M_S2, 0.02 * GRAVITY_M_S2)


def _commanded(figures: Figures) -> tuple[FloatArray, FloatArray]:
    """Return weights and offset of the thrust over mass that must be commanded, drag included."""
    lag_s = np.array([figures.tilt_lag_s, figures.tilt_lag_s, figures.thrust_lag_s])
    dead_s = np.array([figures.tilt_dead_time_s, figures.tilt_dead_time_s, figures.thrust_dead_time_s])
    drag_1_s = figures.drag_1_s * np.array([1.0, 1.0, 0.0])
    first_s, second_s2 = lag_s + dead_s, lag_s * dead_s + dead_s * dead_s / 2.0
    weights = np.zeros((ORDERS, 3))
    for order, lead in enumerate((1.0, first_s, second_s2), start=2):
        weights[order] += lead
        weights[order - 1] += lead * drag_1_s
    return weights, np.array([0.0, 0.0, GRAVITY_M_S2])


def _of(order: int) -> FloatArray:
    weights = np.zeros((ORDERS, 3))
    weights[order] = 1.0
    return weights


def _norm(vector: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.sum(vector * vector, axis=-1) + 1e-12))


def _cone(slope: float) -> Rule:
    """Bound the horizontal part by `slope` times the vertical one."""

    def rule(thrust: FloatArray, allowed: FloatArray) -> tuple[FloatArray, FloatArray]:
        most_m_s2 = np.minimum(allowed, 1.0) * slope * GRAVITY_M_S2
        level = thrust * [1.0, 1.0, 0.0]
        size = _norm(level)
        gradient = level / (most_m_s2 * size)[..., np.newaxis]
        gradient[..., 2] = -1.0 / GRAVITY_M_S2
        return size / most_m_s2 - thrust[..., 2] / GRAVITY_M_S2, gradient

    return rule


def _ellipsoid(spare_m_s2: float) -> Rule:
    """Bound the thrust, of which the horizontal part may take PLANNED_SHARE of what the height leaves.

    The share is that of the thrust beyond the weight.
    """
    stretch = np.array([1.0 / PLANNED_SHARE, 1.0 / PLANNED_SHARE, 1.0])

    def rule(thrust: FloatArray, allowed: FloatArray) -> tuple[FloatArray, FloatArray]:
        stretched, most_m_s2 = stretch * thrust, allowed * spare_m_s2
        size = _norm(stretched)
        return (size - GRAVITY_M_S2) / most_m_s2 - 1.0, stretch * stretched / (most_m_s2 * size)[
            ..., np.newaxis
        ]

    return rule


def _ball(most: float, stretch: FloatArray) -> Rule:
    def rule(vector: FloatArray, _: FloatArray) -> tuple[FloatArray, FloatArray]:
        stretched = stretch * vector
        size = _norm(stretched)
        return size / most - 1.0, stretch * stretched / (most * size[..., np.newaxis])

    return rule


def _above(least_m_s2: float) -> Rule:
    def rule(thrust: FloatArray, _: FloatArray) -> tuple[FloatArray, FloatArray]:
        down = np.broadcast_to(np.array([0.0, 0.0, -1.0 / GRAVITY_M_S2]), thrust.shape)
        return (least_m_s2 - thrust[..., 2]) / GRAVITY_M_S2, down

    return rule


def _below(direction: FloatArray, most: float) -> Rule:
    def rule(vector: FloatArray, _: FloatArray) -> tuple[FloatArray, FloatArray]:
        return vector @ direction / most - 1.0, np.broadcast_to(direction / most, vector.shape)

    return rule


def _wall(axis: int, side: float, wall_m: float) -> Rule:
    """Bound a coordinate by a wall, to a metre."""
    outwards = np.zeros(3)
    outwards[axis] = side

    def rule(position: FloatArray, _: FloatArray) -> tuple[FloatArray, FloatArray]:
        return position @ outwards - side * wall_m, np.broadcast_to(outwards, position.shape)

    return rule
