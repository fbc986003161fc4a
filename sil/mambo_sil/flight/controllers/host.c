/* SPDX-License-Identifier: MIT-0
 *
 * What Python and the engine of the simulation call besides batch.c. Compiled with a bundle, not part of it.
 */
#include <stdint.h>

#include "nmpc.h"

/* Python passes arrays of numbers where the C reads structs. */
#define ONE(member, column, quantity) +1
#define NUMBERS(record) ((0 record##_REALS(ONE)) * sizeof(nmpc_real_t))
#ifdef NMPC_HAS_HEIGHT
#define AXES 3
#else
#define AXES 2
#endif
#ifndef NMPC_HAS_WHOLES
typedef char assert_state_is_an_array[(sizeof(nmpc_state_t) == NUMBERS(STATE)) ? 1 : -1];
typedef char assert_target_is_an_array[(sizeof(nmpc_target_t) == NUMBERS(TARGET)) ? 1 : -1];
#endif
typedef char assert_command_is_an_array[(sizeof(nmpc_command_t) == NUMBERS(COMMAND)) ? 1 : -1];
#ifndef NMPC_STORED_NUMBERS
typedef char assert_weights_are_an_array[(sizeof(nmpc_weights_t) == 2 * sizeof(nmpc_real_t)) ? 1 : -1];
#endif

void nmpc_host_reset(nmpc_t *controllers, int n, const nmpc_command_t *command, int *status)
{
    int i;

    for (i = 0; i < n; i++) {
        status[i] = (int)nmpc_reset(&controllers[i], &command[i]);
    }
}

#ifdef NMPC_STORED_NUMBERS
void nmpc_host_report_command(nmpc_t *controllers, int n, const nmpc_command_t *command, int *status)
{
    int i;

    for (i = 0; i < n; i++) {
        status[i] = (int)nmpc_report_command(&controllers[i], &command[i]);
    }
}
#else
void nmpc_host_set_weights(nmpc_t *controllers, int n, const nmpc_weights_t *weights, int *status)
{
    int i;

    for (i = 0; i < n; i++) {
        status[i] = (int)nmpc_set_weights(&controllers[i], &weights[i]);
    }
}
#endif

/* Changes of the position, of the velocity and of the heading, one after the other. */
void nmpc_host_frame_jumped(nmpc_t *controllers, int n, const nmpc_real_t *change, int *status)
{
    int i;

    for (i = 0; i < n; i++) {
        const nmpc_real_t *const one = &change[i * ((2 * AXES) + 1)];

        status[i] = (int)nmpc_frame_jumped(&controllers[i], one, &one[AXES], one[2 * AXES]);
    }
}

#ifdef NMPC_HAS_HEIGHT
void nmpc_host_report_thrust(nmpc_t *controllers, int n, const nmpc_real_t *thrust_m_s2, int *status)
{
    int i;

    for (i = 0; i < n; i++) {
        status[i] = (int)nmpc_report_thrust(&controllers[i], thrust_m_s2[i]);
    }
}

/* The thrusts that were last commanded, set or reported. */
void nmpc_host_last_thrust(const nmpc_t *controllers, int n, nmpc_real_t *thrust_m_s2)
{
    int i;

    for (i = 0; i < n; i++) {
        thrust_m_s2[i] = controllers[i].height.thrust_m_s2;
    }
}
#endif

#ifdef NMPC_LIMIT_SPEED
typedef char assert_limits_are_an_array[(sizeof(nmpc_limits_t) == NUMBERS(LIMITS)) ? 1 : -1];

void nmpc_host_set_limits(nmpc_t *controllers, int n, const nmpc_limits_t *limits, int *status)
{
    int i;

    for (i = 0; i < n; i++) {
        status[i] = (int)nmpc_set_limits(&controllers[i], &limits[i]);
    }
}

void nmpc_host_limits_active(const nmpc_t *controllers, int n, int *active)
{
    int i;

    for (i = 0; i < n; i++) {
        active[i] = (int)nmpc_limits_active(&controllers[i]);
    }
}
#endif

