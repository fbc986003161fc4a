"""What the page's sliders change: for each position of a slider, the members of the engine's records."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from mambo_nmpc.codegen.design import Design
from mambo_nmpc.codegen.representation import WEIGHTS
from mambo_nmpc.codegen.settings.model import Settings
from mambo_nmpc.sil.engine.records import flight_records
from mambo_nmpc.sil.flight.loop import Flight
from mambo_nmpc.sil.plant.arrays import FloatArray
from mambo_nmpc.sil.plant.disturbances import Disturbances
from mambo_nmpc.sil.sensors.mocap import MotionCapture
from mambo_nmpc.sil.vehicles.sections import FirstOrderAttitude

_WIND: Final = ("gust_mean_m_s", "gust_sigma_m_s", "gust_decay", "gust_x", "gust_roots")
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
    """Return the sliders of wind, sensor noise and motor lag for a drone that flies as `flight`."""
    speeds, degrees = np.arange(0.0, 10.5, 0.5), np.arange(0.0, 360.0, 15.0)
    found = [
        _dial("wind", "Wind", "m/s", speeds, 0, _records(flight, _WIND, wind_speed_m_s=speeds)),
        _dial(
            "towards",
            "Wind direction (0\N{DEGREE SIGN} right, 90\N{DEGREE SIGN} down)",
            "\N{DEGREE SIGN}",
            degrees,
            6,
            _records(flight, ("gust_heading",), wind_direction_rad=np.radians(degrees)),
        ),
        _noise_dial(flight),
    ]
    if not isinstance(flight.vehicle.drone.attitude, FirstOrderAttitude):
        found.append(_lag_dial(flight))
    return found


def weight_dial(settings: Settings, title: str, drone: int) -> Dial:
    """Return the slider of the effort weight of a 1-norm, with weights in the numbers of its C."""
    numbers, cost = Design(settings).numbers, settings.cost
    base = cost.effort_weight or 1.0
    values = [factor * base for factor in _FACTORS if factor * base <= numbers.effort_limit]
    if cost.effort_weight not in values:
        values = sorted([*values, cost.effort_weight])
    weights = numbers.quantize(np.array([[cost.tracking_weight, value] for value in values]), WEIGHTS)
    return Dial(
        f"effort{drone + 1}",
        f"Effort weight of {title}",
        "per rad",
        values,
        values.index(cost.effort_weight),
        {"weights": weights.tolist()},
        drone,
    )


def _noise_dial(flight: Flight) -> Dial:
    """Return the slider of sensor noise; at 0 controllers receive the true state."""
    assert isinstance(flight.sensors, MotionCapture)
    scales = np.arange(0.0, 10.5, 0.5)
    noisy = replace(
        flight, flights=len(scales), sensors=replace(flight.sensors, noise_scale=scales), seeds=None
    )
    return _dial(
        "noise",
        "Sensor noise (motion capture)",
        "\N{MULTIPLICATION SIGN}",
        scales,
        0,
        _members(noisy, ("noise",)),
    )


def _lag_dial(flight: Flight) -> Dial:
    """Return the slider of the motor lag; it starts at that of the drone."""
    own_s = flight.vehicle.drone.motor_lag_s
    lags_s = np.union1d(np.arange(0, 21) / 200.0, own_s)
    vehicle = replace(flight.vehicle, motor_lag_s=lags_s)
    lagging = replace(flight, flights=len(lags_s), vehicle=vehicle, seeds=None)
    return _dial(
        "lag",
        "Motor lag",
        "ms",
        1000.0 * lags_s,
        int(np.searchsorted(lags_s, own_s)),
        _members(lagging, ("rotor_decay",)),
    )


def _records(flight: Flight, members: Sequence[str], **disturbances: FloatArray) -> dict[str, list[Any]]:
    """Return members of the records of flights with these disturbances."""
    count = len(next(iter(disturbances.values())))
    windy = replace(flight, flights=count, disturbances=Disturbances(**disturbances), seeds=None)
    return _members(windy, members)


def _members(flight: Flight, members: Sequence[str]) -> dict[str, list[Any]]:
    records = flight_records(flight, np.zeros((flight.flights, 4)))
    return {member: records[member].reshape(flight.flights, -1).tolist() for member in members}


def _dial(
    key: str, label: str, unit: str, values: FloatArray, start: int, members: dict[str, list[Any]]
) -> Dial:
    return Dial(key, label, unit, [round(float(value), 6) for value in values], start, members)
