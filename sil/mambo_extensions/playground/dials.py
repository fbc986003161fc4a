"""What the page's sliders change: for each position of a slider, the members of the engine's records."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from mambo_codegen.methods import method_of
from mambo_codegen.numbers.representation import WEIGHTS
from mambo_codegen.settings.model import Settings
from mambo_sil.drone.plant.disturbances import Disturbances
from mambo_sil.drone.sensors.mocap import MotionCapture
from mambo_sil.drone.vehicles.vehicle_sections import FirstOrderAttitude
from mambo_sil.flight.engine.records import flight_records
from mambo_sil.flight.height_profiles import HOVER_HEIGHT_M
from mambo_sil.flight.loop import Flight

_WIND: Final = ("gust_mean_m_s", "gust_sigma_m_s", "gust_decay", "gust_x", "gust_roots")
_HEIGHTS_M: Final = tuple(number / 10.0 for number in range(8, 31))
_SWINGS_M: Final = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
_SPEEDS: Final = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0)
_TIMES: Final = "\N{MULTIPLICATION SIGN}"
_FACTORS: Final = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)


@dataclass(frozen=True)
class Dial:
    """One slider: its values, where it starts, and the numbers that each value writes, by member.

    `key` is its name in the fragment of the page's address. `drone` is the index of the only drone that it
    changes; None: it changes all.
    """

    key: str
    label: str
    unit: str
    values: list[float]
    start: int
    members: dict[str, list[Any]]
    drone: int | None = None


def dials(flight: Flight) -> list[Dial]:
    """Return the sliders of wind, sensor noise and motor lag for a drone that flies as `flight`.

    Without sensor noise the page gives the controllers the true state.
    """
    sensors, vehicle = flight.sensors, flight.vehicle
    assert isinstance(sensors, MotionCapture)
    steps, degrees, own_s = np.arange(0.0, 10.5, 0.5), np.arange(0.0, 360.0, 15.0), vehicle.drone.motor_lag_s
    lags_s = np.union1d(np.arange(0, 21) / 200.0, own_s)
    windy, heading = Disturbances(steps), Disturbances(0.0, np.radians(degrees))
    noisy, lagging = replace(sensors, noise_scale=steps), replace(vehicle, motor_lag_s=lags_s)
    direction = "Wind direction (0\N{DEGREE SIGN} right, 90\N{DEGREE SIGN} down)"
    noise = "Sensor noise (motion capture)"
    own = int(np.searchsorted(lags_s, own_s))

    def members(count: int, names: Sequence[str], **changes: Any) -> dict[str, list[Any]]:
        """Return members of the records of flights that differ from `flight`."""
        records = flight_records(replace(flight, flights=count, seeds=None, **changes), np.zeros((count, 4)))
        return {name: records[name].reshape(count, -1).tolist() for name in names}

    found = [
        Dial(
            "wind",
            "Wind 20 ft above the ground",
            "m/s",
            steps.tolist(),
            0,
            members(len(steps), _WIND, disturbances=windy),
        ),
        Dial(
            *("towards", direction, "\N{DEGREE SIGN}", degrees.tolist(), 6),
            members(len(degrees), ("gust_heading",), disturbances=heading),
        ),
        Dial("noise", noise, _TIMES, steps.tolist(), 0, members(len(steps), ("noise",), sensors=noisy)),
    ]
    if not isinstance(vehicle.drone.attitude, FirstOrderAttitude):
        lags_ms = [round(float(1000.0 * lag_s), 6) for lag_s in lags_s]
        decays = members(len(lags_s), ("rotor_decay",), vehicle=lagging)
        found.append(Dial("lag", "Motor lag", "ms", lags_ms, own, decays))
    return found


def target_dials(*, spatial: bool) -> list[Dial]:
    """Return the sliders of the target, its speed and, if `spatial`, its height; they change no record."""
    speed = Dial("speed", "Speed of the curve", _TIMES, list(_SPEEDS), _SPEEDS.index(1.0), {})
    height = Dial(
        "height", "Height of the target", "m", list(_HEIGHTS_M), _HEIGHTS_M.index(HOVER_HEIGHT_M), {}
    )
    swing = Dial("swing", "Swing of its height (\N{PLUS-MINUS SIGN})", "m", list(_SWINGS_M), 0, {})
    return [speed, height, swing] if spatial else [speed]


def weight_dial(settings: Settings, title: str, drone: int) -> Dial:
    """Return the slider of the effort weight, with weights in the numbers of its C."""
    method, cost = method_of(settings), settings.cost
    _, most = method.weight_limits
    base = cost.effort_weight or 1.0
    values = [factor * base for factor in _FACTORS if factor * base <= most]
    if cost.effort_weight not in values:
        values = sorted([*values, cost.effort_weight])
    weights = method.numbers.quantize(np.array([[cost.tracking_weight, value] for value in values]), WEIGHTS)
    return Dial(
        f"effort{drone + 1}",
        f"Effort weight of {title}",
        "per rad",
        values,
        values.index(cost.effort_weight),
        {"weights": weights.tolist()},
        drone,
    )
