/* SPDX-License-Identifier: MIT-0
 *
 * The ground at height 0: sil/mambo_sil/drone/plant/ground.py.
 */
#ifndef ENGINE_GROUND_H
#define ENGINE_GROUND_H

#include "vehicle.h"

/* Thrust near the ground over that far from it: Cheeseman and Bennett (1955). */
static inline real_t ground_effect(const engine_simulation_t *simulation, const engine_flight_t *flight, real_t height_m)
{
    const real_t radius_m = flight->ground_effect_radius_m;
    const real_t rotor_height_m = maximum(height_m + simulation->rotor_height_m, radius_m / 2.0);
    const real_t ratio = radius_m / (4.0 * rotor_height_m);

    return choose(radius_m > 0.0, 1.0 / (1.0 - (ratio * ratio)), splat(1.0));
}

/* Put drones that are below the ground on it, at rest and level unless they rise. */
static inline void carry_on_ground(const engine_flight_t *flight, real_t *body)
{
    const mask_t low = flight->landing & (body[POSITION + 2] >= 0.0);
    real_t velocity_m_s[3];
    rotation_t r;
    mask_t resting;
    int i;

    if (any(low)) {
        r = rotation(body + EULER);
        to_world(&r, body + VELOCITY, velocity_m_s);
        resting = low & (velocity_m_s[2] >= 0.0);
        body[POSITION + 2] = choose(low, splat(0.0), body[POSITION + 2]);
        for (i = 0; i < 3; i++) {
            body[VELOCITY + i] = choose(resting, splat(0.0), body[VELOCITY + i]);
            body[RATES + i] = choose(resting, splat(0.0), body[RATES + i]);
        }
        body[EULER] = choose(resting, splat(0.0), body[EULER]);
        body[EULER + 1] = choose(resting, splat(0.0), body[EULER + 1]);
    }
}

#endif
