/* SPDX-License-Identifier: MIT-0
 *
 * Instruments and estimators: sil/sensors/{instruments,estimators}.py, operation by operation.
 */
#ifndef ENGINE_SENSORS_H
#define ENGINE_SENSORS_H

#include "vehicle.h"

#define IMU 6
#define TAPS 6

typedef struct {
    double imu[IMU];
    double sonar_m;
    double pressure_pa;
    double flow_m_s[2];
} readings_t;

/* What instruments and estimators remember from one tick to the next. */
typedef struct {
    double velocity_m_s[3];
    double motion[IMU];
    double imu_value[IMU];
    double imu_rate[IMU];
    double flow_m_s[2];
    int64_t tick;
    readings_t delayed;

    double euler_rad[3];
    rotation_t rotation;
    double forces[TAPS][3];
    double low_pass[2][3]; /* pressure, sonar */
    double z_m;
    double velocity_z_m_s;
    double predicted_z_m;
    double predicted_velocity_z_m_s;
    double body_velocity_m_s[2];
    double predicted_body_velocity_m_s[2];
    double position_m[2];
} suite_t;

/* Mean specific force since the last tick, in current body axes, and body rates. */
static inline void measure_motion(const engine_simulation_t *simulation, const suite_t *suite, const seen_t *truth_now,
                                  const rotation_t *r, double *motion)
{
    double force[3];
    int i;

    for (i = 0; i < 3; i++) {
        force[i] = (truth_now->velocity_m_s[i] - suite->velocity_m_s[i]) / simulation->step_s;
        motion[3 + i] = truth_now->rates_rad_s[i];
    }
    force[2] = force[2] - simulation->gravity_m_s2;
    to_body(r, force, motion);
}

static inline void measure_flow(const engine_simulation_t *simulation, const seen_t *truth_now, const rotation_t *r,
                                double *flow_m_s)
{
    const double lever = simulation->flow_coupling * truth_now->position_m[2];
    double body_m_s[3];

    to_body(r, truth_now->velocity_m_s, body_m_s);
    flow_m_s[0] = body_m_s[0] + (lever * -truth_now->rates_rad_s[1]);
    flow_m_s[1] = body_m_s[1] + (lever * truth_now->rates_rad_s[0]);
}

