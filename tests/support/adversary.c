/* Steps one controller through inputs of every kind, for sanitizers to watch; prints what came out. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "nmpc.h"
#include "nmpc_self_test.h"

#define STEPS 20000
#define EPISODES 3

static uint64_t seed = 1;

/* Draw 32 bits (xorshift64*). */
static uint32_t draw(void)
{
    seed ^= seed >> 12;
    seed ^= seed << 25;
    seed ^= seed >> 27;
    return (uint32_t)((seed * UINT64_C(2685821657736338717)) >> 32);
}

/* Draw a number: within +/- `limit`, at its ends, tiny, or any bits at all. */
static nmpc_real_t number(nmpc_real_t limit)
{
    const nmpc_real_t unit = ((nmpc_real_t)draw() / (nmpc_real_t)2147483648.0) - (nmpc_real_t)1;
    nmpc_real_t value;
    unsigned char raw[sizeof(value)];
    size_t i;

    switch (draw() % 40U) {
    case 0U:
        for (i = 0; i < sizeof(raw); i++) {
            raw[i] = (unsigned char)draw();
        }
        (void)memcpy(&value, raw, sizeof(value));
        return value;
    case 1U:
        return limit;
    case 2U:
        return -limit;
    case 3U:
        return unit * (nmpc_real_t)1e-38;
    default:
        return unit * limit;
    }
}

int main(void)
{
    nmpc_t controller;
    nmpc_state_t state;
    nmpc_target_t target;
    nmpc_command_t command;
    nmpc_weights_t weights;
    int good = 0;
    int wild = 0;
    unsigned long digest = 0UL;
    int i;

    (void)memset(&controller, 0xA5, sizeof(controller));
    nmpc_init(&controller);
    for (i = 0; i < STEPS; i++) {
        state.position_m[0] = number(NMPC_POSITION_RANGE_M);
        state.position_m[1] = number((nmpc_real_t)1);
        state.velocity_m_s[0] = number(NMPC_VELOCITY_RANGE_M_S);
        state.velocity_m_s[1] = number((nmpc_real_t)1);
        state.roll_rad = number(NMPC_TILT_LIMIT_RAD);
        state.pitch_rad = number(NMPC_ATTITUDE_RANGE_RAD);
        state.yaw_rad = number(NMPC_YAW_RANGE_RAD);
        target.position_m[0] = number(NMPC_POSITION_RANGE_M);
        target.position_m[1] = number((nmpc_real_t)1);
        target.velocity_m_s[0] = number(NMPC_VELOCITY_RANGE_M_S);
        target.velocity_m_s[1] = number((nmpc_real_t)1);
        if ((i % 100) == 99) {
            command.roll_rad = number((nmpc_real_t)4);
            command.pitch_rad = number((nmpc_real_t)4);
            weights.tracking = number(NMPC_WEIGHT_LIMIT);
            weights.effort = number(NMPC_WEIGHT_LIMIT);
            (void)nmpc_reset(&controller, &command);
            (void)nmpc_set_weights(&controller, &weights);
        }
        if (nmpc_step(&controller, &state, &target, (nmpc_real_t)9.81 + number((nmpc_real_t)5), &command)
            == NMPC_OK) {
            good++;
        }
        if (!((command.roll_rad >= -NMPC_TILT_LIMIT_RAD) && (command.roll_rad <= NMPC_TILT_LIMIT_RAD)
              && (command.pitch_rad >= -NMPC_TILT_LIMIT_RAD) && (command.pitch_rad <= NMPC_TILT_LIMIT_RAD))) {
            wild++;
        }
    }
    for (i = 0; i < EPISODES; i++) {
        digest = nmpc_self_test_episode(&controller, i, digest);
    }
    (void)printf("good %d wild %d self-test %d digest %lu\n", good, wild, nmpc_self_test(&controller), digest);
    return 0;
}
