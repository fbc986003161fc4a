#define _POSIX_C_SOURCE 199309L
#include "quadratic.h"
#include "nmpc.c" /* the function of interest is static */

void run(const float state[16], float moves[2])
{
    moves[0] = optimizer_minimize(NMPC_RIGHT, &state[0], NMPC_RIGHT_LIMIT_M_STEP2);
    moves[1] = optimizer_minimize(NMPC_FORWARD, &state[8], NMPC_FORWARD_LIMIT_M_STEP2);
}
