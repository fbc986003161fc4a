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

/* The first tick sets the position, and the latest of the late ones. */
static inline void mocap_start(const engine_simulation_t *simulation, const seen_t *start, mocap_t *mocap)
{
    int64_t k;
    int i;

    for (i = 0; i < 3; i++) {
        for (k = 1; k <= simulation->mocap_delay_ticks; k++) {
            mocap->late_m[k][i] = start->position_m[i];
        }
        mocap->velocity_m_s[i] = start->velocity_m_s[i];
    }
    mocap->tick = 0;
}

/* What the controllers receive at this tick. */
static inline seen_t capture(const engine_simulation_t *simulation, const engine_flight_t *flight,
                             const seen_t *truth_now, const real_t *draws, mocap_t *mocap)
{
    const int64_t depth = simulation->mocap_delay_ticks + 1;
    const int64_t tick = mocap->tick;
    seen_t seen = *truth_now;
    int i;

    for (i = 0; i < 3; i++) {
        mocap->late_m[tick % depth][i] = truth_now->position_m[i];
        if ((tick % simulation->mocap_period_ticks) == 0) {
            const real_t position_m = mocap->late_m[(tick + 1) % depth][i] + (flight->noise[i] * draws[i]);

            if (tick > 0) {
                const real_t quotient = (position_m - mocap->position_m[i]) / simulation->mocap_period_s;

                mocap->velocity_m_s[i] = mocap->velocity_m_s[i]
                                         + (simulation->mocap_share * (quotient - mocap->velocity_m_s[i]));
            }
            mocap->position_m[i] = position_m;
        }
        seen.position_m[i] = mocap->position_m[i];
        seen.velocity_m_s[i] = mocap->velocity_m_s[i];
        seen.euler_rad[i] = truth_now->euler_rad[i] + (flight->noise[3 + i] * draws[3 + i]);
    }
    mocap->tick = tick + 1;
    return seen;
}

#endif
