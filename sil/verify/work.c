/* SPDX-License-Identifier: MIT-0
 *
 * Steps controllers in turn on inputs from standard input, and writes the outcome of each step and how often
 * every counted place ran in it. Compiled together with a library whose functions and loops count.
 */
#include <stdio.h>
#include <string.h>

#include "nmpc.h"

unsigned int nmpc_work_counts[NMPC_WORK_PLACES];

static nmpc_t controllers[NMPC_WORK_CONTROLLERS];

typedef struct {
    nmpc_state_t state;
    nmpc_target_t target;
    nmpc_real_t thrust_acceleration_m_s2;
} nmpc_work_input_t;

int main(void)
{
    nmpc_work_input_t input;
    int turn;

    for (turn = 0; turn < NMPC_WORK_CONTROLLERS; turn++) {
        nmpc_init(&controllers[turn]);
    }
    turn = 0;
    while (fread(&input, sizeof(input), 1, stdin) == 1) {
        nmpc_command_t command;
        int status;

        memset(nmpc_work_counts, 0, sizeof(nmpc_work_counts));
        status = (int)nmpc_step(&controllers[turn], &input.state, &input.target,
                                input.thrust_acceleration_m_s2, &command);
        fwrite(&status, sizeof(status), 1, stdout);
        fwrite(&command, sizeof(command), 1, stdout);
        fwrite(nmpc_work_counts, sizeof(nmpc_work_counts), 1, stdout);
        turn = (turn + 1) % NMPC_WORK_CONTROLLERS;
    }
    return 0;
}
