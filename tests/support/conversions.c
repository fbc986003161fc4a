/* Reads floats from standard input and writes the numbers and floats that a fixed point controller makes of them. */
#include <stdio.h>

#include "nmpc.h"

int main(void)
{
    static nmpc_t controller;
    const nmpc_real_t constants[7] = { NMPC_POSITION(-1.5),   NMPC_VELOCITY(0.1),   NMPC_ANGLE(-0.3),  NMPC_YAW(3.14159),
                                       NMPC_THRUST_ACCELERATION(9.81), NMPC_TRACKING(123.4), NMPC_EFFORT(0.7) };
    float in[12];

    (void)fwrite(constants, sizeof(constants), 1, stdout);
    nmpc_init(&controller);
    while (fread(in, sizeof(in), 1, stdin) == 1) {
        const nmpc_float_state_t state = { { in[0], in[1] }, { in[2], in[3] }, in[4], in[5], in[6] };
        const nmpc_float_target_t target = { { in[7], in[8] }, { in[9], in[10] } };
        nmpc_float_command_t command;
        float out[4];

        out[0] = (float)nmpc_float_step(&controller, &state, &target, in[11], &command);
        out[1] = command.roll_rad;
        out[2] = command.pitch_rad;
        out[3] = nmpc_float_last_cost(&controller);
        (void)fwrite(out, sizeof(out), 1, stdout);
    }
    return 0;
}
