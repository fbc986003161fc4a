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

#include "float_records.h"
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
        quantize_state(state, &fixed_state);
        quantize_target(target, &fixed_target);
#if WITH_HEIGHT
        status = nmpc_step(self, &fixed_state, &fixed_target, &fixed_command);
#else
        status = nmpc_step(self, &fixed_state, &fixed_target, quantize(thrust_acceleration_m_s2, NMPC_THRUST_SCALE),
                           &fixed_command);
#endif
    }
    in_si_command(&fixed_command, command);
    return status;
}

nmpc_status_t nmpc_float_reset(nmpc_t *self, const nmpc_float_command_t *command)
{
    nmpc_command_t fixed_command;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    quantize_command(command, &fixed_command);
    return nmpc_reset(self, &fixed_command);
}

#if WITH_QUADRATIC
nmpc_status_t nmpc_float_report_command(nmpc_t *self, const nmpc_float_command_t *command)
{
    nmpc_command_t fixed_command;

    if (command == NULL) {
        return NMPC_NULL_POINTER;
    }

    quantize_command(command, &fixed_command);
    return nmpc_report_command(self, &fixed_command);
}
#if WITH_HEIGHT

nmpc_status_t nmpc_float_report_thrust(nmpc_t *self, float thrust_m_s2)
{
    return nmpc_report_thrust(self, quantize(thrust_m_s2, NMPC_THRUST_SCALE));
}
#endif

nmpc_status_t nmpc_float_last_estimate(const nmpc_t *self, nmpc_float_estimate_t *estimate)
{
    nmpc_estimate_t fixed_estimate;

    if ((estimate == NULL) || (nmpc_last_estimate(self, &fixed_estimate) != NMPC_OK)) {
        return NMPC_NULL_POINTER;
    }

    in_si_estimate(&fixed_estimate, estimate);
    return NMPC_OK;
}
#else
nmpc_status_t nmpc_float_set_weights(nmpc_t *self, const nmpc_float_weights_t *weights)
{
    nmpc_weights_t fixed_weights;

    if (weights == NULL) {
        return NMPC_NULL_POINTER;
    }

    quantize_weights(weights, &fixed_weights);
    return nmpc_set_weights(self, &fixed_weights);
}

float nmpc_float_last_cost(const nmpc_t *self)
{
    return (float)nmpc_last_cost(self) * NMPC_COST_UNIT;
}
#endif
#if WITH_LIMITS

void nmpc_float_default_limits(nmpc_float_limits_t *limits)
{
    nmpc_limits_t fixed_limits;

    if (limits == NULL) {
        return;
    }

    nmpc_default_limits(&fixed_limits);
    shrink_limits(&fixed_limits, limits);
}

nmpc_status_t nmpc_float_set_limits(nmpc_t *self, const nmpc_float_limits_t *limits)
{
    nmpc_limits_t fixed_limits;

    if (limits == NULL) {
        return NMPC_NULL_POINTER;
    }

    quantize_limits(limits, &fixed_limits);
    return nmpc_set_limits(self, &fixed_limits);
}
#endif

#if WITH_HEIGHT
nmpc_status_t nmpc_float_frame_jumped(nmpc_t *self, const float position_change_m[3],
                                      const float velocity_change_m_s[3], float heading_change_rad)
#elif WITH_SHIFT
nmpc_status_t nmpc_float_frame_jumped(nmpc_t *self, const float position_change_m[2],
                                      const float velocity_change_m_s[2], float heading_change_rad)
#else
nmpc_status_t nmpc_float_frame_jumped(const nmpc_t *self, const float position_change_m[2],
                                      const float velocity_change_m_s[2], float heading_change_rad)
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
    return nmpc_frame_jumped(self, fixed_position_m, fixed_velocity_m_s, quantize(heading_change_rad, NMPC_YAW_SCALE));
}

float nmpc_float_slew_heading(float previous_rad, float wanted_rad, float most_change_rad)
{
    const nmpc_real_t slewed_rad =
        nmpc_slew_heading(quantize(previous_rad, NMPC_YAW_SCALE), quantize(wanted_rad, NMPC_YAW_SCALE),
                          quantize(most_change_rad, NMPC_YAW_SCALE));

    return (float)slewed_rad * NMPC_YAW_UNIT;
}
