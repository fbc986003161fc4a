/* A firmware's program for the C of mambo-nmpc 0.1.0: flies a point mass, and prints each command. */
#include <stdio.h>

#include "nmpc.h"

#define STEPS 400
#define THRUST_ACCELERATION_M_S2 9.81f

static nmpc_t controller;

int main(void)
{
    nmpc_state_t state = { { 0, 0 }, { 0, 0 }, 0, 0, 0 };
    nmpc_target_t target = { { 1.0f, -0.5f }, { 0.2f, 0.1f } };
    nmpc_command_t command = { 0.01f, -0.02f };
    const nmpc_weights_t weights = { 1.0f, 3.0f };
    int step;
    int axis;

    nmpc_init(&controller);
    if (nmpc_reset(&controller, &command) != NMPC_OK) {
        return 1;
    }
    for (step = 0; step < STEPS; step++) {
        const nmpc_real_t push_m_s2[2] = { -THRUST_ACCELERATION_M_S2 * command.pitch_rad,
                                           THRUST_ACCELERATION_M_S2 * command.roll_rad };
        if (nmpc_step(&controller, &state, &target, THRUST_ACCELERATION_M_S2, &command) != NMPC_OK) {
            return 1;
        }
        (void)printf("%.9g %.9g\n", (double)command.roll_rad, (double)command.pitch_rad);
        for (axis = 0; axis < 2; axis++) {
            state.position_m[axis] += NMPC_UPDATE_PERIOD_S * state.velocity_m_s[axis];
            state.velocity_m_s[axis] += NMPC_UPDATE_PERIOD_S * push_m_s2[axis];
            target.position_m[axis] += NMPC_UPDATE_PERIOD_S * target.velocity_m_s[axis];
        }
        state.roll_rad = command.roll_rad;
        state.pitch_rad = command.pitch_rad;
    }
    if (nmpc_set_weights(&controller, &weights) != NMPC_OK || nmpc_last_iterations(&controller) <= 0 ||
        nmpc_has_converged(&controller) < 0 || !(nmpc_last_cost(&controller) >= 0)) {
        return 1;
    }
    return nmpc_version()[0] == '\0' ||
           nmpc_step(&controller, 0, &target, THRUST_ACCELERATION_M_S2, &command) != NMPC_NULL_POINTER;
}
