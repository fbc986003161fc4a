/* SPDX-License-Identifier: MIT-0
 *
 * Conversion between float and the fixed point numbers of the controller.
 * MISRA C:2012: departs from rule 15.5, for the reason in deviations.txt.
 */
#include <stddef.h>

#include "nmpc_float.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x22D24429UL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

/* Factors from SI units to numbers, and from numbers to SI units. */
#define NMPC_POSITION_SCALE 524288.0f
#define NMPC_VELOCITY_SCALE 8.388608e+06f
#define NMPC_ANGLE_SCALE 3.3554432e+07f
#define NMPC_YAW_SCALE 1.048576e+06f
#define NMPC_THRUST_SCALE 3.3554432e+07f
#define NMPC_ANGLE_UNIT 2.9802322e-08f
#define NMPC_POSITION_UNIT 1.9073486e-06f
#define NMPC_VELOCITY_UNIT 1.1920929e-07f
#define NMPC_DISTURBANCE_UNIT 1.8626451e-09f

/* 2^31: every number is smaller. */
#define NMPC_NUMBERS_END 2147483648.0f

/* Nearest number, ties away from zero; the largest number for what overflows and for NaN. */
static nmpc_real_t quantize(float value, float scale)
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
            /* Truncation gave the nearest number. */
        }
    }
    return number;
}

nmpc_status_t nmpc_float_step(nmpc_t *self, const nmpc_float_state_t *state, const nmpc_float_target_t *target,
                              float thrust_acceleration_m_s2, nmpc_float_command_t *command)
{
    nmpc_state_t fixed_state;
    nmpc_target_t fixed_target;
    nmpc_command_t fixed_command;
    nmpc_status_t status;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    if ((state == NULL) || (target == NULL)) {
        status = nmpc_step(self, NULL, NULL, 0, &fixed_command);
    } else {
        int axis;

        for (axis = 0; axis < 2; axis++) {
            fixed_state.position_m[axis] = quantize(state->position_m[axis], NMPC_POSITION_SCALE);
            fixed_state.velocity_m_s[axis] = quantize(state->velocity_m_s[axis], NMPC_VELOCITY_SCALE);
            fixed_target.position_m[axis] = quantize(target->position_m[axis], NMPC_POSITION_SCALE);
            fixed_target.velocity_m_s[axis] = quantize(target->velocity_m_s[axis], NMPC_VELOCITY_SCALE);
        }
        fixed_state.roll_rad = quantize(state->roll_rad, NMPC_ANGLE_SCALE);
        fixed_state.pitch_rad = quantize(state->pitch_rad, NMPC_ANGLE_SCALE);
        fixed_state.yaw_rad = quantize(state->yaw_rad, NMPC_YAW_SCALE);
        status = nmpc_step(self, &fixed_state, &fixed_target,
                           quantize(thrust_acceleration_m_s2, NMPC_THRUST_SCALE), &fixed_command);
    }
    command->roll_rad = (float)fixed_command.roll_rad * NMPC_ANGLE_UNIT;
    command->pitch_rad = (float)fixed_command.pitch_rad * NMPC_ANGLE_UNIT;
    return status;
}

nmpc_status_t nmpc_float_reset(nmpc_t *self, const nmpc_float_command_t *command)
{
    nmpc_command_t fixed_command;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    fixed_command.roll_rad = quantize(command->roll_rad, NMPC_ANGLE_SCALE);
    fixed_command.pitch_rad = quantize(command->pitch_rad, NMPC_ANGLE_SCALE);
    return nmpc_reset(self, &fixed_command);
}

nmpc_status_t nmpc_float_set_command(nmpc_t *self, const nmpc_float_command_t *command)
{
    nmpc_command_t fixed_command;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    fixed_command.roll_rad = quantize(command->roll_rad, NMPC_ANGLE_SCALE);
    fixed_command.pitch_rad = quantize(command->pitch_rad, NMPC_ANGLE_SCALE);
    return nmpc_set_command(self, &fixed_command);
}

nmpc_status_t nmpc_float_last_estimate(const nmpc_t *self, nmpc_float_estimate_t *estimate)
{
    nmpc_estimate_t fixed_estimate;
    int axis;

    if ((estimate == NULL) || (nmpc_last_estimate(self, &fixed_estimate) != NMPC_OK)) {
        return NMPC_NULL_POINTER;
    }

    for (axis = 0; axis < 2; axis++) {
        estimate->position_m[axis] = (float)fixed_estimate.position_m[axis] * NMPC_POSITION_UNIT;
        estimate->velocity_m_s[axis] = (float)fixed_estimate.velocity_m_s[axis] * NMPC_VELOCITY_UNIT;
        estimate->disturbance_m_s2[axis] = (float)fixed_estimate.disturbance_m_s2[axis] * NMPC_DISTURBANCE_UNIT;
    }
    estimate->is_valid = fixed_estimate.is_valid;
    return NMPC_OK;
}
