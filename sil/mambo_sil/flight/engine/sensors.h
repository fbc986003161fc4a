/* SPDX-License-Identifier: MIT-0
 *
 * Instruments and estimators: sil/mambo_sil/drone/sensors/{instruments,estimators}.py, operation by operation.
 */
#ifndef ENGINE_SENSORS_H
#define ENGINE_SENSORS_H

#include "vehicle.h"

#define IMU 6
#define TAPS 6

typedef struct {
    real_t imu[IMU];
    real_t sonar_m;
    real_t pressure_pa;
    real_t flow_m_s[2];
} readings_t;

/* What instruments and estimators remember from one tick to the next. */
typedef struct {
    real_t velocity_m_s[3];
    real_t motion[IMU];
    real_t imu_value[IMU];
    real_t imu_rate[IMU];
    real_t flow_m_s[2];
    int64_t tick;
    readings_t delayed;

    real_t euler_rad[3];
    rotation_t rotation;
    real_t forces[TAPS][3];
    real_t low_pass[2][3]; /* pressure, sonar */
    real_t z_m;
    real_t velocity_z_m_s;
    real_t predicted_z_m;
    real_t predicted_velocity_z_m_s;
    real_t body_velocity_m_s[2];
    real_t predicted_body_velocity_m_s[2];
    real_t position_m[2];
} suite_t;

/* Mean specific force since the last tick, in current body axes, and body rates. */
static inline void measure_motion(const engine_simulation_t *simulation, const suite_t *suite, const seen_t *truth_now,
                                  const rotation_t *r, real_t *motion)
{
    real_t force[3];
    int i;

    for (i = 0; i < 3; i++) {
        force[i] = (truth_now->velocity_m_s[i] - suite->velocity_m_s[i]) / simulation->step_s;
        motion[3 + i] = truth_now->rates_rad_s[i];
    }
    force[2] = force[2] - simulation->gravity_m_s2;
    to_body(r, force, motion);
}

static inline void measure_flow(const engine_simulation_t *simulation, const seen_t *truth_now, const rotation_t *r,
                                real_t *flow_m_s)
{
    const real_t lever = simulation->flow_coupling * truth_now->position_m[2];
    real_t body_m_s[3];

    to_body(r, truth_now->velocity_m_s, body_m_s);
    flow_m_s[0] = body_m_s[0] + (lever * -truth_now->rates_rad_s[1]);
    flow_m_s[1] = body_m_s[1] + (lever * truth_now->rates_rad_s[0]);
}

static inline void suite_start(const engine_simulation_t *simulation, const seen_t *start, const rotation_t *r,
                               suite_t *suite)
{
    real_t body_m_s[3];
    int i;
    int k;

    for (i = 0; i < 3; i++) {
        suite->velocity_m_s[i] = start->velocity_m_s[i];
        suite->euler_rad[i] = start->euler_rad[i];
    }
    measure_motion(simulation, suite, start, r, suite->motion);
    for (i = 0; i < IMU; i++) {
        suite->imu_value[i] = suite->motion[i];
        suite->imu_rate[i] = splat(0.0);
    }
    measure_flow(simulation, start, r, suite->flow_m_s);
    suite->tick = 0;
    suite->rotation = *r;
    suite->z_m = start->position_m[2];
    suite->velocity_z_m_s = start->velocity_m_s[2];
    suite->predicted_z_m = suite->z_m;
    suite->predicted_velocity_z_m_s = suite->velocity_z_m_s;
    to_body(r, start->velocity_m_s, body_m_s);
    for (i = 0; i < 2; i++) {
        for (k = 0; k < 3; k++) {
            suite->low_pass[i][k] = suite->z_m / (8.0 * simulation->low_pass_b);
        }
        suite->body_velocity_m_s[i] = body_m_s[i];
        suite->predicted_body_velocity_m_s[i] = body_m_s[i];
        suite->position_m[i] = start->position_m[i];
    }
}

