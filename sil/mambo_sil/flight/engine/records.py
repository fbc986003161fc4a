"""Fill the engine's records from the parameters of a simulation."""

from collections.abc import Mapping, Sequence
from dataclasses import astuple
from typing import Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from mambo_codegen.numbers.gravity import GRAVITY_M_S2
from mambo_sil.drone.plant import gusts, loops
from mambo_sil.drone.plant.airframe import airframe_of
from mambo_sil.drone.plant.arrays import FloatArray
from mambo_sil.drone.plant.first_order import FirstOrderDrone
from mambo_sil.drone.plant.ground import ROTOR_HEIGHT_M
from mambo_sil.drone.plant.rotors import LEAST_YAW, wrench_per_command
from mambo_sil.drone.plant.vehicle import STEP_S, Vehicle
from mambo_sil.drone.sensors import drift, estimators, instruments, mocap
from mambo_sil.drone.sensors.drift import DriftingEstimate
from mambo_sil.drone.sensors.mocap import MotionCapture
from mambo_sil.drone.sensors.suites import AnySensors
from mambo_sil.drone.vehicles.vehicle_file import VehicleFile
from mambo_sil.drone.vehicles.vehicle_sections import (
    CascadeAttitude,
    FirstOrderAttitude,
    MamboAttitude,
    MixerName,
)
from mambo_sil.flight import altitude_loops
from mambo_sil.flight.columns import LEVEL, Columns
from mambo_sil.flight.controllers.thrust_controller import CAPPED_SHARE
from mambo_sil.flight.engine.engine_library import record_type
from mambo_sil.flight.loop import HEIGHT_REFERENCE_M, LOST_M, Flight, open_loop_updates, start_state
from mambo_sil.flight.names import AltitudeName

Record = NDArray[Any]

_STOCK: Final = (
    *("attitude_p_n_m", "attitude_i_n_m_s", "attitude_d_n_m_s", "integral_limit_rad_s"),
    *("integral_leak_1_s", "yaw_p_n_m", "yaw_d_n_m_s"),
)
_CASCADE: Final = ("cascade", "rate_max_rad_s", "output_max")
_FIRST_ORDER: Final = (
    *("response_gain", "response_lag_s", "late_ticks", "decay_before", "decay_after"),
    *("yaw_lag_s", "yaw_decay", "acceleration_per_tilt_g", "trim_rad"),
)
_THRUST: Final = ("thrust_gain", "thrust_late_ticks", "thrust_decay_before", "thrust_decay_after")
_DRIFT: Final = ("drift_keep", "drift_corrected_s")
_MOCAP: Final = ("mocap_period_ticks", "mocap_delay_ticks", "mocap_period_s", "mocap_share")
_PLACED: Final = ("mocap_beside", "mocap_lever_m")


