/* If `last` is the command of the previous call, the controller continues, warm start included; any other value
 * resets it to that command. */
#include "run.h"
#include "nmpc.h"

#ifdef NMPC_POSITION_BITS
#define UNITS(bits) ((float)(1L << (bits)))
#else
#define UNITS(bits) 1.0f
#endif
#define ANGLE UNITS(NMPC_ANGLE_BITS)

static nmpc_t controller;
static float given[2];
static int is_set;

void run(const float error[4], const float last[2], float moves[4])
{
    nmpc_state_t state = {{0, 0}, {0, 0}, 0, 0, 0};
    const nmpc_target_t target = {{0, 0}, {0, 0}};
    nmpc_command_t command;
    int i;

    if (!is_set) {
        nmpc_init(&controller);
        is_set = 1;
    }
    for (i = 0; i < 2; i++) {
        state.position_m[i] = (nmpc_real_t)(error[2 * i] * UNITS(NMPC_POSITION_BITS));
        state.velocity_m_s[i] = (nmpc_real_t)(error[2 * i + 1] * UNITS(NMPC_VELOCITY_BITS));
    }
    state.roll_rad = command.roll_rad = (nmpc_real_t)(last[0] * ANGLE);
    state.pitch_rad = command.pitch_rad = (nmpc_real_t)(last[1] * ANGLE);
    if (last[0] != given[0] || last[1] != given[1]) {
        nmpc_reset(&controller, &command);
    }
    nmpc_step(&controller, &state, &target, (nmpc_real_t)(9.81f * UNITS(NMPC_THRUST_BITS)), &command);
    for (i = 0; i < 4; i++) {
        moves[i] = (float)controller.plan_rad[i] / ANGLE;
    }
    given[0] = moves[0];
    given[1] = moves[1];
}
