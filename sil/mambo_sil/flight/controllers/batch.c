/* SPDX-License-Identifier: MIT-0
 *
 * Steps n controllers in one call from Python. Compiled with a bundle, not part of it.
 */
#include <stddef.h>

#include "nmpc.h"

#ifdef NMPC_HAS_WHOLES
#define WHOLE_TYPE nmpc_real_t
#define ONE(member, column, quantity) +1
#define STATE_NUMBERS (0 STATE_REALS(ONE) STATE_WHOLES(ONE))
#define TARGET_NUMBERS (0 TARGET_REALS(ONE) TARGET_WHOLES(ONE))
#define TAKE(member, column, quantity) \
    taken.member = *next; \
    next++;
#define TAKE_WHOLE(member, column, quantity) \
    taken.member = WHOLE_OF(*next); \
    next++;

/* A state of its numbers in their order. */
static nmpc_state_t state_of(const nmpc_real_t *numbers)
{
    const nmpc_real_t *next = numbers;
    nmpc_state_t taken;

    STATE_REALS(TAKE)
    STATE_WHOLES(TAKE_WHOLE)
    return taken;
}

static nmpc_target_t target_of(const nmpc_real_t *numbers)
{
    const nmpc_real_t *next = numbers;
    nmpc_target_t taken;

    TARGET_REALS(TAKE)
    TARGET_WHOLES(TAKE_WHOLE)
    return taken;
}

#define STATE_AT(numbers, i) state_of(&(numbers)[(i) * STATE_NUMBERS])
#define TARGET_AT(numbers, i) target_of(&(numbers)[(i) * TARGET_NUMBERS])
#else
/* Python passes arrays of numbers where the C reads structs: host.c asserts that they are alike. */
#define STATE_AT(numbers, i) ((const nmpc_state_t *)(const void *)(numbers))[i]
#define TARGET_AT(numbers, i) ((const nmpc_target_t *)(const void *)(numbers))[i]
#endif

#ifdef NMPC_STORED_NUMBERS
/* Output arrays of a step: for each controller one element, of stored NMPC_STORED_NUMBERS. */
typedef struct {
    int *status;
#ifdef NMPC_HAS_HEIGHT
    nmpc_real_t (*command_rad)[2];
#else
    nmpc_command_t *command;
#endif
    int *steps_blind;
    int *saturated;
    nmpc_real_t *stored;
#ifdef NMPC_LIMIT_SPEED
    int *active_limits;
#endif
#ifdef NMPC_HAS_HEIGHT
    nmpc_real_t *thrust_m_s2;
#endif
} nmpc_outcome_t;

static void read_outcome(const nmpc_t *self, int i, const nmpc_outcome_t *outcome)
{
    const nmpc_real_t *stored = (const nmpc_real_t *)(const void *)self;
    int k;

    outcome->steps_blind[i] = (int)self->steps_blind;
    if (outcome->saturated != NULL) {
        outcome->saturated[i] = nmpc_is_saturated(self);
    }
    for (k = 0; k < NMPC_STORED_NUMBERS; k++) {
        outcome->stored[(i * NMPC_STORED_NUMBERS) + k] = stored[k];
    }
#ifdef NMPC_LIMIT_SPEED
    outcome->active_limits[i] = (int)self->active_limits;
#endif
}
#else
/* Output arrays of a step: for each controller one element, of gradient and plan_rad NMPC_MOVES. */
typedef struct {
    int *status;
    nmpc_command_t *command;
    nmpc_sum_t *cost;
    nmpc_sum_t *gradient;
    nmpc_real_t *plan_rad;
    int *iterations;
    int *converged;
#ifdef NMPC_LIMIT_SPEED
    nmpc_bounds_t *limits;
    int *steps_blind;
    int *active_limits;
#endif
} nmpc_outcome_t;

static void read_outcome(const nmpc_t *self, int i, const nmpc_outcome_t *outcome)
{
    int k;

    outcome->cost[i] = nmpc_last_cost(self);
    outcome->iterations[i] = nmpc_last_iterations(self);
    outcome->converged[i] = nmpc_has_converged(self);
    for (k = 0; k < NMPC_MOVES; k++) {
        outcome->gradient[(i * NMPC_MOVES) + k] = self->gradient[k];
        outcome->plan_rad[(i * NMPC_MOVES) + k] = self->plan_rad[k];
    }
#ifdef NMPC_LIMIT_SPEED
    outcome->limits[i] = self->bounds;
    outcome->steps_blind[i] = (int)self->steps_blind;
    outcome->active_limits[i] = (int)self->active_limits;
#endif
}
#endif

void nmpc_batch_init(nmpc_t *controllers, int n)
{
    int i;

    for (i = 0; i < n; i++) {
        nmpc_init(&controllers[i]);
    }
}

#ifdef NMPC_HAS_HEIGHT
/* There is no thrust; Python passes none. */
void nmpc_batch_step(nmpc_t *controllers, int n, const nmpc_real_t *state, const nmpc_real_t *target,
                     const nmpc_real_t *none, const nmpc_outcome_t *outcome)
{
    int i;

    (void)none;
    for (i = 0; i < n; i++) {
        const nmpc_state_t measured = STATE_AT(state, i);
        const nmpc_target_t wanted = TARGET_AT(target, i);
        nmpc_command_t command;

        outcome->status[i] = (int)nmpc_step(&controllers[i], &measured, &wanted, &command);
        outcome->command_rad[i][0] = command.roll_rad;
        outcome->command_rad[i][1] = command.pitch_rad;
        outcome->thrust_m_s2[i] = command.thrust_m_s2;
        read_outcome(&controllers[i], i, outcome);
    }
}

void nmpc_batch_report_thrust(nmpc_t *controllers, int n, const nmpc_real_t *thrust_m_s2)
{
    int i;

    for (i = 0; i < n; i++) {
        (void)nmpc_report_thrust(&controllers[i], thrust_m_s2[i]);
    }
}
#else
void nmpc_batch_step(nmpc_t *controllers, int n, const nmpc_real_t *state, const nmpc_real_t *target,
                            const nmpc_real_t *thrust_acceleration_m_s2, const nmpc_outcome_t *outcome)
{
    int i;

    for (i = 0; i < n; i++) {
        const nmpc_state_t measured = STATE_AT(state, i);
        const nmpc_target_t wanted = TARGET_AT(target, i);

        outcome->status[i] = (int)nmpc_step(&controllers[i], &measured, &wanted, thrust_acceleration_m_s2[i],
                                            &outcome->command[i]);
        read_outcome(&controllers[i], i, outcome);
    }
}
#endif

unsigned long nmpc_batch_instance_bytes(void)
{
    return (unsigned long)sizeof(nmpc_t);
}
