/* SPDX-License-Identifier: MIT-0
 *
 * Observer: a Kalman filter with fixed gains for position, velocity and disturbance (not in the paper).
 */
#include "nmpc_observer.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xF8CA429DUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

void nmpc_observer_clear(nmpc_t *self)
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        self->observer.position_m[axis] = (nmpc_real_t)0;
        self->observer.velocity_m_step[axis] = (nmpc_real_t)0;
        self->observer.disturbance_m_step2[axis] = (nmpc_real_t)0;
    }
}

void nmpc_observer_start(nmpc_t *self, const nmpc_state_t *state)
{
    int axis;

    for (axis = 0; axis < 2; axis++) {
        self->observer.position_m[axis] = state->position_m[axis];
        self->observer.velocity_m_step[axis] = NMPC_UPDATE_STEP_S * state->velocity_m_s[axis];
    }
}

void nmpc_observer_correct(nmpc_t *self, const nmpc_state_t *state)
{
    nmpc_observer_t *const observer = &self->observer;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t position_m = observer->position_m[axis];
        const nmpc_real_t velocity_m_step = observer->velocity_m_step[axis];
        const nmpc_real_t measured_m = state->position_m[axis];
        const nmpc_real_t measured_m_step = NMPC_UPDATE_STEP_S * state->velocity_m_s[axis];
        const nmpc_real_t innovation_m = measured_m - position_m;
        const nmpc_real_t innovation_m_step = measured_m_step - velocity_m_step;

        observer->position_m[axis] =
            nmpc_clamp(position_m
                           + ((NMPC_POSITION_BY_POSITION * innovation_m) + (NMPC_POSITION_BY_VELOCITY * innovation_m_step)),
                       NMPC_ESTIMATED_POSITION_LIMIT_M);
        observer->velocity_m_step[axis] =
            nmpc_clamp(velocity_m_step
                           + ((NMPC_VELOCITY_BY_POSITION * innovation_m) + (NMPC_VELOCITY_BY_VELOCITY * innovation_m_step)),
                       NMPC_VELOCITY_LIMIT_M_STEP);
        observer->disturbance_m_step2[axis] =
            nmpc_clamp(observer->disturbance_m_step2[axis]
                           + ((NMPC_DISTURBANCE_BY_POSITION * innovation_m) + (NMPC_DISTURBANCE_BY_VELOCITY * innovation_m_step)),
                       NMPC_DISTURBANCE_LIMIT_M_STEP2);
    }
}

void nmpc_observer_predict(nmpc_t *self, const nmpc_real_t tilt_m_step2[2])
{
    nmpc_observer_t *const observer = &self->observer;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const nmpc_real_t acceleration_m_step2 = tilt_m_step2[axis] + nmpc_observer_disturbance(self, axis);
        const nmpc_real_t velocity_m_step = observer->velocity_m_step[axis];
        const nmpc_real_t mean_m_step = velocity_m_step + (NMPC_HALF * acceleration_m_step2);

        observer->position_m[axis] =
            nmpc_clamp(observer->position_m[axis] + mean_m_step,
                       NMPC_ESTIMATED_POSITION_LIMIT_M);
        observer->velocity_m_step[axis] =
            nmpc_clamp(velocity_m_step + acceleration_m_step2, NMPC_VELOCITY_LIMIT_M_STEP);
    }
}
