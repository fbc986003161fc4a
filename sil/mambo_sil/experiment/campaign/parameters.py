"""The parameters that vary from flight to flight: domain, and distribution in the default campaign.

docs/reference/campaign-toml.md gives the sources of the default ranges.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from mambo_sil.drone.plant.airframe import NOMINAL, airframe_of
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.experiment.campaign.distributions import Distribution, Domain, parse
from mambo_sil.flight.names import CURVE_NAMES
from mambo_sil.flight.own_curve import is_curve_file
from mambo_sil.flight.scenario import Scenario


def _axes(
    stem: str, unit: str, axes: str, domain: tuple[float, float], default: Any
) -> dict[str, Distribution]:
    """Return one parameter per axis."""
    return {f"{stem}_{axis}{unit}": parse(default, Domain(*domain)) for axis in axes}


def _parameter(low: float, high: float, default: Any) -> Distribution:
    return parse(default, Domain(low, high))


def _uniform(low: float, high: float) -> dict[str, list[float]]:
    return {"uniform": [low, high]}


PARAMETERS: Final[dict[str, Distribution]] = {
    "mass_kg": _parameter(0.01, 1.0, _uniform(0.063, 0.08)),
    **_axes("inertia_scale", "", "xyz", (0.1, 10.0), _uniform(0.8, 1.2)),
    "thrust_scale": _parameter(0.1, 10.0, _uniform(0.9, 1.1)),
    "motor_lag_s": _parameter(0.0, 1.0, _uniform(0.0, 0.05)),
    "drag_1_s": _parameter(0.0, 10.0, _uniform(0.0335, 0.1005)),
    "battery_sag_1_s": _parameter(0.0, 1.0, _uniform(0.0, 0.001)),
    "command_delay_ticks": parse({"choice": [0, 1, 2]}, Domain(0, 200, whole=True)),
    "dropped_share": _parameter(0.0, 1.0, _uniform(0.0, 0.05)),
    "noise_scale": _parameter(0.0, 1000.0, {"log_uniform": [0.5, 2.0]}),
    **_axes("accelerometer_bias", "_m_s2", "xyz", (-10.0, 10.0), {"normal": [0.0, 0.02]}),
    **_axes("gyro_bias", "_rad_s", "xyz", (-10.0, 10.0), {"normal": [0.0, 0.0005]}),
    **_axes("push", "_m_s2", "xy", (-100.0, 100.0), 0.0),
    "wind_speed_m_s": _parameter(0.0, 50.0, _uniform(0.0, 2.0)),
    "wind_direction_rad": _parameter(-10.0, 10.0, _uniform(-math.pi, math.pi)),
    "yaw_rad": _parameter(-1000.0, 1000.0, _uniform(-math.pi, math.pi)),
    "yaw_rate_rad_s": _parameter(-10.0, 10.0, 0.0),
    **_axes("start_offset", "_m", "xy", (-100.0, 100.0), _uniform(-0.5, 0.5)),
    "start_offset_z_m": _parameter(-100.0, 100.0, _uniform(-0.2, 0.2)),
    **_axes("start_velocity", "_m_s", "xyz", (-10.0, 10.0), _uniform(-0.2, 0.2)),
    "start_roll_rad": _parameter(-1.0, 1.0, _uniform(-0.1, 0.1)),
    "start_pitch_rad": _parameter(-1.0, 1.0, _uniform(-0.1, 0.1)),
    "payload_kg": _parameter(-0.5, 1.0, 0.0),
    "payload_time_s": _parameter(0.0, 3600.0, 0.0),
    **_axes("impulse", "_n_s", "xyz", (-1.0, 1.0), 0.0),
    "impulse_time_s": _parameter(0.0, 3600.0, 0.0),
    "trajectory": parse("bernoulli", Domain.of_names(CURVE_NAMES, is_curve_file)),
    "size_m": _parameter(-1000.0, 1000.0, 2.0),
    "rate_rad_s": _parameter(-100.0, 100.0, 0.5),
    "vertical_gust_m_s2": _parameter(-100.0, 100.0, 0.0),
    "vertical_gust_time_s": _parameter(0.0, 3600.0, 0.0),
    "ground_effect_radius_m": _parameter(0.0, 1.0, 0.0),
}
"""Domain and default distribution by name, with the Mambo, in the order in which they use the
random stream of a flight: a new parameter must be appended."""

TRAJECTORY: Final = "trajectory"
OF_THE_CURVE: Final = (TRAJECTORY, "size_m", "rate_rad_s")
"""Parameters that are written in the section [flight]; all others are written in [draws]."""

Draw = dict[str, Any]
"""One flight: its parameters by name, and the `seed` of its noise, gusts and dropped updates."""


def draw(seed: int, flight: int, distributions: Mapping[str, Distribution]) -> Draw:
    """Return seed and parameters of flight number `flight`; they depend on both numbers only."""
    numbers, noise = np.random.SeedSequence(seed, spawn_key=(flight,)).spawn(2)
    shares = np.random.Generator(np.random.Philox(numbers)).random(len(PARAMETERS))
    drawn: Draw = {"seed": int(noise.generate_state(1, np.uint64)[0] >> np.uint64(1))}
    for name, share in zip(PARAMETERS, shares.tolist(), strict=True):
        drawn[name] = distributions[name].domain.value(distributions[name].quantile(share))
    return drawn


def defaults_of(drone: VehicleFile) -> dict[str, Distribution]:
    """Return the defaults that depend on the drone: of its values the same shares as with the Mambo.

    The lag of its motors, if it has one, varies by a fifth.
    """
    found = {
        "mass_kg": _scaled("mass_kg", drone.body.mass_kg / NOMINAL.body.mass_kg),
        "drag_1_s": _scaled("drag_1_s", drone.body.drag_1_s / NOMINAL.body.drag_1_s),
    }
    if drone.motor_lag_s > 0.0:
        lag_s = _uniform(0.8 * drone.motor_lag_s, min(1.2 * drone.motor_lag_s, 1.0))
        found["motor_lag_s"] = parse(lag_s, PARAMETERS["motor_lag_s"].domain)
    return found


def _scaled(name: str, factor: float) -> Distribution:
    """Return the default distribution of a parameter with all its numbers times `factor`."""
    default = PARAMETERS[name]
    return replace(default, numbers=tuple(factor * one for one in default.numbers))


def scenario_values(drawn: Draw, drone: VehicleFile) -> dict[str, Any]:
    """Return the draws as keys of a `Scenario` of a drone; rotor thrust and torque have the same scale."""
    airframe = airframe_of(drone)

    def parts(stem: str, unit: str, axes: str = "xyz") -> tuple[float, ...]:
        return tuple(drawn[f"{stem}_{axis}{unit}"] for axis in axes)

    scale, factors = drawn["thrust_scale"], parts("inertia_scale", "")
    return {name: value for name, value in drawn.items() if name in Scenario.model_fields} | {
        "inertia_kg_m2": tuple(f * j for f, j in zip(factors, airframe.inertia_kg_m2, strict=True)),
        "thrust_factor_n_s2": scale * airframe.thrust_factor_n_s2,
        "torque_factor_n_m_s2": scale * airframe.torque_factor_n_m_s2,
        "accelerometer_bias_m_s2": parts("accelerometer_bias", "_m_s2"),
        "gyro_bias_rad_s": parts("gyro_bias", "_rad_s"),
        "push_m_s2": parts("push", "_m_s2", "xy"),
        "start_offset_m": parts("start_offset", "_m"),
        "start_velocity_m_s": parts("start_velocity", "_m_s"),
        "start_tilt_rad": (drawn["start_roll_rad"], drawn["start_pitch_rad"]),
        "impulse_n_s": parts("impulse", "_n_s"),
    }
