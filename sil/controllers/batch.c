/* SPDX-License-Identifier: MIT-0
 *
 * Steps n controllers in one call from Python. Compiled with a bundle, not part of it.
 */
#include "nmpc.h"

/* Output arrays of a step: for each controller one element, of gradient and plan_rad NMPC_MOVES. */
typedef struct {
    int *status;
    nmpc_command_t *command;
    nmpc_sum_t *cost;
    nmpc_sum_t *gradient;
    nmpc_real_t *plan_rad;
    int *iterations;
    int *converged;
} nmpc_outcome_t;

void nmpc_batch_init(nmpc_t *controllers, int n)
{
    int i;

    for (i = 0; i < n; i++) {
        nmpc_init(&controllers[i]);
    }
}

void nmpc_batch_step(nmpc_t *controllers, int n, const nmpc_state_t *state, const nmpc_target_t *target,
                            const nmpc_real_t *thrust_acceleration_m_s2, const nmpc_outcome_t *outcome)
{
    int i;
    int k;

    for (i = 0; i < n; i++) {
        const nmpc_t *self = &controllers[i];

        outcome->status[i] = (int)nmpc_step(&controllers[i], &state[i], &target[i], thrust_acceleration_m_s2[i],
                                            &outcome->command[i]);
        outcome->cost[i] = nmpc_last_cost(self);
        outcome->iterations[i] = nmpc_last_iterations(self);
        outcome->converged[i] = nmpc_has_converged(self);
        for (k = 0; k < NMPC_MOVES; k++) {
            outcome->gradient[(i * NMPC_MOVES) + k] = self->gradient[k];
            outcome->plan_rad[(i * NMPC_MOVES) + k] = self->plan_rad[k];
        }
    }
}

unsigned long nmpc_batch_instance_bytes(void)
{
    return (unsigned long)sizeof(nmpc_t);
}

#ifdef NMPC_ANGLE_BITS
/* Nearest number, ties away from zero; the largest number for NaN and for what overflows. */
static nmpc_real_t quantize(double value, int bits)
{
    const double scaled = value * (double)((nmpc_sum_t)1 << bits);
    nmpc_real_t number = 2147483647;

    if ((scaled > -2147483647.0) && (scaled < 2147483647.0)) {
        number = (nmpc_real_t)scaled;
        number += (nmpc_real_t)(2.0 * (scaled - (double)number));
    }
    return number;
}
#define NUMBER(value, quantity) quantize(value, NMPC_##quantity##_BITS)
#define ANGLE_RAD(number) ((double)(number) / (double)((nmpc_sum_t)1 << NMPC_ANGLE_BITS))
#else
#define NUMBER(value, quantity) ((nmpc_real_t)(value))
#define ANGLE_RAD(number) ((double)(number))
#endif

/* One step of one controller in SI units, for the engine of the simulation. */
long long nmpc_batch_engine_step(void *self, const double *state, const double *target,
                                 double thrust_acceleration_m_s2, double *command_rad)
{
    nmpc_state_t measured;
    nmpc_target_t wanted;
    nmpc_command_t command;
    nmpc_status_t status;
    int i;

    for (i = 0; i < 2; i++) {
        measured.position_m[i] = NUMBER(state[i], POSITION);
        measured.velocity_m_s[i] = NUMBER(state[2 + i], VELOCITY);
        wanted.position_m[i] = NUMBER(target[i], POSITION);
        wanted.velocity_m_s[i] = NUMBER(target[2 + i], VELOCITY);
    }
    measured.roll_rad = NUMBER(state[4], ANGLE);
    measured.pitch_rad = NUMBER(state[5], ANGLE);
    measured.yaw_rad = NUMBER(state[6], YAW);
    status = nmpc_step((nmpc_t *)self, &measured, &wanted, NUMBER(thrust_acceleration_m_s2, THRUST), &command);
    command_rad[0] = ANGLE_RAD(command.roll_rad);
    command_rad[1] = ANGLE_RAD(command.pitch_rad);
    return (long long)status;
}
