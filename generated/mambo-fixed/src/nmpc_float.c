/* SPDX-License-Identifier: MIT-0
 *
 * Floats in and out of a fixed point controller.
 * MISRA C:2012: departs from rule 15.5, for the reason in deviations.txt.
 */
#include <stddef.h>

#include "nmpc_float.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0xD4C905DCUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* Numbers per unit, and units per number. */
#define NMPC_POSITION_SCALE 524288.0f
#define NMPC_VELOCITY_SCALE 8.388608e+06f
#define NMPC_ANGLE_SCALE 5.368709e+08f
#define NMPC_YAW_SCALE 1.048576e+06f
#define NMPC_THRUST_SCALE 3.3554432e+07f
#define NMPC_TRACKING_SCALE 64.0f
#define NMPC_EFFORT_SCALE 2.6843546e+08f
#define NMPC_ANGLE_UNIT 1.8626451e-09f
#define NMPC_COST_UNIT 2.9802322e-08f

/* 2^31: no number reaches it. */
#define NMPC_NUMBERS_END 2147483648.0f

static nmpc_real_t number_of(float value, float scale)
{
    const float scaled = value * scale;
    nmpc_real_t number = 2147483647;

    if ((scaled > -NMPC_NUMBERS_END) && (scaled < NMPC_NUMBERS_END)) {
        float rest;

        number = (nmpc_real_t)scaled;
        rest = scaled - (float)number;
        if (rest >= 0.5f) {
            number++;
        } else if (rest <= -0.5f) {
            number--;
        } else {
            /* The nearest already. */
        }
    }
    return number;
}

nmpc_status_t nmpc_float_step(nmpc_t *self, const nmpc_float_state_t *state, const nmpc_float_target_t *target,
                              float thrust_acceleration_m_s2, nmpc_float_command_t *command)
{
    nmpc_state_t here;
    nmpc_target_t there;
    nmpc_command_t next;
    nmpc_status_t status;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    if ((state == NULL) || (target == NULL)) {
        status = nmpc_step(self, NULL, NULL, 0, &next);
    } else {
        int axis;

        for (axis = 0; axis < 2; axis++) {
            here.position_m[axis] = number_of(state->position_m[axis], NMPC_POSITION_SCALE);
            here.velocity_m_s[axis] = number_of(state->velocity_m_s[axis], NMPC_VELOCITY_SCALE);
            there.position_m[axis] = number_of(target->position_m[axis], NMPC_POSITION_SCALE);
            there.velocity_m_s[axis] = number_of(target->velocity_m_s[axis], NMPC_VELOCITY_SCALE);
        }
        here.roll_rad = number_of(state->roll_rad, NMPC_ANGLE_SCALE);
        here.pitch_rad = number_of(state->pitch_rad, NMPC_ANGLE_SCALE);
        here.yaw_rad = number_of(state->yaw_rad, NMPC_YAW_SCALE);
        status = nmpc_step(self, &here, &there, number_of(thrust_acceleration_m_s2, NMPC_THRUST_SCALE), &next);
    }
    command->roll_rad = (float)next.roll_rad * NMPC_ANGLE_UNIT;
    command->pitch_rad = (float)next.pitch_rad * NMPC_ANGLE_UNIT;
    return status;
}

nmpc_status_t nmpc_float_reset(nmpc_t *self, const nmpc_float_command_t *command)
{
    nmpc_command_t last;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    last.roll_rad = number_of(command->roll_rad, NMPC_ANGLE_SCALE);
    last.pitch_rad = number_of(command->pitch_rad, NMPC_ANGLE_SCALE);
    return nmpc_reset(self, &last);
}

nmpc_status_t nmpc_float_set_weights(nmpc_t *self, const nmpc_float_weights_t *weights)
{
    nmpc_weights_t numbers;

    if (weights == NULL) {
        return NMPC_NULL_POINTER;
    }

    numbers.tracking = number_of(weights->tracking, NMPC_TRACKING_SCALE);
    numbers.effort = number_of(weights->effort, NMPC_EFFORT_SCALE);
    return nmpc_set_weights(self, &numbers);
}

float nmpc_float_last_cost(const nmpc_t *self)
{
    return (float)nmpc_last_cost(self) * NMPC_COST_UNIT;
}
