/* SPDX-License-Identifier: MIT-0
 *
 * A drone of whose code nothing is known: sil/mambo_sil/drone/plant/first_order.py, operation by operation.
 */
#ifndef ENGINE_FIRST_ORDER_H
#define ENGINE_FIRST_ORDER_H

#include "vehicle.h"

/* 0.2 s of 2000 ticks a second. */
#define LATE_TICKS_MAX 400

/* Commands and demands of thrust that have not acted yet, and the thrust. */
typedef struct {
    real_t sent_rad[LATE_TICKS_MAX + 2][2];
    real_t demanded_n[LATE_TICKS_MAX + 2];
    real_t thrust_n;
} late_t;

/* Commands of level flight, and a steady demand of thrust. */
static inline void late_start(const engine_simulation_t *simulation, real_t demanded_n, late_t *late)
{
    int i;

    for (i = 0; i < (LATE_TICKS_MAX + 2); i++) {
        late->sent_rad[i][0] = splat(0.0);
        late->sent_rad[i][1] = splat(0.0);
        late->demanded_n[i] = demanded_n;
    }
    late->thrust_n = simulation->thrust_gain * demanded_n;
}

/* The angles at the later nodes and the end of the tick, and their rates of change there. */
static inline void follow(const engine_simulation_t *simulation, int64_t tick, const real_t *start_rad,
                          real_t heading_rad, const late_t *late, real_t nodes_rad[3][3], real_t *slopes_rad_s)
{
    int axis;
    int node;

    for (axis = 0; axis < 2; axis++) {
        const int64_t newest = (tick - simulation->late_ticks[axis]) + (LATE_TICKS_MAX + 2);
        const real_t now = simulation->response_gain[axis] * late->sent_rad[newest % (LATE_TICKS_MAX + 2)][axis];
        const real_t before = simulation->response_gain[axis]
                              * late->sent_rad[(newest - 1) % (LATE_TICKS_MAX + 2)][axis];

        for (node = 0; node < 3; node++) {
            const real_t turned = before + ((start_rad[axis] - before) * simulation->decay_before[axis][node]);

            nodes_rad[node][axis] = now + ((turned - now) * simulation->decay_after[axis][node]);
        }
        slopes_rad_s[axis] = (now - nodes_rad[2][axis]) / simulation->response_lag_s[axis];
    }
    for (node = 0; node < 3; node++) {
        nodes_rad[node][2] = heading_rad + ((start_rad[2] - heading_rad) * simulation->yaw_decay[node]);
    }
    slopes_rad_s[2] = (heading_rad - nodes_rad[2][2]) / simulation->yaw_lag_s;
}

/* The thrust at the nodes and at the end of the tick. */
static inline void deliver(const engine_simulation_t *simulation, int64_t tick, real_t demanded_n, late_t *late,
                           real_t *nodes_n)
{
    const int64_t newest = (tick - simulation->thrust_late_ticks) + (LATE_TICKS_MAX + 2);
    real_t now;
    real_t before;
    int node;

    late->demanded_n[tick % (LATE_TICKS_MAX + 2)] = demanded_n;
    now = simulation->thrust_gain * late->demanded_n[newest % (LATE_TICKS_MAX + 2)];
    before = simulation->thrust_gain * late->demanded_n[(newest - 1) % (LATE_TICKS_MAX + 2)];
    nodes_n[0] = simulation->thrust_lags ? late->thrust_n : demanded_n;
    for (node = 0; node < 3; node++) {
        const real_t reached = before + ((nodes_n[0] - before) * simulation->thrust_decay_before[node]);

        nodes_n[1 + node] = simulation->thrust_lags ? (now + ((reached - now) * simulation->thrust_decay_after[node]))
                                                    : demanded_n;
    }
    late->thrust_n = nodes_n[3];
}

/* Acceleration in the world by thrust, push, gravity and lift. */
static inline void accelerate(const engine_simulation_t *simulation, const engine_flight_t *flight,
                              const surroundings_t *around, real_t share, real_t thrust_n, const real_t *angles_rad,
                              real_t *acceleration_m_s2)
{
    const real_t thrust[3] = { splat(0.0), splat(0.0), -((share * thrust_n) / around->mass_kg) };
    const real_t trimmed_rad[3] = { angles_rad[0] - simulation->trim_rad[0],
                                    angles_rad[1] - simulation->trim_rad[1], angles_rad[2] };
    const rotation_t r = rotation(trimmed_rad);
    int i;

    to_world(&r, thrust, acceleration_m_s2);
    for (i = 0; i < 2; i++) {
        acceleration_m_s2[i] = (simulation->acceleration_per_tilt_g * acceleration_m_s2[i]) + flight->push_m_s2[i];
    }
    acceleration_m_s2[2] = acceleration_m_s2[2] + (simulation->gravity_m_s2 - around->lift_m_s2);
}