static inline void suite_start(const engine_simulation_t *simulation, const seen_t *start, const rotation_t *r,
                               suite_t *suite)
{
    double body_m_s[3];
    int i;
    int k;

    for (i = 0; i < 3; i++) {
        suite->velocity_m_s[i] = start->velocity_m_s[i];
        suite->euler_rad[i] = start->euler_rad[i];
    }
    measure_motion(simulation, suite, start, r, suite->motion);
    for (i = 0; i < IMU; i++) {
        suite->imu_value[i] = suite->motion[i];
        suite->imu_rate[i] = 0.0;
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

/* The readings that reach the estimators at this tick: those of the tick before, at the first its own. */
static inline readings_t read_instruments(const engine_simulation_t *simulation, const engine_flight_t *flight,
                                          const seen_t *truth_now, const rotation_t *r, const double *draws,
                                          suite_t *suite)
{
    const double *transition = simulation->imu_transition;
    const double height_m = -truth_now->position_m[2];
    readings_t now;
    readings_t arriving;
    double motion[IMU];
    int i;

    measure_motion(simulation, suite, truth_now, r, motion);
    for (i = 0; i < IMU; i++) {
        const double mean = 0.5 * (suite->motion[i] + motion[i]);
        const double value = suite->imu_value[i];
        const double rate = suite->imu_rate[i];

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
    now.sonar_m = maximum(height_m + (flight->noise[6] * draws[6]), simulation->sonar_min_m);
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
    const double p = readings->imu[3];
    const double q = readings->imu[4];
    const double yaw_axis_rate = readings->imu[5];
    const double yaw_rate = ((r->sin_roll * q) + (r->cos_roll * yaw_axis_rate)) / r->cos_pitch;
    double roll = suite->euler_rad[0] + (simulation->step_s * (p + (r->sin_pitch * yaw_rate)));
    double pitch = suite->euler_rad[1]
                   + (simulation->step_s * ((r->cos_roll * q) - (r->sin_roll * yaw_axis_rate)));
    double smooth[3];
    double magnitude;
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
    magnitude = sqrt(((smooth[0] * smooth[0]) + (smooth[1] * smooth[1])) + (smooth[2] * smooth[2]));
    if (fabs(magnitude - simulation->gravity_m_s2) < (simulation->tilt_gate * simulation->gravity_m_s2)) {
        const double kept = 1.0 - simulation->tilt_weight;

        roll = (kept * roll) + (simulation->tilt_weight * arc_tangent(smooth[1] / smooth[2]));
        pitch = (kept * pitch)
                + (simulation->tilt_weight * arc_sine(clip(smooth[0] / simulation->gravity_m_s2, -1.0, 1.0)));
    }
    suite->euler_rad[0] = roll;
    suite->euler_rad[1] = pitch;
    suite->euler_rad[2] = suite->euler_rad[2] + (simulation->step_s * yaw_rate);
    suite->rotation = rotation(suite->euler_rad);
}

/* Butterworth low-pass of third order. */
static inline double low_pass(const engine_simulation_t *simulation, double *state, double value)
{
    const double now = ((value - (simulation->low_pass_a[0] * state[0])) - (simulation->low_pass_a[1] * state[1]))
                       - (simulation->low_pass_a[2] * state[2]);
    const double output = simulation->low_pass_b * (((now + (3.0 * state[0])) + (3.0 * state[1])) + state[2]);

    state[2] = state[1];
    state[1] = state[0];
    state[0] = now;
    return output;
}

/* Kalman filter of height and vertical velocity. */
static inline void estimate_altitude(const engine_simulation_t *simulation, const readings_t *readings,
                                     double acceleration_m_s2, suite_t *suite)
{
    const double sonar = -readings->sonar_m;
    const double slow_pressure = low_pass(simulation, suite->low_pass[0], readings->pressure_pa / simulation->pa_per_m);
    const double slow_sonar = low_pass(simulation, suite->low_pass[1], sonar);
    const int accepted = (fabs(suite->z_m - sonar) <= simulation->sonar_jump_m) && (sonar < -simulation->sonar_min_m)
                         && ((fabs(slow_pressure - suite->z_m) < simulation->pressure_jump_m)
                             || (fabs(slow_sonar - suite->z_m) < simulation->slow_jump_m));
    const double innovation = accepted ? (sonar - suite->predicted_z_m) : 0.0;

    suite->z_m = suite->predicted_z_m + (simulation->altitude_gains[0] * innovation);
    suite->velocity_z_m_s = suite->predicted_velocity_z_m_s + (simulation->altitude_gains[1] * innovation);
    suite->predicted_z_m = suite->z_m + (simulation->step_s * suite->velocity_z_m_s);
    suite->predicted_velocity_z_m_s = suite->velocity_z_m_s + (simulation->step_s * acceleration_m_s2);
}

/* Kalman filter of the velocity along body x and y. */
static inline void estimate_velocity(const engine_simulation_t *simulation, const readings_t *readings,
                                     const double *acceleration_m_s2, suite_t *suite)
{
    const double p = readings->imu[3];
    const double q = readings->imu[4];
    const double tilt_rad = maximum(fabs(suite->euler_rad[0]), fabs(suite->euler_rad[1]));
    const double rate_rad_s = maximum(fabs(p), fabs(q));
    const double jump_m_s = maximum(fabs(readings->flow_m_s[0] - suite->body_velocity_m_s[0]),
                                    fabs(readings->flow_m_s[1] - suite->body_velocity_m_s[1]));
    const int accepted = (((tilt_rad <= simulation->flow_tilt_rad) && (rate_rad_s <= simulation->flow_rate_rad_s))
                          || (rate_rad_s <= simulation->flow_slow_rad_s))
                         && (jump_m_s <= simulation->flow_jump_m_s) && (suite->z_m <= -simulation->flow_min_height_m);
    const double rotation_rate[2] = { q, -p };
    int i;

    for (i = 0; i < 2; i++) {
        const double predicted = suite->predicted_body_velocity_m_s[i];
        double flow_m_s = readings->flow_m_s[i];

        if (simulation->derotated) {
            flow_m_s = flow_m_s + (suite->z_m * rotation_rate[i]);
        }
        suite->body_velocity_m_s[i] = predicted
                                      + (simulation->velocity_gain * (accepted ? (flow_m_s - predicted) : 0.0));
        suite->predicted_body_velocity_m_s[i] =
            suite->body_velocity_m_s[i]
            + ((simulation->step_s * simulation->acceleration_gain) * acceleration_m_s2[i]);
    }
}

/* The estimate that the controllers receive at this tick. */
static inline seen_t estimate(const engine_simulation_t *simulation, const engine_flight_t *flight,
                              const seen_t *truth_now, const rotation_t *r, const double *draws, suite_t *suite)
{
    const readings_t readings = read_instruments(simulation, flight, truth_now, r, draws, suite);
    double force[3];
    double acceleration_m_s2[2];
    double velocity_m_s[3];
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
