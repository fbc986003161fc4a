/* The controller with one wrong output in the steps `first_wrong` to `last_wrong`, counted from 0. nmpc_self_test.c
 * is compiled with nmpc_step and nmpc_last_cost renamed to the functions here. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "nmpc_self_test.h"

enum { NOTHING, STATUS, ROLL, PITCH, COST, GRADIENT_OF_ROLL, GRADIENT_OF_PITCH, OUTPUTS };

static int wrong_output, first_wrong, last_wrong, steps;

nmpc_status_t wrong_step(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target,
                         nmpc_real_t thrust_acceleration_m_s2, nmpc_command_t *command);
nmpc_sum_t wrong_last_cost(const nmpc_t *self);

static int is_wrong(int output)
{
    return (output == wrong_output) && (steps > first_wrong) && (steps - 1 <= last_wrong);
}

nmpc_status_t wrong_step(nmpc_t *self, const nmpc_state_t *state, const nmpc_target_t *target,
                         nmpc_real_t thrust_acceleration_m_s2, nmpc_command_t *command)
{
    const nmpc_status_t status = nmpc_step(self, state, target, thrust_acceleration_m_s2, command);

    if ((self == NULL) || (state == NULL) || (target == NULL) || (command == NULL)) {
        return status;
    }
    steps++;
    command->roll_rad += (nmpc_real_t)is_wrong(ROLL);
    command->pitch_rad += (nmpc_real_t)is_wrong(PITCH);
    self->gradient[0] += (nmpc_sum_t)is_wrong(GRADIENT_OF_ROLL);
    self->gradient[1] += (nmpc_sum_t)is_wrong(GRADIENT_OF_PITCH);
    return is_wrong(STATUS) ? (nmpc_status_t)(status + 1) : status;
}

nmpc_sum_t wrong_last_cost(const nmpc_t *self)
{
    const nmpc_sum_t cost = nmpc_last_cost(self);

    return is_wrong(COST) ? cost + cost + (nmpc_sum_t)1 : cost;
}

/* Print the result of the self-test for every output that is wrong from step argv[1] to step argv[2], and whether the
 * instance is then as nmpc_init leaves it. */
int main(int argc, char **argv)
{
    static nmpc_t scratch, fresh;

    first_wrong = (argc == 3) ? atoi(argv[1]) : 0;
    last_wrong = (argc == 3) ? atoi(argv[2]) : 0;
    memset(&fresh, 0x5A, sizeof fresh);
    nmpc_init(&fresh);
    for (wrong_output = NOTHING; wrong_output < OUTPUTS; wrong_output++) {
        int result;

        steps = 0;
        memset(&scratch, 0x5A, sizeof scratch);
        result = nmpc_self_test(&scratch);
        printf("%d%s ", result, (memcmp(&scratch, &fresh, sizeof scratch) == 0) ? "" : "?");
    }
    return 0;
}