/* The readings that reach the estimators at this tick: from the tick before, at the first its own. */
static inline readings_t read_instruments(const engine_simulation_t *simulation, const engine_flight_t *flight,
                                          const seen_t *truth_now, const rotation_t *r, const real_t *draws,
                                          suite_t *suite)
{
    const double *transition = simulation->imu_transition;
    const real_t height_m = -truth_now->position_m[2];
    readings_t now;
    readings_t arriving;
    real_t motion[IMU];
    int i;

    measure_motion(simulation, suite, truth_now, r, motion);
    for (i = 0; i < IMU; i++) {
        const real_t mean = 0.5 * (suite->motion[i] + motion[i]);
        const real_t value = suite->imu_value[i];
        const real_t rate = suite->imu_rate[i];

        suite->motion[i] = motion[i];
        suite->imu_value[i] = ((transition[0] * value) + (transition[1] * rate))
                              + (simulation->imu_input_gain[0] * mean);
        suite->imu_rate[i] = ((transition[2] * value) + (transition[3] * rate))
                             + (simulation->imu_input_gain[1] * mean);
        now.imu[i] = clip((suite->imu_value[i] + flight->bias[i]) + (flight->noise[i] * draws[i]),
                          -simulation->imu_limits[i], simulation->imu_limits[i]);
    }
    for (i = 0; i < 3; i++) {
        suite->velocity_m_s[i] = truth_now->velocity_m_s[i];
    }
    if ((suite->tick == 0)
        || (((simulation->flow_images * suite->tick) / simulation->flow_ticks)
            != ((simulation->flow_images * (suite->tick - 1)) / simulation->flow_ticks))) {
        measure_flow(simulation, truth_now, r, suite->flow_m_s);
    }
    now.sonar_m = maximum(height_m + (flight->noise[6] * draws[6]), splat(simulation->sonar_min_m));
    now.pressure_pa = (flight->noise[7] * draws[7]) - (simulation->pa_per_m * height_m);
    now.flow_m_s[0] = suite->flow_m_s[0];
    now.flow_m_s[1] = suite->flow_m_s[1];
    arriving = (suite->tick == 0) ? now : suite->delayed;
    suite->delayed = now;
    return arriving;
}

/* Complementary filter of the attitude. */
static inline void estimate_attitude(const engine_simulation_t *simulation, const readings_t *readings, suite_t *suite)
{
    const rotation_t *r = &suite->rotation;
    const real_t p = readings->imu[3];
    const real_t q = readings->imu[4];
    const real_t yaw_axis_rate = readings->imu[5];
    const real_t yaw_rate = ((r->sin_roll * q) + (r->cos_roll * yaw_axis_rate)) / r->cos_pitch;
    real_t roll = suite->euler_rad[0] + (simulation->step_s * (p + (r->sin_pitch * yaw_rate)));
    real_t pitch = suite->euler_rad[1]
                   + (simulation->step_s * ((r->cos_roll * q) - (r->sin_roll * yaw_axis_rate)));
    real_t smooth[3];
    real_t force;
    mask_t steady;
    int i;
    int k;

    for (i = 0; i < 3; i++) {
        for (k = TAPS - 1; k > 0; k--) {
            suite->forces[k][i] = (suite->tick == 0) ? readings->imu[i] : suite->forces[k - 1][i];
        }
        suite->forces[0][i] = readings->imu[i];
        smooth[i] = simulation->accelerometer_taps[0] * suite->forces[0][i];
        for (k = 1; k < TAPS; k++) {
            smooth[i] = smooth[i] + (simulation->accelerometer_taps[k] * suite->forces[k][i]);
        }
    }
    force = square_root(((smooth[0] * smooth[0]) + (smooth[1] * smooth[1])) + (smooth[2] * smooth[2]));
    steady = magnitude(force - simulation->gravity_m_s2) < (simulation->tilt_gate * simulation->gravity_m_s2);
    if (any(steady)) {
        const double kept = 1.0 - simulation->tilt_weight;
        const real_t roll_seen = arc_tangent(smooth[1] / smooth[2]);
        const real_t pitch_seen = arc_sine(clip(smooth[0] / simulation->gravity_m_s2, -1.0, 1.0));

        roll = choose(steady, (kept * roll) + (simulation->tilt_weight * roll_seen), roll);
        pitch = choose(steady, (kept * pitch) + (simulation->tilt_weight * pitch_seen), pitch);
    }
    suite->euler_rad[0] = roll;
    suite->euler_rad[1] = pitch;
    suite->euler_rad[2] = suite->euler_rad[2] + (simulation->step_s * yaw_rate);
    suite->rotation = rotation(suite->euler_rad);
}

/* Butterworth low-pass of third order. */
static inline real_t low_pass(const engine_simulation_t *simulation, real_t *state, real_t value)
{
    const real_t now = ((value - (simulation->low_pass_a[0] * state[0])) - (simulation->low_pass_a[1] * state[1]))
                       - (simulation->low_pass_a[2] * state[2]);
    const real_t output = simulation->low_pass_b * (((now + (3.0 * state[0])) + (3.0 * state[1])) + state[2]);

    state[2] = state[1];
    state[1] = state[0];
    state[0] = now;
    return output;
}

