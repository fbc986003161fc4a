"""Fill the engine's records from the parameters of a simulation."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mambo_nmpc.sil.engine.build import record_type
from mambo_nmpc.sil.flight.loop import HEIGHT_REFERENCE_M, LOST_M, Flight, lifting_updates, start_state
from mambo_nmpc.sil.plant import gusts, loops
from mambo_nmpc.sil.plant.airframe import GRAVITY_M_S2, MAMBO
from mambo_nmpc.sil.plant.arrays import FloatArray
from mambo_nmpc.sil.plant.rotors import wrench_per_command
from mambo_nmpc.sil.plant.vehicle import STEP_S
from mambo_nmpc.sil.sensors import estimators, instruments

Record = NDArray[Any]


def simulation_record(flight: Flight, times_s: FloatArray) -> Record:
    """Return the engine_simulation_t of a simulation whose updates are at `times_s` (k,)."""
    sensors = flight.sensors
    transition, input_gain = instruments.discretize_imu(STEP_S)
    images, ticks = instruments.FLOW_IMAGES_PER_TICKS
    return _record(
        "engine_simulation_t",
        1,
        {
            "flights": flight.flights,
            "updates": len(times_s),
            "ticks_per_update": flight.ticks_per_update,
            "first_tick": round(times_s[0] / STEP_S),
            "lifting_updates": lifting_updates(flight, times_s),
            "disturbed": flight.disturbances.any,
            "windy": flight.disturbances.windy,
            "dropping": bool(np.any(flight.link.dropped_share)),
            "sensed": sensors is not None,
            "derotated": sensors is not None and sensors.derotated,
            "step_s": STEP_S,
            "gravity_m_s2": GRAVITY_M_S2,
            "lost_m": LOST_M,
            "height_reference_m": HEIGHT_REFERENCE_M,
            "gust_across": gusts.ACROSS_GAINS,
            "attitude_p_n_m": loops.ATTITUDE_P_N_M[:, 0],
            "attitude_i_n_m_s": loops.ATTITUDE_I_N_M_S,
            "attitude_d_n_m_s": loops.ATTITUDE_D_N_M_S[:, 0],
            "integral_limit_rad_s": loops.INTEGRAL_LIMIT_RAD_S,
            "integral_leak_1_s": loops.INTEGRAL_LEAK_1_S,
            "yaw_p_n_m": loops.YAW_P_N_M,
            "yaw_d_n_m_s": loops.YAW_D_N_M_S,
            "altitude_p_n_m": loops.ALTITUDE_P_N_M,
            "altitude_d_n_s_m": loops.ALTITUDE_D_N_S_M,
            "weight_n": loops.WEIGHT_N,
            "thrust_limit_n": loops.THRUST_LIMIT_N,
            "take_off_thrust_n": loops.TAKE_OFF_THRUST_N,
            "wrench_per_command": wrench_per_command(MAMBO)[:, 0],
            "nominal_mass_kg": MAMBO.mass_kg,
            "rotor_offset_m": flight.vehicle.airframe.rotor_offset_m,
            "speed_squared_per_command_rad2_s2": flight.vehicle.airframe.speed_squared_per_command_rad2_s2,
            "command_min": MAMBO.command_min,
            "command_max": MAMBO.command_max,
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
    """Return one engine_flight_t for each of n flights, whose first targets are (n, 4)."""
    n, vehicle, disturbances = flight.flights, flight.vehicle, flight.disturbances
    airframe, sensors = vehicle.airframe, flight.sensors or instruments.Sensors()
    start = start_state(flight, first_target)
    gust = gusts.coefficients(
        disturbances.wind_speed_m_s,
        disturbances.wind_direction_rad,
        n,
        height_m=-HEIGHT_REFERENCE_M,
        step_s=STEP_S,
    )
    return _record(
        "engine_flight_t",
        n,
        {
            "body_start": start.body.T,
            "rotor_start_rad_s": start.rotor_speed_rad_s.T,
            "yaw_rad": flight.yaw_rad,
            "yaw_rate_rad_s": flight.yaw_rate_rad_s,
            "mass_kg": airframe.mass_kg,
            "inertia_kg_m2": _columns(airframe.inertia_kg_m2, n),
            "thrust_factor_n_s2": airframe.thrust_factor_n_s2,
            "torque_per_thrust_m": airframe.torque_per_thrust_m,
            "rotor_decay": vehicle.rotor_decay[:, 0].T,
            "drag_1_s": vehicle.drag_1_s,
            "wind_m_s2": _columns(vehicle.wind_m_s2, n),
            "gust_mean_m_s": gust.mean_m_s,
            "gust_sigma_m_s": gust.sigma_m_s,
            "gust_heading": _columns(gust.heading, n),
            "gust_decay": gust.decay,
            "gust_x": gust.x,
            "gust_roots": _columns((gust.root_aa, gust.root_ab, gust.root_bb), n),
            "battery_sag_1_s": disturbances.battery_sag_1_s,
            "payload_kg": disturbances.payload_kg,
            "payload_tick": np.rint(np.asarray(disturbances.payload_time_s) / STEP_S),
            "push_n_s": _columns(disturbances.push_n_s, n),
            "push_tick": np.rint(np.asarray(disturbances.push_time_s) / STEP_S),
            "delay_ticks": flight.link.delay_ticks,
            "dropped_share": flight.link.dropped_share,
            "noise": instruments.noise_deviations(sensors, n).T,
            "bias": _columns((*sensors.accelerometer_bias_m_s2, *sensors.gyro_bias_rad_s), n),
        },
    )


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
