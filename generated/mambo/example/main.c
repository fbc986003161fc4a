/* SPDX-License-Identifier: MIT-0
 *
 * Example: run the self-test and its digest, then fly a point mass to a target that moves along x. The point mass
 * follows the commanded attitude with the lags of the settings; `mambo-nmpc fly` simulates the whole drone.
 */
#include <stdio.h>

#include "nmpc.h"
#include "nmpc_self_test.h"

#if !defined(NMPC_SETTINGS_ID) || (NMPC_SETTINGS_ID != 0x65406E0BUL)
#error "this file and its headers are of different bundles: run mambo-nmpc generate again"
#endif

#define THRUST_ACCELERATION_M_S2 9.81f
#define STEPS_PER_LINE 50
#define LINES 11
/* Of the way to its command, what an angle covers in an update period. */
#define ROLL_SHARE 0.03448276f
#define PITCH_SHARE 0.06097561f

static nmpc_t controller;

/* Integrate the point mass over one update period, at yaw 0. */
static void fly(nmpc_state_t *state, const nmpc_command_t *command)
{
    const nmpc_real_t acceleration_m_s2[2] = { -THRUST_ACCELERATION_M_S2 * state->pitch_rad,
                                               THRUST_ACCELERATION_M_S2 * state->roll_rad };
    int axis;

    for (axis = 0; axis < 2; axis++) {
        state->position_m[axis] += NMPC_UPDATE_PERIOD_S * state->velocity_m_s[axis];
        state->velocity_m_s[axis] += NMPC_UPDATE_PERIOD_S * acceleration_m_s2[axis];
    }
    state->roll_rad += ROLL_SHARE * (command->roll_rad - state->roll_rad);
    state->pitch_rad += PITCH_SHARE * (command->pitch_rad - state->pitch_rad);
}

int main(void)
{
    nmpc_state_t state = { { 0, 0 }, { 0, 0 }, 0, 0, 0 };
    nmpc_target_t target = { { 1.0f, 1.0f }, { 0.2f, 0 }, { 0, 0 }, { 0, 0 }, 0 };
    nmpc_command_t command = { 0, 0 };
    const int first_difference = nmpc_self_test(&controller);
    unsigned long digest = 0UL;
    int episode;
    int refused = 0;
    int line;
    int step;

    (void)printf("%s\n", nmpc_version());
    if (first_difference != 0) {
        (void)printf("self-test: step %d differs from the reference\n", first_difference);
        return 1;
    }
    (void)printf("self-test: all steps equal the reference\n");
    for (episode = 0; episode < NMPC_SELF_TEST_EPISODES; episode++) {
        digest = nmpc_self_test_episode(&controller, episode, digest);
    }
    (void)printf("digest: 0x%08lX after %ld steps\n", digest,
                 (long)NMPC_SELF_TEST_EPISODES * (long)NMPC_SELF_TEST_TICKS);
    if (digest != NMPC_SELF_TEST_DIGEST) {
        (void)printf("digest: the reference has 0x%08lX\n", NMPC_SELF_TEST_DIGEST);
        return 1;
    }
    (void)printf("\n");

    (void)printf("  time s    x m      y m    target x  roll rad  pitch rad\n");
    nmpc_init(&controller);
    for (line = 0; line < LINES; line++) {
        (void)printf("%7.2f  %7.3f  %7.3f  %7.3f  %8.4f  %8.4f\n",
                     (double)(line * STEPS_PER_LINE) * (double)NMPC_UPDATE_PERIOD_S,
                     (double)state.position_m[0], (double)state.position_m[1], (double)target.position_m[0],
                     (double)command.roll_rad, (double)command.pitch_rad);
        for (step = 0; step < STEPS_PER_LINE; step++) {
            if (nmpc_step(&controller, &state, &target, THRUST_ACCELERATION_M_S2, &command) != NMPC_OK) {
                refused++; /* out of range: the command repeats the last one */
            }
            fly(&state, &command);
            target.position_m[0] += NMPC_UPDATE_PERIOD_S * target.velocity_m_s[0];
        }
    }
    if (refused != 0) {
        (void)printf("%d steps refused an input out of range\n", refused);
    }
    return 0;
}
