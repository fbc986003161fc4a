/* ---- Float ----------------------------------------------------------------------------------------------------------
 *
 * Conversion between float and the fixed point numbers of the controller. The linker leaves out what nobody calls.
 */

#include "float_units.h"

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

#if WITH_HEIGHT
nmpc_status_t nmpc_float_step(nmpc_t *self, const nmpc_float_state_t *state, const nmpc_float_target_t *target,
                              nmpc_float_command_t *command)
#else
nmpc_status_t nmpc_float_step(nmpc_t *self, const nmpc_float_state_t *state, const nmpc_float_target_t *target,
                              float thrust_acceleration_m_s2, nmpc_float_command_t *command)
#endif
{
    nmpc_state_t fixed_state;
    nmpc_target_t fixed_target;
    nmpc_command_t fixed_command;
    nmpc_status_t status;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    if ((state == NULL) || (target == NULL)) {
#if WITH_HEIGHT
        status = nmpc_step(self, NULL, NULL, &fixed_command);
#else
        status = nmpc_step(self, NULL, NULL, 0, &fixed_command);
#endif
    } else {
        int axis;

        for (axis = 0; axis < 2; axis++) {
            fixed_state.position_m[axis] = quantize(state->position_m[axis], NMPC_POSITION_SCALE);
            fixed_state.velocity_m_s[axis] = quantize(state->velocity_m_s[axis], NMPC_VELOCITY_SCALE);
            fixed_target.position_m[axis] = quantize(target->position_m[axis], NMPC_POSITION_SCALE);
            fixed_target.velocity_m_s[axis] = quantize(target->velocity_m_s[axis], NMPC_VELOCITY_SCALE);
#if WITH_GIVEN
            fixed_target.acceleration_m_s2[axis] = quantize(target->acceleration_m_s2[axis], NMPC_THRUST_SCALE);
#endif
        }
        fixed_state.roll_rad = quantize(state->roll_rad, NMPC_ANGLE_SCALE);
        fixed_state.pitch_rad = quantize(state->pitch_rad, NMPC_ANGLE_SCALE);
        fixed_state.yaw_rad = quantize(state->yaw_rad, NMPC_YAW_SCALE);
#if WITH_HEIGHT
        fixed_state.height_m = quantize(state->height_m, NMPC_POSITION_SCALE);
        fixed_state.climb_m_s = quantize(state->climb_m_s, NMPC_VELOCITY_SCALE);
        fixed_state.grounded = state->grounded;
        fixed_target.height_m = quantize(target->height_m, NMPC_POSITION_SCALE);
        fixed_target.climb_m_s = quantize(target->climb_m_s, NMPC_VELOCITY_SCALE);
#endif
#if WITH_HEIGHT and WITH_GIVEN
        fixed_target.climb_acceleration_m_s2 = quantize(target->climb_acceleration_m_s2, NMPC_THRUST_SCALE);
#endif
#if WITH_HEIGHT
        status = nmpc_step(self, &fixed_state, &fixed_target, &fixed_command);
#else
        status = nmpc_step(self, &fixed_state, &fixed_target, quantize(thrust_acceleration_m_s2, NMPC_THRUST_SCALE),
                           &fixed_command);
#endif
    }
    command->roll_rad = (float)fixed_command.roll_rad * NMPC_ANGLE_UNIT;
    command->pitch_rad = (float)fixed_command.pitch_rad * NMPC_ANGLE_UNIT;
#if WITH_HEIGHT
    command->thrust_m_s2 = (float)fixed_command.thrust_m_s2 * NMPC_THRUST_UNIT;
#endif
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
#if WITH_HEIGHT
    fixed_command.thrust_m_s2 = quantize(command->thrust_m_s2, NMPC_THRUST_SCALE);
#endif
    return nmpc_reset(self, &fixed_command);
}

#if WITH_QUADRATIC
nmpc_status_t nmpc_float_set_command(nmpc_t *self, const nmpc_float_command_t *command)
{
    nmpc_command_t fixed_command;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    fixed_command.roll_rad = quantize(command->roll_rad, NMPC_ANGLE_SCALE);
    fixed_command.pitch_rad = quantize(command->pitch_rad, NMPC_ANGLE_SCALE);
#if WITH_HEIGHT
    fixed_command.thrust_m_s2 = quantize(command->thrust_m_s2, NMPC_THRUST_SCALE);
#endif
    return nmpc_set_command(self, &fixed_command);
}
#if WITH_HEIGHT

nmpc_status_t nmpc_float_set_thrust(nmpc_t *self, float thrust_m_s2)
{
    return nmpc_set_thrust(self, quantize(thrust_m_s2, NMPC_THRUST_SCALE));
}
#endif

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
#if WITH_HEIGHT
    estimate->height_m = (float)fixed_estimate.height_m * NMPC_POSITION_UNIT;
    estimate->climb_m_s = (float)fixed_estimate.climb_m_s * NMPC_VELOCITY_UNIT;
#endif
#if WITH_HEIGHT and WITH_THRUST_GAIN
    estimate->thrust_gain = (float)fixed_estimate.thrust_gain * NMPC_FACTOR_UNIT;
#elif WITH_HEIGHT and WITH_LIFT
    estimate->lift_m_s2 = (float)fixed_estimate.lift_m_s2 * NMPC_DISTURBANCE_UNIT;
#endif
#if WITH_TILT_GAIN
    estimate->roll_gain = (float)fixed_estimate.roll_gain * NMPC_FACTOR_UNIT;
    estimate->pitch_gain = (float)fixed_estimate.pitch_gain * NMPC_FACTOR_UNIT;
