/* SPDX-License-Identifier: MIT-0
 *
 * The rigid body of the paper, equations 2 to 7: sil/mambo_sil/drone/plant/rigid_body.py, operation by operation.
 */
#ifndef ENGINE_RIGID_BODY_H
#define ENGINE_RIGID_BODY_H

#include "elementary.h"
#include "engine.h"

#define POSITION 0
#define VELOCITY 3
#define EULER 6
#define RATES 9
#define STATE_ROWS 12

/* Sines and cosines of roll, pitch and yaw. */
typedef struct {
    real_t sin_roll, cos_roll, sin_pitch, cos_pitch, sin_yaw, cos_yaw;
} rotation_t;

/* Mass, wind and acceleration upwards in one tick. */
typedef struct {
    real_t mass_kg;
    real_t air_m_s[2];
    real_t lift_m_s2;
} surroundings_t;

static inline rotation_t rotation(const real_t *euler_rad)
{
    rotation_t r;

    sine_cosine(euler_rad[0], &r.sin_roll, &r.cos_roll);
    sine_cosine(euler_rad[1], &r.sin_pitch, &r.cos_pitch);
    sine_cosine(euler_rad[2], &r.sin_yaw, &r.cos_yaw);
    return r;
}

/* R of eq 3 times a body vector. */
static inline void to_world(const rotation_t *r, const real_t *vector, real_t *world)
{
    const real_t x = vector[0];
    const real_t y = vector[1];
    const real_t z = vector[2];
    const real_t heading_y = (r->cos_roll * y) - (r->sin_roll * z);
    const real_t pitched_z = (r->sin_roll * y) + (r->cos_roll * z);
    const real_t heading_x = (r->cos_pitch * x) + (r->sin_pitch * pitched_z);

    world[0] = (r->cos_yaw * heading_x) - (r->sin_yaw * heading_y);
    world[1] = (r->sin_yaw * heading_x) + (r->cos_yaw * heading_y);
    world[2] = (r->cos_pitch * pitched_z) - (r->sin_pitch * x);
}

/* R transposed times a world vector. */
static inline void to_body(const rotation_t *r, const real_t *vector, real_t *body)
{
    const real_t x = vector[0];
    const real_t y = vector[1];
    const real_t z = vector[2];
    const real_t heading_x = (r->cos_yaw * x) + (r->sin_yaw * y);
    const real_t heading_y = (r->cos_yaw * y) - (r->sin_yaw * x);
    const real_t pitched_z = (r->cos_pitch * z) + (r->sin_pitch * heading_x);

    body[0] = (r->cos_pitch * heading_x) - (r->sin_pitch * z);
    body[1] = (r->cos_roll * heading_y) + (r->sin_roll * pitched_z);
    body[2] = (r->cos_roll * pitched_z) - (r->sin_roll * heading_y);
}

/* Time derivative of a state under a wrench. */
static inline void derivative(const engine_simulation_t *simulation, const engine_flight_t *flight,
                              const surroundings_t *around, const rotation_t *r, const real_t *state,
                              const real_t *wrench, real_t *rate)
{
    const real_t u = state[3];
    const real_t v = state[4];
    const real_t w = state[5];
    const real_t p = state[9];
    const real_t q = state[10];
    const real_t yaw_axis_rate = state[11];
    const real_t *inertia = flight->inertia_kg_m2;
    const real_t push_x = flight->push_m_s2[0];
    const real_t push_y = flight->push_m_s2[1];
    real_t heading_x = (r->cos_yaw * push_x) + (r->sin_yaw * push_y);
    real_t heading_y = (r->cos_yaw * push_y) - (r->sin_yaw * push_x);
    const real_t down = simulation->gravity_m_s2 - around->lift_m_s2;
    const real_t pitched_z = (r->cos_pitch * down) + (r->sin_pitch * heading_x);
    const real_t external_x = (r->cos_pitch * heading_x) - (r->sin_pitch * down);
    const real_t external_y = (r->cos_roll * heading_y) + (r->sin_roll * pitched_z);
    const real_t external_z = (r->cos_roll * pitched_z) - (r->sin_roll * heading_y);
    real_t yaw_rate;

    /* Equation 2. */
    to_world(r, state + VELOCITY, rate + POSITION);

    /* Equations 6 and 7. */
    rate[3] = (external_x - (flight->drag_1_s * u)) - ((q * w) - (yaw_axis_rate * v));
    rate[4] = (external_y - (flight->drag_1_s * v)) - ((yaw_axis_rate * u) - (p * w));
    if (simulation->windy) {
        const real_t air_x = around->air_m_s[0];
        const real_t air_y = around->air_m_s[1];

        heading_x = (r->cos_yaw * air_x) + (r->sin_yaw * air_y);
        heading_y = (r->cos_yaw * air_y) - (r->sin_yaw * air_x);
        rate[3] = rate[3] + (flight->drag_1_s * (r->cos_pitch * heading_x));
        rate[4] = rate[4]
                  + (flight->drag_1_s * ((r->cos_roll * heading_y) + (r->sin_roll * (r->sin_pitch * heading_x))));
    }
    rate[5] = (external_z - (wrench[0] / around->mass_kg)) - ((p * v) - (q * u));

    /* Equations 4 and 5. */
    yaw_rate = ((r->sin_roll * q) + (r->cos_roll * yaw_axis_rate)) / r->cos_pitch;
    rate[6] = p + (r->sin_pitch * yaw_rate);
    rate[7] = (r->cos_roll * q) - (r->sin_roll * yaw_axis_rate);
    rate[8] = yaw_rate;

    /* Euler's equation. */
    rate[9] = (wrench[1] - ((inertia[2] - inertia[1]) * (q * yaw_axis_rate))) / inertia[0];
    rate[10] = (wrench[2] - ((inertia[0] - inertia[2]) * (yaw_axis_rate * p))) / inertia[1];
    rate[11] = (wrench[3] - ((inertia[1] - inertia[0]) * (p * q))) / inertia[2];
}

#endif
