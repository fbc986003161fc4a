/* A firmware's program for the C of mambo-nmpc 0.1.0 with a quadratic cost: flies a point mass, prints commands. */
#include <stdio.h>

#include "nmpc.h"

#define STEPS 400

static nmpc_t controller;

int main(void)
{
    nmpc_state_t state = { { 0, 0 }, { 0, 0 }, 0, 0, 0.5f };
    nmpc_target_t target = { { 1.0f, -0.5f }, { 0.2f, 0.1f } };
    nmpc_command_t command = { 0.01f, -0.02f };
    nmpc_estimate_t estimate;
    int step;
    int axis;

    nmpc_init(&controller);
    if (nmpc_reset(&controller, &command) != NMPC_OK || nmpc_set_command(&controller, &command) != NMPC_OK) {
        return 1;
    }
    for (step = 0; step < STEPS; step++) {
        if (nmpc_step(&controller, &state, &target, 9.81f, &command) != NMPC_OK) {
            return 1;
        }
        (void)printf("%.9g %.9g\n", (double)command.roll_rad, (double)command.pitch_rad);
        for (axis = 0; axis < 2; axis++) {
            state.position_m[axis] += NMPC_UPDATE_PERIOD_S * state.velocity_m_s[axis];
            target.position_m[axis] += NMPC_UPDATE_PERIOD_S * target.velocity_m_s[axis];
        }
        state.velocity_m_s[0] -= NMPC_UPDATE_PERIOD_S * 9.81f * (0.88f * state.pitch_rad + 0.48f * state.roll_rad);
        state.velocity_m_s[1] += NMPC_UPDATE_PERIOD_S * 9.81f * (0.88f * state.roll_rad - 0.48f * state.pitch_rad);
        state.roll_rad += 0.05f * (command.roll_rad - state.roll_rad);
        state.pitch_rad += 0.05f * (command.pitch_rad - state.pitch_rad);
    }
    return nmpc_last_estimate(&controller, &estimate) != NMPC_OK || nmpc_is_saturated(&controller) < 0 ||
           nmpc_version()[0] == '\0' || !(estimate.position_m[0] > 0);
}