#endif
    estimate->is_valid = fixed_estimate.is_valid;
    return NMPC_OK;
}
#else
nmpc_status_t nmpc_float_set_weights(nmpc_t *self, const nmpc_float_weights_t *weights)
{
    nmpc_weights_t fixed_weights;

    if (weights == NULL) {
        return NMPC_NULL_POINTER;
    }

    fixed_weights.tracking = quantize(weights->tracking, NMPC_TRACKING_SCALE);
    fixed_weights.effort = quantize(weights->effort, NMPC_EFFORT_SCALE);
    return nmpc_set_weights(self, &fixed_weights);
}

float nmpc_float_last_cost(const nmpc_t *self)
{
    return (float)nmpc_last_cost(self) * NMPC_COST_UNIT;
}
#endif
#if WITH_LIMITS

/* The nearest float that is not larger in magnitude, so that nmpc_float_set_limits() accepts what it is a limit of. */
static float shrink(nmpc_real_t number, float unit)
{
    float value = (float)number;

    if ((number > 0) ? ((nmpc_real_t)value > number) : ((nmpc_real_t)value < number)) {
        value = value * 0.9999999f;
    }
    return value * unit;
}

void nmpc_float_default_limits(nmpc_float_limits_t *limits)
{
    nmpc_limits_t fixed_limits;
    int axis;

    if (limits == NULL) {
        return;
    }

    nmpc_default_limits(&fixed_limits);
    limits->speed_m_s = shrink(fixed_limits.speed_m_s, NMPC_VELOCITY_UNIT);
    limits->braking_m_s2 = (float)fixed_limits.braking_m_s2 * NMPC_BRAKING_UNIT;
    for (axis = 0; axis < 2; axis++) {
        limits->fence_min_m[axis] = shrink(fixed_limits.fence_min_m[axis], NMPC_POSITION_UNIT);
        limits->fence_max_m[axis] = shrink(fixed_limits.fence_max_m[axis], NMPC_POSITION_UNIT);
    }
    limits->tilt_rad = shrink(fixed_limits.tilt_rad, NMPC_ANGLE_UNIT);
#if WITH_HEIGHT
    limits->floor_m = shrink(fixed_limits.floor_m, NMPC_POSITION_UNIT);
    limits->ceiling_m = shrink(fixed_limits.ceiling_m, NMPC_POSITION_UNIT);
    limits->climb_m_s = shrink(fixed_limits.climb_m_s, NMPC_VELOCITY_UNIT);
    limits->descent_m_s = shrink(fixed_limits.descent_m_s, NMPC_VELOCITY_UNIT);
#endif
}

nmpc_status_t nmpc_float_set_limits(nmpc_t *self, const nmpc_float_limits_t *limits)
{
    nmpc_limits_t fixed_limits;
    int axis;

    if (limits == NULL) {
        return NMPC_NULL_POINTER;
    }

    fixed_limits.speed_m_s = quantize(limits->speed_m_s, NMPC_VELOCITY_SCALE);
    fixed_limits.braking_m_s2 = quantize(limits->braking_m_s2, NMPC_BRAKING_SCALE);
    for (axis = 0; axis < 2; axis++) {
        fixed_limits.fence_min_m[axis] = quantize(limits->fence_min_m[axis], NMPC_POSITION_SCALE);
        fixed_limits.fence_max_m[axis] = quantize(limits->fence_max_m[axis], NMPC_POSITION_SCALE);
    }
    fixed_limits.tilt_rad = quantize(limits->tilt_rad, NMPC_ANGLE_SCALE);
#if WITH_HEIGHT
    fixed_limits.floor_m = quantize(limits->floor_m, NMPC_POSITION_SCALE);
    fixed_limits.ceiling_m = quantize(limits->ceiling_m, NMPC_POSITION_SCALE);
    fixed_limits.climb_m_s = quantize(limits->climb_m_s, NMPC_VELOCITY_SCALE);
    fixed_limits.descent_m_s = quantize(limits->descent_m_s, NMPC_VELOCITY_SCALE);
#endif
    return nmpc_set_limits(self, &fixed_limits);
}
#endif

#if WITH_HEIGHT
nmpc_status_t nmpc_float_shift(nmpc_t *self, const float position_change_m[3], const float velocity_change_m_s[3],
                               float heading_change_rad)
#elif WITH_SHIFT
nmpc_status_t nmpc_float_shift(nmpc_t *self, const float position_change_m[2], const float velocity_change_m_s[2],
                               float heading_change_rad)
#else
nmpc_status_t nmpc_float_shift(const nmpc_t *self, const float position_change_m[2], const float velocity_change_m_s[2],
                               float heading_change_rad)
#endif
{
    nmpc_real_t fixed_position_m[NMPC_AXES];
    nmpc_real_t fixed_velocity_m_s[NMPC_AXES];
    int axis;

    if ((position_change_m == NULL) || (velocity_change_m_s == NULL)) {
        return NMPC_NULL_POINTER;
    }

    for (axis = 0; axis < NMPC_AXES; axis++) {
        fixed_position_m[axis] = quantize(position_change_m[axis], NMPC_POSITION_SCALE);
        fixed_velocity_m_s[axis] = quantize(velocity_change_m_s[axis], NMPC_VELOCITY_SCALE);
    }
    return nmpc_shift(self, fixed_position_m, fixed_velocity_m_s, quantize(heading_change_rad, NMPC_YAW_SCALE));
}

float nmpc_float_slew_heading(float previous_rad, float wanted_rad, float most_change_rad)
{
    const nmpc_real_t slewed_rad =
        nmpc_slew_heading(quantize(previous_rad, NMPC_YAW_SCALE), quantize(wanted_rad, NMPC_YAW_SCALE),
                          quantize(most_change_rad, NMPC_YAW_SCALE));

    return (float)slewed_rad * NMPC_YAW_UNIT;
}