#ifdef NMPC_HAS_GUARD
void nmpc_host_set_position_measured(nmpc_t *controllers, int n, const unsigned char *is_measured, int *status)
{
    int i;

    for (i = 0; i < n; i++) {
        status[i] = (int)nmpc_set_position_measured(&controllers[i], (int)is_measured[i]);
    }
}
#endif

#ifdef NMPC_STORED_NUMBERS
/* The accelerations that tilt and drag do not explain, as learnt, along x and y. */
void nmpc_host_last_disturbance(const nmpc_t *controllers, int n, nmpc_real_t *disturbance_m_s2)
{
    int i;

    for (i = 0; i < n; i++) {
        nmpc_estimate_t estimate;

        (void)nmpc_last_estimate(&controllers[i], &estimate);
        disturbance_m_s2[2 * i] = estimate.disturbance_m_s2[0];
        disturbance_m_s2[(2 * i) + 1] = estimate.disturbance_m_s2[1];
    }
}
#endif

#ifdef NMPC_ANGLE_BITS
/* Nearest number, ties away from zero; the largest number for NaN and for what overflows. */
static nmpc_real_t number_of(double value, int bits)
{
    const double scaled = value * (double)((nmpc_sum_t)1 << bits);
    nmpc_real_t number = 2147483647;

    if ((scaled > -2147483647.0) && (scaled < 2147483647.0)) {
        number = (nmpc_real_t)scaled;
        number += (nmpc_real_t)(2.0 * (scaled - (double)number));
    }
    return number;
}
#define NUMBER(value, quantity) number_of(value, NMPC_##quantity##_BITS)
#define IN_SI(number, quantity) ((double)(number) / (double)((nmpc_sum_t)1 << NMPC_##quantity##_BITS))
#else
#define NUMBER(value, quantity) ((nmpc_real_t)(value))
#define IN_SI(number, quantity) ((double)(number))
#endif

/* Headings in SI units. */
void nmpc_host_slew_heading(int n, const double *previous_rad, const double *wanted_rad, double most_change_rad,
                            double *next_rad)
{
    int i;

    for (i = 0; i < n; i++) {
        const nmpc_real_t next = nmpc_slew_heading(NUMBER(previous_rad[i], YAW), NUMBER(wanted_rad[i], YAW),
                                                   NUMBER(most_change_rad, YAW));

        next_rad[i] = IN_SI(next, YAW);
    }
}

#define WHOLE_TYPE double
#define MEASURE(member, column, quantity) measured.member = NUMBER(state[column], quantity);
#define MEASURE_WHOLE(member, column, quantity) measured.member = WHOLE_OF(state[column]);
#define WANT(member, column, quantity) wanted.member = NUMBER(target[column], quantity);
#define WANT_WHOLE(member, column, quantity) wanted.member = WHOLE_OF(target[column]);
#define GIVE(member, column, quantity) command[column] = IN_SI(given.member, quantity);

/* One step of one controller in SI units, for the engine of the simulation, with the columns of the closed loop. Of a
 * controller of the height a thrust that is no NaN is the reported one. */
int64_t nmpc_host_step(void *self, const double *state, const double *target,
                       double thrust_acceleration_m_s2, double *command)
{
    nmpc_state_t measured;
    nmpc_target_t wanted;
    nmpc_command_t given;
    nmpc_status_t status;

    STATE_REALS(MEASURE)
    STATE_WHOLES(MEASURE_WHOLE)
    TARGET_REALS(WANT)
    TARGET_WHOLES(WANT_WHOLE)
#ifdef NMPC_HAS_HEIGHT
    if (thrust_acceleration_m_s2 == thrust_acceleration_m_s2) {
        (void)nmpc_report_thrust((nmpc_t *)self, NUMBER(thrust_acceleration_m_s2, THRUST));
    }
    status = nmpc_step((nmpc_t *)self, &measured, &wanted, &given);
#else
    status = nmpc_step((nmpc_t *)self, &measured, &wanted, NUMBER(thrust_acceleration_m_s2, THRUST), &given);
#endif
    COMMAND_REALS(GIVE)
    return (int64_t)status;
}
