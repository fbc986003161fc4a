/* SPDX-License-Identifier: MIT-0
 *
 * Estimates that drift: sil/mambo_sil/drone/sensors/drift.py, operation by operation.
 */
#ifndef ENGINE_DRIFT_H
#define ENGINE_DRIFT_H

#include "vehicle.h"

/* Errors of position and velocity. */
typedef struct {
    real_t position_m[3];
    real_t velocity_m_s[3];
} drift_t;

static inline void drift_start(drift_t *errors)
{
    int i;

    for (i = 0; i < 3; i++) {
        errors->position_m[i] = splat(0.0);
        errors->velocity_m_s[i] = splat(0.0);
    }
}

/* What the controllers receive at this tick. */
static inline seen_t drift(const engine_simulation_t *simulation, const engine_flight_t *flight,
                           const seen_t *measured, const real_t *draws, drift_t *errors)
{
    seen_t seen = *measured;
    int i;

    for (i = 0; i < 3; i++) {
        const real_t gone_m_s = errors->velocity_m_s[i] - (errors->position_m[i] / simulation->drift_corrected_s[i]);

        errors->position_m[i] = errors->position_m[i] + (simulation->step_s * gone_m_s);
        errors->velocity_m_s[i] = (simulation->drift_keep * errors->velocity_m_s[i]) + (flight->noise[i] * draws[i]);
        seen.position_m[i] = measured->position_m[i] + errors->position_m[i];
        seen.velocity_m_s[i] = measured->velocity_m_s[i] + errors->velocity_m_s[i];
    }
    return seen;
}

#endif