/* Time derivative of position and velocity in the world. */
static inline void motion_derivative(const engine_flight_t *flight, const surroundings_t *around, const real_t *motion,
                                     const real_t *acceleration_m_s2, real_t *rate)
{
    int i;

    for (i = 0; i < 3; i++) {
        rate[i] = motion[3 + i];
        rate[3 + i] = acceleration_m_s2[i];
    }
    for (i = 0; i < 2; i++) {
        rate[3 + i] = acceleration_m_s2[i] - (flight->drag_1_s * (motion[3 + i] - around->air_m_s[i]));
    }
}

/* Advance the body by a tick; `r` belongs to the state before. */
static inline void advance(const engine_simulation_t *simulation, const engine_flight_t *flight,
                           const surroundings_t *around, real_t thrust_share, real_t thrust_n, real_t heading_rad,
                           int64_t tick, const real_t *command_rad, const rotation_t *r, late_t *late, real_t *body)
{
    const double half_s = simulation->step_s / 2.0;
    const double three_quarters_s = (3.0 * simulation->step_s) / 4.0;
    const double ninth_s = simulation->step_s / 9.0;
    const real_t share = thrust_share * flight->thrust_factor_n_s2;
    real_t thrusts_n[4];
    real_t nodes_rad[3][3];
    real_t slopes_rad_s[3];
    real_t motion[6];
    real_t acceleration_m_s2[3];
    real_t first[6];
    real_t second[6];
    real_t third[6];
    real_t inner[6];
    rotation_t turned;
    int i;

    late->sent_rad[tick % (LATE_TICKS_MAX + 2)][0] = command_rad[0];
    late->sent_rad[tick % (LATE_TICKS_MAX + 2)][1] = command_rad[1];
    follow(simulation, tick, body + EULER, heading_rad, late, nodes_rad, slopes_rad_s);
    deliver(simulation, tick, maximum(thrust_n, splat(0.0)), late, thrusts_n);
    for (i = 0; i < 3; i++) {
        motion[i] = body[POSITION + i];
    }
    to_world(r, body + VELOCITY, motion + 3);

    accelerate(simulation, flight, around, share, thrusts_n[0], body + EULER, acceleration_m_s2);
    motion_derivative(flight, around, motion, acceleration_m_s2, first);
    for (i = 0; i < 6; i++) {
        inner[i] = motion[i] + (half_s * first[i]);
    }
    accelerate(simulation, flight, around, share, thrusts_n[1], nodes_rad[0], acceleration_m_s2);
    motion_derivative(flight, around, inner, acceleration_m_s2, second);
    for (i = 0; i < 6; i++) {
        inner[i] = motion[i] + (three_quarters_s * second[i]);
    }
    accelerate(simulation, flight, around, share, thrusts_n[2], nodes_rad[1], acceleration_m_s2);
    motion_derivative(flight, around, inner, acceleration_m_s2, third);
    for (i = 0; i < 6; i++) {
        motion[i] = motion[i] + (ninth_s * (((2.0 * first[i]) + (3.0 * second[i])) + (4.0 * third[i])));
    }

    turned = rotation(nodes_rad[2]);
    for (i = 0; i < 3; i++) {
        body[POSITION + i] = motion[i];
        body[EULER + i] = nodes_rad[2][i];
    }
    to_body(&turned, motion + 3, body + VELOCITY);
    body[RATES] = slopes_rad_s[0] - (turned.sin_pitch * slopes_rad_s[2]);
    body[RATES + 1] = (turned.cos_roll * slopes_rad_s[1])
                      + (turned.sin_roll * (turned.cos_pitch * slopes_rad_s[2]));
    body[RATES + 2] = (turned.cos_roll * (turned.cos_pitch * slopes_rad_s[2])) - (turned.sin_roll * slopes_rad_s[1]);
}

#endif
