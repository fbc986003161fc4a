/* The generated C in a program of your own: a point mass flies to a target 1 m ahead, and stays there.
 *
 * $ mambo-nmpc generate mambo -o nmpc
 * ...
 * $ cmake -B build
 * ...
 * $ cmake --build build
 * ...
 * $ build/own_loop
 * 0.0 s: x  0.000 m, pitch -0.3500 rad
 * 1.0 s: x  0.789 m, pitch  0.2158 rad
 * 2.0 s: x  1.063 m, pitch -0.0216 rad
 * 3.0 s: x  0.973 m, pitch -0.0042 rad
 * 4.0 s: x  0.999 m, pitch  0.0033 rad
 * 5.0 s: x  0.999 m, pitch -0.0007 rad
 */
#include <stdio.h>

#include "nmpc.h"
#include "nmpc_self_test.h"

#define GRAVITY_M_S2 9.81f
#define LAG_S 0.2f /* of the attitude behind its command */

static nmpc_t controller; /* all of its memory */

/* Your estimator and your drone: here a point mass that tilts with a lag, at heading 0. */
static void fly(nmpc_state_t *state, const nmpc_command_t *command)
{
    const float share = NMPC_UPDATE_PERIOD_S / LAG_S;

    state->position_m[0] += NMPC_UPDATE_PERIOD_S * state->velocity_m_s[0];
    state->position_m[1] += NMPC_UPDATE_PERIOD_S * state->velocity_m_s[1];
    state->velocity_m_s[0] -= NMPC_UPDATE_PERIOD_S * GRAVITY_M_S2 * state->pitch_rad; /* nose up: backwards */
    state->velocity_m_s[1] += NMPC_UPDATE_PERIOD_S * GRAVITY_M_S2 * state->roll_rad;
    state->roll_rad += share * (command->roll_rad - state->roll_rad);
    state->pitch_rad += share * (command->pitch_rad - state->pitch_rad);
}

int main(void)
{
    nmpc_state_t state = { { 0 }, { 0 }, 0, 0, 0 };
    const nmpc_target_t target = { { 1.0f, 0 }, { 0 }, { 0 }, { 0 }, 0 }; /* at rest */
    nmpc_command_t command;
    int step;

    if (nmpc_self_test(&controller) != 0) {
        return 1; /* other bits than the reference: do not fly */
    }
    nmpc_init(&controller);
    for (step = 0; step <= 500; step++) {
        (void)nmpc_step(&controller, &state, &target, GRAVITY_M_S2, &command); /* refused: the last command */
        if ((step % 100) == 0) {
            (void)printf("%3.1f s: x %6.3f m, pitch %7.4f rad\n", (double)step * (double)NMPC_UPDATE_PERIOD_S,
                         (double)state.position_m[0], (double)command.pitch_rad);
        }
        fly(&state, &command);
    }
    return 0;
}
