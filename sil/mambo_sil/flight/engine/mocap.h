/* SPDX-License-Identifier: MIT-0
 *
 * Motion capture: sil/mambo_sil/drone/sensors/mocap.py, operation by operation.
 */
#ifndef ENGINE_MOCAP_H
#define ENGINE_MOCAP_H

#include "vehicle.h"

/* 0.2 s of 2000 ticks a second. */
#define MOCAP_DELAY_MAX 400

typedef struct {
    real_t late_m[MOCAP_DELAY_MAX + 1][3];
    real_t position_m[3];
    real_t velocity_m_s[3];
    int64_t tick;
} mocap_t;

/* The way from the centre of mass to the measured place. */
static inline void mocap_arm(const engine_simulation_t *simulation, const rotation_t *r, real_t *arm_m)
{
    const double *lever_m = simulation->mocap_lever_m;
    const real_t in_body_m[3] = { splat(lever_m[0]), splat(lever_m[1]), splat(lever_m[2]) };

    to_world(r, in_body_m, arm_m);
}

/* The place that is measured. */
static inline void measured_place(const engine_simulation_t *simulation, const seen_t *truth_now, const rotation_t *r,
                                  real_t *place_m)
{
    real_t arm_m[3] = { splat(0.0), splat(0.0), splat(0.0) };
    int i;

    if (simulation->mocap_beside) {
        mocap_arm(simulation, r, arm_m);
    }
    for (i = 0; i < 3; i++) {
        place_m[i] = simulation->mocap_beside ? (truth_now->position_m[i] + arm_m[i]) : truth_now->position_m[i];
    }
}

/* The first tick sets the position, and the latest of the late ones. */
static inline void mocap_start(const engine_simulation_t *simulation, const seen_t *start, const rotation_t *r,
                               mocap_t *mocap)
{
    real_t place_m[3];
    int64_t k;
    int i;

    measured_place(simulation, start, r, place_m);
    for (i = 0; i < 3; i++) {
        for (k = 1; k <= simulation->mocap_delay_ticks; k++) {
            mocap->late_m[k][i] = place_m[i];
        }
        mocap->velocity_m_s[i] = start->velocity_m_s[i];
    }
    mocap->tick = 0;
}

/* What the controllers receive at this tick. */
static inline seen_t capture(const engine_simulation_t *simulation, const engine_flight_t *flight,
                             const seen_t *truth_now, const rotation_t *r, const real_t *draws, mocap_t *mocap)
{
    const int64_t depth = simulation->mocap_delay_ticks + 1;
    const int64_t tick = mocap->tick;
    seen_t seen = *truth_now;
    real_t place_m[3];
    real_t arm_m[3] = { splat(0.0), splat(0.0), splat(0.0) };
    int i;

    for (i = 0; i < 3; i++) {
        seen.euler_rad[i] = truth_now->euler_rad[i] + (flight->noise[3 + i] * draws[3 + i]);
    }
    if (simulation->mocap_beside) {
        const rotation_t seen_rotation = rotation(seen.euler_rad);

        mocap_arm(simulation, &seen_rotation, arm_m);
    }
    measured_place(simulation, truth_now, r, place_m);
    for (i = 0; i < 3; i++) {
        mocap->late_m[tick % depth][i] = place_m[i];
        if ((tick % simulation->mocap_period_ticks) == 0) {
            real_t position_m = mocap->late_m[(tick + 1) % depth][i] + (flight->noise[i] * draws[i]);

            if (simulation->mocap_beside) {
                position_m = position_m - arm_m[i];
            }
            if (tick > 0) {
                const real_t quotient = (position_m - mocap->position_m[i]) / simulation->mocap_period_s;

                mocap->velocity_m_s[i] = mocap->velocity_m_s[i]
                                         + (simulation->mocap_share * (quotient - mocap->velocity_m_s[i]));
            }
            mocap->position_m[i] = position_m;
        }
        seen.position_m[i] = mocap->position_m[i];
        seen.velocity_m_s[i] = mocap->velocity_m_s[i];
    }
    mocap->tick = tick + 1;
    return seen;
}

#endif