def simulation_record(flight: Flight, times_s: FloatArray, columns: Columns = LEVEL) -> Record:
    """Return the engine_simulation_t of a simulation with updates at `times_s` (k,), for some controllers."""
    sensors, drone = flight.sensors, flight.vehicle.drone
    nominal, step_s = airframe_of(drone), drone.step_s
    transition, input_gain = instruments.discretize_imu(STEP_S)
    images, ticks = instruments.FLOW_IMAGES_PER_TICKS
    return _record(
        "engine_simulation_t",
        1,
        _attitude(drone)
        | _thrust(flight.vehicle)
        | _mocap(sensors, step_s)
        | _drift(sensors, step_s)
        | {
            "flights": flight.flights,
            "updates": len(times_s),
            "ticks_per_update": flight.ticks_per_update,
            "first_tick": round(times_s[0] / step_s),
            "open_loop_updates": open_loop_updates(flight, times_s),
            "disturbed": flight.disturbances.any,
            "windy": flight.disturbances.windy,
            "dropping": bool(np.any(flight.link.dropped_share)),
            "sensed": sensors is not None,
            "captured": isinstance(sensors, MotionCapture),
            "drifting": isinstance(sensors, DriftingEstimate),
            "derotated": isinstance(sensors, instruments.Sensors) and sensors.derotated,
            "near_ground": flight.disturbances.near_ground,
            "landing": flight.landing.any(),
            "commands_thrust": columns.commands_thrust,
            "seen_beside": flight.vehicle.is_seen_beside,
            "target_columns": flight.targets_for(columns).shape[2],
            "step_s": step_s,
            "gravity_m_s2": GRAVITY_M_S2,
            "lost_m": LOST_M,
            "height_reference_m": HEIGHT_REFERENCE_M,
            "rotor_height_m": ROTOR_HEIGHT_M,
            "gust_across": gusts.ACROSS_GAINS,
            **_altitude(flight),
            "weight_n": drone.weight_n,
            "thrust_limit_n": drone.altitude.thrust_max_n,
            "take_off_thrust_n": loops.take_off_thrust_n(drone),
            "capped_n": CAPPED_SHARE * drone.weight_n,
            "wrench_per_command": wrench_per_command(nominal)[:, 0],
            "nominal_mass_kg": nominal.mass_kg,
            "rotor_offset_m": flight.vehicle.airframe.rotor_offset_m,
            "speed_squared_per_command_rad2_s2": flight.vehicle.airframe.speed_squared_per_command_rad2_s2,
            "command_min": nominal.command_min,
            "command_max": nominal.command_max,
            "mixer": get_args(MixerName).index(nominal.mixer),
            "least_yaw": LEAST_YAW * nominal.command_max,
            "imu_transition": np.ravel(transition),
            "imu_input_gain": input_gain,
            "imu_limits": instruments.IMU_LIMITS[:, 0],
            "sonar_min_m": instruments.SONAR_MIN_M,
            "pa_per_m": instruments.PA_PER_M,
            "flow_coupling": instruments.FLOW_COUPLING,
            "flow_images": images,
            "flow_ticks": ticks,
            "accelerometer_taps": estimators.ACCELEROMETER_TAPS,
            "tilt_weight": estimators.TILT_WEIGHT,
            "tilt_gate": estimators.TILT_GATE,
            "altitude_gains": estimators.altitude_gains(),
            "low_pass_a": estimators.LOW_PASS_A,
            "low_pass_b": estimators.LOW_PASS_B,
            "sonar_jump_m": estimators.SONAR_JUMP_M,
            "pressure_jump_m": estimators.PRESSURE_JUMP_M,
            "slow_jump_m": estimators.SLOW_JUMP_M,
            "velocity_gain": estimators.velocity_gain(),
            "acceleration_gain": estimators.ACCELERATION_GAIN,
            "flow_tilt_rad": estimators.FLOW_TILT_RAD,
            "flow_rate_rad_s": estimators.FLOW_RATE_RAD_S,
            "flow_slow_rad_s": estimators.FLOW_SLOW_RAD_S,
            "flow_jump_m_s": estimators.FLOW_JUMP_M_S,
            "flow_min_height_m": estimators.FLOW_MIN_HEIGHT_M,
        },
    )


