#define _POSIX_C_SOURCE 199309L
#include "quadratic.h"
#include "nmpc_attitude.h"
#include "nmpc_optimizer.h"

void run(const float state[16], float moves[2])
{
    moves[0] = nmpc_optimizer_minimize(NMPC_RIGHT, &state[0], NMPC_RIGHT_LIMIT_M_STEP2);
    moves[1] = nmpc_optimizer_minimize(NMPC_FORWARD, &state[8], NMPC_FORWARD_LIMIT_M_STEP2);
}
