/* A program as its author wrote it for version 0.3: targets have a position and a velocity, and what it does not name
 * is 0. It flies a point mass to 1 m ahead and 0.5 m right, then along y at 0.2 m/s, and prints where it is. */
#include <stdio.h>

#include "nmpc.h"
#include "nmpc_self_test.h"

static nmpc_t controller;
static nmpc_state_t state;
static nmpc_target_t target;

static void fly(const nmpc_command_t *command)
{
    const float share = NMPC_UPDATE_PERIOD_S / 0.2f;
    int axis;

    for (axis = 0; axis < 2; axis++) {
        state.position_m[axis] += NMPC_UPDATE_PERIOD_S * state.velocity_m_s[axis];
    }
    state.velocity_m_s[0] -= NMPC_UPDATE_PERIOD_S * 9.81f * state.pitch_rad;
    state.velocity_m_s[1] += NMPC_UPDATE_PERIOD_S * 9.81f * state.roll_rad;
    state.roll_rad += share * (command->roll_rad - state.roll_rad);
    state.pitch_rad += share * (command->pitch_rad - state.pitch_rad);
}

int main(void)
{
    nmpc_command_t command;
    int step;

    if (nmpc_self_test(&controller) != 0) {
        return 1;
    }
    nmpc_init(&controller);
    target.position_m[0] = 1.0f;
    target.position_m[1] = 0.5f;
    for (step = 0; step < 1000; step++) {
        if (step >= 500) {
            target.velocity_m_s[1] = 0.2f;
            target.position_m[1] += NMPC_UPDATE_PERIOD_S * target.velocity_m_s[1];
        }
        if (nmpc_step(&controller, &state, &target, 9.81f, &command) != NMPC_OK) {
            return 2;
        }
        fly(&command);
    }
    (void)printf("%.3f %.3f\n", (double)state.position_m[0], (double)(state.position_m[1] - target.position_m[1]));
    return 0;
}