def flight_records(flight: Flight, first_target: FloatArray) -> Record:
    """Return one engine_flight_t for each of n flights, whose first targets are (n, 9 or 13)."""
    n, vehicle, disturbances = flight.flights, flight.vehicle, flight.disturbances
    airframe = vehicle.airframe
    start, step_s = start_state(flight, first_target), vehicle.drone.step_s
    gust = gusts.coefficients(
        disturbances.wind_speed_m_s,
        disturbances.wind_direction_rad,
        n,
        height_m=-HEIGHT_REFERENCE_M,
        step_s=step_s,
    )
    return _record(
        "engine_flight_t",
        n,
        {
            "body_start": start.body.T,
            "rotor_start_rad_s": start.rotor_speed_rad_s.T,
            "thrust_start_n": start.memory[-1] if vehicle.drone.thrust is not None else 0.0,
            "yaw_rad": flight.yaw_rad,
            "yaw_rate_rad_s": flight.yaw_rate_rad_s,
            "landing": -flight.landing.astype(np.int64),
            "mass_kg": airframe.mass_kg,
            "inertia_kg_m2": _columns(airframe.inertia_kg_m2, n),
            "thrust_factor_n_s2": airframe.thrust_factor_n_s2,
            "torque_per_thrust_m": airframe.torque_per_thrust_m,
            "rotor_decay": vehicle.rotor_decay[:, 0].T,
            "drag_1_s": vehicle.drag_1_s,
            "push_m_s2": _columns(disturbances.push_m_s2, n),
            "gust_mean_m_s": gust.mean_m_s,
            "gust_sigma_m_s": gust.sigma_m_s,
            "gust_heading": _columns(gust.heading, n),
            "gust_decay": gust.decay,
            "gust_x": gust.x,
            "gust_roots": _columns((gust.root_aa, gust.root_ab, gust.root_bb), n),
            "battery_sag_1_s": disturbances.battery_sag_1_s,
            "payload_kg": disturbances.payload_kg,
            "payload_tick": np.rint(np.asarray(disturbances.payload_time_s) / step_s),
            "impulse_n_s": _columns(disturbances.impulse_n_s, n),
            "impulse_tick": np.rint(np.asarray(disturbances.impulse_time_s) / step_s),
            "vertical_gust_m_s2": disturbances.vertical_gust_m_s2,
            "vertical_gust_tick": np.rint(np.asarray(disturbances.vertical_gust_time_s) / step_s),
            "ground_effect_radius_m": disturbances.ground_effect_radius_m,
            "delay_ticks": flight.link.delay_ticks,
            "dropped_share": flight.link.dropped_share,
            "lever_error_m": _columns(vehicle.lever_error_m, n),
            **_noise(flight),
        },
    )


