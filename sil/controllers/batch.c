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