/* Kalman filter of height and vertical velocity. */
static inline void estimate_altitude(const engine_simulation_t *simulation, const readings_t *readings,
                                     real_t acceleration_m_s2, suite_t *suite)
{
    const real_t sonar = -readings->sonar_m;
    const real_t slow_pressure = low_pass(simulation, suite->low_pass[0], readings->pressure_pa / simulation->pa_per_m);
    const real_t slow_sonar = low_pass(simulation, suite->low_pass[1], sonar);
    const mask_t steady = magnitude(suite->z_m - sonar) <= simulation->sonar_jump_m;
    const mask_t pressure_agrees = magnitude(slow_pressure - suite->z_m) < simulation->pressure_jump_m;
    const mask_t sonar_agrees = magnitude(slow_sonar - suite->z_m) < simulation->slow_jump_m;
    const mask_t accepted = steady & (sonar < -simulation->sonar_min_m) & (pressure_agrees | sonar_agrees);
    const real_t innovation = choose(accepted, sonar - suite->predicted_z_m, splat(0.0));

    suite->z_m = suite->predicted_z_m + (simulation->altitude_gains[0] * innovation);
    suite->velocity_z_m_s = suite->predicted_velocity_z_m_s + (simulation->altitude_gains[1] * innovation);
    suite->predicted_z_m = suite->z_m + (simulation->step_s * suite->velocity_z_m_s);
    suite->predicted_velocity_z_m_s = suite->velocity_z_m_s + (simulation->step_s * acceleration_m_s2);
}

/* Kalman filter of the velocity along body x and y. */
static inline void estimate_velocity(const engine_simulation_t *simulation, const readings_t *readings,
                                     const real_t *acceleration_m_s2, suite_t *suite)
{
    const real_t p = readings->imu[3];
    const real_t q = readings->imu[4];
    const real_t tilt_rad = maximum(magnitude(suite->euler_rad[0]), magnitude(suite->euler_rad[1]));
    const real_t rate_rad_s = maximum(magnitude(p), magnitude(q));
    const real_t jump_m_s = maximum(magnitude(readings->flow_m_s[0] - suite->body_velocity_m_s[0]),
                                    magnitude(readings->flow_m_s[1] - suite->body_velocity_m_s[1]));
    const mask_t accepted = (((tilt_rad <= simulation->flow_tilt_rad) & (rate_rad_s <= simulation->flow_rate_rad_s))
                             | (rate_rad_s <= simulation->flow_slow_rad_s))
                            & (jump_m_s <= simulation->flow_jump_m_s) & (suite->z_m <= -simulation->flow_min_height_m);
    const real_t rotation_rate[2] = { q, -p };
    int i;

    for (i = 0; i < 2; i++) {
        const real_t predicted = suite->predicted_body_velocity_m_s[i];
        real_t flow_m_s = readings->flow_m_s[i];

        if (simulation->derotated) {
            flow_m_s = flow_m_s + (suite->z_m * rotation_rate[i]);
        }
        suite->body_velocity_m_s[i] =
            predicted + (simulation->velocity_gain * choose(accepted, flow_m_s - predicted, splat(0.0)));
        suite->predicted_body_velocity_m_s[i] =
            suite->body_velocity_m_s[i]
            + ((simulation->step_s * simulation->acceleration_gain) * acceleration_m_s2[i]);
    }
}

/* The estimate that the controllers receive at this tick. */
static inline seen_t estimate(const engine_simulation_t *simulation, const engine_flight_t *flight,
                              const seen_t *truth_now, const rotation_t *r, const real_t *draws, suite_t *suite)
{
    const readings_t readings = read_instruments(simulation, flight, truth_now, r, draws, suite);
    real_t force[3];
    real_t acceleration_m_s2[2];
    real_t velocity_m_s[3];
    seen_t seen;
    int i;

    estimate_attitude(simulation, &readings, suite);
    suite->tick++;
    to_world(&suite->rotation, readings.imu, force);
    estimate_altitude(simulation, &readings, force[2] + simulation->gravity_m_s2, suite);
    acceleration_m_s2[0] = readings.imu[0] + (-simulation->gravity_m_s2 * suite->rotation.sin_pitch);
    acceleration_m_s2[1] = readings.imu[1]
                           + ((simulation->gravity_m_s2 * suite->rotation.sin_roll) * suite->rotation.cos_pitch);
    estimate_velocity(simulation, &readings, acceleration_m_s2, suite);
    velocity_m_s[0] = suite->body_velocity_m_s[0];
    velocity_m_s[1] = suite->body_velocity_m_s[1];
    velocity_m_s[2] = suite->velocity_z_m_s;
    to_world(&suite->rotation, velocity_m_s, seen.velocity_m_s);
    seen.velocity_m_s[2] = suite->velocity_z_m_s;
    seen.position_m[2] = suite->z_m;
    for (i = 0; i < 2; i++) {
        seen.position_m[i] = suite->position_m[i];
        suite->position_m[i] = suite->position_m[i] + (simulation->step_s * seen.velocity_m_s[i]);
    }
    for (i = 0; i < 3; i++) {
        seen.euler_rad[i] = suite->euler_rad[i];
        seen.rates_rad_s[i] = readings.imu[3 + i];
    }
    return seen;
}

#endif