def in_lanes(records: Record, lanes: int) -> NDArray[np.int64]:
    """Return n records of `flight_records` in groups: (groups, members, lanes), each member 8 bytes.

    The last flight fills the lanes that the last group has left.
    """
    members = records.view(np.int64).reshape(len(records), -1)
    groups = -(-len(records) // lanes)
    flights = np.minimum(np.arange(groups * lanes), len(records) - 1).reshape(groups, lanes)
    return np.ascontiguousarray(members[flights].swapaxes(1, 2))


def _attitude(drone: VehicleFile) -> dict[str, Any]:
    """Return the members of the attitude loops; of other kinds than the drone's they are 0."""
    values: dict[str, Any] = dict.fromkeys((*_STOCK, *_CASCADE, *_FIRST_ORDER), 0)
    match drone.attitude:
        case MamboAttitude() as stock:
            axes = stock.roll, stock.pitch
            found = (
                [axis.p_n_m for axis in axes],
                [axis.i_n_m_s for axis in axes],
                [axis.d_n_m_s for axis in axes],
                *(stock.integral_limit_rad_s, stock.integral_leak_1_s, stock.yaw.p_n_m, stock.yaw.d_n_m_s),
            )
            return values | {"attitude": 0} | dict(zip(_STOCK, found, strict=True))
        case CascadeAttitude() as cascade:
            gains = [list(axis.model_dump().values()) for axis in (cascade.roll, cascade.pitch, cascade.yaw)]
            limits = cascade.rate_max_rad_s, cascade.output_max
            return values | {"attitude": 1} | dict(zip(_CASCADE, (gains, *limits), strict=True))
        case FirstOrderAttitude() as first_order:
            whole, responses = FirstOrderDrone(drone, first_order), (first_order.roll, first_order.pitch)
            follows: tuple[Any, ...] = (
                [response.gain for response in responses],
                [response.lag_s for response in responses],
                [decay.late_ticks for decay in whole.decays],
                [decay.before for decay in whole.decays],
                [decay.after for decay in whole.decays],
                *(first_order.yaw_lag_s, whole.yaw_decay, first_order.acceleration_per_tilt_g),
                [first_order.roll_trim_rad, first_order.pitch_trim_rad],
            )
            return values | {"attitude": 2} | dict(zip(_FIRST_ORDER, follows, strict=True))


def _altitude(flight: Flight) -> dict[str, Any]:
    """Return the members of the altitude loop."""
    drone, law = flight.vehicle.drone, flight.altitude
    mass_kg, gains = drone.body.mass_kg, law.gains_for(drone)
    stock = law.name == "stock"
    return {
        "altitude_law": get_args(AltitudeName).index(law.name),
        "altitude_p_n_m": drone.altitude.p_n_m if stock else mass_kg * gains.height_1_s2,
        "altitude_d_n_s_m": drone.altitude.d_n_s_m if stock else mass_kg * gains.climb_1_s,
        "altitude_i_n_m_s": mass_kg * gains.integral_1_s3,
        "altitude_mass_kg": mass_kg,
        "least_level": altitude_loops.LEAST_LEVEL,
        "integrated_error_m": altitude_loops.INTEGRATED_ERROR_M,
        "integral_limit_n": altitude_loops.INTEGRAL_SHARE * drone.weight_n,
    }


def _thrust(vehicle: Vehicle) -> dict[str, Any]:
    """Return the members of the response of the thrust, a gain of 1 without."""
    response, loop = vehicle.drone.thrust, vehicle.loop
    if response is None or not isinstance(loop, FirstOrderDrone) or loop.thrust_decay is None:
        return dict.fromkeys(("thrust_lags", *_THRUST), 0) | {"thrust_gain": 1.0}
    decay = loop.thrust_decay
    found = response.gain, decay.late_ticks, decay.before, decay.after
    return {"thrust_lags": 1} | dict(zip(_THRUST, found, strict=True))


def _mocap(sensors: AnySensors | None, step_s: float) -> dict[str, Any]:
    """Return the members of the motion capture, 0 without."""
    if not isinstance(sensors, MotionCapture):
        return dict.fromkeys((*_MOCAP, *_PLACED), 0)
    lever_m = sensors.figures.lever_m
    sampled = dict(zip(_MOCAP, astuple(mocap.sampling(sensors.figures, step_s)), strict=True))
    return sampled | dict(zip(_PLACED, (any(lever_m), lever_m), strict=True))


def _drift(sensors: AnySensors | None, step_s: float) -> dict[str, Any]:
    """Return the members of estimates that drift, 0 without."""
    if not isinstance(sensors, DriftingEstimate):
        return dict.fromkeys(_DRIFT, 0)
    return dict(zip(_DRIFT, astuple(drift.fading(sensors.figures, step_s)), strict=True))


def _noise(flight: Flight) -> dict[str, Any]:
    """Return noise and biases of the sensors, 0 without."""
    sensors, n = flight.sensors, flight.flights
    noise, bias = np.zeros((n, instruments.NOISES)), np.zeros((n, 6))
    if isinstance(sensors, MotionCapture):
        noise[:, : mocap.NOISES] = mocap.mocap_deviations(sensors, n).T
    elif isinstance(sensors, DriftingEstimate):
        noise[:, : drift.NOISES] = drift.drift_deviations(sensors, n, flight.vehicle.drone.step_s).T
    elif sensors is not None:
        noise = instruments.noise_deviations(sensors, n).T
        bias = _columns((*sensors.accelerometer_bias_m_s2, *sensors.gyro_bias_rad_s), n)
    return {"noise": noise, "bias": bias}


def _columns(values: Sequence[Any], n: int) -> FloatArray:
    """Return quantities, each one value or (n,), as the columns of an array (n, quantities)."""
    return np.stack([np.broadcast_to(np.asarray(value, np.float64), n) for value in values], axis=-1)


def _record(name: str, n: int, values: Mapping[str, Any]) -> Record:
    """Return n records of type `name` with `values` of all members."""
    record = np.zeros(n, record_type(name))
    assert set(values) == set(record.dtype.names or ()), "records.h and its values have different members"
    for member, value in values.items():
        record[member] = value
    return record
